//! Everything that can be done with a word or a key: one table for buttons, menus, shortcuts, the palette and the help.

use egui::{
    Context, Event, Frame, InputState, Key, KeyboardShortcut, Modal, Modifiers, RichText, ScrollArea, TextEdit, Ui,
};

use super::app::{App, TABS, Tab, Wanted};
use super::theme::Palette;
use super::widgets::{Icon, dialog, icon_button};
use crate::ape::Config;
use crate::experiment::{PRESETS, WORLDS};
use crate::lab::Command as ToSession;
use crate::mdp::GridSpec;
use crate::picture::COLOR_MAPS;

/// A line of the table.
pub struct Command {
    /// What it is called by the program.
    pub name: &'static str,
    pub title: &'static str,
    pub help: &'static str,
    pub icon: Option<Icon>,
    /// Keys that do it, where no text is being written.
    pub keys: &'static [KeyboardShortcut],
    /// Whether it is possible now.
    pub can: fn(&App) -> bool,
    pub run: fn(&mut App, &Context),
}

const fn key(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

const fn shifted(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::SHIFT, key)
}

fn always(_: &App) -> bool {
    true
}

fn can_train(app: &App) -> bool {
    let state = app.shown().map(|(_, snapshot)| snapshot.state);
    app.setup().ensemble.is_none() && state.is_some() && app.is_session_alive()
}

fn is_shown(app: &App) -> bool {
    app.shown().is_some()
}

fn move_by(app: &mut App, updates: i64) {
    let update = (i64::from(app.moment()) + updates).clamp(0, i64::from(u32::MAX));
    app.seek(update as u32);
}

