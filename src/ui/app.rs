//! The page: what it knows, what it hears from the session, and what can be done with it. Where its parts stand is in page.rs.

use std::hash::Hasher;
use std::time::Duration;

use super::board::Shown;
use super::commands::PaletteWindow;
use super::compare::Kept;
use super::experiments::bench::BenchTab;
use super::experiments::race::RaceTab;
use super::experiments::sweep::SweepTab;
use super::experiments::table1::Table1Tab;
use super::heatmap::Pictures;
use super::host::Host;
use super::settings::Preferences;
use super::slow_clones::SlowClones;
use super::world::WorldTab;
use super::{theme, toolbar};
use crate::ape::observer::ObserverChoice;
use crate::ape::{Config, Digest, EnsembleFile};
use crate::attack::AttackerChoice;
use crate::experiment::{Course, CurvePoint, Denied, PRESETS, Setup};
use crate::lab::{
    Command, Event, Exported, IN_FLIGHT, Link, OTHER_VERSION, PROTOCOL, Pool, RunState, Snapshot, Started, shortened,
};
use crate::mdp::GridSpec;

/// What moving β does.
#[derive(Clone, Copy, PartialEq)]
pub enum BetaMode {
    /// A whole run from the seed.
    Retrain,
    /// The training goes on.
    Continue,
}

/// The parts of the page beside the controls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tab {
    Learn,
    Train,
    World,
    Race,
    Sweep,
    Bench,
    Table1,
}

/// Every tab: its name in an address, its label, and what it is for.
pub static TABS: [(Tab, &str, &str, &str); 7] = [
    (Tab::Learn, "learn", "Learn", "A lesson in ten steps, on the live page"),
    (Tab::Train, "train", "Train", "Policies and their training, live"),
    (Tab::World, "world", "World", "Draw walls, move the goal, and train in it"),
    (Tab::Race, "race", "Race", "An expert, the clone and the optimal policy from one cell"),
    (Tab::Sweep, "sweep", "β sweep", "Whole runs for many β"),
    (Tab::Bench, "bench", "Attack bench", "Every cloner against the ensemble that is shown"),
    (Tab::Table1, "table1", "Table 1", "The paper's comparison, over seeds"),
];

