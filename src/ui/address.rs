//! The page in its address: what is shown, so that a reload or another visitor sees the same.

use egui::Context;

use super::app::{App, Opened, Promise, TABS, View};
use super::{lesson, toolbar};
use crate::ape::Digest;
use crate::attack::AttackerChoice;
use crate::experiment::address::{
    AddressError, Pairs, bad, decode, encode, finish, read, read_cell, shown, take, write,
};
use crate::experiment::{PRESETS, Setup};
use crate::lab::{Command, RunState};
use crate::mdp::{Grid, RETURN_KINDS};

/// Least time between two changes of the address, in seconds: there are browsers that refuse more than a hundred in thirty.
const PAUSE: f64 = 0.35;
/// Why nothing is copied where [`super::Host::can_copy`] says no.
pub(super) const NO_CLIPBOARD: &str = "The browser lets only pages that come over https copy something.";
/// Turns of β that a link holds.
const MOST_TURNS: usize = 200;
/// The file that the visitor has opened, kept over a reload: its name, and in the next line its text.
const FILE: &str = "ensemble";

impl App {
    /// What is on the page as the text behind `#`.
    pub(super) fn fragment(&self) -> String {
        let mut setup = self.setup.clone();
        if setup.course.turns.len() > MOST_TURNS {
            // Too many to tell: a run with the β that is set now, from its start.
            setup.config.beta = setup.last_beta();
            setup.course.turns.clear();
        }
        let mut pairs = write(&setup);
        let view = &self.view;
        let mut put = |name: &str, value: String| pairs.push((name.to_owned(), value));
        if let Some(Opened { name, sum }) = &self.opened {
            put("file", name.clone());
            put("sum", sum.to_string());
        }
        let (_, tab, ..) = TABS.iter().find(|(tab, ..)| *tab == view.tab).unwrap_or(&TABS[1]);
        if *tab != "train" {
            put("tab", (*tab).to_owned());
        }
        if view.step > 0 {
            put("step", (view.step + 1).to_string());
        }
        if view.kind > 0 {
            put("return", RETURN_KINDS[view.kind].name.to_owned());
        }
        if view.speed != toolbar::DEFAULT_SPEED {
            put("speed", written_speed(view.speed));
        }
        if view.clones != App::usual_clones(setup.config.observer) {
            put("clones", view.clones.iter().map(AttackerChoice::to_string).collect::<Vec<_>>().join(";"));
        }
        let Some((started, snapshot)) = self.shown() else { return encode(&pairs) };
        let cols = started.setup.grid.cols as usize;
        let of_controls = (setup.grid.rows * setup.grid.cols) as usize;
        if let Some(cell) = view.cell.filter(|cell| started.setup.grid == setup.grid && *cell < of_controls) {
            put("cell", format!("{},{}", cell / cols, cell % cols));
        }
        if let Some(Promise { update, digest, .. }) = self.promise.filter(|promise| promise.leads) {
            // It is still on its way there.
            update.iter().for_each(|update| put("at", update.to_string()));
            digest.iter().for_each(|digest| put("digest", digest.to_string()));
            return encode(&pairs);
        }
        let is_resting = matches!(snapshot.state, RunState::Paused | RunState::Finished) && !self.is_retraining();
        // While it changes, the end of the run is what is linked to; so it is while something else is shown than the controls say.
        if is_resting && self.shows_controls() && setup.course.turns.len() == self.setup.course.turns.len() {
            if snapshot.update != snapshot.last_update {
                put("at", snapshot.update.to_string());
            }
            if let Some(digest) = snapshot.digest {
                put("digest", digest.to_string());
            }
        }
        encode(&pairs)
    }

