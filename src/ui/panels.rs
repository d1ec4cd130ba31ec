//! The panels: every expert, the clones, the optimal policy, and where they stand.

use egui::{Align, ComboBox, Layout, Rect, RichText, Ui, UiBuilder, Vec2, vec2};

use super::app::View;
use super::heatmap::{Heatmap, Pictures};
use super::numbers;
use super::theme::{self, GAP, Palette};
use super::widgets::{Icon, icon_button};
use crate::ape::observer::ObserverChoice;
use crate::lab::{PolicyView, Snapshot, Started};
use crate::mdp::{Grid, RETURN_KINDS};

/// A panel: what it shows and what it is called.
pub struct Panel<'a> {
    pub title: String,
    /// Nothing while the session has not evaluated it yet.
    pub policy: Option<&'a PolicyView>,
    /// For a clone its place in [`View::clones`], and p(c|s).
    pub clone: Option<(usize, &'a [f32])>,
}

/// All panels, in order.
pub fn list<'a>(started: &'a Started, snapshot: &'a Snapshot, view: &View) -> Vec<Panel<'a>> {
    let experts = snapshot.experts.iter().enumerate().map(|(index, policy)| Panel {
        title: if snapshot.experts.len() == 1 { "Expert".to_owned() } else { format!("Expert {}", index + 1) },
        policy: Some(policy),
        clone: None,
    });
    let clones = view.clones.iter().enumerate().map(|(index, observer)| {
        let clone = snapshot.clones.iter().find(|clone| clone.observer == *observer);
        let contexts = clone.map_or(&[][..], |clone| &clone.contexts);
        let title = format!("Clone ({observer})");
        Panel { title, policy: clone.map(|clone| &clone.view), clone: Some((index, contexts)) }
    });
    let optimal = Panel { title: "Optimal".to_owned(), policy: Some(&started.optimal), clone: None };
    experts.chain(clones).chain(std::iter::once(optimal)).collect()
}

/// What a visitor did to the panels.
#[derive(Default)]
pub struct Touched {
    /// The cell under the pointer.
    pub cell: Option<usize>,
    /// The clones to show from now on.
    pub clones: Option<Vec<ObserverChoice>>,
}

/// Height of a panel's title.
fn title_height(ui: &Ui) -> f32 {
    ui.spacing().interact_size.y + 20.0
}

/// How panels are laid out in a given area: columns, size of a picture, and what is left for the rest of
/// the page: beside the last row or below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    pub columns: usize,
    pub picture: Vec2,
    /// Space for chart and inspector, in place of panels in the last row; below everything when `None`.
    pub rest: Option<Rect>,
}

/// Least size of chart and inspector together: beside the panels, and in a strip below them.
const REST_BESIDE: Vec2 = vec2(330.0, 300.0);
const REST_BELOW: f32 = 210.0;

/// The plan with the largest pictures.
pub fn plan(ui: &Ui, area: Rect, panels: usize, grid: &Grid) -> Plan {
    let title = title_height(ui);
    let aspect = grid.cols() as f32 / grid.rows() as f32;
    let fit = |columns: usize, rows: usize, height: f32| -> Vec2 {
        let width = (area.width() - GAP * 2.0 * (columns - 1) as f32) / columns as f32;
        let height = (height - GAP * (rows - 1) as f32) / rows as f32 - title;
        let width = width.min(height * aspect).floor().max(40.0);
        vec2(width, width / aspect)
    };
    let mut best = Plan { columns: 1, picture: Vec2::ZERO, rest: None };
    for columns in 1..=panels {
        let rows = panels.div_ceil(columns);
        let below = fit(columns, rows, area.height() - REST_BELOW - GAP);
        if below.x > best.picture.x {
            best = Plan { columns, picture: below, rest: None };
        }
        let in_last_row = panels - (rows - 1) * columns;
        if in_last_row < columns {
            let picture = fit(columns, rows, area.height());
            let left = area.left() + in_last_row as f32 * (picture.x + 2.0 * GAP);
            let top = area.top() + (rows - 1) as f32 * (picture.y + title + GAP);
            let rest = Rect::from_min_max(egui::pos2(left, top), area.max);
            let is_enough = rest.width() >= REST_BESIDE.x && rest.height() >= REST_BESIDE.y;
            if is_enough && picture.x > best.picture.x {
                best = Plan { columns, picture, rest: Some(rest) };
            }
        }
    }
    best
}