/// What has become of the run that the controls ask for.
#[derive(Clone, Copy, PartialEq)]
enum Asked {
    /// None was asked for, or it was refused.
    Nothing,
    /// Nothing has been heard of it.
    Waits,
    Begun,
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
#[derive(Clone)]
pub struct View {
    pub tab: Tab,
    /// Place in [`crate::mdp::RETURN_KINDS`] of the return that is shown.
    pub kind: usize,
    /// Place in [`crate::picture::COLOR_MAPS`] of the heatmaps' colours.
    pub color_map: usize,
    /// Who clones, one for each clone panel; the first is in the headline too.
    pub clones: Vec<AttackerChoice>,
    pub beta_mode: BetaMode,
    /// Place in [`toolbar::SPEEDS`].
    pub speed: usize,
    /// The cell marked in every panel.
    pub cell: Option<usize>,
    /// The update that was asked for and is not shown yet.
    pub sought: Option<u32>,
    /// The step of the lesson.
    pub step: usize,
    /// The step whose picture was put on the page last.
    pub staged: Option<usize>,
    pub is_help_open: bool,
    /// Whether the policies stand there as a table.
    pub is_table_open: bool,
    /// Whether text was being written when the last frame ended.
    pub is_writing: bool,
    /// Whether the page was last used by keyboard.
    pub is_by_keyboard: bool,
}

/// The session at the other end of the link, as far as the page knows.
pub enum Session {
    Starting,
    Ready,
    /// It is gone; the sentence says how.
    Failed(String),
}

/// How long a worker may owe an answer before the visitor is offered another, in seconds.
pub(super) const PATIENCE: f64 = 10.0;
/// Single updates that may be on their way: a key that is held down would fill a slow worker's inbox.
const MOST_STEPS: u32 = 4;

/// How often a session that has died is started again by itself: so many times in so many seconds.
const MOST_RESTARTS: usize = 3;
const WITHIN: f64 = 60.0;

/// The page.
pub struct App {
    pub(super) link: Box<dyn Link>,
    pub(super) session: Session,
    /// When it was started again by itself.
    restarts: Vec<f64>,
    asked: Asked,
    /// When it was asked for, on the page's clock, in seconds.
    pub(super) asked_at: f64,
    /// Whether that run is to play once it has begun.
    plays: bool,
    /// A β that the run is to go on with, and the last snapshot that may have been made before the session heard of it.
    continued: Option<(f64, u32)>,
    /// How long the session has said nothing although it should: seconds of a page that is seen.
    silence: f64,
    /// Whether the session that has died showed its last run: another can go on with it.
    can_resume: bool,
    /// How many updates it has made again of that run, which it shows once it is where it was.
    pub(super) remade: Option<u32>,
    /// What the controls say; the session is told of every change.
    pub(super) setup: Setup,
    /// The place in [`PRESETS`] that `setup` was taken from, as long as nothing was changed since.
    pub(super) preset: Option<usize>,
    /// A run that has begun and shown nothing yet.
    pub(super) begun: Option<Started>,
    /// What is on the page: a run, its grid, its latest snapshot and its curve so far.
    pub(super) shown: Option<Shown>,
    /// A sentence from the session about something it would not do.
    pub(super) notice: Option<String>,
    pub view: View,
    pub preferences: Preferences,
    /// Whether the visitor has been told that preferences are not kept.
    pub(super) is_forgetful: bool,
    /// Runs that stay on the page to compare with.
    pub kept: Vec<Kept>,
    pub palette: PaletteWindow,
    /// Whether this visitor has not been here before.
    pub is_new: bool,
    pub(super) pictures: Pictures,
    pub pool: Pool,
    pub(super) host: Box<dyn Host>,
    pub(super) world: WorldTab,
    pub(super) race: RaceTab,
    pub(super) bench: BenchTab,
    pub(super) table1: Table1Tab,
    pub(super) sweep: SweepTab,
    /// The moment and digest that the address promises; then whether they came true.
    pub(super) promise: Option<Promise>,
    pub(super) reproduced: Option<Reproduced>,
    /// What the address says, and when that was last looked at.
    pub(super) address: (String, f64),
    /// What the next ensembles from the session are for.
    wanted: Vec<Wanted>,
    pub(super) slow_clones: SlowClones,
    /// The file that the ensemble on the page was read from.
    pub opened: Option<Opened>,
    /// The widget that had the keyboard's focus when the page was drawn last.
    pub(super) focus: Option<egui::Id>,
    /// The page's clock, in seconds.
    pub(super) now: f64,
    /// Snapshots taken in, over all sessions.
    pub(super) taken: u64,
    /// Single updates that were asked for since.
    stepped: u32,
    /// A snapshot that has come and not been drawn yet.
    pub(super) undrawn: Option<u32>,
    /// The last snapshot that the session was told has been drawn.
    seen: u32,
}

/// A file that was opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    pub name: String,
    /// Tells its text from that of others of its name.
    pub sum: Digest,
}

impl Opened {
    pub fn new(name: String, text: &str) -> Opened {
        let mut hash = fnv::FnvHasher::default();
        hash.write(text.as_bytes());
        Opened { name, sum: Digest(hash.finish()) }
    }
}

/// What an address says of the run it opens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The moment to show; none is the end.
    pub update: Option<u32>,
    pub digest: Option<Digest>,
    /// Whether the page goes there by itself: until the visitor goes somewhere else.
    pub leads: bool,
}

/// Whether a run has come to the digest of the address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reproduced {
    pub run: u32,
    pub update: u32,
    pub promised: Digest,
}

