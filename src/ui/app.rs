//! The page: what it knows, what it hears from the session, and where its parts stand.

use egui::{CentralPanel, Frame, Margin, RichText, ScrollArea, Ui};

use super::board::Shown;
use super::experiments::bench::BenchTab;
use super::experiments::race::RaceTab;
use super::experiments::sweep::SweepTab;
use super::experiments::table1::Table1Tab;
use super::heatmap::{self, Pictures};
use super::host::Host;
use super::panels::Touched;
use super::theme::{self, GAP, NARROW, Palette, SPACE, WIDE};
use super::widgets::choose;
use super::{controls, focus, headline, help, toolbar};
use crate::ape::observer::ObserverChoice;
use crate::ape::{Config, EnsembleFile};
use crate::attack::AttackerChoice;
use crate::experiment::{Denied, Outcome, PRESETS, Setup, Task};
use crate::lab::{
    CloneView, Command, Event, Exported, Link, PROTOCOL, Pool, RunState, Snapshot, Started, TaskEvent, TaskId,
};

/// What moving β does.
#[derive(Clone, Copy, PartialEq)]
pub enum BetaMode {
    /// A whole run from the seed.
    Retrain,
    /// The training goes on.
    Continue,
}

/// The parts of the page beside the controls.
#[derive(Clone, Copy, PartialEq)]
pub enum Tab {
    Train,
    Race,
    Sweep,
    Bench,
    Table1,
}

/// What an ensemble is wanted for, once the session has sent it.
#[derive(Clone, Copy, PartialEq)]
pub enum Wanted {
    /// Attack it on the bench.
    Bench,
    /// Race it.
    Race,
    /// Give it to the visitor as a file.
    Save,
    /// Make the clones that are not quick.
    Clones,
}

/// How the page looks at a run; nothing here changes the run.
pub struct View {
    pub tab: Tab,
    /// Place in [`crate::mdp::RETURN_KINDS`] of the return that is shown.
    pub kind: usize,
    /// Who clones, one for each clone panel; the first is in the headline too.
    pub clones: Vec<AttackerChoice>,
    pub beta_mode: BetaMode,
    /// Place in [`toolbar::SPEEDS`].
    pub speed: usize,
    /// The cell marked in every panel.
    pub cell: Option<usize>,
    pub is_help_open: bool,
    /// Whether the page was last used by keyboard.
    pub is_by_keyboard: bool,
}

/// The session at the other end of the link, as far as the page knows.
enum Session {
    Starting,
    Ready,
    /// It is gone; the sentence says how.
    Failed(String),
}

/// The page.
pub struct App {
    link: Box<dyn Link>,
    session: Session,
    /// What the controls say; the session is told of every change.
    setup: Setup,
    /// The place in [`PRESETS`] that `setup` was taken from, as long as nothing was changed since.
    preset: Option<usize>,
    /// A run that has begun and shown nothing yet.
    begun: Option<Started>,
    /// What is on the page: a run, its grid, its latest snapshot and its curve so far.
    shown: Option<Shown>,
    /// A sentence from the session about something it would not do.
    notice: Option<String>,
    pub view: View,
    pictures: Pictures,
    pub pool: Pool,
    host: Box<dyn Host>,
    bench: BenchTab,
    race: RaceTab,
    table1: Table1Tab,
    sweep: SweepTab,
    /// What the next ensembles from the session are for.
    wanted: Vec<Wanted>,
    /// Clones being made that are not quick, and those that were, each with the run and update it is of.
    making: Vec<(TaskId, (u32, u32), AttackerChoice)>,
    made: Vec<((u32, u32), CloneView)>,
    /// Name of the file that the ensemble on the page was read from.
    pub opened: Option<String>,
    /// The page's clock, in seconds.
    now: f64,
    /// Snapshots taken in, over all sessions.
    taken: u64,
    /// A snapshot that has come and not been drawn yet.
    undrawn: Option<u32>,
}

