//! A sweep in shards: which runs belong to which, the file that holds a shard, and how shards are joined again.
//! Nothing here reads or writes files.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Setup, SetupError, Sweep, SweepRun, sweep};
use crate::ape::json::{quoted, without_mark};
use crate::ape::{Config, Digest, Trainer};
use crate::mdp::{Grid, GridSpec, KnownReturns, Returns};

/// Shard I of K, written `I/K`. Run r of a sweep, counted from 0, is in shard r mod K + 1, so that every shard has
/// its share of every β.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardNumber {
    /// I, from 1.
    pub shard: u32,
    /// K.
    pub shards: u32,
}

impl ShardNumber {
    /// Most shards of a sweep.
    pub const MOST: u32 = 10_000;

    fn check(self) -> Result<ShardNumber, ShardError> {
        let is_good = (1..=Self::MOST).contains(&self.shards) && (1..=self.shards).contains(&self.shard);
        if is_good { Ok(self) } else { Err(ShardError::Number(self.to_string())) }
    }

    /// The runs of this shard, of so many.
    fn indexes(self, runs: usize) -> impl ExactSizeIterator<Item = usize> {
        (self.shard as usize - 1..runs).step_by(self.shards as usize)
    }
}

impl fmt::Display for ShardNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.shard, self.shards)
    }
}

impl FromStr for ShardNumber {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<ShardNumber, ShardError> {
        let wrong = || ShardError::Number(text.to_owned());
        let (shard, shards) = text.split_once('/').ok_or_else(wrong)?;
        let number = |text: &str| text.parse().map_err(|_| wrong());
        ShardNumber { shard: number(shard)?, shards: number(shards)? }.check().map_err(|_| wrong())
    }
}

/// Why a shard, or its file, is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShardError {
    #[error("{0}: must be I/K, shard I of K, with I from 1 to K and K from 1 to {most}", most = ShardNumber::MOST)]
    Number(String),
    #[error("{which}: the sweep has {runs} runs, expected K from 1 to {runs}")]
    Many { which: ShardNumber, runs: usize },
    #[error("{which}: {runs} runs in a shard, expected at most {}: take {least} shards or more", Shard::MOST_RUNS)]
    Large { which: ShardNumber, runs: usize, least: usize },
    #[error("not a shard of a sweep: {0}; expected what ape sweep --shard writes, a whole file")]
    Json(String),
    #[error("format {0:?}: must be \"ape-sweep-shard\"")]
    Format(String),
    #[error("version {0}: this program reads version 1")]
    Version(u32),
    #[error("{0}")]
    Setup(#[from] SetupError),
    #[error("{0}")]
    Sweep(String),
    #[error("sweep.{name} has {found} entries: must have from 1 to 1000")]
    Entries { name: &'static str, found: usize },
    #[error("{run}: {what}")]
    Run { run: RunPlace, what: String },
    #[error("complete true: {0} missing, expected false")]
    Complete(String),
    #[error("complete false: every run is there, expected true")]
    Incomplete,
    #[error("shard {found}: expected shard {expected}")]
    Other { found: ShardNumber, expected: ShardNumber },
    #[error("{0}")]
    Mixed(Box<Difference>),
    #[error("{file}: {difference}, as in {first}")]
    MixedFiles { file: String, first: String, difference: Box<Difference> },
    #[error("{0}: given twice, expected every file once")]
    Twice(String),
    #[error("{file}: shard {which}, which is in {first} too: expected every shard once")]
    Duplicate { file: String, first: String, which: ShardNumber },
    #[error("{file}: shard {which} is not finished, {missing} missing: expected the same ape sweep to be run again")]
    Unfinished { file: String, which: ShardNumber, missing: String },
    #[error("{0} missing: expected every shard of the sweep")]
    Gaps(String),
}

/// The first field in which two sweeps differ.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} {found}{remark}: expected {expected}")]
pub struct Difference {
    field: String,
    found: String,
    expected: String,
    /// What a reader cannot tell from the field.
    remark: &'static str,
}

/// One run of a sweep, as sentences name it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunPlace {
    index: usize,
    beta: f64,
    seed: u32,
}

