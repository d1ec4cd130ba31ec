//! The page, in egui and nothing else: the same in a browser and in a window.
//!
//! - [`App`] (app.rs): what the page knows, what it hears and what it asks for.
//! - toolbar, headline, controls, board (panels, chart, inspector), help: the parts of the page.
//! - heatmap: one policy on one grid. theme: every colour, font and distance. numbers: how they are written.
//!   widgets: small pieces that several parts use. focus: the ring around what the keyboard acts on.

mod app;
mod board;
mod chart;
mod controls;
mod focus;
mod headline;
mod heatmap;
mod help;
mod inspector;
mod numbers;
mod panels;
mod theme;
mod toolbar;
mod widgets;

pub use app::App;