    /// Puts what is on the page into the address, where that has changed and it is time.
    pub(super) fn update_address(&mut self, ctx: &Context) {
        // Until the first run is there the address is the visitor's. While a run plays it says how to make it again.
        if self.shown.is_none() {
            return;
        }
        let fragment = self.fragment();
        if fragment == self.address.0 {
            return;
        }
        // A run that was just asked for mostly ends before, and comes into the address with its digest.
        let last = if self.is_retraining() { self.address.1.max(self.asked_at) } else { self.address.1 };
        let wait = last + PAUSE - self.now;
        if wait > 0.0 {
            return ctx.request_repaint_after_secs(wait as f32);
        }
        self.host.set_address(&fragment);
        self.address = (fragment, self.now);
    }

    pub(super) fn copy_link(&mut self, ctx: &Context) {
        let link = self.host.link(&self.fragment());
        if !self.host.can_copy() {
            self.notice = Some(format!("{NO_CLIPBOARD} Copy the address of this page instead: it is the link."));
            return;
        }
        ctx.copy_text(link);
        let turns = self.setup.course.turns.len();
        self.notice = Some(match &self.opened {
            _ if turns > MOST_TURNS => format!(
                "Link copied, but β was moved {turns} times during this run, which is more than a link holds: it opens the run without that."
            ),
            Some(Opened { name, .. }) => format!(
                "Link copied. The ensemble of {name} is too large for a link: whoever opens it needs the file as well."
            ),
            None => "Link copied: whoever opens it sees the same, to the last bit.".to_owned(),
        });
    }

    /// Keeps a file for the next visit of this visitor.
    pub(super) fn keep_file(&mut self, name: &str, text: &str) -> Result<(), String> {
        self.host
            .keep(FILE, &format!("{name}\n{text}"))
            .map_err(|error| format!("{error} The next visit will not bring {name} back."))
    }

    /// Shows what an address says; where it is no good, says why and shows the default.
    pub(super) fn visit(&mut self, fragment: &str) {
        // What stands there now is the visitor's; what is not so is put right.
        self.address.0 = fragment.to_owned();
        if fragment.is_empty() {
            return;
        }
        self.is_new = false;
        match self.read_address(fragment) {
            Ok(None) => {}
            Ok(Some((name, sum))) => {
                // Another file may have the same name.
                let is_meant = |text: &&str| sum.is_none_or(|sum| Opened::new(name.clone(), text).sum == sum);
                let text = [self.host.kept(FILE), self.host.kept_elsewhere(FILE)]
                    .into_iter()
                    .flatten()
                    .find_map(|kept| kept.strip_prefix(&format!("{name}\n")).filter(is_meant).map(str::to_owned));
                match text {
                    Some(text) => {
                        let clones = self.view.clones.clone();
                        self.open(name, Ok(text));
                        self.show_clones(clones);
                    }
                    None => {
                        self.load_preset(0);
                        let sentence = format!(
                            "This link shows the ensemble of {}, which is not in the link: open the file, or drop it here.",
                            shown(&name)
                        );
                        self.notice = Some(sentence);
                    }
                }
            }
            Err(error) => {
                self.load_preset(0);
                self.notice = Some(format!("This link cannot be read: {error}. Here is the default instead."));
            }
        }
    }

    /// Takes up what an address says; returns the name of the file that it is about, where there is one, and its sum.
    fn read_address(&mut self, fragment: &str) -> Result<Option<(String, Option<Digest>)>, AddressError> {
        let mut pairs = decode(fragment)?;
        let file = take(&mut pairs, "file");
        let sum = read_digest(&mut pairs, "sum")?;
        // Where no more is said than which step, the step sets its own stage.
        let is_staged = pairs.iter().any(|(name, _)| name != "tab" && name != "step");
        let setup = read(&mut pairs)?;
        let mut view = View {
            cell: None,
            kind: 0,
            step: 0,
            tab: super::app::Tab::Train,
            speed: toolbar::DEFAULT_SPEED,
            ..self.view.clone()
        };
        let mut clones = App::usual_clones(setup.config.observer);
        read_view(&mut pairs, &setup, &mut view, &mut clones)?;
        let promise = read_promise(&mut pairs, &setup)?;
        finish(&pairs)?;
        let preset = PRESETS.iter().position(|preset| (preset.setup)() == setup);
        self.begin(setup, preset);
        view.staged = is_staged.then_some(view.step);
        self.view = view;
        self.send(Command::Speed(toolbar::SPEEDS[self.view.speed]));
        self.show_clones(clones);
        self.promise = Some(promise).filter(|promise| promise.update.is_some() || promise.digest.is_some());
        Ok(file.map(|name| (name, sum)))
    }
}

