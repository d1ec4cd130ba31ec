//! A setup in an address: readable, versioned, checked. `v=1&beta=0.3&observer=replay(60)&walls=4:0-3,6`.
//!
//! What is as by default is left out. An address is pairs of a name and a value; those that no setup knows are left to
//! whoever wrote them, and in the end to nobody: [`finish`] refuses them.

use percent_encoding::{AsciiSet, CONTROLS, percent_decode_str, utf8_percent_encode};

use super::{PRESETS, Preset, Setup};
use crate::ape::{Config, FIELDS, Field, written};
use crate::mdp::{Cell, Grid, GridSpec};

/// Version of the names and of what they mean.
const VERSION: &str = "1";
/// Longest address that is read, in bytes, and most names in it.
const LONGEST: usize = 50_000;
const MOST_NAMES: usize = 100;
/// What browsers would change in an address, and what separates its parts.
const ESCAPED: &AsciiSet =
    &CONTROLS.add(b' ').add(b'"').add(b'<').add(b'>').add(b'`').add(b'#').add(b'%').add(b'&').add(b'+');

/// Names and values, in order.
pub type Pairs = Vec<(String, String)>;

/// Why an address is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct AddressError(String);

fn refuse<T>(sentence: String) -> Result<T, AddressError> {
    Err(AddressError(sentence))
}

/// A pair that is no good.
pub fn bad<T>(name: &str, value: &str, expected: &str) -> Result<T, AddressError> {
    refuse(format!("{}={}: expected {expected}", shown(name), shown(value)))
}

/// As much of a name or a value as a sentence can take.
pub fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Pairs as the text that follows `#`.
pub fn encode(pairs: &Pairs) -> String {
    let pair = |(name, value): &(String, String)| format!("{name}={}", utf8_percent_encode(value, ESCAPED));
    std::iter::once(format!("v={VERSION}")).chain(pairs.iter().map(pair)).collect::<Vec<_>>().join("&")
}

/// The pairs of such a text.
pub fn decode(text: &str) -> Result<Pairs, AddressError> {
    if text.len() > LONGEST {
        return refuse(format!("it is {} bytes long, expected at most {LONGEST}", text.len()));
    }
    let mut pairs = Pairs::new();
    for part in text.split('&').filter(|part| !part.is_empty()) {
        let Some((name, value)) = part.split_once('=') else {
            return bad(part, "", "names and values as in beta=0.3");
        };
        let Ok(value) = percent_decode_str(value).decode_utf8() else {
            return bad(name, value, "text in UTF-8");
        };
        if pairs.iter().any(|(other, _)| other == name) {
            return refuse(format!("{} stands there twice", shown(name)));
        }
        if pairs.len() == MOST_NAMES {
            return refuse(format!("it has more than {MOST_NAMES} names"));
        }
        pairs.push((name.to_owned(), value.into_owned()));
    }
    match take(&mut pairs, "v").as_deref() {
        Some(VERSION) => Ok(pairs),
        Some(other) => bad("v", other, &format!("{VERSION}, the version that this page reads")),
        None => refuse(format!("it does not begin with v={VERSION}")),
    }
}

/// Takes a pair out.
pub fn take(pairs: &mut Pairs, name: &str) -> Option<String> {
    let index = pairs.iter().position(|(other, _)| other == name)?;
    Some(pairs.remove(index).1)
}

/// Refuses what nobody has taken.
pub fn finish(pairs: &Pairs) -> Result<(), AddressError> {
    match pairs.first() {
        None => Ok(()),
        Some((name, value)) => bad(name, value, "no such name in version 1"),
    }
}

/// What a setup differs in from the default. An ensemble is told by its preset's name; one from a file is not in it.
pub fn write(setup: &Setup) -> Pairs {
    let mut pairs = Pairs::new();
    let mut put = |name: &str, value: String| pairs.push((name.to_owned(), value));
    let (grid, paper) = (&setup.grid, GridSpec::default());
    let given = PRESETS.iter().find(|preset| setup.ensemble.is_some() && (preset.setup)().ensemble == setup.ensemble);
    if let Some(preset) = given {
        put("ensemble", preset.name.to_owned());
    }
    if (grid.rows, grid.cols) != (paper.rows, paper.cols) {
        put("size", format!("{}x{}", grid.rows, grid.cols));
    }
    if grid.goal != paper.goal {
        put("goal", format!("{},{}", grid.goal.0, grid.goal.1));
    }
    if !grid.walls.is_empty() {
        put("walls", write_walls(&grid.walls));
    }
    if grid.slip != paper.slip {
        put("slip", written(grid.slip));
    }
    for field in &FIELDS {
        let value = field.text(&setup.config);
        if value != field.text(&Config::default()) {
            put(field.name, value);
        }
    }
    if !setup.course.turns.is_empty() {
        let turn = |(update, beta): &(u32, f64)| format!("{update}:{}", written(*beta));
        let turns: Vec<String> = setup.course.turns.iter().map(turn).collect();
        put("turns", turns.join(";"));
    }
    if let Some(updates) = setup.course.updates {
        put("updates", updates.to_string());
    }
    pairs
}

