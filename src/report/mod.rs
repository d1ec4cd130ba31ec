//! Experiments on paper: all results as one document.

mod results;

pub use results::results;