/// Updates per second; `max` is as fast as it goes.
fn written_speed(speed: usize) -> String {
    toolbar::SPEEDS[speed].map_or("max".to_owned(), |speed| speed.to_string())
}

fn read_view(
    pairs: &mut Pairs,
    setup: &Setup,
    view: &mut View,
    clones: &mut Vec<AttackerChoice>,
) -> Result<(), AddressError> {
    if let Some(value) = take(pairs, "tab") {
        let Some((tab, ..)) = TABS.iter().find(|(_, name, ..)| *name == value) else {
            let names: Vec<&str> = TABS.iter().map(|(_, name, ..)| *name).collect();
            return bad("tab", &value, &format!("one of {}", names.join(", ")));
        };
        view.tab = *tab;
    }
    if let Some(value) = take(pairs, "step") {
        match value.parse::<usize>() {
            Ok(step @ 1..) if step <= lesson::STEPS.len() => view.step = step - 1,
            _ => return bad("step", &value, &format!("a number from 1 to {}", lesson::STEPS.len())),
        }
    }
    if let Some(value) = take(pairs, "return") {
        let Some(kind) = RETURN_KINDS.iter().position(|kind| kind.name == value) else {
            let names: Vec<&str> = RETURN_KINDS.iter().map(|kind| kind.name).collect();
            return bad("return", &value, &format!("one of {}", names.join(", ")));
        };
        view.kind = kind;
    }
    if let Some(value) = take(pairs, "speed") {
        let written: Vec<String> = (0..toolbar::SPEEDS.len()).map(written_speed).collect();
        match written.iter().position(|speed| *speed == value) {
            Some(speed) => view.speed = speed,
            None => return bad("speed", &value, &format!("one of {}", written.join(", "))),
        }
    }
    if let Some(value) = take(pairs, "clones") {
        match value.split(';').map(str::parse).collect::<Result<Vec<AttackerChoice>, _>>() {
            Ok(read) if matches!(&read[..], [_]) || matches!(&read[..], [a, b] if a != b) => *clones = read,
            _ => return bad("clones", &value, "one cloner or two different ones, as uniform;occupancy"),
        }
    }
    if let Some(value) = take(pairs, "cell") {
        let grid = Grid::new(setup.grid.clone()).ok();
        let cell = read_cell(&value).filter(|(row, col)| *row < setup.grid.rows && *col < setup.grid.cols);
        let (Some((row, col)), Some(grid)) = (cell, grid) else { return bad("cell", &value, "row,column of the grid") };
        view.cell = Some(row as usize * grid.cols() + col as usize);
    }
    Ok(())
}

fn read_promise(pairs: &mut Pairs, setup: &Setup) -> Result<Promise, AddressError> {
    let mut promise = Promise { update: None, digest: None, leads: true };
    if let Some(value) = take(pairs, "at") {
        match value.parse() {
            _ if setup.ensemble.is_some() => {
                return bad("at", &value, "none with a given ensemble, which has no updates");
            }
            Ok(update) if update <= setup.updates() => promise.update = Some(update),
            _ => return bad("at", &value, &format!("an update of the run, 0 to {}", setup.updates())),
        }
    }
    promise.digest = read_digest(pairs, "digest")?;
    Ok(promise)
}

fn read_digest(pairs: &mut Pairs, name: &str) -> Result<Option<Digest>, AddressError> {
    let Some(value) = take(pairs, name) else { return Ok(None) };
    value.parse().map(Some).or_else(|_| bad(name, &value, "16 hexadecimal digits"))
}