/// The setup of an address: everything about it is valid. Takes its pairs out.
pub fn read(pairs: &mut Pairs) -> Result<Setup, AddressError> {
    let mut setup = Setup::default();
    if let Some(name) = take(pairs, "ensemble") {
        let preset = Preset::find(&name).map(|preset| (preset.setup)()).filter(|setup| setup.ensemble.is_some());
        let Some(preset) = preset else { return bad("ensemble", &name, "a preset with an ensemble, as trap") };
        if let Some((name, value)) = pairs.iter().find(|(name, _)| ["size", "goal", "walls", "slip"].contains(&&**name))
        {
            return bad(name, value, "no world of its own where an ensemble is given, which has one");
        }
        setup = Setup { config: Config::default(), ..preset };
    }
    if let Some(value) = take(pairs, "size") {
        let size = value.split_once('x').and_then(|(rows, cols)| Some((rows.parse().ok()?, cols.parse().ok()?)));
        let Some((rows, cols)) = size else { return bad("size", &value, "rows x columns, as 10x10") };
        (setup.grid.rows, setup.grid.cols) = (rows, cols);
    }
    if let Some(value) = take(pairs, "goal") {
        let Some(goal) = read_cell(&value) else { return bad("goal", &value, "row,column, as 0,0") };
        setup.grid.goal = goal;
    }
    if let Some(value) = take(pairs, "walls") {
        let Some(walls) = read_walls(&value) else {
            return bad("walls", &value, "rows with their columns, as 2:0-3,5;4:1");
        };
        setup.grid.walls = walls;
    }
    if let Some(value) = take(pairs, "slip") {
        let Ok(slip) = value.parse() else { return bad("slip", &value, "a number from 0 to below 1") };
        setup.grid.slip = slip;
    }
    for field in &FIELDS {
        if let Some(value) = take(pairs, field.name) {
            set(field, &mut setup.config, &value)?;
        }
    }
    if let Some(value) = take(pairs, "turns") {
        let turn = |text: &str| text.split_once(':').and_then(|(u, beta)| Some((u.parse().ok()?, beta.parse().ok()?)));
        let Some(turns) = value.split(';').map(turn).collect() else {
            return bad("turns", &value, "updates with their β, as 300:0.2;400:0.6");
        };
        setup.course.turns = turns;
    }
    if let Some(value) = take(pairs, "updates") {
        let Ok(updates) = value.parse() else { return bad("updates", &value, "a whole number") };
        setup.course.updates = Some(updates);
    }
    setup.check().map(|()| setup).map_err(|error| AddressError(error.to_string()))
}

fn set(field: &Field, config: &mut Config, value: &str) -> Result<(), AddressError> {
    field.set(config, value).or_else(|error| bad(field.name, value, &error.expected))
}

/// `row,column`.
pub fn read_cell(text: &str) -> Option<Cell> {
    let (row, col) = text.split_once(',')?;
    Some((row.parse().ok()?, col.parse().ok()?))
}

/// Row by row, neighbours as a range: `2:0-3,5;4:1`.
fn write_walls(walls: &[Cell]) -> String {
    let mut sorted = walls.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    let row = |cells: &[Cell]| {
        let runs = cells.chunk_by(|a, b| a.1 + 1 == b.1).map(|run| match run {
            [(_, only)] => only.to_string(),
            run => format!("{}-{}", run[0].1, run[run.len() - 1].1),
        });
        format!("{}:{}", cells[0].0, runs.collect::<Vec<_>>().join(","))
    };
    sorted.chunk_by(|a, b| a.0 == b.0).map(row).collect::<Vec<_>>().join(";")
}

fn read_walls(text: &str) -> Option<Vec<Cell>> {
    let mut walls = Vec::new();
    for part in text.split(';') {
        let (row, runs) = part.split_once(':')?;
        let row = row.parse().ok()?;
        for run in runs.split(',') {
            let (first, last) = run.split_once('-').unwrap_or((run, run));
            let (first, last): (u32, u32) = (first.parse().ok()?, last.parse().ok()?);
            // No grid is wider: a range is never long.
            if first > last || last >= Grid::MAX_SIDE || walls.len() > Grid::MOST_WALLS {
                return None;
            }
            walls.extend((first..=last).map(|col| (row, col)));
        }
    }
    // As it is written: who writes the same world in another order has the same run.
    walls.sort_unstable();
    walls.dedup();
    Some(walls)
}

#[cfg(test)]
mod tests {
    use super::super::Course;
    use super::*;