/// Draws all panels by a plan, from the top left of what is free in `ui`.
pub fn show(
    ui: &mut Ui,
    panels: &[Panel],
    plan: &Plan,
    grid: &Grid,
    view: &View,
    version: u64,
    pictures: &mut Pictures,
) -> Touched {
    let mut touched = Touched::default();
    let title = title_height(ui);
    let size = vec2(plan.picture.x, plan.picture.y + title);
    for row in panels.chunks(plan.columns) {
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), size.y), egui::Sense::hover());
        for (column, panel) in row.iter().enumerate() {
            let left = line.left() + column as f32 * (size.x + 2.0 * GAP);
            let place = Rect::from_min_size(egui::pos2(left, line.top()), size);
            ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
                ui.set_clip_rect(place.expand(6.0).intersect(ui.clip_rect()));
                show_title(ui, panel, title, view, &mut touched);
                let picture = Rect::from_min_size(place.min + vec2(0.0, title), plan.picture);
                let Some(policy) = panel.policy else {
                    ui.painter().rect_filled(picture, 4.0, Palette::of(ui).raised);
                    return;
                };
                let id = egui::Id::unique(("heatmap", &panel.title));
                let name = describe(&panel.title, policy);
                let heatmap = Heatmap { id, name: &name, grid, policy, version, marked: view.cell };
                let cell = heatmap.show(ui, picture, pictures);
                touched.cell = touched.cell.or(cell);
            });
        }
    }
    touched
}

/// A panel in words.
fn describe(title: &str, policy: &PolicyView) -> String {
    let returns = &policy.returns;
    format!(
        "{title}: arrows and hitting times. Capped return {} steps, success {}.",
        numbers::steps(returns.capped_return),
        numbers::percent(returns.success)
    )
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
            ui.label(RichText::new("Clone").text_style(theme::strong()).color(palette.clone));
            let button = if view.clones.len() == 1 { Some(Icon::Add) } else { (index > 0).then_some(Icon::Remove) };
            let side = ui.spacing().interact_size.y;
            let width = ui.available_width() - button.map_or(0.0, |_| side + 4.0);
            choose_observer(ui, index, width, view, touched);
            ui.spacing_mut().interact_size.y = side;
            match button {
                Some(Icon::Add) if icon_button(ui, Icon::Add, "Show a second clone beside it", false).clicked() => {
                    let other = ObserverChoice::all().find(|choice| !view.clones.contains(choice));
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
    let kind = &RETURN_KINDS[view.kind];
    let text = match panel.policy.map(|policy| &policy.returns) {
        None => "evaluating …".to_owned(),
        Some(returns) => {
            let value = numbers::of_kind(kind, (kind.get)(returns));
            let arrive = format!("{} arrive in time", numbers::percent(returns.success));
            if kind.is_steps { format!("{value} steps, {arrive}") } else { arrive }
        }
    };
    ui.allocate_ui_with_layout(vec2(line.x, 20.0), Layout::left_to_right(Align::Center), |ui| {
        ui.add(egui::Label::new(RichText::new(text).small().color(palette.muted)).truncate());
    });
}

fn choose_observer(ui: &mut Ui, index: usize, width: f32, view: &View, touched: &mut Touched) {
    let chosen = view.clones[index];
    let name = format!("Who clones, panel {}", index + 1);
    let choices: Vec<ObserverChoice> = ObserverChoice::all()
        .map(|choice| if choice.model().name == chosen.model().name { chosen } else { choice })
        .filter(|choice| *choice == chosen || !view.clones.contains(choice))
        .collect();
    let response = ComboBox::from_id_salt(("clone", index))
        .width(width.max(60.0))
        .truncate()
        .selected_text(chosen.to_string())
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

    /// On the screens people have, pictures are as large as this, and everything has its place.
    #[test]
    fn five_panels_fill_the_page() {
        let grid = Grid::new(GridSpec::default()).unwrap();
        egui::__run_test_ui(|ui| {
            let at = |width, height| Rect::from_min_size(egui::Pos2::ZERO, vec2(width, height));
            let laptop = plan(ui, at(1000.0, 640.0), 5, &grid);
            assert!(laptop.columns == 3 && laptop.rest.is_some() && laptop.picture.x > 250.0, "{laptop:?}");
            let rest = laptop.rest.unwrap();
            assert!(at(1000.0, 640.0).contains_rect(rest) && rest.left() > 2.0 * laptop.picture.x);
            let four_k = plan(ui, at(3500.0, 1900.0), 5, &grid);
            assert!(four_k.picture.x > 600.0, "{four_k:?}");
        });
    }
}