impl App {
    /// Opens the page on the first preset; training starts when the session is ready.
    pub fn new(ctx: &egui::Context, link: Box<dyn Link>, pool: Pool, host: Box<dyn Host>) -> App {
        theme::install(ctx);
        let mut app = App {
            link,
            session: Session::Starting,
            setup: Setup::default(),
            preset: None,
            begun: None,
            shown: None,
            notice: None,
            view: View {
                tab: Tab::Train,
                kind: 0,
                clones: Vec::new(),
                beta_mode: BetaMode::Retrain,
                speed: 5,
                cell: None,
                is_help_open: false,
                is_by_keyboard: false,
            },
            pictures: Pictures::default(),
            pool,
            host,
            bench: BenchTab::default(),
            race: RaceTab::default(),
            table1: Table1Tab::default(),
            sweep: SweepTab::default(),
            wanted: Vec::new(),
            making: Vec::new(),
            made: Vec::new(),
            opened: None,
            now: 0.0,
            taken: 0,
            undrawn: None,
        };
        app.load_preset(0);
        app
    }

    /// What the controls say.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    pub fn preset(&self) -> Option<usize> {
        self.preset
    }

    /// The run on the page and its latest snapshot.
    pub fn shown(&self) -> Option<(&Started, &Snapshot)> {
        self.shown.as_ref().map(|shown| (&shown.started, &shown.snapshot))
    }

    /// What is collected of r̃, where the run denies the clone that.
    pub fn denied(&self) -> Option<Denied> {
        self.shown.as_ref()?.curve.last()?.denied
    }

    /// Whether a run has begun that has not shown anything yet.
    pub fn is_retraining(&self) -> bool {
        self.begun.is_some()
    }

    /// Whether there is a session, or one on its way.
    pub fn is_session_alive(&self) -> bool {
        !matches!(self.session, Session::Failed(_))
    }

    /// Sends a command; while there is no session, none is needed: it will be told everything.
    pub fn send(&mut self, command: Command) {
        if matches!(self.session, Session::Ready) {
            self.link.send(&command);
        }
    }

    pub fn load_preset(&mut self, index: usize) {
        self.setup = (PRESETS[index].setup)();
        self.preset = Some(index);
        self.opened = None;
        self.show_clones_of(self.setup.config.observer);
        self.load();
    }

    /// Trains with another configuration; a given ensemble is left for it.
    pub fn reconfigure(&mut self, config: Config) {
        if config.observer != self.setup.config.observer {
            self.show_clones_of(config.observer);
        }
        self.setup.config = config;
        self.setup.ensemble = None;
        self.preset = None;
        self.opened = None;
        self.load();
    }

    /// Whether the ensemble on the page can be had from the session: it is there, and shows what it has.
    pub fn can_export(&self) -> bool {
        self.shown.is_some() && matches!(self.session, Session::Ready) && !self.is_retraining()
    }

    /// Asks the session for the ensemble.
    pub fn want(&mut self, wanted: Wanted) {
        if self.can_export() && !self.wanted.contains(&wanted) {
            self.wanted.push(wanted);
            self.send(Command::Export);
        }
    }

    /// Gives a file to the visitor.
    pub fn save(&mut self, name: &str, text: &str) {
        self.notice = self.host.save(name, text).err();
    }

    pub fn ask_for_file(&mut self) {
        self.notice = self.host.ask_for_file().err();
    }

    /// Shows the ensemble of a file; one that is no good is refused with a sentence.
    fn open(&mut self, name: String, text: Result<String, String>) {
        let file = text.and_then(|text| EnsembleFile::parse(&text).map_err(|error| error.to_string()));
        let checked = file.and_then(|file| file.clone().check().map(|_| file).map_err(|error| error.to_string()));
        match checked {
            Err(sentence) => self.notice = Some(format!("{name}: {sentence}.")),
            Ok(file) => {
                let left_out =
                    file.left_out.as_ref().map(|why| format!("{name}: its config is not ours and left out ({why})."));
                self.setup.grid = file.grid.clone();
                self.setup.config = file.config.clone().unwrap_or_default();
                self.setup.ensemble = Some(file);
                self.preset = None;
                self.show_clones_of(self.setup.config.observer);
                self.opened = Some(name);
                self.load();
                self.notice = left_out;
            }
        }
    }

    pub fn set_beta(&mut self, beta: f64) {
        if beta != self.setup.config.beta {
            self.setup.config.beta = beta;
            self.preset = None;
            self.send(match self.view.beta_mode {
                BetaMode::Retrain => Command::Retrain { beta },
                BetaMode::Continue => Command::Continue { beta },
            });
        }
    }

    fn load(&mut self) {
        self.notice = None;
        self.send(Command::Load { setup: Box::new(self.setup.clone()), play: true });
    }

    /// The clone that is trained against, and the honest one or the blind one beside it.
    fn show_clones_of(&mut self, observer: ObserverChoice) {
        let own = AttackerChoice::of(observer);
        let beside = if own == AttackerChoice::OCCUPANCY { AttackerChoice::UNIFORM } else { AttackerChoice::OCCUPANCY };
        self.show_clones(vec![own, beside]);
    }

    fn show_clones(&mut self, clones: Vec<AttackerChoice>) {
        self.view.clones = clones;
        self.send(Command::Show(self.view.clones.clone()));
    }

    /// Takes in what the session has said; to be called also while nothing is drawn.
    pub fn hear(&mut self) {
        while let Some(event) = self.link.receive() {
            match event {
                Ok(Event::Ready { protocol }) if protocol == PROTOCOL => {
                    self.session = Session::Ready;
                    // Of a session that is gone nothing comes any more, and its runs had other numbers.
                    self.wanted.clear();
                    self.made.clear();
                    self.making.drain(..).for_each(|(id, ..)| self.pool.cancel(id));
                    self.send(Command::Speed(toolbar::SPEEDS[self.view.speed]));
                    self.send(Command::Show(self.view.clones.clone()));
                    self.load();
                }
                Ok(Event::Ready { .. }) => {
                    let sentence = "The worker is of another version than the page: reload the page.";
                    self.session = Session::Failed(sentence.to_owned());
                }
                Ok(Event::Started(started)) => self.begun = Some(*started),
                Ok(Event::Snapshot(snapshot)) => self.take(*snapshot),
                Ok(Event::Exported(exported)) => self.take_ensemble(*exported),
                Ok(Event::Refused(sentence)) => {
                    self.wanted.clear();
                    self.notice = Some(sentence);
                }
                Err(sentence) => {
                    self.session = Session::Failed(sentence);
                    self.begun = None;
                    self.wanted.clear();
                }
            }
        }
        for (id, event) in self.pool.receive() {
            let batches = [&mut self.bench.batch, &mut self.table1.batch, &mut self.sweep.batch];
            batches.into_iter().flatten().for_each(|batch| batch.hear(id, &event, self.now));
            self.race.hear(id, &event, self.now);
            self.take_clone(id, event);
        }
        while let Some((name, text)) = self.host.opened() {
            self.open(name, text);
        }
    }

    /// An ensemble has come: to each of those who wanted it.
    fn take_ensemble(&mut self, exported: Exported) {
        for wanted in std::mem::take(&mut self.wanted) {
            match wanted {
                Wanted::Bench => {
                    let mut bench = std::mem::take(&mut self.bench);
                    bench.attack(exported.clone(), self, self.now);
                    self.bench = bench;
                }
                Wanted::Race => {
                    let mut race = std::mem::take(&mut self.race);
                    race.begin(exported.clone(), self, self.now);
                    self.race = race;
                }
                Wanted::Save => {
                    if let Ok(text) = serde_json::to_string(&exported.file) {
                        self.save("ape-ensemble.json", &text);
                    }
                }
                Wanted::Clones => self.make_clones(&exported),
            }
        }
    }

    /// Begins to make the clones on the page that are not quick, where they are not there for this moment.
    fn make_clones(&mut self, exported: &Exported) {
        let moment = (exported.run, exported.update);
        for attacker in self.slow_clones() {
            let is_made = self.made.iter().any(|(of, clone)| *of == moment && clone.cloner == attacker);
            let is_being_made = self.making.iter().any(|(_, of, cloner)| *of == moment && *cloner == attacker);
            if is_made || is_being_made {
                continue;
            }
            let Config { horizon, seed, .. } = self.setup.config;
            let ensemble = Box::new(EnsembleFile { config: None, ..exported.file.clone() });
            let id = self.pool.begin(Task::Attack { ensemble, attacker, horizon, seed });
            self.making.push((id, moment, attacker));
        }
    }

    fn slow_clones(&self) -> Vec<AttackerChoice> {
        let own = AttackerChoice::of(self.setup.config.observer);
        let is_slow = |cloner: &AttackerChoice| *cloner != own && !cloner.model().is_quick;
        self.view.clones.iter().copied().filter(is_slow).collect()
    }

    /// A clone that is not quick has been made, or not.
    fn take_clone(&mut self, id: TaskId, event: TaskEvent) {
        let Some(index) = self.making.iter().position(|(task, ..)| *task == id) else { return };
        match event {
            TaskEvent::Ready | TaskEvent::Progress(_) => {}
            TaskEvent::Failed(sentence) => {
                self.making.remove(index);
                self.notice = Some(sentence);
            }
            TaskEvent::Done(outcome) => {
                let (_, moment, cloner) = self.making.remove(index);
                if let Outcome::Attack(_, cloned) = *outcome {
                    self.made.push((moment, CloneView::new(cloner, &cloned)));
                }
                self.add_made_clones();
            }
        }
    }

    /// Adds the clones that are not quick to the snapshot on the page; where it rests, those that are missing are
    /// asked for.
    fn add_made_clones(&mut self) {
        let slow = self.slow_clones();
        let Some(shown) = &mut self.shown else { return };
        let moment = (shown.snapshot.run, shown.snapshot.update);
        // Of moments gone by nothing is kept.
        self.made.retain(|(of, _)| *of == moment);
        self.making.retain(|(id, of, _)| {
            if *of != moment {
                self.pool.cancel(*id);
            }
            *of == moment
        });
        for (_, clone) in &self.made {
            if !shown.snapshot.clones.iter().any(|other| other.cloner == clone.cloner) {
                shown.snapshot.clones.push(clone.clone());
                self.taken += 1;
                shown.version = self.taken;
            }
        }
        let is_resting = shown.snapshot.state != RunState::Playing && self.begun.is_none();
        let is_missing = |cloner: &AttackerChoice| {
            !shown.snapshot.clones.iter().any(|clone| clone.cloner == *cloner)
                && !self.making.iter().any(|(_, _, making)| making == cloner)
        };
        if is_resting && slow.iter().any(is_missing) {
            self.want(Wanted::Clones);
        }
    }

    /// Puts a snapshot on the page.
    fn take(&mut self, mut snapshot: Snapshot) {
        self.taken += 1;
        self.undrawn = Some(snapshot.number);
        let points = std::mem::take(&mut snapshot.curve);
        if let Some(started) = self.begun.take_if(|begun| begun.run == snapshot.run) {
            self.shown = Shown::new(started, snapshot, points, self.taken);
        } else if let Some(shown) = self.shown.as_mut().filter(|shown| shown.started.run == snapshot.run) {
            shown.curve.extend(points);
            shown.snapshot = snapshot;
            shown.version = self.taken;
        }
        self.add_made_clones();
    }
}

