//! The table of [`Config`]'s fields: names, ranges, the paper's values and a sentence about each.
//!
//! Checking, the command line's flags and the page's controls all read it.

use super::observer::ObserverChoice;
use super::{AdversaryReward, AlgorithmKind, BaselineKind, Config, GradientKind, ReturnToGo};

/// One field of [`Config`].
pub struct Field {
    /// As in files and, with dashes, on the command line.
    pub name: &'static str,
    /// As on the page.
    pub label: &'static str,
    /// The paper's value, as text, where it has one.
    pub paper: Option<&'static str>,
    pub help: &'static str,
    pub kind: Kind,
}

/// How a field is read, written and limited.
pub enum Kind {
    Real {
        low: f64,
        high: f64,
        get: fn(&Config) -> f64,
        set: fn(&mut Config, f64),
    },
    Whole {
        low: u32,
        high: u32,
        get: fn(&Config) -> u32,
        set: fn(&mut Config, u32),
    },
    /// A word; `options` are those to choose from.
    Word {
        options: fn() -> Vec<String>,
        /// What can be written, in words.
        known: fn() -> String,
        get: fn(&Config) -> String,
        set: fn(&mut Config, &str) -> bool,
    },
    /// Free text, `none` for nothing.
    Text {
        expected: &'static str,
        get: fn(&Config) -> String,
        /// Whether the text was one that is expected.
        set: fn(&mut Config, &str) -> bool,
    },
}

/// A field outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} {value}: must be {expected}")]
pub struct ConfigError {
    pub field: &'static str,
    pub value: String,
    pub expected: String,
}

impl Field {
    /// The field of this name, which must be in the table.
    pub fn named(name: &str) -> &'static Field {
        FIELDS.iter().find(|field| field.name == name).expect("asked for by a name in the table")
    }

    /// What it is, and the paper's value.
    pub fn tip(&self) -> String {
        let paper = self.paper.map(|value| format!(" Paper: {value}.")).unwrap_or_default();
        format!("{}{paper}", self.help)
    }

    /// What a value must be.
    pub fn expected(&self) -> String {
        match &self.kind {
            Kind::Real { low, high, .. } => format!("a number from {low} to {high}"),
            Kind::Whole { low, high, .. } => format!("a whole number from {low} to {high}"),
            Kind::Word { known, .. } => format!("one of {}", known()),
            Kind::Text { expected, .. } => (*expected).to_owned(),
        }
    }

    fn error(&self, value: impl ToString) -> ConfigError {
        ConfigError { field: self.name, value: value.to_string(), expected: self.expected() }
    }

    /// Whether the field's value in `config` lies in its range.
    pub fn check(&self, config: &Config) -> Result<(), ConfigError> {
        match &self.kind {
            Kind::Real { low, high, get, .. } => {
                let value = get(config);
                if (*low..=*high).contains(&value) { Ok(()) } else { Err(self.error(written(value))) }
            }
            Kind::Whole { low, high, get, .. } => {
                let value = get(config);
                if (*low..=*high).contains(&value) { Ok(()) } else { Err(self.error(value)) }
            }
            Kind::Word { .. } => Ok(()),
            Kind::Text { get, set, .. } => {
                let value = get(config);
                if set(&mut config.clone(), &value) { Ok(()) } else { Err(self.error(value)) }
            }
        }
    }

    /// Sets the field from text and checks it.
    pub fn set(&self, config: &mut Config, text: &str) -> Result<(), ConfigError> {
        let is_read = match &self.kind {
            Kind::Real { set, .. } => text.parse().map(|value| set(config, value)).is_ok(),
            Kind::Whole { set, .. } => text.parse().map(|value| set(config, value)).is_ok(),
            Kind::Word { set, .. } | Kind::Text { set, .. } => set(config, text),
        };
        if is_read { self.check(config) } else { Err(self.error(text)) }
    }

    /// The field's value as text.
    pub fn text(&self, config: &Config) -> String {
        match &self.kind {
            Kind::Real { get, .. } => written(get(config)),
            Kind::Whole { get, .. } => get(config).to_string(),
            Kind::Word { get, .. } | Kind::Text { get, .. } => get(config),
        }
    }
}