/// Every command, as the palette and the help list them.
pub static COMMANDS: [Command; 24] = [
    Command {
        name: "play",
        title: "Play or pause",
        help: "Trains on, or stops; a run that has ended goes on for as long again",
        icon: Some(Icon::Play),
        keys: &[key(Key::Space)],
        can: can_train,
        run: |app, _| app.send(if app.is_playing() { ToSession::Pause } else { ToSession::Play }),
    },
    Command {
        name: "step",
        title: "One update",
        help: "One update of the policies, then pause",
        icon: Some(Icon::Step),
        keys: &[key(Key::S)],
        can: can_train,
        run: |app, _| app.send(ToSession::Step),
    },
    Command {
        name: "reset",
        title: "Back to the start",
        help: "The run from its beginning, with the β that is set",
        icon: Some(Icon::Reset),
        keys: &[key(Key::R)],
        can: can_train,
        run: |app, _| app.reset(),
    },
    Command {
        name: "earlier",
        title: "One update back",
        help: "Everything on the page as it was one update before",
        icon: Some(Icon::Earlier),
        keys: &[key(Key::ArrowLeft)],
        can: can_train,
        run: |app, _| move_by(app, -1),
    },
    Command {
        name: "later",
        title: "One update on",
        help: "Everything on the page as it was one update later",
        icon: Some(Icon::Later),
        keys: &[key(Key::ArrowRight)],
        can: can_train,
        run: |app, _| move_by(app, 1),
    },
    Command {
        name: "much earlier",
        title: "Fifty updates back",
        help: "Everything on the page as it was fifty updates before",
        icon: None,
        keys: &[shifted(Key::ArrowLeft)],
        can: can_train,
        run: |app, _| move_by(app, -50),
    },
    Command {
        name: "much later",
        title: "Fifty updates on",
        help: "Everything on the page as it was fifty updates later",
        icon: None,
        keys: &[shifted(Key::ArrowRight)],
        can: can_train,
        run: |app, _| move_by(app, 50),
    },
    Command {
        name: "first",
        title: "To the first update",
        help: "Everything on the page as it was before training",
        icon: None,
        keys: &[key(Key::Home)],
        can: can_train,
        run: |app, _| app.seek(0),
    },
    Command {
        name: "last",
        title: "To the last update",
        help: "Everything on the page as it is now",
        icon: None,
        keys: &[key(Key::End)],
        can: can_train,
        run: |app, _| app.seek(u32::MAX),
    },
    Command {
        name: "more beta",
        title: "More β",
        help: "β up by 0.05: the clone's failure counts for more",
        icon: None,
        keys: &[key(Key::ArrowUp)],
        can: can_train,
        run: |app, _| app.move_beta(0.05),
    },
    Command {
        name: "less beta",
        title: "Less β",
        help: "β down by 0.05: the clone's failure counts for less",
        icon: None,
        keys: &[key(Key::ArrowDown)],
        can: can_train,
        run: |app, _| app.move_beta(-0.05),
    },
    Command {
        name: "pin",
        title: "Keep this run to compare",
        help: "Its figures and curve stay, and the next run stands beside them",
        icon: Some(Icon::Pin),
        keys: &[key(Key::P)],
        can: is_shown,
        run: |app, _| app.pin(),
    },
    Command {
        name: "link",
        title: "Copy link",
        help: "An address that holds grid, configuration, seed and view: whoever opens it sees the same, to the last bit",
        icon: Some(Icon::Link),
        keys: &[key(Key::L)],
        can: is_shown,
        run: |app, ctx| app.copy_link(ctx),
    },
    Command {
        name: "figure",
        title: "Figure as SVG",
        help: "All panels as a vector picture on white, with colour bar and caption",
        icon: None,
        keys: &[],
        can: is_shown,
        run: |app, _| app.export_picture(),
    },
    Command {
        name: "figure png",
        title: "Figure as PNG",
        help: "The same picture in pixels",
        icon: None,
        keys: &[],
        can: is_shown,
        run: |app, _| app.export_png(),
    },
    Command {
        name: "curve",
        title: "Curve as CSV",
        help: "All four returns of ensemble and clone over training, as a table",
        icon: None,
        keys: &[],
        can: App::has_curve,
        run: |app, _| app.export_curve(),
    },
    Command {
        name: "ensemble",
        title: "Ensemble as JSON",
        help: "Every expert's policy in full precision, with grid and configuration; this page and the command ape read it",
        icon: None,
        keys: &[],
        can: App::can_export,
        run: |app, _| app.want(Wanted::Save),
    },
    Command {
        name: "model",
        title: "Transition model as JSON",
        help: "P[s][a] as (probability, next state, reward, terminated), as Gymnasium's toy-text environments have it",
        icon: None,
        keys: &[],
        can: is_shown,
        run: |app, _| app.export_model(),
    },
    Command {
        name: "open",
        title: "Open an ensemble …",
        help: "Shows and attacks the policies of a file, your own too; it can also be dropped on the page",
        icon: None,
        keys: &[key(Key::O)],
        can: always,
        run: |app, _| app.ask_for_file(),
    },
    Command {
        name: "table",
        title: "Policies as a table",
        help: "Every cell's steps and probabilities as text",
        icon: Some(Icon::Table),
        keys: &[key(Key::T)],
        can: is_shown,
        run: |app, _| app.view.is_table_open = !app.view.is_table_open,
    },
    Command {
        name: "colours",
        title: "Next colours",
        help: "Viridis as in the paper, one for colour-blind viewers, one of high contrast",
        icon: None,
        keys: &[key(Key::C)],
        can: always,
        run: |app, ctx| {
            let color_map = (app.preferences.color_map + 1) % COLOR_MAPS.len();
            app.prefer(super::settings::Preferences { color_map, ..app.preferences }, ctx);
        },
    },
    Command {
        name: "explain",
        title: "Explain every control",
        help: "What a control does stands under it, or only in its tooltip",
        icon: None,
        keys: &[key(Key::E)],
        can: always,
        run: |app, ctx| {
            let explains = !app.preferences.explains;
            app.prefer(super::settings::Preferences { explains, ..app.preferences }, ctx);
        },
    },
    Command {
        name: "palette",
        title: "Find a command",
        help: "Every command, preset, world and tab by its name",
        icon: Some(Icon::Search),
        keys: &[KeyboardShortcut::new(Modifiers::COMMAND, Key::K)],
        can: always,
        run: |app, _| app.palette.open(),
    },
    Command {
        name: "help",
        title: "What is this?",
        help: "What the page shows, and every shortcut",
        icon: Some(Icon::Help),
        keys: &[key(Key::Questionmark), shifted(Key::Questionmark), shifted(Key::Slash)],
        can: always,
        run: |app, _| app.view.is_help_open = !app.view.is_help_open,
    },
];

