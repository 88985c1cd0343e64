//! What can be chosen about a built-in scene, and what was chosen.

use std::fmt;

use super::suggestion::did_you_mean;
use crate::LoadError;

/// One thing that can be chosen about a built-in scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The key in `key=value`.
    pub name: &'static str,
    /// The value if nobody chooses one.
    pub default: &'static str,
    /// Which values it takes; shown in words.
    pub kind: Kind,
    /// What it changes, as half a sentence.
    pub meaning: &'static str,
}

/// The values that a [`Parameter`] takes. `Display` says it in words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number, both ends included.
    Integer {
        /// The least.
        min: u32,
        /// The greatest.
        max: u32,
    },
    /// A number, both ends included.
    Number {
        /// The least.
        min: f32,
        /// The greatest.
        max: f32,
    },
    /// One of these words.
    Choice(&'static [&'static str]),
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Value {
    Integer(u32),
    Number(f32),
    Choice(&'static str),
}

impl Kind {
    fn parse(self, text: &str) -> Option<Value> {
        match self {
            Self::Integer { min, max } => {
                text.parse().ok().filter(|value| (min..=max).contains(value)).map(Value::Integer)
            }
            Self::Number { min, max } => {
                text.parse().ok().filter(|value| (min..=max).contains(value)).map(Value::Number)
            }
            Self::Choice(words) => words.iter().find(|word| **word == text).map(|word| Value::Choice(word)),
        }
    }
}

/// One value for every parameter of a scene.
#[derive(Debug)]
pub(super) struct Values {
    parameters: &'static [Parameter],
    values: Vec<Value>,
}

impl Values {
    /// The values that `text`, a list `key=value,key=value`, asks for; defaults for all others.
    pub(super) fn parse(scene: &str, parameters: &'static [Parameter], text: Option<&str>) -> Result<Self, LoadError> {
        let wrong = |detail: String| LoadError::BuiltIn(format!("@{scene}: {detail}"));
        let mut chosen: Vec<Option<Value>> = vec![None; parameters.len()];
        for item in text.into_iter().flat_map(|list| list.split(',')) {
            let (key, value) = item
                .split_once('=')
                .map(|(key, value)| (key.trim(), value.trim()))
                .ok_or_else(|| wrong(format!("'{item}' is not of the form key=value")))?;
            let Some(index) = parameters.iter().position(|parameter| parameter.name == key) else {
                let keys: Vec<&str> = parameters.iter().map(|parameter| parameter.name).collect();
                let hint = did_you_mean(key, &keys);
                let known = if keys.is_empty() {
                    "it takes no parameters".to_owned()
                } else {
                    format!("known are {}", keys.join(", "))
                };
                return Err(wrong(format!("no parameter is called '{key}'{hint}; {known}")));
            };
            let kind = parameters[index].kind;
            let parsed = kind.parse(value).ok_or_else(|| wrong(format!("{key} takes {kind}, not '{value}'")))?;
            if chosen[index].replace(parsed).is_some() {
                return Err(wrong(format!("{key} is given twice")));
            }
        }
        let values = chosen
            .into_iter()
            .zip(parameters)
            .map(|(value, parameter)| value.or_else(|| parameter.kind.parse(parameter.default)))
            .collect::<Option<_>>()
            .ok_or_else(|| wrong("a default is out of its own range".into()))?;
        Ok(Self { parameters, values })
    }

    fn value(&self, name: &str) -> Option<Value> {
        self.parameters.iter().position(|parameter| parameter.name == name).map(|index| self.values[index])
    }

    /// The value of an integer parameter. Panics if the scene has none of that name.
    pub(super) fn integer(&self, name: &str) -> u32 {
        match self.value(name) {
            Some(Value::Integer(value)) => value,
            other => unreachable!("integer parameter '{name}' is {other:?}"),
        }
    }

    /// The value of a number parameter. Panics if the scene has none of that name.
    pub(super) fn number(&self, name: &str) -> f32 {
        match self.value(name) {
            Some(Value::Number(value)) => value,
            other => unreachable!("number parameter '{name}' is {other:?}"),
        }
    }

    /// The value of a choice. Panics if the scene has none of that name.
    pub(super) fn choice(&self, name: &str) -> &'static str {
        match self.value(name) {
            Some(Value::Choice(value)) => value,
            other => unreachable!("choice '{name}' is {other:?}"),
        }
    }
}

/// The parameter `seed` that every random scene has.
pub(super) const SEED: Parameter = Parameter {
    name: "seed",
    default: "1",
    kind: Kind::Integer { min: 0, max: u32::MAX },
    meaning: "another number gives another scene of the same kind",
};

/// An integer parameter.
pub(super) const fn integer(
    name: &'static str,
    default: &'static str,
    (min, max): (u32, u32),
    meaning: &'static str,
) -> Parameter {
    Parameter { name, default, kind: Kind::Integer { min, max }, meaning }
}

/// A number parameter.
pub(super) const fn number(
    name: &'static str,
    default: &'static str,
    (min, max): (f32, f32),
    meaning: &'static str,
) -> Parameter {
    Parameter { name, default, kind: Kind::Number { min, max }, meaning }
}

/// A choice.
pub(super) const fn choice(
    name: &'static str,
    default: &'static str,
    words: &'static [&'static str],
    meaning: &'static str,
) -> Parameter {
    Parameter { name, default, kind: Kind::Choice(words), meaning }
}

/// Triangles after instancing that no scene exceeds.
pub(super) const MAX_TRIANGLES: u64 = 200_000_000;

/// Triangles that no scene holds without instancing, so that memory stays below a gigabyte.
pub(super) const MAX_STORED_TRIANGLES: u64 = 20_000_000;

/// Refuses a scene that would be too large, before anything is allocated for it. The factors' product is the number of
/// triangles.
pub(super) fn check_triangles(scene: &str, limit: u64, factors: &[u64]) -> Result<(), LoadError> {
    let count = factors.iter().fold(1_u64, |product, &factor| product.saturating_mul(factor));
    if count <= limit {
        return Ok(());
    }
    Err(LoadError::BuiltIn(format!("@{scene}: these parameters ask for {count} triangles; at most {limit} are made")))
}
