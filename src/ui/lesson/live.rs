//! The figures of the lesson, taken from what is on the page.

use crate::attack::AttackerChoice;
use crate::lab::{CloneView, PolicyView};
use crate::mdp::{Action, Policy, RETURN_KINDS, occupancy};
use crate::ui::app::App;
use crate::ui::numbers;

/// Most cells times steps times experts that the page computes by itself: about a millisecond.
const MOST_WORK: usize = 1_000_000;

fn first_clone(app: &App) -> Option<(&CloneView, String)> {
    let (_, snapshot) = app.shown()?;
    let clone = snapshot.clones.iter().find(|clone| Some(&clone.cloner) == app.view.clones.first())?;
    Some((clone, clone.cloner.to_string()))
}

/// The returns of ensemble and clones, by the return that is shown.
pub fn clone_and_ensemble(app: &App) -> Option<String> {
    let (_, snapshot) = app.shown()?;
    let kind = &RETURN_KINDS[app.view.kind];
    let who = if snapshot.experts.len() == 1 { "The expert" } else { "The ensemble" };
    let mut text = format!("{who} returns {}", numbers::of_kind(kind, (kind.get)(&snapshot.ensemble)));
    for cloner in &app.view.clones {
        let clone = snapshot.clones.iter().find(|clone| clone.cloner == *cloner)?;
        let value = clone.view.returns.get(app.view.kind).map(|value| numbers::of_kind(kind, value));
        text += &format!(", the clone ({cloner}) {}", value.unwrap_or("–".to_owned()));
    }
    Some(format!("{text} ({}).", kind.label))
}

/// What each expert and the first clone do at the cell that is marked.
pub fn one_cell(app: &App) -> Option<String> {
    let (started, snapshot) = app.shown()?;
    let Some(cell) = app.view.cell else { return Some("Point at a cell.".to_owned()) };
    let cols = started.setup.grid.cols as usize;
    let likely = |policy: &PolicyView| {
        let row = policy.policy.get(cell)?;
        let mut actions: Vec<(Action, f32)> = Action::ALL.into_iter().zip(*row).filter(|(_, p)| *p > 0.05).collect();
        actions.sort_by(|a, b| b.1.total_cmp(&a.1));
        let words = actions.iter().map(|(a, p)| format!("{} {}", a.name(), numbers::decimal(f64::from(*p), 2)));
        Some(words.collect::<Vec<_>>().join(", "))
    };
    let mut text = format!("Row {}, column {}. ", cell / cols, cell % cols);
    for (index, expert) in snapshot.experts.iter().enumerate() {
        text += &format!("Expert {}: {}. ", index + 1, likely(expert)?);
    }
    let (clone, name) = first_clone(app)?;
    if clone.contexts.is_empty() {
        return Some(format!("{text}Clone ({name}), which tells no experts apart: {}.", likely(&clone.view)?));
    }
    let n = snapshot.experts.len();
    let weights: Vec<String> = clone
        .contexts
        .get(cell * n..(cell + 1) * n)?
        .iter()
        .enumerate()
        .map(|(c, p)| format!("p({}|s) = {}", c + 1, numbers::decimal(f64::from(*p), 2)))
        .collect();
    Some(format!("{text}Clone ({name}) with {}: {}.", weights.join(", "), likely(&clone.view)?))
}

/// What the detours cost the experts and the clone, against the best there is.
pub fn price(app: &App) -> Option<String> {
    let (started, snapshot) = app.shown()?;
    let (clone, _) = first_clone(app)?;
    let best = started.optimal.returns.horizon_return;
    let (ensemble, clone) = (snapshot.ensemble.horizon_return, clone.view.returns);
    Some(format!(
        "Within T the ensemble needs {} steps more than the best, the clone {}. The experts arrive in {} of episodes, the clone in {}.",
        numbers::decimal(best - ensemble, 1),
        numbers::decimal(best - clone.horizon_return, 1),
        numbers::percent(snapshot.ensemble.success),
        numbers::percent(clone.success),
    ))
}

/// Both sides of the identity, for the ensemble on the page.
pub fn identity(app: &App) -> Option<String> {
    let shown = app.board()?;
    let (snapshot, grid) = (&shown.snapshot, shown.grid());
    let horizon = shown.started.setup.config.horizon;
    if grid.cells() * horizon as usize * snapshot.experts.len() > MOST_WORK {
        return Some("This grid and T are too large to compute both sides here.".to_owned());
    }
    if !app.view.clones.contains(&AttackerChoice::OCCUPANCY) {
        return Some("Both sides are of the honest clone: choose “occupancy” in one of the clones’ panels.".to_owned());
    }
    let clone = snapshot.clones.iter().find(|clone| clone.cloner == AttackerChoice::OCCUPANCY)?;
    let n = snapshot.experts.len() as f64;
    let (mut demonstrated, mut rest) = (0.0, 0.0);
    for expert in &snapshot.experts {
        let rows = expert.policy.iter().map(|row| {
            let sum: f64 = row.iter().map(|p| f64::from(*p)).sum();
            row.map(|p| f64::from(p) / sum)
        });
        let spent = occupancy(grid, &Policy::from_rows(rows.collect()), horizon);
        demonstrated += spent.visits.iter().sum::<f64>() / n;
        let left = spent.cut_off.iter().zip(&clone.view.hitting_time).map(|(m, h)| m * f64::from(*h));
        rest += left.sum::<f64>() / n;
    }
    let starts = grid.starts();
    let steps: f64 = starts.iter().map(|&s| f64::from(clone.view.hitting_time[s as usize])).sum();
    let steps = steps / starts.len() as f64;
    Some(format!(
        "Left: the honest clone takes {} steps, computed from its own policy. Right: D = {}, and {} for what was cut off: together {}. (Means over the {} cells where episodes start. The paper's returns count the goal, too, with 0: {}.)",
        numbers::short(steps),
        numbers::short(demonstrated),
        numbers::short(rest),
        numbers::short(demonstrated + rest),
        starts.len(),
        numbers::short(-steps * starts.len() as f64 / grid.free_cells() as f64),
    ))
}

/// The clone's capped return beside what an episode costs.
pub fn capped_and_real(app: &App) -> Option<String> {
    let (clone, name) = first_clone(app)?;
    let returns = clone.view.returns;
    Some(format!(
        "The clone ({name}) returns {} capped, {} within T, and arrives in {} of episodes.",
        returns.capped_return.map_or("–".to_owned(), numbers::steps),
        numbers::steps(returns.horizon_return),
        numbers::percent(returns.success),
    ))
}