/// The keys of the tabs, in their order.
const TAB_KEYS: [Key; 7] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7];

/// The command of this name, which must be in the table.
pub fn named(name: &str) -> &'static Command {
    COMMANDS.iter().find(|command| command.name == name).expect("asked for by a name in the table")
}

impl Command {
    /// Its first key in words, where it has one.
    pub fn key(&self) -> Option<String> {
        self.keys.first().map(shortcut)
    }

    /// What stands in its tooltip.
    pub fn tip(&self) -> String {
        self.key().map_or(self.help.to_owned(), |key| format!("{} ({key})", self.help))
    }
}

fn shortcut(keys: &KeyboardShortcut) -> String {
    let key = match keys.logical_key {
        Key::ArrowLeft => "Left",
        Key::ArrowRight => "Right",
        Key::ArrowUp => "Up",
        Key::ArrowDown => "Down",
        Key::Questionmark | Key::Slash => "?",
        key => key.name(),
    };
    match keys.modifiers {
        Modifiers::SHIFT => format!("Shift+{key}"),
        Modifiers::COMMAND => format!("Ctrl/Cmd+{key}"),
        _ => key.to_owned(),
    }
}

/// The button of a command, with its icon.
pub fn button(ui: &mut Ui, app: &mut App, name: &str) {
    let command = named(name);
    let can = (command.can)(app);
    let response =
        ui.add_enabled_ui(can, |ui| icon_button(ui, command.icon.unwrap_or(Icon::Help), command.title, false));
    if response.inner.on_hover_text(command.tip()).clicked() {
        (command.run)(app, ui.ctx());
    }
}

/// A line of a menu; closes it when it is pressed.
pub fn menu_line(ui: &mut Ui, app: &mut App, name: &str) {
    let command = named(name);
    let button = egui::Button::new(command.title).shortcut_text(command.key().unwrap_or_default());
    let response = ui.add_enabled((command.can)(app), button).accessible_name(command.title);
    if response.on_hover_text(command.help).clicked() {
        (command.run)(app, ui.ctx());
        ui.close();
    }
}

/// Does what the keys say. Letters are left to who writes text, arrows and space to who has the focus.
pub fn listen(ctx: &Context, app: &mut App) {
    // What is written and the Enter that ends it may come in one frame: the letters were not meant for us.
    let is_writing = ctx.text_edit_focused();
    let was_writing = std::mem::replace(&mut app.view.is_writing, is_writing);
    if is_writing || was_writing || egui::Popup::is_any_open(ctx) {
        return;
    }
    let has_focus = ctx.memory(|memory| memory.focused().is_some());
    // What is open over the page: all that is left is the key that opened it.
    let open = match () {
        () if app.view.is_help_open || app.palette.is_open() => Some("help"),
        () if app.view.is_table_open => Some("table"),
        () => None,
    };
    for command in &COMMANDS {
        for keys in command.keys {
            const OF_WIDGETS: [Key; 7] =
                [Key::Space, Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown, Key::Home, Key::End];
            let is_taken =
                (has_focus && OF_WIDGETS.contains(&keys.logical_key)) || open.is_some_and(|open| command.name != open);
            let presses = if is_taken { 0 } else { ctx.input_mut(|input| take_key(input, keys)) };
            if presses > 0 && (command.can)(app) {
                (0..presses).for_each(|_| (command.run)(app, ctx));
                // What it changed is drawn in the next frame.
                ctx.request_repaint();
                return;
            }
        }
    }
    for (key, (tab, ..)) in TAB_KEYS.into_iter().zip(TABS) {
        if open.is_none() && ctx.input(|input| input.modifiers.is_none() && input.key_pressed(key)) {
            app.view.tab = tab;
            ctx.request_repaint();
        }
    }
}

