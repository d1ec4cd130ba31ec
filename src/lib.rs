//! ape-lab: adversarial policy ensembles (Zhan, Tiomkin & Abbeel 2019), exact, live and in the browser.
//!
//! The rooms, lower ones first; none imports one that stands below it in this list:
//!
//! - [`mdp`]: gridworlds, stationary policies, their exact returns. Knows nothing of ensembles.
//! - [`ape`]: ensembles, their files and figures, who an observer takes the actor to be, and PG-APE.
//! - [`attack`]: the cloners, from behaviour cloning to a recurrent network, and what their clones return.
//! - [`experiment`]: what a run starts from, the presets, and the course of a run.
//! - [`lab`]: a training session as a state machine with messages in and out, and a thread to run it.
//! - `files`: files written whole or not at all, natively.
//! - `picture`: heat maps and charts as SVG, and the maps from steps to colours.
//! - `report`: the results of all experiments as a document.
//! - `ui`: the page, in egui and nothing else.
//! - `web`: what only a browser has: the worker, the mirror of the page for assistive technology.
//!
//! The programs in `src/bin` are thin: `app` (the page, or a window), `worker` (the browser's worker) and
//! `ape` (the command line).

pub mod ape;
pub mod attack;
pub mod experiment;
#[cfg(all(not(target_arch = "wasm32"), any(feature = "page", feature = "cli")))]
pub mod files;
pub mod lab;
pub mod mdp;
#[cfg(any(feature = "page", feature = "cli"))]
pub mod picture;
#[cfg(feature = "cli")]
pub mod report;
#[cfg(feature = "page")]
pub mod ui;
#[cfg(target_arch = "wasm32")]
pub mod web;
