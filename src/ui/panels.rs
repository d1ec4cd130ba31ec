//! The panels: every expert, the clones, the optimal policy, and where they stand.

use egui::{Align, ComboBox, Layout, Rect, RichText, Ui, UiBuilder, Vec2, vec2};

use super::app::View;
use super::heatmap::{Heatmap, Pictures};
use super::numbers;
use super::theme::{self, GAP, MENU, Palette};
use super::widgets::{Icon, icon_button};
use crate::attack::AttackerChoice;
use crate::lab::{PolicyView, RunState, Snapshot, Started};
use crate::mdp::{Grid, RETURN_KINDS};

/// A panel: what it shows and what it is called.
pub struct Panel<'a> {
    pub title: String,
    /// The same in a column's head.
    pub short: String,
    /// Nothing while the session has not evaluated it yet.
    pub policy: Option<&'a PolicyView>,
    /// For a clone its place in [`View::clones`], and p(c|s).
    pub clone: Option<(usize, &'a [f32])>,
    /// What is said in the place of its figures until then.
    pub waiting: String,
    /// Whether it stays the same during a run.
    pub is_of_run: bool,
}

impl Panel<'_> {
    /// Whether it shows a clone with a memory, which is as at the start of an episode.
    fn remembers(&self, view: &View) -> bool {
        self.clone.is_some_and(|(index, _)| view.clones[index].model().remembers)
    }

    /// The line under its title: the chosen return and how many arrive, or what is being waited for.
    pub fn figures(&self, view: &View) -> String {
        let kind = &RETURN_KINDS[view.kind];
        let text = match self.policy.map(|policy| &policy.returns) {
            None => self.waiting.clone(),
            Some(returns) => {
                let arrive = format!("{} arrive", numbers::percent(returns.success));
                match returns.get(view.kind) {
                    _ if !kind.is_steps => arrive,
                    Some(value) => format!("{} steps, {arrive}", numbers::steps(value)),
                    None => format!("{} in T, {arrive}", numbers::steps(returns.horizon_return)),
                }
            }
        };
        if self.remembers(view) { format!("start: {text}") } else { text }
    }
}

/// All panels, in order.
pub fn list<'a>(started: &'a Started, snapshot: &'a Snapshot, view: &View) -> Vec<Panel<'a>> {
    let experts = snapshot.experts.iter().enumerate().map(|(index, policy)| Panel {
        title: if snapshot.experts.len() == 1 { "Expert".to_owned() } else { format!("Expert {}", index + 1) },
        short: format!("E{}", index + 1),
        policy: Some(policy),
        clone: None,
        waiting: String::new(),
        is_of_run: false,
    });
    let cells = started.optimal.policy.len();
    let clones = view.clones.iter().enumerate().map(|(index, cloner)| {
        let clone = snapshot.clones.iter().find(|clone| clone.cloner == *cloner);
        let contexts = clone.map_or(&[][..], |clone| &clone.contexts);
        let title = format!("Clone ({cloner})");
        Panel {
            title,
            short: cloner.to_string(),
            policy: clone.map(|clone| &clone.view),
            clone: Some((index, contexts)),
            waiting: waiting(cloner.is_quick(cells, started.setup.config.horizon), snapshot.state),
            is_of_run: false,
        }
    });
    let optimal = Panel {
        title: "Optimal".to_owned(),
        short: "optimal".to_owned(),
        policy: Some(&started.optimal),
        clone: None,
        waiting: String::new(),
        is_of_run: true,
    };
    experts.chain(clones).chain(std::iter::once(optimal)).collect()
}

/// Why a clone is not there yet.
fn waiting(is_quick: bool, state: RunState) -> String {
    match state {
        _ if is_quick => "evaluating …".to_owned(),
        RunState::Playing => "made when training rests".to_owned(),
        _ => "being made …".to_owned(),
    }
}

/// What a visitor did to the panels.
#[derive(Default)]
pub struct Touched {
    /// The cell under the pointer.
    pub cell: Option<usize>,
    /// The clones to show from now on.
    pub clones: Option<Vec<AttackerChoice>>,
    /// The moment of the run to show.
    pub update: Option<u32>,
    /// β to go on with from the moment shown.
    pub continue_with: Option<f64>,
}

/// Height of a panel's title.
fn title_height(ui: &Ui) -> f32 {
    ui.spacing().interact_size.y + 20.0
}

/// How panels are laid out in a given area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    pub columns: usize,
    /// Size of a picture.
    pub picture: Vec2,
    /// Whether chart and inspector stand at the right of the panels, or below them.
    pub is_rest_right: bool,
}

/// Least width of chart and inspector at the right, and least height below.
const REST_RIGHT: f32 = 340.0;
const REST_BELOW: f32 = 210.0;
/// Width under which panels stand below each other.
const TINY: f32 = 330.0;

