//! Experiments on paper: pictures as SVG, and all results as one document.

pub mod picture;
mod results;

pub use results::results;
