//! Choosing a model from a table by a word, with a number in parentheses where it takes one: `replay(60)`.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A line of a table of models.
pub trait Model: Sized + 'static {
    /// What a line is called in a sentence, as "observer".
    const WHAT: &'static str;

    fn table() -> &'static [Self];

    /// Its name in files, addresses and on the command line.
    fn name(&self) -> &'static str;

    /// What the number in parentheses means, where the model takes one.
    fn parameter(&self) -> Option<&Parameter>;
}

/// The number in parentheses: its meaning, default and range.
pub struct Parameter {
    pub meaning: &'static str,
    pub default: u32,
    pub low: u32,
    pub high: u32,
}

/// A line of the table of `M`, with its number.
#[derive(Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Choice<M: Model> {
    index: u32,
    parameter: u32,
    model: PhantomData<fn() -> M>,
}

impl<M: Model> Clone for Choice<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Model> Copy for Choice<M> {}

impl<M: Model> PartialEq for Choice<M> {
    fn eq(&self, other: &Self) -> bool {
        (self.index, self.parameter) == (other.index, other.parameter)
    }
}

impl<M: Model> Eq for Choice<M> {}

impl<M: Model> Choice<M> {
    /// The line of this place in the table; `parameter` is 0 where it takes none.
    pub const fn at(index: u32, parameter: u32) -> Self {
        Choice { index, parameter, model: PhantomData }
    }

    /// Every model, each with its default parameter.
    pub fn all() -> impl Iterator<Item = Self> {
        let default = |model: &M| model.parameter().map_or(0, |parameter| parameter.default);
        M::table().iter().enumerate().map(move |(index, model)| Self::at(index as u32, default(model)))
    }

    /// Every model as it is written, with the range of its number.
    pub fn known() -> String {
        let known = M::table().iter().map(|model| match model.parameter() {
            Some(p) => format!("{}({}), {} to {}", model.name(), p.meaning, p.low, p.high),
            None => model.name().to_owned(),
        });
        known.collect::<Vec<_>>().join("; ")
    }

    pub fn model(&self) -> &'static M {
        &M::table()[self.index as usize]
    }

    /// The number in parentheses; 0 for a model that takes none.
    pub fn parameter(&self) -> u32 {
        self.parameter
    }

    /// The same model with another number, brought into its range; the same choice for a model without one.
    pub fn with_parameter(self, parameter: u32) -> Self {
        match self.model().parameter() {
            Some(range) => Choice { parameter: parameter.clamp(range.low, range.high), ..self },
            None => self,
        }
    }
}

impl<M: Model> fmt::Display for Choice<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.model().parameter() {
            Some(_) => write!(f, "{}({})", self.model().name(), self.parameter),
            None => f.write_str(self.model().name()),
        }
    }
}

impl<M: Model> fmt::Debug for Choice<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl<M: Model> From<Choice<M>> for String {
    fn from(choice: Choice<M>) -> String {
        choice.to_string()
    }
}

/// Text that names no model of a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} {text:?}: must be one of {known}")]
pub struct ChoiceError {
    what: &'static str,
    text: String,
    known: String,
}

impl<M: Model> FromStr for Choice<M> {
    type Err = ChoiceError;

    fn from_str(text: &str) -> Result<Self, ChoiceError> {
        let (name, argument) = match text.strip_suffix(')').and_then(|text| text.split_once('(')) {
            Some((name, argument)) => (name, Some(argument)),
            None => (text, None),
        };
        let parse = || {
            let default = Self::all().find(|choice| choice.model().name() == name)?;
            match (default.model().parameter(), argument) {
                (_, None) => Some(default),
                (None, Some(_)) => None,
                (Some(range), Some(argument)) => {
                    let parameter = argument.parse().ok().filter(|value| (range.low..=range.high).contains(value))?;
                    Some(Choice { parameter, ..default })
                }
            }
        };
        parse().ok_or_else(|| ChoiceError {
            what: M::WHAT,
            text: text.chars().take(40).collect(),
            known: Self::known(),
        })
    }
}

impl<M: Model> TryFrom<String> for Choice<M> {
    type Error = ChoiceError;

    fn try_from(text: String) -> Result<Self, ChoiceError> {
        text.parse()
    }
}