impl Plan {
    /// The plan with the largest pictures.
    pub fn new(ui: &Ui, area: Vec2, panels: usize, grid: &Grid) -> Plan {
        let title = title_height(ui);
        let aspect = grid.cols() as f32 / grid.rows() as f32;
        let plans =
            (1..=panels).flat_map(|columns| [(columns, true), (columns, false)]).map(|(columns, is_rest_right)| {
                let rows = panels.div_ceil(columns);
                let space = if is_rest_right {
                    area - vec2(REST_RIGHT + 2.0 * GAP, 0.0)
                } else {
                    area - vec2(0.0, REST_BELOW + GAP)
                };
                let width = (space.x - GAP * 2.0 * (columns - 1) as f32) / columns as f32;
                let height = (space.y - GAP * (rows - 1) as f32) / rows as f32 - title;
                let width = width.min(height * aspect).floor().max(40.0);
                Plan { columns, picture: vec2(width, width / aspect), is_rest_right }
            });
        plans.reduce(|best, plan| if plan.picture.x > best.picture.x { plan } else { best }).expect("a page has panels")
    }

    /// So many columns over a width, as high as they come; one where two have no room for their titles.
    pub fn stacked(width: f32, columns: usize, grid: &Grid) -> Plan {
        let columns = if width < TINY { 1 } else { columns };
        let picture = ((width - 2.0 * GAP * (columns - 1) as f32) / columns as f32).floor();
        Plan {
            columns,
            picture: vec2(picture, picture * grid.rows() as f32 / grid.cols() as f32),
            is_rest_right: false,
        }
    }

    /// The largest pictures in an area that is theirs alone.
    pub fn filling(ui: &Ui, area: Vec2, panels: usize, grid: &Grid) -> Plan {
        let title = title_height(ui);
        let aspect = grid.cols() as f32 / grid.rows() as f32;
        let plans = (1..=panels).map(|columns| {
            let rows = panels.div_ceil(columns);
            let width = (area.x - GAP * 2.0 * (columns - 1) as f32) / columns as f32;
            let height = (area.y - 24.0 - GAP * rows as f32) / rows as f32 - title;
            let width = width.min(height * aspect).floor().max(40.0);
            Plan { columns, picture: vec2(width, width / aspect), is_rest_right: false }
        });
        plans.reduce(|best, plan| if plan.picture.x > best.picture.x { plan } else { best }).expect("a page has panels")
    }

    /// Width of all columns.
    pub fn width(&self) -> f32 {
        self.columns as f32 * (self.picture.x + 2.0 * GAP) - 2.0 * GAP
    }
}

/// What all panels stand on.
pub struct Ground<'a> {
    pub grid: &'a Grid,
    /// Changes whenever a policy does.
    pub version: u64,
    /// Changes with the run.
    pub run_version: u64,
    /// Cells with a reward r̃ of their own.
    pub rewards: &'a [(usize, f64)],
}

/// Draws all panels by a plan, from the top left of what is free in `ui`.
pub fn show(
    ui: &mut Ui,
    panels: &[Panel],
    plan: &Plan,
    ground: &Ground,
    view: &View,
    pictures: &mut Pictures,
) -> Touched {
    let Ground { grid, rewards, .. } = *ground;
    let mut touched = Touched::default();
    let id_of = |panel: &Panel| egui::Id::unique(("heatmap", &panel.title));
    pictures.keep_only(&panels.iter().map(id_of).collect::<Vec<_>>());
    let title = title_height(ui);
    let size = vec2(plan.picture.x, plan.picture.y + title);
    for row in panels.chunks(plan.columns) {
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), size.y), egui::Sense::hover());
        for (column, panel) in row.iter().enumerate() {
            let left = line.left() + column as f32 * (size.x + 2.0 * GAP);
            let place = Rect::from_min_size(egui::pos2(left, line.top()), size);
            // A child that takes no room of its own: the line above has been taken already.
            let ui = &mut ui.new_child(UiBuilder::new().max_rect(place).id_salt(&panel.title));
            show_title(ui, panel, title, view, &mut touched);
            let picture = Rect::from_min_size(place.min + vec2(0.0, title), plan.picture);
            let Some(policy) = panel.policy else {
                ui.painter().rect_filled(picture, 4.0, Palette::of(ui).raised);
                continue;
            };
            let id = id_of(panel);
            let version = if panel.is_of_run { ground.run_version } else { ground.version };
            let name = describe(&panel.title, policy);
            let rewards = if panel.clone.is_some() { rewards } else { &[] };
            let View { cell: marked, color_map, .. } = *view;
            let heatmap = Heatmap { id, name: &name, grid, policy, version, marked, rewards, color_map };
            let cell = heatmap.show(ui, picture, pictures);
            touched.cell = touched.cell.or(cell);
        }
    }
    touched
}