impl eframe::App for App {
    fn logic(&mut self, _ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.hear();
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }
}

impl App {
    /// Draws the page, and says what has been drawn.
    pub fn show(&mut self, ui: &mut Ui) {
        self.draw(ui);
        if let Some(number) = self.undrawn.take() {
            self.send(Command::Seen(number));
        }
    }

    fn draw(&mut self, ui: &mut Ui) {
        self.now = ui.input(|input| input.time);
        for file in ui.input(|input| input.raw.dropped_files.clone()) {
            self.host.read(file);
        }
        let width = ui.available_width();
        if width < NARROW {
            theme::enlarge_targets(ui);
        }
        let margin = if width < NARROW { 10 } else { SPACE as i8 };
        let sheet = Frame::new().fill(Palette::of(ui).ground).inner_margin(Margin::symmetric(margin, 10));
        if width < WIDE {
            CentralPanel::no_frame().frame(sheet).show(ui, |ui| {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                    self.show_top(ui);
                    self.show_tab(ui, Shown::show_stacked);
                    ui.add_space(GAP);
                    theme::card(ui).show(ui, |ui| {
                        ui.set_width(ui.available_width());
                        controls::show(ui, self);
                    });
                });
            });
        } else {
            egui::Panel::top("top").frame(sheet).show_separator_line(false).show(ui, |ui| self.show_top(ui));
            egui::Panel::left("controls")
                .exact_size(272.0)
                .resizable(false)
                .show_separator_line(false)
                .frame(Frame::new().fill(Palette::of(ui).ground).inner_margin(Margin {
                    left: margin,
                    right: 4,
                    top: 0,
                    bottom: 10,
                }))
                .show(ui, |ui| {
                    theme::card(ui).show(ui, |ui| {
                        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| controls::show(ui, self));
                    });
                });
            let rest = Frame::new().fill(Palette::of(ui).ground).inner_margin(Margin {
                left: 12,
                right: margin,
                top: 0,
                bottom: 10,
            });
            CentralPanel::no_frame().frame(rest).show(ui, |ui| self.show_tab(ui, Shown::show_planned));
        }
        self.show_help(ui);
        focus::show(ui, &mut self.view.is_by_keyboard);
    }

    fn show_top(&mut self, ui: &mut Ui) {
        ui.scope(|ui| toolbar::show(ui, self));
        ui.add_space(2.0);
        self.show_messages(ui);
        headline::show_sentence(ui, self);
        ui.add_space(4.0);
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            headline::show(ui, self);
        });
    }

    /// What has gone wrong, and what can be done about it.
    fn show_messages(&mut self, ui: &mut Ui) {
        let palette = Palette::of(ui);
        let message = |ui: &mut Ui, sentence: &str, button: &str| -> bool {
            theme::card(ui)
                .stroke(egui::Stroke::new(1.5, palette.warning))
                .show(ui, |ui| {
                    ui.horizontal_wrapped(|ui| {
                        let label = ui.label(RichText::new(sentence).color(palette.warning));
                        ui.ctx().accesskit_node_builder(label.id, |node| node.set_role(egui::Role::Alert));
                        ui.button(button).clicked()
                    })
                    .inner
                })
                .inner
        };
        if let Session::Failed(sentence) = &self.session {
            let sentence = format!("{sentence} What is on the page stays; training needs a new worker.");
            if message(ui, &sentence, "Restart the worker") {
                self.session = Session::Starting;
                self.link.restart();
            }
        }
        if let Some(sentence) = self.notice.clone()
            && message(ui, &sentence, "Dismiss")
        {
            self.notice = None;
        }
    }

    /// The tabs, and the one that is open.
    fn show_tab(&mut self, ui: &mut Ui, draw: fn(&Shown, &mut Ui, &View, &mut Pictures) -> Touched) {
        let options = [
            (Tab::Train, "Train", "Policies and their training, live"),
            (Tab::Race, "Race", "An expert, the clone and the optimal policy from one cell"),
            (Tab::Sweep, "β sweep", "Whole runs for many β"),
            (Tab::Bench, "Attack bench", "Every cloner against the ensemble that is shown"),
            (Tab::Table1, "Table 1", "The paper's comparison, over seeds"),
        ];
        let is_stacked = ui.ctx().content_rect().width() < WIDE;
        ui.horizontal(|ui| {
            choose(ui, "Tab", &mut self.view.tab, &options);
            if self.view.tab == Tab::Train && !is_stacked {
                ui.add_space(SPACE);
                heatmap::color_bar(ui);
            }
        });
        ui.add_space(2.0);
        if self.view.tab == Tab::Train {
            return self.show_board(ui, draw);
        }
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            let mut show = |ui: &mut Ui| match self.view.tab {
                Tab::Train => {}
                Tab::Race => {
                    let mut tab = std::mem::take(&mut self.race);
                    tab.show(ui, self);
                    self.race = tab;
                }
                Tab::Sweep => {
                    let mut tab = std::mem::take(&mut self.sweep);
                    tab.show(ui, self);
                    self.sweep = tab;
                }
                Tab::Bench => {
                    let mut tab = std::mem::take(&mut self.bench);
                    tab.show(ui, self);
                    self.bench = tab;
                }
                Tab::Table1 => {
                    let mut tab = std::mem::take(&mut self.table1);
                    tab.show(ui, self);
                    self.table1 = tab;
                }
            };
            if is_stacked {
                // The page itself scrolls.
                show(ui);
            } else {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, show);
            }
        });
    }

    /// The run that is shown, by `draw`; then what the visitor did to it.
    fn show_board(&mut self, ui: &mut Ui, draw: fn(&Shown, &mut Ui, &View, &mut Pictures) -> Touched) {
        let Some(shown) = &self.shown else {
            if self.is_session_alive() {
                ui.label(RichText::new("The first policies are on their way …").color(Palette::of(ui).muted));
            }
            return;
        };
        let touched = draw(shown, ui, &self.view, &mut self.pictures);
        if touched.cell.is_some() {
            self.view.cell = touched.cell;
        }
        if let Some(clones) = touched.clones {
            self.show_clones(clones);
        }
    }

    fn show_help(&mut self, ui: &mut Ui) {
        if self.view.is_help_open && help::show(ui) {
            self.view.is_help_open = false;
        }
    }
}