/// A number as text that reads back to the last bit, and is short also where it is tiny or huge.
pub fn written(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

macro_rules! real {
    ($field:ident, $low:expr, $high:expr) => {
        Kind::Real { low: $low, high: $high, get: |config| config.$field, set: |config, value| config.$field = value }
    };
}

macro_rules! whole {
    ($field:ident, $low:expr, $high:expr) => {
        Kind::Whole { low: $low, high: $high, get: |config| config.$field, set: |config, value| config.$field = value }
    };
}

macro_rules! word {
    ($field:ident, $($text:literal => $value:expr),+) => {
        Kind::Word {
            options: || vec![$($text.to_owned()),+],
            known: || [$($text),+].join(", "),
            get: |config| match config.$field { $(value if value == $value => $text.to_owned(),)+ _ => unreachable!("every value has a word") },
            set: |config, text| match text { $($text => { config.$field = $value; true })+ _ => false },
        }
    };
}

/// `none`, or what `text` is for a value.
fn optional<T>(value: &Option<T>, text: impl Fn(&T) -> String) -> String {
    value.as_ref().map_or("none".to_owned(), text)
}

/// Every field, in the order of [`Config`].
pub static FIELDS: [Field; 19] = [
    Field {
        name: "experts",
        label: "Experts n",
        paper: Some("2"),
        help: "Number of expert policies. One of them, drawn at random, acts for a whole episode.",
        kind: whole!(experts, 1, Config::MAX_EXPERTS),
    },
    Field {
        name: "beta",
        label: "β",
        paper: Some("0.6"),
        help: "Weight of the clone's return in J = E[ensemble] − β E[clone] (Eq. 3). At 0 the experts care only about the goal.",
        kind: real!(beta, 0.0, Config::MAX_BETA),
    },
    Field {
        name: "algorithm",
        label: "Algorithm",
        paper: Some("pg_ape"),
        help: "How J is climbed: by policy gradient from sampled episodes (the paper's Algorithm 1), or by the exact gradient of \
               J over T steps, without sampling and undiscounted (ours).",
        kind: word!(algorithm, "pg_ape" => AlgorithmKind::PgApe, "exact" => AlgorithmKind::Exact),
    },
    Field {
        name: "observer",
        label: "Observer",
        paper: Some("replay(60)"),
        help: "Who the experts take the cloner to be: how it guesses which expert acted at a cell, p(c|s) (Eq. 1).",
        kind: Kind::Word {
            options: || ObserverChoice::all().map(|choice| choice.to_string()).collect(),
            known: ObserverChoice::known,
            get: |config| config.observer.to_string(),
            set: |config, text| text.parse().map(|observer| config.observer = observer).is_ok(),
        },
    },
    Field {
        name: "gradient",
        label: "Clone gradient",
        paper: Some("sampled_context"),
        help: "∇ log π_o by the one expert that was drawn with the action, or by every expert's responsibility for it (appendix).",
        kind: word!(gradient, "sampled_context" => GradientKind::SampledContext, "mixture" => GradientKind::Mixture),
    },
    Field {
        name: "learning_rate",
        label: "Learning rate",
        paper: Some("0.05"),
        help: "Step size of Adam, for policies and baselines.",
        kind: real!(learning_rate, 0.0, 10.0),
    },
    Field {
        name: "value_weight",
        label: "Value weight",
        paper: Some("0.5"),
        help: "Weight of the baseline's squared error (Eq. 4). Adam takes most of its effect away where baselines are tables of their own.",
        kind: real!(value_weight, 0.0, 1000.0),
    },
    Field {
        name: "baseline",
        label: "Baseline",
        paper: Some("joint"),
        help: "One table fitted to R on the ensemble's episodes and to −βR on the clone's (Eq. 4), or a table for each: less variance.",
        kind: word!(baseline, "joint" => BaselineKind::Joint, "separate" => BaselineKind::Separate),
    },
    Field {
        name: "entropy_start",
        label: "Entropy bonus, first update",
        paper: Some("0.5"),
        help: "Weight of the mean entropy of visited states at the first update; it then falls linearly.",
        kind: real!(entropy_start, 0.0, 1000.0),
    },
    Field {
        name: "entropy_end",
        label: "Entropy bonus, last update",
        paper: Some("0.005"),
        help: "Weight of the entropy bonus at the last update.",
        kind: real!(entropy_end, 0.0, 1000.0),
    },
    Field {
        name: "discount",
        label: "Discount γ",
        paper: Some("0.99"),
        help: "What a step's reward counts one step earlier.",
        kind: real!(discount, 0.0, 1.0),
    },
    Field {
        name: "return_to_go",
        label: "Discount counts",
        paper: None,
        help: "R(t) = Σ γ^(t'−t) r from the step on, as the paper's scale of Ṽ suggests; or Σ γ^t' r, as in its section 2.2, the exact gradient.",
        kind: word!(return_to_go, "from_step" => ReturnToGo::FromStep, "from_start" => ReturnToGo::FromStart),
    },
    Field {
        name: "horizon",
        label: "Horizon T (steps)",
        paper: Some("100"),
        help: "Longest episode, in steps.",
        kind: whole!(horizon, 1, Config::MAX_HORIZON),
    },
    Field {
        name: "batch_steps",
        label: "Batch (steps)",
        paper: Some("4096"),
        help: "Whole episodes are played until at least this many steps, with the ensemble and again with the clone.",
        kind: whole!(batch_steps, 1, 1_000_000),
    },
    Field {
        name: "total_steps",
        label: "Run (ensemble steps)",
        paper: Some("3000000"),
        help: "Length of a run in ensemble steps: divided by the batch it gives the number of updates, 732 in the paper.",
        kind: whole!(total_steps, 1, 1_000_000_000),
    },
    Field {
        name: "exact_updates",
        label: "Run of exact APE (updates)",
        paper: None,
        help: "Length of a run of the algorithm exact, in updates.",
        kind: whole!(exact_updates, 1, 100_000),
    },
    Field {
        name: "adversary_reward",
        label: "Adversary reward r̃",
        paper: Some("none"),
        help: "What the clone is to be denied in place of the reward: J = E[ensemble] − β E[Σ r̃ of the clone] (\"The Semantics of \
               Reward\"). A cell counts for every step that begins there.",
        kind: Kind::Text {
            expected: AdversaryReward::FORM,
            get: |config| optional(&config.adversary_reward, ToString::to_string),
            set: |config, text| {
                let reward = if text == "none" { Some(None) } else { text.parse().ok().map(Some) };
                reward.map(|reward| config.adversary_reward = reward).is_some()
            },
        },
    },
    Field {
        name: "alpha",
        label: "Constraint α (steps)",
        paper: Some("none"),
        help: "Eq. 2: minimise the clone's return while the ensemble's return within T stays at least α. β then follows by dual \
               ascent, from its value above and at least 0.6.",
        kind: Kind::Text {
            expected: "none, or a return from -10000 to -0.1",
            get: |config| optional(&config.alpha, ToString::to_string),
            set: |config, text| {
                let range = -10_000.0..=-0.1;
                let text = text.replace('−', "-");
                let value = text.parse().ok().filter(|value| range.contains(value)).map(Some);
                let alpha = if text == "none" { Some(None) } else { value };
                alpha.map(|alpha| config.alpha = alpha).is_some()
            },
        },
    },
    Field {
        name: "seed",
        label: "Seed",
        paper: None,
        help: "Everything random comes from it: the same seed gives the same run, to the last bit, in every browser and natively.",
        kind: whole!(seed, 0, u32::MAX),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The table names exactly the fields that a file has, and reads back what it writes.
    #[test]
    fn the_table_is_the_configuration() {
        let json = serde_json::to_value(Config::default()).unwrap();
        let mut names: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
        names.sort_unstable();
        assert_eq!(names, json.as_object().unwrap().keys().collect::<Vec<_>>());
        let mut copy = Config { experts: 7, seed: 9, ..Config::paper() };
        for field in &FIELDS {
            field.set(&mut copy, &field.text(&Config::default())).unwrap();
        }
        assert_eq!(copy, Config::default());
    }

    #[test]
    fn the_paper_column_is_the_papers_configuration() {
        let mut config = Config::default();
        for field in &FIELDS {
            if let Some(value) = field.paper {
                field.set(&mut config, value).unwrap();
            }
        }
        assert_eq!(config, Config::paper());
    }

    #[test]
    fn text_that_is_no_value_is_refused() {
        let set = |name: &str, text: &str| Field::named(name).set(&mut Config::default(), text);
        assert_eq!(set("beta", "x").unwrap_err().to_string(), "beta x: must be a number from 0 to 2");
        assert_eq!(set("experts", "2.5").unwrap_err().to_string(), "experts 2.5: must be a whole number from 1 to 8");
        assert!(set("beta", "NaN").is_err() && set("observer", "nobody").is_err() && set("gradient", "").is_err());
    }
}