/// How often these keys were pressed since the last frame, with exactly these modifiers at that moment; nobody else
/// hears of it then.
fn take_key(input: &mut InputState, keys: &KeyboardShortcut) -> usize {
    let before = input.events.len();
    input.events.retain(|event| {
        !matches!(event, Event::Key { key, pressed: true, modifiers, .. }
            if *key == keys.logical_key && modifiers.matches_exact(keys.modifiers))
    });
    before - input.events.len()
}

/// Every shortcut with what it does, for the help.
pub fn shortcuts() -> impl Iterator<Item = (String, &'static str)> {
    let commands = COMMANDS.iter().filter_map(|command| Some((command.key()?, command.title)));
    let tabs = TAB_KEYS.iter().zip(&TABS).map(|(key, (_, _, label, _))| (key.name().to_owned(), *label));
    commands.chain(tabs)
}

/// What a line of the palette does.
#[derive(Clone, Copy)]
enum Deed {
    Command(&'static Command),
    Tab(Tab),
    Preset(usize),
    World(usize),
}

/// The palette: a window to find a command by its name.
#[derive(Default)]
pub struct PaletteWindow {
    /// What has been typed, while it is open.
    query: Option<String>,
    /// The line that Enter does.
    chosen: usize,
}

impl PaletteWindow {
    pub fn open(&mut self) {
        (self.query, self.chosen) = (Some(String::new()), 0);
    }