    fn through(setup: &Setup) -> Setup {
        let text = encode(&write(setup));
        let mut pairs = decode(&text).unwrap();
        let back = read(&mut pairs).unwrap();
        assert_eq!(finish(&pairs), Ok(()));
        back
    }

    #[test]
    fn setups_come_back_as_they_were() {
        for preset in &PRESETS {
            let setup = (preset.setup)();
            assert_eq!(through(&setup), setup, "{}", preset.name);
        }
        let grid =
            GridSpec { rows: 5, cols: 32, goal: (4, 31), slip: 0.1, walls: vec![(0, 3), (0, 4), (0, 5), (2, 7)] };
        let config = Config {
            beta: 1.0 / 3.0,
            observer: "replay(7)".parse().unwrap(),
            adversary_reward: "1,1=-1 stay=0.5".parse().ok(),
            alpha: Some(-14.5),
            ..Config::default()
        };
        let course = Course { turns: vec![(10, 0.25), (300, 0.1)], updates: Some(900) };
        let setup = Setup { grid, config, course, ensemble: None };
        assert_eq!(through(&setup), setup);
        assert_eq!(encode(&write(&Setup::default())), "v=1");
        let text = encode(&write(&setup));
        assert!(text.contains("walls=0:3-5;2:7") && text.contains("turns=10:0.25;300:0.1"), "{text}");
    }

    /// Three hundred zeros in each of a few numbers made an address too long to be read again.
    #[test]
    fn a_world_is_the_same_in_any_order_of_its_walls() {
        for walls in ["1:1;0:1", "0:1,1;1:1", "0:1-1;1:1;0:1"] {
            let setup = read(&mut decode(&format!("v=1&walls={walls}")).unwrap()).unwrap();
            assert_eq!(setup.grid.walls, [(0, 1), (1, 1)], "{walls}");
            assert_eq!(through(&setup), setup);
        }
    }

    #[test]
    fn tiny_numbers_are_written_short() {
        let tiny = 5e-324;
        let course = Course { turns: (0..200).map(|update| (update, tiny)).collect(), updates: None };
        let grid = GridSpec { slip: tiny, ..GridSpec::default() };
        let reward: Vec<String> = (1..100).map(|cell| format!("{},{}=1e-310", cell / 10, cell % 10)).collect();
        let config = Config { beta: tiny, adversary_reward: reward.join(" ").parse().ok(), ..Config::default() };
        let setup = Setup { grid, config, course, ensemble: None };
        assert_eq!(setup.check(), Ok(()));
        assert_eq!(through(&setup), setup);
        let text = encode(&write(&setup));
        assert!(text.len() < 5000 && text.contains("slip=5e-324&beta=5e-324"), "{text}");
        let huge = crate::mdp::GridError::Slip(1e300).to_string()
            + &Config { beta: 1e300, ..Config::default() }.check().unwrap_err().to_string();
        assert!(huge.len() < 120, "{huge}");
    }

    #[test]
    fn what_is_wrong_is_said() {
        let sentence = |text: &str| {
            let pairs = decode(text).map_err(|error| error.to_string());
            let read = pairs
                .and_then(|mut pairs| read(&mut pairs).and_then(|_| finish(&pairs)).map_err(|error| error.to_string()));
            read.unwrap_err()
        };
        for (text, expected) in [
            ("beta=0.3", "it does not begin with v=1"),
            ("v=2&beta=0.3", "v=2: expected 1, the version"),
            ("v=1&beta=9", "beta=9: expected a number from 0 to 2"),
            ("v=1&beta=NaN", "beta=NaN: expected a number"),
            ("v=1&beta", "expected names and values"),
            ("v=1&beta=0.1&beta=0.2", "beta stands there twice"),
            ("v=1&colour=red", "colour=red: expected no such name"),
            ("v=1&size=10", "size=10: expected rows x columns"),
            ("v=1&size=99x99", "99 × 99"),
            ("v=1&goal=10,0", "outside the grid"),
            ("v=1&walls=0:1;1:0", "column 2) cannot reach"),
            ("v=1&walls=0:0-99999999", "expected rows with their columns"),
            ("v=1&ensemble=trap&size=5x5", "no world of its own"),
            ("v=1&turns=732:0.1", "in the order of their updates"),
            ("v=1&turns=5:0.1;4:0.1", "in the order of their updates"),
            ("v=1&ensemble=blind", "a preset with an ensemble"),
            ("v=1&observer=%ff", "text in UTF-8"),
            ("v=1&slip=1", "slip 1"),
        ] {
            let found = sentence(text);
            assert!(found.contains(expected), "{text}: {found}");
        }
        assert!(sentence(&"x".repeat(LONGEST + 1)).contains("50001 bytes"));
        let names: Vec<String> = (0..200).map(|i| format!("n{i}=1")).collect();
        assert!(sentence(&names.join("&")).contains("more than 100 names"));
        assert!(sentence(&format!("v=1&{}=1", "n".repeat(9000))).len() < 200);
    }
}