impl fmt::Display for RunPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "run {} (β {}, seed {})", self.index, self.beta, self.seed)
    }
}

/// A few of many, and how many more; with the verb that goes with their number.
fn listed(all: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = all.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    let verb = if all.len() == 1 { "is" } else { "are" };
    format!("{}{rest} {verb}", all[..all.len() - more].join(", "))
}

/// A whole sweep before it is run: shards are of one sweep when these are equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepPlan {
    /// Version of the program.
    pub program: String,
    pub grid: GridSpec,
    /// Of the first run: the others have another `beta` and `seed`.
    pub config: Config,
    pub betas: Vec<f64>,
    /// Number of seeds, from 1 on.
    pub seeds: u32,
    /// Hash of all parameters of the last run after three updates: programs that train alike share it.
    pub digest: Digest,
}

impl SweepPlan {
    /// Checks everything; trains for three updates.
    pub fn new(setup: &Setup, betas: Vec<f64>, seeds: u32) -> Result<SweepPlan, ShardError> {
        let (grid, config) = (setup.grid.clone(), setup.config.clone());
        let program = env!("CARGO_PKG_VERSION").to_owned();
        let mut plan = SweepPlan { program, grid, config, betas, seeds, digest: Digest::default() };
        plan.check_lists()?;
        plan.config = plan.setup(0).config;
        plan.check()?;
        let last = plan.setup(plan.runs() - 1);
        let said = |error: &dyn fmt::Display| ShardError::Sweep(error.to_string());
        let grid = Grid::new(last.grid).map_err(|error| said(&error))?;
        let mut trainer = Trainer::new(grid, last.config).map_err(|error| said(&error))?;
        (0..3).for_each(|_| trainer.update());
        plan.digest = trainer.digest();
        Ok(plan)
    }

    fn check_lists(&self) -> Result<(), ShardError> {
        for (name, found) in [("betas", self.betas.len()), ("seeds", self.seeds as usize)] {
            if !(1..=1000).contains(&found) {
                return Err(ShardError::Entries { name, found });
            }
        }
        Ok(())
    }

    fn check(&self) -> Result<(), ShardError> {
        self.check_lists()?;
        for &beta in &self.betas {
            Config { beta, ..self.config.clone() }.check().map_err(SetupError::from)?;
        }
        sweep::check(&self.config).map_err(ShardError::Sweep)?;
        Sweep::check_betas(&self.betas).map_err(|error| ShardError::Sweep(format!("sweep.betas: {error}")))?;
        Ok(self.setup(0).check()?)
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.betas.len() * self.seeds as usize
    }

    /// What run `index` starts from.
    pub fn setup(&self, index: usize) -> Setup {
        let RunPlace { beta, seed, .. } = self.place(index);
        Setup { grid: self.grid.clone(), config: Config { beta, seed, ..self.config.clone() }, ..Setup::default() }
    }

    fn place(&self, index: usize) -> RunPlace {
        let (beta, seed) = Sweep::place(&self.betas, self.seeds, index);
        RunPlace { index, beta, seed }
    }

    /// Where this is another sweep than `expected`, to the last bit.
    fn compare(&self, expected: &SweepPlan) -> Option<Box<Difference>> {
        /// Causes before what follows from them.
        const FIELDS: [&str; 6] = ["program", "grid", "config", "betas", "seeds", "digest"];
        let fields = |plan| serde_json::to_value(plan).unwrap_or_default();
        let (found, expected) = (fields(self), fields(expected));
        let differ = |field: &&str| difference(&format!("sweep.{field}"), &found[*field], &expected[*field]);
        FIELDS.iter().find_map(differ)
    }
}

