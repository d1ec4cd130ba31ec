//! r̃: what the clone is to be denied where that is not the goal (paper, "The Semantics of Reward").

use std::fmt;
use std::str::FromStr;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use super::fields::written;
use crate::mdp::{ACTIONS, Action, Cell, Grid};

/// r̃(s, a), the sum of a reward for acting in a cell and one for the action chosen. Written as
/// `9,9=-1 stay=0.5`: row,column=reward or action=reward, with spaces between.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct AdversaryReward {
    cells: Vec<(Cell, f64)>,
    actions: [f64; ACTIONS],
}

impl AdversaryReward {
    /// How it is written.
    pub const FORM: &str =
        "none, or rewards as 9,9=-1 (row,column) or stay=0.5 (action) with spaces between, each from -1000 to 1000";
    const MOST: f64 = 1000.0;
    /// Most terms: each cell of the largest grid, and each action.
    const MOST_TERMS: usize = Grid::MOST_WALLS + ACTIONS;

    /// About how many bytes a copy takes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.cells.as_slice())
    }

    /// The first cell where no step of a grid begins: outside, a wall or the goal.
    pub fn idle(&self, grid: &Grid) -> Option<Cell> {
        let idle = |&(row, col): &Cell| {
            let is_outside = row as usize >= grid.rows() || col as usize >= grid.cols();
            is_outside || grid.starts().binary_search(&(row * grid.cols() as u32 + col)).is_err()
        };
        self.cells.iter().map(|(cell, _)| *cell).find(idle)
    }

    /// r̃(s, a), `[S][5]`; the grid must have all its cells.
    pub fn table(&self, grid: &Grid) -> Vec<[f64; ACTIONS]> {
        let mut table = vec![self.actions; grid.cells()];
        for &((row, col), reward) in &self.cells {
            table[row as usize * grid.cols() + col as usize].iter_mut().for_each(|entry| *entry += reward);
        }
        table
    }

    /// The reward of acting in a cell, for drawing.
    pub fn of_cell(&self, cell: Cell) -> f64 {
        self.cells.iter().filter(|(other, _)| *other == cell).map(|(_, reward)| reward).sum()
    }
}

impl fmt::Display for AdversaryReward {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cells = self.cells.iter().map(|((row, col), reward)| format!("{row},{col}={}", written(*reward)));
        let actions = Action::ALL.iter().zip(&self.actions).filter(|(_, reward)| **reward != 0.0);
        let actions = actions.map(|(action, reward)| format!("{}={}", action.name().to_lowercase(), written(*reward)));
        f.write_str(&cells.chain(actions).collect::<Vec<_>>().join(" "))
    }
}

/// Text that is no reward.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RewardError {
    #[error("adversary_reward {0:?}: must be {form}", form = AdversaryReward::FORM)]
    Term(String),
    #[error("adversary_reward of more than {most} terms: must be one for each cell and action at most", most = AdversaryReward::MOST_TERMS)]
    Long,
}

impl RewardError {
    fn term(text: &str) -> RewardError {
        RewardError::Term(text.chars().take(40).collect())
    }
}

impl FromStr for AdversaryReward {
    type Err = RewardError;

    fn from_str(text: &str) -> Result<Self, RewardError> {
        let mut reward = AdversaryReward::default();
        if text.split_whitespace().nth(Self::MOST_TERMS).is_some() {
            return Err(RewardError::Long);
        }
        for term in text.split_whitespace() {
            let parsed = || {
                let (place, value) = term.split_once('=')?;
                let value: f64 = value.parse().ok().filter(|value: &f64| value.abs() <= Self::MOST)?;
                if let Some((row, col)) = place.split_once(',') {
                    return Some((Some((row.parse().ok()?, col.parse().ok()?)), 0, value));
                }
                let action = Action::ALL.iter().position(|action| action.name().eq_ignore_ascii_case(place))?;
                Some((None, action, value))
            };
            match parsed().ok_or_else(|| RewardError::term(term))? {
                (Some(cell), _, value) => reward.cells.push((cell, value)),
                (None, action, value) => reward.actions[action] += value,
            }
        }
        if reward == AdversaryReward::default() { Err(RewardError::term(text)) } else { Ok(reward) }
    }
}

/// Reads r̃ or, as everywhere else it is written, none.
pub fn or_none<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<AdversaryReward>, D::Error> {
    let text = Option::<String>::deserialize(deserializer)?.filter(|text| text != "none");
    text.map(|text| text.parse().map_err(D::Error::custom)).transpose()
}

impl TryFrom<String> for AdversaryReward {
    type Error = RewardError;

    fn try_from(text: String) -> Result<Self, RewardError> {
        text.parse()
    }
}

impl From<AdversaryReward> for String {
    fn from(reward: AdversaryReward) -> String {
        reward.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    #[test]
    fn it_reads_back_as_it_is_written() {
        let reward: AdversaryReward = "9,9=-1  Stay=0.5 0,3=2".parse().unwrap();
        assert_eq!(reward.to_string(), "9,9=-1 0,3=2 stay=0.5");
        assert_eq!(reward.to_string().parse(), Ok(reward.clone()));
        let grid = Grid::new(GridSpec::default()).unwrap();
        let table = reward.table(&grid);
        assert_eq!(
            (table[99], table[3], table[50]),
            ([-1.0, -1.0, -1.0, -1.0, -0.5], [2.0, 2.0, 2.0, 2.0, 2.5], [0.0, 0.0, 0.0, 0.0, 0.5])
        );
        assert_eq!(reward.idle(&grid), None);
        for (text, cell) in [("5,5=1 10,0=1", (10, 0)), ("0,0=5", (0, 0))] {
            assert_eq!(text.parse::<AdversaryReward>().unwrap().idle(&grid), Some(cell));
        }
    }

    #[test]
    fn text_that_is_none_is_named() {
        for bad in ["", "9,9", "9,9=x", "jump=1", "9,9=NaN", "9,9=1e9", "-1,0=2"] {
            assert!(bad.parse::<AdversaryReward>().unwrap_err().to_string().contains("row,column"), "{bad}");
        }
        assert_eq!("1,1=1 ".repeat(2000).parse::<AdversaryReward>(), Err(RewardError::Long));
    }
}