impl App {
    /// Opens the page on the first preset; training starts when the session is ready.
    pub fn new(ctx: &egui::Context, link: Box<dyn Link>, pool: Pool, host: Box<dyn Host>) -> App {
        theme::install(ctx);
        let mut app = App {
            link,
            session: Session::Starting,
            restarts: Vec::new(),
            asked: Asked::Nothing,
            asked_at: 0.0,
            plays: true,
            continued: None,
            silence: 0.0,
            can_resume: false,
            remade: None,
            setup: Setup::default(),
            preset: None,
            begun: None,
            shown: None,
            notice: None,
            view: View {
                tab: Tab::Train,
                kind: 0,
                color_map: 0,
                clones: Vec::new(),
                beta_mode: BetaMode::Retrain,
                speed: toolbar::DEFAULT_SPEED,
                cell: None,
                sought: None,
                step: 0,
                staged: None,
                is_help_open: false,
                is_table_open: false,
                is_writing: false,
                is_by_keyboard: false,
            },
            preferences: Preferences::default(),
            is_forgetful: false,
            kept: Vec::new(),
            palette: PaletteWindow::default(),
            is_new: false,
            pictures: Pictures::default(),
            pool,
            host,
            world: WorldTab::default(),
            promise: None,
            reproduced: None,
            address: (String::new(), 0.0),
            bench: BenchTab::default(),
            race: RaceTab::default(),
            table1: Table1Tab::default(),
            sweep: SweepTab::default(),
            wanted: Vec::new(),
            slow_clones: SlowClones::default(),
            opened: None,
            focus: None,
            now: 0.0,
            taken: 0,
            stepped: 0,
            undrawn: None,
            seen: 0,
        };
        app.recall_preferences(ctx);
        app.is_new = app.host.kept("visited").is_none();
        app.load_preset(0);
        app
    }