/// The first leaf in which two values differ, by their text, which holds every bit of a number.
fn difference(field: &str, found: &Value, expected: &Value) -> Option<Box<Difference>> {
    let differ = |found: String, expected: String| {
        let remark = if field == "sweep.digest" { " (by a program that trains otherwise)" } else { "" };
        Some(Box::new(Difference { field: field.to_owned(), found, expected, remark }))
    };
    match (found, expected) {
        (Value::Object(found), Value::Object(expected)) => {
            expected.iter().find_map(|(name, value)| difference(&format!("{field}.{name}"), found.get(name)?, value))
        }
        (Value::Array(found), Value::Array(expected)) if found.len() != expected.len() => {
            differ(format!("of {} entries", found.len()), expected.len().to_string())
        }
        (Value::Array(found), Value::Array(expected)) => (found.iter().zip(expected).enumerate())
            .find_map(|(index, (found, expected))| difference(&format!("{field}[{index}]"), found, expected)),
        _ => {
            let text = |value: &Value| if value.is_null() { "none".to_owned() } else { value.to_string() };
            let short = |text: String| match text.char_indices().nth(60) {
                Some((end, _)) => format!("{}…", &text[..end]),
                None => text,
            };
            let (found, expected) = (text(found), text(expected));
            if found == expected { None } else { differ(short(found), short(expected)) }
        }
    }
}

/// A run with its place in the sweep, from 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "RunFields")]
struct IndexedRun {
    index: usize,
    #[serde(flatten)]
    run: SweepRun,
}

/// The same as it is read: `flatten` would keep all that stands in a run until its end, in many times the memory of its text.
#[derive(Deserialize)]
struct RunFields {
    index: usize,
    beta: f64,
    seed: u32,
    ensemble: Returns,
    clone: KnownReturns,
    occupancy: KnownReturns,
    digest: Digest,
}

impl From<RunFields> for IndexedRun {
    fn from(fields: RunFields) -> IndexedRun {
        let RunFields { index, beta, seed, ensemble, clone, occupancy, digest } = fields;
        IndexedRun { index, run: SweepRun { beta, seed, ensemble, clone, occupancy, digest } }
    }
}

/// A shard as a file: `{"format":"ape-sweep-shard","version":1,"shard":I,"shards":K,"complete":…,"sweep":…,"runs":[…]}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shard {
    format: String,
    version: u32,
    shard: u32,
    shards: u32,
    /// Whether all its runs are there.
    complete: bool,
    sweep: SweepPlan,
    /// In the order of their indexes.
    runs: Vec<IndexedRun>,
}

impl Shard {
    const FORMAT: &str = "ape-sweep-shard";
    /// Most runs of a shard.
    pub const MOST_RUNS: usize = 100_000;
    /// Longest text of a file, in bytes: a run takes at most 900.
    pub const LONGEST: usize = 100_000_000;
    /// Most values of a file, in its lists: a run has 16.
    const MOST_VALUES: usize = 4_000_000;

    /// A shard of which no run is done.
    pub fn new(sweep: SweepPlan, which: ShardNumber) -> Result<Shard, ShardError> {
        let ShardNumber { shard, shards } = which;
        let format = Self::FORMAT.to_owned();
        let shard = Shard { format, version: 1, shard, shards, complete: false, sweep, runs: Vec::new() };
        shard.check_which()?;
        Ok(shard)
    }

    fn check_which(&self) -> Result<(), ShardError> {
        let which = self.which().check()?;
        let runs = self.sweep.runs();
        if which.shards as usize > runs {
            return Err(ShardError::Many { which, runs });
        }
        if self.size() > Self::MOST_RUNS {
            let least = runs.div_ceil(Self::MOST_RUNS);
            return Err(ShardError::Large { which, runs: self.size(), least });
        }
        Ok(())
    }

    pub fn which(&self) -> ShardNumber {
        ShardNumber { shard: self.shard, shards: self.shards }
    }

    pub fn sweep(&self) -> &SweepPlan {
        &self.sweep
    }

    /// Number of its runs, done or not.
    pub fn size(&self) -> usize {
        self.which().indexes(self.sweep.runs()).len()
    }

    /// Indexes of the runs that are not done, ascending.
    pub fn missing(&self) -> Vec<usize> {
        let is_missing = |index: &usize| self.runs.binary_search_by_key(index, |run| run.index).is_err();
        self.which().indexes(self.sweep.runs()).filter(is_missing).collect()
    }

    fn missing_sentence(&self) -> String {
        let missing = self.missing();
        listed(&missing.iter().map(|&index| self.sweep.place(index).to_string()).collect::<Vec<_>>())
    }