    pub fn is_open(&self) -> bool {
        self.query.is_some()
    }
}

/// Every line, with its title, what it is, and its key.
fn lines() -> Vec<(Deed, String, &'static str, String)> {
    let mut lines: Vec<_> = COMMANDS
        .iter()
        .filter(|command| command.name != "palette")
        .map(|command| {
            (Deed::Command(command), command.title.to_owned(), command.help, command.key().unwrap_or_default())
        })
        .collect();
    for (index, (tab, _, label, help)) in TABS.iter().enumerate() {
        let key = TAB_KEYS.get(index).map_or("", |key| key.name()).to_owned();
        lines.push((Deed::Tab(*tab), format!("Go to: {label}"), help, key));
    }
    for (index, preset) in PRESETS.iter().enumerate() {
        lines.push((Deed::Preset(index), format!("Preset: {}", preset.title), preset.summary, String::new()));
    }
    for (index, world) in WORLDS.iter().enumerate() {
        lines.push((Deed::World(index), format!("World: {}", world.title), world.summary, String::new()));
    }
    lines
}

/// Whether every word of the query is in the text.
fn matches(query: &str, text: &str) -> bool {
    let text = text.to_lowercase();
    query.to_lowercase().split_whitespace().all(|word| text.contains(word))
}

/// Draws the palette, when it is open.
pub fn show_palette(ctx: &Context, app: &mut App) {
    let Some(mut query) = app.palette.query.take() else { return };
    let pressed = |key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    let (downs, ups) = (pressed(Key::ArrowDown), pressed(Key::ArrowUp));
    let (is_entered, is_left) = (pressed(Key::Enter), pressed(Key::Escape));
    let (mut chosen, mut done) = (app.palette.chosen, None);
    let screen = ctx.content_rect().size();
    let response = Modal::new(egui::Id::unique("palette"))
        .frame(Frame::popup(&ctx.global_style()).inner_margin(12))
        .show(ctx, |ui| {
            dialog(ui, "Find a command");
            ui.set_width(480.0_f32.min(screen.x - 48.0));
            let edit = TextEdit::singleline(&mut query).hint_text("Find a command, preset, world or tab");
            let edit = ui.add(edit.desired_width(f32::INFINITY).margin(egui::Margin::symmetric(8, 8)));
            edit.request_focus();
            if edit.accessible_name("Find a command").changed() {
                chosen = 0;
            }
            // By what is written now: the last letters and Enter may come in one frame.
            let mut found: Vec<_> =
                lines().into_iter().filter(|(_, title, help, _)| matches(&query, &format!("{title} {help}"))).collect();
            // Those whose title says it come first.
            found.sort_by_key(|(_, title, ..)| !matches(&query, title));
            let last = found.len().saturating_sub(1);
            chosen = (chosen + usize::from(downs)).min(last).saturating_sub(usize::from(ups));
            let is_moved = chosen != app.palette.chosen;
            done = found.get(chosen).filter(|_| is_entered).map(|line| line.0);
            ScrollArea::vertical().max_height((screen.y - 160.0).min(420.0)).auto_shrink([false, true]).show(
                ui,
                |ui| {
                    let palette = Palette::of(ui);
                    for (index, (deed, title, help, key)) in found.iter().enumerate() {
                        let can = match deed {
                            Deed::Command(command) => (command.can)(app),
                            _ => true,
                        };
                        let button =
                            egui::Button::selectable(index == chosen, title.as_str()).shortcut_text(key.as_str());
                        let button = button.min_size(egui::vec2(ui.available_width(), 0.0));
                        let response = ui.add_enabled(can, button).accessible_name(title).on_hover_text(*help);
                        if index == chosen && is_moved {
                            response.scroll_to_me(None);
                        }
                        if response.clicked() {
                            done = Some(*deed);
                        }
                    }
                    if found.is_empty() {
                        ui.label(RichText::new(format!("Nothing is called “{query}”.")).color(palette.muted));
                    }
                },
            );
        });
    app.palette.chosen = chosen;
    let is_left = is_left || response.should_close();
    if is_left || done.is_some() {
        // Whatever is pressed next is not written here.
        ctx.memory_mut(|memory| memory.stop_text_input());
    }
    if is_left {
        return ctx.request_repaint();
    }
    let Some(deed) = done else {
        app.palette.query = Some(query);
        return;
    };
    ctx.request_repaint();
    match deed {
        Deed::Command(command) if (command.can)(app) => (command.run)(app, ctx),
        Deed::Command(_) => {}
        Deed::Tab(tab) => app.view.tab = tab,
        Deed::Preset(index) => app.load_preset(index),
        Deed::World(index) => {
            let mut tab = std::mem::take(&mut app.world);
            tab.change(app, GridSpec { slip: app.setup().grid.slip, ..WORLDS[index].grid() });
            app.world = tab;
            app.view.tab = Tab::World;
        }
    }
}

impl App {
    /// Moves β by a little, on the slider's grid.
    fn move_beta(&mut self, by: f64) {
        let beta = libm::round((self.setup().last_beta() + by) * 100.0) / 100.0;
        self.set_beta(beta.clamp(0.0, Config::MAX_BETA));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        let mut keys: Vec<_> = COMMANDS.iter().flat_map(|command| command.keys).map(|k| format!("{k:?}")).collect();
        keys.extend(TAB_KEYS.map(|k| format!("{:?}", key(k))));
        let count = keys.len();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), count);
        assert!(TABS.len() <= TAB_KEYS.len());
    }

    #[test]
    fn names_and_titles_are_their_own() {
        for (index, command) in COMMANDS.iter().enumerate() {
            assert!(COMMANDS.iter().skip(index + 1).all(|o| o.name != command.name && o.title != command.title));
        }
        assert!(matches("pre bli", "Preset: Blind clone") && !matches("maze", "Preset: Blind clone"));
    }
}
