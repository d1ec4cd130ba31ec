//! The page, in egui and nothing else: the same in a browser and in a window.
//!
//! - [`App`] (app.rs): what the page knows, what it hears and what it asks for.
//! - page: where the parts of the page stand. commands: everything that can be done with a word or a key. address: the page in its
//!   address. settings: what a visitor prefers.
//! - toolbar, headline, controls, board (panels, chart, timeline, inspector), compare, help: the parts of the page.
//! - slow_clones: clones in the panels that take too long for a frame. lesson, world: tabs of their own. policy_table: the heatmaps as text. export: what a visitor takes away.
//! - experiments: the tabs beside training. export: pictures, curve and model as texts. host: files, which a browser and a window give in different ways.
//! - heatmap: one policy on one grid; arrows: its arrows. chart, table: figures over figures. theme: every colour, font and distance. numbers: how they are written.
//!   math: equations. widgets: small pieces that several parts use. focus: the ring around what the keyboard acts on.

mod address;
mod app;
mod arrows;
mod board;
mod chart;
mod commands;
mod compare;
mod controls;
mod experiments;
mod export;
mod focus;
mod headline;
mod heatmap;
mod help;
mod host;
mod inspector;
mod lesson;
mod math;
mod numbers;
mod page;
mod panels;
mod policy_table;
mod settings;
mod slow_clones;
mod table;
mod theme;
mod timeline;
mod toolbar;
mod widgets;
mod world;

pub use app::App;
pub use host::{Host, check_length};