    /// Adds a run that is done; one that is refused changes nothing.
    pub fn add(&mut self, index: usize, run: SweepRun) -> Result<(), ShardError> {
        let (Ok(at) | Err(at)) = self.runs.binary_search_by(|run| run.index.cmp(&index).then(Ordering::Less));
        self.runs.insert(at, IndexedRun { index, run });
        let checked = self.check_run(at);
        if checked.is_err() {
            self.runs.remove(at);
        }
        self.complete = self.runs.len() == self.size();
        checked
    }

    /// Whether a run belongs here, comes after the one before it, and is made of numbers.
    fn check_run(&self, at: usize) -> Result<(), ShardError> {
        let IndexedRun { index, run } = &self.runs[at];
        let found = RunPlace { index: *index, beta: run.beta, seed: run.seed };
        let wrong = |what: String| Err(ShardError::Run { run: found, what });
        let (runs, which) = (self.sweep.runs(), self.which());
        if found.index >= runs {
            return wrong(format!("the sweep has {runs} runs, expected an index below"));
        }
        if found.index % self.shards as usize + 1 != self.shard as usize {
            return wrong(format!("expected a run of shard {which}"));
        }
        let expected = self.sweep.place(found.index);
        if (found.beta.to_bits(), found.seed) != (expected.beta.to_bits(), expected.seed) {
            return wrong(format!("expected β {}, seed {} there", expected.beta, expected.seed));
        }
        if at.checked_sub(1).is_some_and(|before| self.runs[before].index >= found.index) {
            return wrong("expected every run once, in ascending order".to_owned());
        }
        let returns = [KnownReturns::from(run.ensemble), run.clone, run.occupancy];
        returns.iter().try_for_each(|returns| returns.check(self.sweep.config.horizon)).or_else(wrong)
    }

    /// Takes over the runs that are done from an earlier file, which must be of the same shard of the same sweep.
    pub fn resume(&mut self, earlier: Shard) -> Result<(), ShardError> {
        if let Some(difference) = earlier.sweep.compare(&self.sweep) {
            return Err(ShardError::Mixed(difference));
        }
        let (found, expected) = (earlier.which(), self.which());
        if found != expected {
            return Err(ShardError::Other { found, expected });
        }
        *self = earlier;
        Ok(())
    }

    /// The text of the file.
    pub fn text(&self) -> Result<String, ShardError> {
        let text = serde_json::to_string(self).map_err(|error| ShardError::Json(error.to_string()))?;
        Ok(text + "\n")
    }

    /// Reads the text of a file and checks everything in it.
    pub fn parse(text: &str) -> Result<Shard, ShardError> {
        #[derive(Deserialize)]
        struct Head {
            format: String,
            version: u32,
        }
        let json = |error: serde_json::Error| ShardError::Json(quoted(&error));
        let text = without_mark(text);
        // Before any list is made of them; a comma within a text counts, too, which ours do not have.
        if text.bytes().filter(|byte| *byte == b',').count() > Self::MOST_VALUES {
            return Err(ShardError::Json(format!("more than {} values", Self::MOST_VALUES)));
        }
        let Head { format, version } = serde_json::from_str(text).map_err(json)?;
        if format != Self::FORMAT {
            return Err(ShardError::Format(quoted(&format)));
        }
        if version != 1 {
            return Err(ShardError::Version(version));
        }
        let shard: Shard = serde_json::from_str(text).map_err(json)?;
        shard.sweep.check()?;
        shard.check_which()?;
        (0..shard.runs.len()).try_for_each(|at| shard.check_run(at))?;
        match (shard.complete, shard.runs.len() == shard.size()) {
            (true, false) => Err(ShardError::Complete(shard.missing_sentence())),
            (false, true) => Err(ShardError::Incomplete),
            _ => Ok(shard),
        }
    }
}