    /// Goes on in another context, as when the browser has taken the old one's graphics away.
    pub fn move_to(&mut self, ctx: &egui::Context) {
        theme::install(ctx);
        self.apply_preferences(ctx);
        // They were made with the old one's letters.
        self.pictures = Pictures::default();
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

    /// The same with its grid and curve.
    pub fn board(&self) -> Option<&Shown> {
        self.shown.as_ref()
    }

    /// What is collected of r̃, where the run denies the clone that, and the update at which it was: the last of the curve.
    pub fn denied(&self) -> Option<(u32, Denied)> {
        let shown = self.shown.as_ref()?;
        let point = shown.curve.iter().rfind(|point| point.update <= shown.snapshot.update)?;
        point.denied.map(|denied| (point.update, denied))
    }

    /// Whether a run is on its way that has not shown anything yet: what is on the page is not what the controls say.
    pub fn is_retraining(&self) -> bool {
        self.asked == Asked::Waits || self.begun.is_some()
    }

    /// Whether training is under way.
    pub fn is_playing(&self) -> bool {
        let is_shown_playing = self.shown().is_some_and(|(_, snapshot)| snapshot.state == RunState::Playing);
        if self.is_retraining() { self.plays } else { is_shown_playing }
    }

    /// Whether the moment on the page is one of what the controls say, and no other β is on its way to it.
    pub fn shows_controls(&self) -> bool {
        self.shown.as_ref().is_some_and(|shown| shown.is_of(&self.setup))
    }

    /// Whether there is a session, or one on its way.
    pub fn is_session_alive(&self) -> bool {
        !matches!(self.session, Session::Failed(_))
    }

    /// Sends a command; while there is no session, none is needed: it will be told everything.
    pub fn send(&mut self, command: Command) {
        if command == Command::Step && self.stepped >= MOST_STEPS {
            return;
        }
        if matches!(command, Command::Load { .. } | Command::Retrain { .. } | Command::Continue { .. } | Command::Play)
        {
            self.stepped = 0;
        }
        match command {
            Command::Load { play, .. } => self.plays = play,
            Command::Retrain { .. } | Command::Continue { .. } | Command::Play => self.plays = true,
            Command::Step | Command::Pause => {
                self.plays = false;
                self.stop_leading();
            }
            Command::Seen(number) => self.seen = number,
            _ => {}
        }
        if matches!(self.session, Session::Ready) {
            if matches!(command, Command::Load { .. } | Command::Retrain { .. }) {
                (self.asked, self.asked_at) = (Asked::Waits, self.now);
            }
            if matches!(command, Command::Play | Command::Step) {
                // It goes there first, and on at once: that moment may never be seen.
                self.view.sought = None;
            }
            self.stepped += u32::from(command == Command::Step);
            self.link.send(&command);
        }
    }

    pub fn load_preset(&mut self, index: usize) {
        self.begin((PRESETS[index].setup)(), Some(index));
    }

    /// Trains with another configuration; a given ensemble is left for it. One that is no good is refused with a sentence.
    pub fn reconfigure(&mut self, config: Config) {
        let config = Config { beta: self.setup.last_beta(), ..config };
        let setup = Setup { grid: self.setup.grid.clone(), config, ..Setup::default() };
        if let Err(error) = setup.check() {
            self.notice = Some(format!("{error}."));
            return;
        }
        if setup.config.observer != self.setup.config.observer {
            self.show_clones_of(setup.config.observer);
        }
        self.setup = setup;
        self.preset = None;
        self.opened = None;
        self.load();
    }

    /// Trains in another world with the configuration that is there; one that is no good is refused with a sentence.
    pub fn change_world(&mut self, grid: GridSpec) -> Result<(), String> {
        let config = Config { beta: self.setup.last_beta(), ..self.setup.config.clone() };
        let setup = Setup { grid, config, ..Setup::default() };
        setup.check().map_err(|error| error.to_string())?;
        self.setup = setup;
        self.preset = None;
        self.opened = None;
        self.view.cell = None;
        self.load();
        Ok(())
    }

    /// Begins with a setup that has been checked.
    pub fn begin(&mut self, setup: Setup, preset: Option<usize>) {
        self.setup = setup;
        self.preset = preset;
        self.opened = None;
        self.show_clones_of(self.setup.config.observer);
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

    /// Gives a picture to the visitor as PNG.
    pub fn save_picture(&mut self, name: &str, svg: &str) {
        self.notice = self.host.save_picture(name, svg).err();
    }

    pub fn ask_for_file(&mut self) {
        self.notice = self.host.ask_for_file().err();
    }

    /// Shows the ensemble of a file; one that is no good is refused with a sentence.
    pub(super) fn open(&mut self, name: String, text: Result<String, String>) {
        let file = text.clone().and_then(|text| EnsembleFile::parse(&text).map_err(|error| error.to_string()));
        let checked = file.and_then(|file| {
            let (grid, config) = (file.grid.clone(), file.config.clone().unwrap_or_default());
            let left_out = file.left_out.clone();
            let setup = Setup { grid, config, course: Course::default(), ensemble: Some(file) };
            setup.check().map_err(|error| error.to_string())?;
            Ok((setup, left_out))
        });
        match checked {
            Err(sentence) => self.notice = Some(format!("{name}: {sentence}.")),
            Ok((setup, left_out)) => {
                let left_out = left_out.map(|why| format!("{name}: its config is not ours and left out ({why})."));
                self.setup = setup;
                self.preset = None;
                self.show_clones_of(self.setup.config.observer);
                self.load();
                let text = text.unwrap_or_default();
                self.notice = left_out.or(self.keep_file(&name, &text).err());
                self.opened = Some(Opened::new(name, &text));
            }
        }
    }

    pub fn set_beta(&mut self, beta: f64) {
        // egui's sliders obey a screen reader also where they are disabled.
        if beta == self.setup.last_beta() || self.setup.ensemble.is_some() {
            return;
        }
        self.preset = None;
        match self.view.beta_mode {
            BetaMode::Retrain => {
                self.setup.config.beta = beta;
                self.setup.course = Course::default();
                self.promise = None;
                self.send(Command::Retrain { beta });
            }
            BetaMode::Continue => self.continue_with(beta),
        }
    }

    /// The run from its start, paused, with the β that is set.
    pub fn reset(&mut self) {
        self.setup.config.beta = self.setup.last_beta();
        if self.setup.course != Course::default() {
            self.setup.course = Course::default();
            self.preset = None;
        }
        (self.promise, self.reproduced, self.view.sought) = (None, None, None);
        self.send_setup(false);
    }

    /// The run goes on from the moment shown with this β; where that lies back, on a branch.
    pub fn continue_with(&mut self, beta: f64) {
        if let Some(shown) = &self.shown {
            // A moment that is searched for comes first.
            let update = self.moment();
            let is_here = self.view.sought.is_none() && !self.is_retraining() && self.continued.is_none();
            let is_same = shown.snapshot.beta == beta && self.setup.course.is_settled(update);
            if is_here && is_same && self.shows_controls() {
                // No turn, no branch: what is to come has been, or comes as it would have.
                (self.preset, self.promise) = (None, None);
                return self.send(Command::Continue { beta });
            }
            if update >= Config::MOST_UPDATES || self.setup.course.turns.len() >= Course::MOST_TURNS {
                // It will say why not.
                return self.send(Command::Continue { beta });
            }
            // The session will say the same.
            let (usual, planned) = (self.setup.config.updates(), self.setup.updates());
            let last = match () {
                () if update < shown.snapshot.recorded => planned.max(update.saturating_add(usual / 2)),
                () if update >= planned => update.saturating_add(usual),
                () => planned,
            };
            let last = last.min(Config::MOST_UPDATES);
            self.setup.course.updates = Some(last).filter(|&last| last != usual);
            self.setup.course.turn(update, beta);
            self.continued = Some((beta, self.seen.saturating_add(IN_FLIGHT)));
            self.preset = None;
            self.promise = None;
            self.view.sought = None;
            self.send(Command::Continue { beta });
        }
    }

    /// Shows another moment of the run, as the visitor wishes.
    pub fn seek(&mut self, update: u32) {
        self.stop_leading();
        self.go_to(update);
    }

    /// What the address promises is still looked out for, but the visitor is elsewhere now.
    fn stop_leading(&mut self) {
        self.promise.iter_mut().for_each(|promise| promise.leads = false);
    }

    fn go_to(&mut self, update: u32) {
        // Nobody would make that moment.
        let Some(shown) = self.shown.as_mut().filter(|_| !matches!(self.session, Session::Failed(_))) else { return };
        shown.remember_end();
        let update = update.min(shown.snapshot.recorded);
        let run = shown.snapshot.run;
        if shown.snapshot.state != RunState::Given && self.view.sought.unwrap_or(shown.snapshot.update) != update {
            self.view.sought = Some(update);
            self.send(Command::Seek { run, update });
        }
    }

    /// The digest that the link which was opened has for the moment shown.
    pub fn promised(&self) -> Option<Digest> {
        let (_, snapshot) = self.shown()?;
        let reproduced =
            self.reproduced.filter(|reproduced| (reproduced.run, reproduced.update) == (snapshot.run, snapshot.update));
        reproduced.map(|reproduced| reproduced.promised)
    }

    /// The update that is shown, or about to be.
    pub fn moment(&self) -> u32 {
        self.view.sought.or(self.shown.as_ref().map(|shown| shown.snapshot.update)).unwrap_or(0)
    }

    fn send_setup(&mut self, play: bool) {
        self.send(Command::Load { setup: Box::new(self.setup.clone()), play });
    }

    /// Trains what the controls say; what was said of the run before is gone.
    fn load(&mut self) {
        self.notice = None;
        self.promise = None;
        self.reproduced = None;
        self.view.sought = None;
        self.send_setup(true);
    }

    /// The clone that is trained against, and the honest one or the blind one beside it.
    pub(super) fn usual_clones(observer: ObserverChoice) -> Vec<AttackerChoice> {
        let own = AttackerChoice::of(observer);
        let beside = if own == AttackerChoice::OCCUPANCY { AttackerChoice::UNIFORM } else { AttackerChoice::OCCUPANCY };
        vec![own, beside]
    }

    fn show_clones_of(&mut self, observer: ObserverChoice) {
        self.show_clones(App::usual_clones(observer));
    }

    pub(super) fn show_clones(&mut self, clones: Vec<AttackerChoice>) {
        self.view.clones = clones;
        self.send(Command::Show(self.view.clones.clone()));
    }

    /// Takes in what the session has said; to be called also while nothing is drawn.
    pub fn hear(&mut self) {
        while let Some(event) = self.link.receive() {
            self.silence = 0.0;
            match event {
                Ok(Event::Ready { protocol }) if protocol == PROTOCOL => {
                    self.session = Session::Ready;
                    self.send(Command::Speed(toolbar::SPEEDS[self.view.speed]));
                    self.send(Command::Show(self.view.clones.clone()));
                    match self.resumption() {
                        Some(resume) => self.send(resume),
                        None => {
                            // The runs of a session that is gone had other numbers.
                            self.slow_clones.clear(&mut self.pool);
                            self.reproduced = None;
                            self.send_setup(self.plays);
                        }
                    }
                }
                Ok(Event::Ready { .. }) => {
                    self.session = Session::Failed(OTHER_VERSION.to_owned());
                }
                Ok(Event::Started(started)) => match started.check() {
                    Ok(_) => {
                        if self.asked != Asked::Nothing {
                            // Runs come in the order they were asked for: after another's, that of the controls is to come.
                            self.asked = if self.is_of_controls(&started) { Asked::Begun } else { Asked::Waits };
                        }
                        if started.branch_of.is_none() {
                            // With the run before went what was still wanted of it.
                            self.wanted.clear();
                        }
                        (self.begun, self.remade) = (Some(*started), None);
                    }
                    Err(sentence) => self.distrust(&sentence),
                },
                Ok(Event::Snapshot(snapshot)) => match self.check(&snapshot) {
                    Ok(()) => self.take(*snapshot),
                    Err(sentence) => self.distrust(&sentence),
                },
                Ok(Event::Exported(exported)) => match exported.check() {
                    Ok(()) => self.take_ensemble(*exported),
                    Err(sentence) => self.distrust(&sentence),
                },
                Ok(Event::Remade(updates)) => self.remade = Some(updates),
                Ok(Event::Refused(sentence)) => {
                    (self.asked, self.continued) = (Asked::Nothing, None);
                    self.stepped = 0;
                    self.wanted.clear();
                    self.notice = Some(shortened(sentence));
                }
                Err(sentence) => self.lose_session(shortened(sentence)),
            }
        }
        let now = self.clock();
        for (id, event) in self.pool.receive() {
            let batches = [&mut self.bench.batch, &mut self.table1.batch, &mut self.sweep.batch];
            batches.into_iter().flatten().for_each(|batch| batch.hear(id, &event, now));
            self.race.hear(id, &event, self.now);
            self.take_clone(id, event);
        }
        while let Some((name, text)) = self.host.opened() {
            self.open(name, text);
        }
        while let Some(fragment) = self.host.visited() {
            self.visit(&fragment);
        }
        while let Some(sentence) = self.host.failure() {
            self.notice = Some(sentence);
        }
    }

    /// The time also where no frame tells it.
    fn clock(&self) -> f64 {
        self.host.now().unwrap_or(self.now)
    }

    /// Takes in the time, and counts how long the session has been silent.
    pub(super) fn tick(&mut self, ctx: &egui::Context) {
        let before = std::mem::replace(&mut self.now, ctx.input(|input| input.time));
        self.look_after_slow_clones(ctx);
        // That a run has begun is said at once, but where another comes to its end before.
        let is_due = matches!(self.session, Session::Starting) || self.asked == Asked::Waits && self.begun.is_none();
        if is_due {
            // A page that nobody sees is not painted, and its worker may rest as well.
            self.silence += (self.now - before).min(1.0);
            ctx.request_repaint_after(Duration::from_millis(500));
        } else {
            self.silence = 0.0;
        }
    }

    /// Whether the session does not answer, though it has neither said nor shown that it is gone.
    pub(super) fn is_silent(&self) -> bool {
        self.silence > PATIENCE
    }

    /// What the worker says makes no sense.
    fn distrust(&mut self, why: &str) {
        self.lose_session(format!("The worker has sent what cannot be shown ({why})."));
    }

    /// Whether a snapshot is one of its run; of a run that is not on the page it does not matter.
    fn check(&self, snapshot: &Snapshot) -> Result<(), String> {
        let begun = self.begun.as_ref().filter(|begun| begun.run == snapshot.run);
        let shown = self.shown.as_ref().filter(|shown| shown.started.run == snapshot.run);
        match (begun, shown) {
            (Some(begun), _) => snapshot.check(&begun.check()?),
            (None, Some(shown)) => snapshot.check(&shown.grid),
            (None, None) => Ok(()),
        }
    }

    /// The session has died. One that was at work is started again, unless that has been of no use.
    fn lose_session(&mut self, sentence: String) {
        let was_at_work = matches!(self.session, Session::Ready);
        self.can_resume = !self.is_retraining() && (was_at_work || self.can_resume);
        self.forget_session();
        let now = self.clock();
        self.restarts.retain(|at| now - at < WITHIN);
        if !was_at_work || self.restarts.len() >= MOST_RESTARTS {
            self.session = Session::Failed(sentence);
            // It said that another had taken its place.
            self.notice = None;
            return;
        }
        self.restarts.push(now);
        self.notice = Some(match self.resumption() {
            Some(_) => {
                let sentence = sentence.trim_end_matches('.');
                format!("{sentence}: it was started again and goes on from update {}.", self.moment())
            }
            None => format!("{} It was started again.", sentence),
        });
        self.restart_session();
    }

    pub(super) fn restart_session(&mut self) {
        self.session = Session::Starting;
        self.can_resume &= !self.is_retraining();
        self.forget_session();
        self.link.restart();
    }

    /// Nothing more comes of what the session was asked for.
    fn forget_session(&mut self) {
        (self.asked, self.begun, self.continued) = (Asked::Nothing, None, None);
        (self.silence, self.seen, self.stepped, self.remade) = (0.0, 0, 0, None);
        self.wanted.clear();
    }

    /// What tells another session of the run on the page, where the controls still say the same.
    fn resumption(&self) -> Option<Command> {
        let Shown { snapshot, .. } = self.shown.as_ref().filter(|_| self.can_resume)?;
        let is_same = self.shows_controls() && snapshot.state != RunState::Given;
        is_same.then(|| Command::Resume {
            run: snapshot.run,
            setup: Box::new(self.setup.clone()),
            recorded: snapshot.recorded,
            update: self.moment(),
            is_playing: snapshot.state == RunState::Playing && self.plays && self.view.sought.is_none(),
        })
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

    /// Puts a snapshot on the page.
    fn take(&mut self, mut snapshot: Snapshot) {
        self.taken += 1;
        (self.stepped, self.remade) = (0, None);
        self.undrawn = Some(snapshot.number);
        let points = std::mem::take(&mut snapshot.curve);
        if let Some(started) = self.begun.take_if(|begun| begun.run == snapshot.run) {
            let past = self.past_of(&started);
            self.view.sought = None;
            // Who pointed at the run before may have marked a cell that this grid has not.
            let cells = snapshot.experts.first().map_or(0, |expert| expert.policy.len());
            self.view.cell = self.view.cell.filter(|cell| *cell < cells);
            self.shown = Shown::new(started, snapshot, [past, points].concat(), self.taken);
        } else if let Some(shown) = self.shown.as_mut().filter(|shown| shown.started.run == snapshot.run) {
            shown.curve.extend(points);
            shown.remember_end();
            shown.snapshot = snapshot;
            shown.version = self.taken;
        }
        self.follow();
        self.add_made_clones();
    }

    /// The curve of a branch up to where it begins; the run that it leaves is kept to compare with.
    fn past_of(&mut self, started: &Started) -> Vec<CurvePoint> {
        let Some((run, update)) = started.branch_of else { return Vec::new() };
        match self.shown.take_if(|shown| shown.started.run == run) {
            Some(mut shown) => {
                let past = shown.curve.iter().filter(|point| point.update <= update).copied().collect();
                // As it was in the end, not where it was left.
                if let Some(end) = shown.end.take() {
                    shown.snapshot = *end;
                }
                self.keep(shown);
                past
            }
            None => Vec::new(),
        }
    }

    /// Whether a run is the one that the controls ask for.
    fn is_of_controls(&self, started: &Started) -> bool {
        (&started.setup.config, &started.setup.grid) == (&self.setup.config, &self.setup.grid)
    }

    /// What follows from a new snapshot: the course of its run, and the moment that the address asks for.
    fn follow(&mut self) {
        let Some(Shown { snapshot, started, .. }) = &self.shown else { return };
        self.continued = self.continued.filter(|(_, last)| snapshot.number <= *last);
        let last_beta = snapshot.course.turns.last().map(|(_, beta)| *beta);
        let is_older = self.continued.is_some_and(|(beta, _)| last_beta != Some(beta));
        // Unless the controls have gone on to another run, or to another β.
        if !self.is_retraining() && !is_older && self.is_of_controls(started) {
            self.setup.course = snapshot.course.clone();
        }
        if self.view.sought == Some(snapshot.update) {
            self.view.sought = None;
        }
        let is_resting = snapshot.state != RunState::Playing && !self.is_retraining();
        if let Some(promise) = self.promise.filter(|_| is_resting) {
            let update = promise.update.unwrap_or(snapshot.last_update);
            if snapshot.update == update {
                let run = snapshot.run;
                self.reproduced = promise.digest.map(|promised| Reproduced { run, update, promised });
                self.promise = None;
            } else if promise.leads && update <= snapshot.recorded {
                self.go_to(update);
            }
        }
    }
}