/// A panel in words.
fn describe(title: &str, policy: &PolicyView) -> String {
    let returns = &policy.returns;
    let success = numbers::percent(returns.success);
    match returns.capped_return {
        Some(capped) => {
            format!(
                "{title}: arrows and hitting times. Capped return {} steps, success {success}.",
                numbers::steps(capped)
            )
        }
        None => format!(
            "{title}: arrows at the start of an episode and steps within T. Return within T {} steps, success {success}.",
            numbers::steps(returns.horizon_return)
        ),
    }
}

fn show_title(ui: &mut Ui, panel: &Panel, height: f32, view: &View, touched: &mut Touched) {
    let palette = Palette::of(ui);
    ui.spacing_mut().item_spacing = vec2(4.0, 0.0);
    let line = vec2(ui.available_width(), height - 20.0);
    ui.allocate_ui_with_layout(line, Layout::left_to_right(Align::Center), |ui| match panel.clone {
        None => {
            ui.label(RichText::new(&panel.title).text_style(theme::strong()));
        }
        Some((index, _)) => {
            let button = if view.clones.len() == 1 { Some(Icon::Add) } else { (index > 0).then_some(Icon::Remove) };
            // Where there is no room for the word, the box's colour has to do.
            if line.x - button.map_or(0.0, |_| height - 16.0) >= 150.0 {
                ui.label(RichText::new("Clone").text_style(theme::strong()).color(palette.clone));
            }
            let side = ui.spacing().interact_size.y;
            let width = ui.available_width() - button.map_or(0.0, |_| side + 4.0);
            // A long name is cut to the room that there is.
            let room = vec2(width.max(60.0), side);
            ui.allocate_ui_with_layout(room, Layout::left_to_right(Align::Center), |ui| {
                choose_cloner(ui, index, view, touched);
            });
            match button {
                Some(Icon::Add) if icon_button(ui, Icon::Add, "Show a second clone beside it", false).clicked() => {
                    let other = AttackerChoice::all().find(|choice| !view.clones.contains(choice));
                    touched.clones = Some(view.clones.iter().copied().chain(other).collect());
                }
                Some(Icon::Remove) if icon_button(ui, Icon::Remove, "Remove this clone", false).clicked() => {
                    let rest = view.clones.iter().enumerate().filter(|(other, _)| *other != index);
                    touched.clones = Some(rest.map(|(_, choice)| *choice).collect());
                }
                _ => {}
            }
        }
    });
    let remembers = panel.remembers(view);
    let text = panel.figures(view);
    ui.allocate_ui_with_layout(vec2(line.x, 20.0), Layout::left_to_right(Align::Center), |ui| {
        let label = ui.add(egui::Label::new(RichText::new(text).small().color(palette.muted)).truncate());
        if remembers {
            let help = "“in T” is the return within T steps. This clone remembers its episode. Arrows are what it does where an episode starts, colour the steps of an \
                        episode that starts there.";
            label.on_hover_text(help);
        }
    });
}

fn choose_cloner(ui: &mut Ui, index: usize, view: &View, touched: &mut Touched) {
    let chosen = view.clones[index];
    let name = format!("Who clones, panel {}", index + 1);
    let mut choices = AttackerChoice::usual();
    if !choices.contains(&chosen) {
        choices.insert(0, chosen);
    }
    let choices: Vec<AttackerChoice> =
        choices.into_iter().filter(|choice| *choice == chosen || !view.clones.contains(choice)).collect();
    let response = ComboBox::from_id_salt(("clone", index))
        .width(ui.available_width())
        .height(MENU)
        .truncate()
        .selected_text(RichText::new(chosen.to_string()).color(Palette::of(ui).clone))
        .show_ui(ui, |ui| {
            for choice in choices {
                let text = format!("{choice}: {}", choice.model().title);
                if ui.selectable_label(choice == chosen, text).on_hover_text(choice.model().summary).clicked() {
                    let mut clones = view.clones.clone();
                    clones[index] = choice;
                    touched.clones = Some(clones);
                }
            }
        })
        .response;
    response.accessible_name(name).on_hover_text(chosen.model().summary);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    /// On the screens people have, pictures are as large as this.
    #[test]
    fn five_panels_fill_the_page() {
        let grid = Grid::new(GridSpec::default()).unwrap();
        egui::__run_test_ui(|ui| {
            for (area, least) in
                [(vec2(980.0, 560.0), 195.0), (vec2(1620.0, 840.0), 300.0), (vec2(3500.0, 1900.0), 800.0)]
            {
                let plan = Plan::new(ui, area, 5, &grid);
                assert!(plan.picture.x >= least, "{plan:?}");
                assert!(plan.width() + if plan.is_rest_right { REST_RIGHT } else { 0.0 } <= area.x, "{plan:?}");
            }
        });
    }
}
