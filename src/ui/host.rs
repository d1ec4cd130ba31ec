//! What the page asks of its surroundings, a browser or a window.

use egui::{DroppedFileHandle, ThemePreference};

use crate::ape::EnsembleFile;

/// Files, in and out; the address; what is kept from one visit to the next.
pub trait Host {
    /// Gives a text to the visitor as a file; the error is a sentence.
    fn save(&mut self, name: &str, text: &str) -> Result<(), String>;

    /// Gives a picture, an SVG document, to the visitor as PNG with two pixels for one. The error is a sentence;
    /// what fails only later is told by [`Host::failure`].
    fn save_picture(&mut self, name: &str, svg: &str) -> Result<(), String>;

    /// A sentence about something that had been begun and has failed since.
    fn failure(&mut self) -> Option<String> {
        None
    }

    /// Asks the visitor for a file; [`Host::opened`] has it later. The error is a sentence.
    fn ask_for_file(&mut self) -> Result<(), String>;

    /// Reads a file that was dropped on the page; [`Host::opened`] has it later.
    fn read(&mut self, file: DroppedFileHandle);

    /// A file that the visitor chose: its name, and its text or a sentence.
    fn opened(&mut self) -> Option<(String, Result<String, String>)>;

    /// What follows `#` in the address: when the page is opened, and again when the visitor has changed it.
    fn visited(&mut self) -> Option<String> {
        None
    }

    /// Puts a text behind `#`; the page stays as it is.
    fn set_address(&mut self, _fragment: &str) {}

    /// The whole address with this text behind `#`.
    fn link(&self, fragment: &str) -> String {
        format!("#{fragment}")
    }

    /// Whether what is copied reaches the clipboard.
    fn can_copy(&self) -> bool {
        true
    }

    /// Keeps a text for the next visit; the error is a sentence.
    fn keep(&mut self, _name: &str, _text: &str) -> Result<(), String> {
        Ok(())
    }

    /// A text that was kept.
    fn kept(&self, _name: &str) -> Option<String> {
        None
    }

    /// The same by whichever tab was the last to keep it.
    fn kept_elsewhere(&self, _name: &str) -> Option<String> {
        None
    }

    /// A fault and what helps to find it, as a text to hand on.
    fn report(&self, fault: &str) -> String {
        format!("ape-lab {}\n{fault}", env!("CARGO_PKG_VERSION"))
    }

    /// Seconds on the clock of the frames. A page that nobody sees hears of what is done, and draws no frame that would
    /// tell the time.
    fn now(&self) -> Option<f64> {
        None
    }

    /// Gives what is around the page the theme that the visitor prefers.
    fn set_theme(&mut self, _theme: ThemePreference) {}

    /// Whether the visitor has asked the system for less motion.
    fn wants_less_motion(&self) -> bool {
        false
    }
}

/// Refuses a file that is too long before it is read.
pub fn check_length(bytes: f64) -> Result<(), String> {
    let longest = EnsembleFile::LONGEST as f64;
    if bytes <= longest {
        return Ok(());
    }
    Err(format!("a file of {:.0} MB, expected at most {:.0} MB", (bytes / 1e6).ceil(), longest / 1e6))
}