/// Joins the shards of a sweep, each with the name of its file, in any order.
pub fn merge_shards(files: Vec<(String, Shard)>) -> Result<Sweep, ShardError> {
    let Some((first, model)) = files.first() else { return Ok(Sweep::default()) };
    let mut by_number: BTreeMap<u32, &String> = BTreeMap::new();
    for (file, shard) in &files {
        let number = difference("shards", &shard.shards.into(), &model.shards.into());
        if let Some(difference) = shard.sweep.compare(&model.sweep).or(number) {
            return Err(ShardError::MixedFiles { file: file.clone(), first: first.clone(), difference });
        }
        match by_number.insert(shard.shard, file) {
            Some(other) if other == file => return Err(ShardError::Twice(file.clone())),
            Some(first) => {
                return Err(ShardError::Duplicate { file: file.clone(), first: first.clone(), which: shard.which() });
            }
            None => {}
        }
    }
    let gaps = (1..=model.shards).filter(|shard| !by_number.contains_key(shard));
    let gaps: Vec<String> = gaps.map(|shard| format!("shard {shard}/{}", model.shards)).collect();
    if !gaps.is_empty() {
        return Err(ShardError::Gaps(listed(&gaps)));
    }
    if let Some((file, shard)) = files.iter().find(|(_, shard)| !shard.complete) {
        let (which, missing) = (shard.which(), shard.missing_sentence());
        return Err(ShardError::Unfinished { file: file.clone(), which, missing });
    }
    let mut runs: Vec<IndexedRun> = files.into_iter().flat_map(|(_, shard)| shard.runs).collect();
    runs.sort_by_key(|run| run.index);
    Ok(Sweep { runs: runs.into_iter().map(|run| run.run).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEDS: u32 = 4;

    type Files = Vec<(String, Shard)>;

    fn planned(config: Config) -> SweepPlan {
        let setup = Setup { config: Config { batch_steps: 100, ..config }, ..Setup::default() };
        SweepPlan::new(&setup, vec![0.0, 0.3, 0.6], SEEDS).unwrap()
    }

    /// Figures that need all their digits; nothing is trained for them.
    fn run(plan: &SweepPlan, index: usize) -> SweepRun {
        let RunPlace { beta, seed, .. } = plan.place(index);
        let figure = -1e-5 / (index as f64 + 3.0);
        let ensemble =
            Returns { capped_return: figure, uncapped_return: figure / 7.0, horizon_return: -0.0, success: 0.1 };
        let unknown = KnownReturns { capped_return: None, uncapped_return: None, ..ensemble.into() };
        SweepRun { beta, seed, ensemble, clone: unknown, occupancy: ensemble.into(), digest: Digest(index as u64) }
    }

    fn shard(plan: &SweepPlan, shard: u32, shards: u32) -> Shard {
        let mut shard = Shard::new(plan.clone(), ShardNumber { shard, shards }).unwrap();
        // In an order in which they may come.
        for index in shard.missing().into_iter().rev() {
            assert!(!shard.complete);
            shard.add(index, run(plan, index)).unwrap();
        }
        shard
    }

    fn shards(plan: &SweepPlan, of: u32) -> Files {
        (1..=of).map(|i| (format!("{i}.json"), shard(plan, i, of))).collect()
    }

    #[test]
    fn every_run_is_in_one_shard_and_shards_are_of_equal_size() {
        let plan = planned(Config::default());
        let all = Sweep::setups(&plan.setup(0), &plan.betas, SEEDS);
        assert_eq!(all.len(), plan.runs());
        assert!((0..plan.runs()).all(|index| plan.setup(index) == all[index]));
        for shards in 1..=12 {
            let parts =
                (1..=shards).map(|i| Shard::new(plan.clone(), ShardNumber { shard: i, shards }).unwrap().missing());
            let parts: Vec<Vec<usize>> = parts.collect();
            let sizes = || parts.iter().map(Vec::len);
            assert!(sizes().max() <= sizes().min().map(|least| least + 1));
            let mut indexes = parts.concat();
            indexes.sort_unstable();
            assert_eq!(indexes, (0..12).collect::<Vec<_>>());
        }
    }

    #[test]
    fn merged_shards_are_the_sweep_to_the_last_bit() {
        let plan = planned(Config::default());
        let whole = Sweep { runs: (0..plan.runs()).map(|index| run(&plan, index)).collect() };
        for of in [1, 5, 7, 12] {
            let read = |(file, shard): (String, Shard)| (file, Shard::parse(&shard.text().unwrap()).unwrap());
            let mut files: Vec<_> = shards(&plan, of).into_iter().map(read).collect();
            files.reverse();
            let merged = merge_shards(files).unwrap();
            assert_eq!(merged, whole);
            assert_eq!(merged.csv(), whole.csv());
            assert_eq!(serde_json::to_string(&merged).unwrap(), serde_json::to_string(&whole).unwrap());
        }
    }

    #[test]
    fn a_shard_goes_on_from_its_file_and_from_no_other() {
        let plan = planned(Config::default());
        let new = || Shard::new(plan.clone(), ShardNumber { shard: 2, shards: 5 }).unwrap();
        let mut half = new();
        half.add(6, run(&plan, 6)).unwrap();
        half.add(11, run(&plan, 11)).unwrap();
        let half = Shard::parse(&half.text().unwrap()).unwrap();
        assert_eq!((half.missing(), half.complete), (vec![1], false));
        assert_eq!(half.missing_sentence(), "run 1 (β 0, seed 2) is");
        let mut resumed = new();
        resumed.resume(half).unwrap();
        resumed.add(1, run(&plan, 1)).unwrap();
        assert_eq!(resumed, shard(&plan, 2, 5));
        let sentence = |other: Shard| new().resume(other).unwrap_err().to_string();
        assert_eq!(sentence(shard(&plan, 3, 5)), "shard 3/5: expected shard 2/5");
        assert_eq!(sentence(shard(&plan, 2, 6)), "shard 2/6: expected shard 2/5");
        let other = planned(Config { discount: 0.5, ..Config::default() });
        assert_eq!(sentence(shard(&other, 2, 5)), "sweep.config.discount 0.5: expected 0.99");
    }

    #[test]
    fn a_run_that_does_not_belong_changes_nothing() {
        let plan = planned(Config::default());
        let mut shard = Shard::new(plan.clone(), ShardNumber { shard: 2, shards: 5 }).unwrap();
        shard.add(1, run(&plan, 1)).unwrap();
        let before = shard.clone();
        let mut infinite = run(&plan, 6);
        infinite.occupancy.uncapped_return = Some(f64::NEG_INFINITY);
        let mut endless = run(&plan, 6);
        endless.occupancy.horizon_return = -101.0;
        let mut certain = run(&plan, 6);
        certain.clone.success = 1.5;
        for (index, run, expected) in [
            (2, run(&plan, 2), "run 2 (β 0, seed 3): expected a run of shard 2/5"),
            (1, run(&plan, 1), "run 1 (β 0, seed 2): expected every run once, in ascending order"),
            (6, run(&plan, 7), "run 6 (β 0.3, seed 4): expected β 0.3, seed 3 there"),
            (6, infinite, "run 6 (β 0.3, seed 3): uncapped_return -inf: expected a number from -1e300 to 0"),
            (6, endless, "run 6 (β 0.3, seed 3): horizon_return -101.0: expected a number from -100 to 0"),
            (6, certain, "run 6 (β 0.3, seed 3): success 1.5: expected a number from 0 to 1"),
            (61, run(&plan, 1), "run 61 (β 0, seed 2): the sweep has 12 runs, expected an index below"),
        ] {
            assert_eq!(shard.add(index, run).unwrap_err().to_string(), expected);
            assert_eq!(shard, before);
        }
    }

    #[test]
    fn what_does_not_fit_together_is_not_merged() {
        let plan = planned(Config::default());
        let sentence = |change: &dyn Fn(&mut Files)| {
            let mut files = shards(&plan, 4);
            change(&mut files);
            merge_shards(files).unwrap_err().to_string()
        };
        let gaps = sentence(&|files| {
            files.remove(2);
            files.remove(0);
        });
        assert_eq!(gaps, "shard 1/4, shard 3/4 are missing: expected every shard of the sweep");
        assert_eq!(sentence(&|files| files.push(files[1].clone())), "2.json: given twice, expected every file once");
        assert_eq!(
            sentence(&|files| files.push(("copy.json".to_owned(), files[1].1.clone()))),
            "copy.json: shard 2/4, which is in 2.json too: expected every shard once"
        );
        let unfinished = sentence(&|files| {
            files[2].1.runs.remove(1);
            files[2].1.complete = false;
        });
        assert!(
            unfinished.contains("3.json: shard 3/4 is not finished, run 6 (β 0.3, seed 3) is missing"),
            "{unfinished}"
        );
        assert_eq!(sentence(&|files| files[1].1 = shard(&plan, 2, 3)), "2.json: shards 3: expected 4, as in 1.json");
        // The first field that differs is named, not what follows from it.
        let other = |change: &dyn Fn(&mut SweepPlan)| sentence(&|files| change(&mut files[3].1.sweep));
        let mixed = other(&|plan| *plan = planned(Config { horizon: 50, ..Config::default() }));
        assert_eq!(mixed, "4.json: sweep.config.horizon 50: expected 100, as in 1.json");
        for (mixed, expected) in [
            (other(&|plan| plan.betas[1] = 0.25), "sweep.betas[1] 0.25: expected 0.3"),
            // Equal as numbers, not as text of a table.
            (other(&|plan| plan.betas[0] = -0.0), "sweep.betas[0] -0.0: expected 0.0"),
            (other(&|plan| plan.betas.push(0.9)), "sweep.betas of 4 entries: expected 3"),
            (other(&|plan| plan.grid.walls.push((1, 1))), "sweep.grid.walls of 1 entries: expected 0"),
            (other(&|plan| plan.config.alpha = Some(-14.0)), "sweep.config.alpha -14.0: expected none"),
            (other(&|plan| plan.program = "0".to_owned()), "sweep.program \"0\": expected"),
            (
                other(&|plan| plan.digest = Digest(1)),
                "\"0000000000000001\" (by a program that trains otherwise): expected",
            ),
        ] {
            assert!(mixed.contains(expected), "{mixed}");
        }
        let few = listed(&(1..=9).map(|i| i.to_string()).collect::<Vec<_>>());
        assert_eq!(few, "1, 2, 3, 4, 5, 6, 7, 8 and 1 more are");
    }

    #[test]
    fn which_shard_is_checked_and_so_is_its_size() {
        assert_eq!("3/7".parse(), Ok(ShardNumber { shard: 3, shards: 7 }));
        for bad in ["0/4", "5/4", "a/b", "", "/", "3", "1/2/3", "-1/4", "1.5/4", "1/0", "1/10001", "1/99999999999"] {
            let error = bad.parse::<ShardNumber>().unwrap_err().to_string();
            assert!(error.starts_with(&format!("{bad}: must be I/K, shard I of K, with I from 1")), "{error}");
        }
        let plan = planned(Config::default());
        let many = Shard::new(plan.clone(), ShardNumber { shard: 1, shards: 13 }).unwrap_err();
        assert_eq!(many.to_string(), "1/13: the sweep has 12 runs, expected K from 1 to 12");
        // A β made twice would count as another seed, whoever wrote the file.
        let twice = SweepPlan { betas: vec![0.5, 0.0, 0.5], ..plan.clone() };
        assert_eq!(twice.check().unwrap_err().to_string(), "sweep.betas: β 0.5 stands there twice, expected each once");
        let large = SweepPlan { betas: vec![0.5; 1000], seeds: 1000, ..plan };
        let error = Shard::new(large.clone(), ShardNumber { shard: 1, shards: 9 }).unwrap_err().to_string();
        assert_eq!(error, "1/9: 111112 runs in a shard, expected at most 100000: take 10 shards or more");
        assert!(Shard::new(large, ShardNumber { shard: 1, shards: 10 }).is_ok());
    }

    /// The largest shard there can be is shorter than the longest text that is read.
    #[test]
    fn a_run_is_no_longer_than_is_said() {
        let figure = -1.2345678901234567e-300;
        let returns = KnownReturns {
            capped_return: Some(figure),
            uncapped_return: Some(figure),
            horizon_return: figure,
            success: figure,
            horizon_error: figure,
            success_error: figure,
        };
        let ensemble =
            Returns { capped_return: figure, uncapped_return: figure, horizon_return: figure, success: figure };
        let run = SweepRun {
            beta: -figure,
            seed: 1000,
            ensemble,
            clone: returns,
            occupancy: returns,
            digest: Digest(u64::MAX),
        };
        let text = serde_json::to_string(&IndexedRun { index: 999_999, run }).unwrap();
        assert!(text.len() < 900, "{}", text.len());
    }
}
