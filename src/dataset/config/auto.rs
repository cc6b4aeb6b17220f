//! Type of numeric settings that the program may choose: `"auto"`, or a number.

use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};

/// Configuration value that leaves a number to the program.
pub const AUTO: &str = "auto";

/// Number, or `"auto"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"auto\" or a number of this kind")]
pub enum Auto<T> {
    /// `"auto"`: the program chooses the value.
    #[default]
    #[serde(serialize_with = "serialize_auto", deserialize_with = "deserialize_auto")]
    Chosen,
    Given(T),
}

fn serialize_auto<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(AUTO)
}

fn deserialize_auto<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
    if String::deserialize(deserializer)? == AUTO { Ok(()) } else { Err(D::Error::custom("another word")) }
}

impl<T> Auto<T> {
    /// The given value; `None` for `"auto"`.
    pub fn given(self) -> Option<T> {
        match self {
            Self::Chosen => None,
            Self::Given(value) => Some(value),
        }
    }
}

impl<T> From<T> for Auto<T> {
    fn from(value: T) -> Self {
        Self::Given(value)
    }
}

/// Settings in which every `"auto"` of `given` is replaced by the value that `choose` returns for its key.
///
/// # Errors
/// An `"auto"` for which there is no value, or a value of another type, such as a fraction for a count.
pub fn filled<T: DeserializeOwned>(
    given: &impl Serialize,
    choose: impl Fn(&str) -> Option<Value>,
) -> serde_json::Result<T> {
    let mut values = serde_json::to_value(given)?;
    for (key, value) in values.as_object_mut().into_iter().flatten() {
        if *value == AUTO
            && let Some(chosen) = choose(key)
        {
            *value = chosen;
        }
    }
    serde_json::from_value(values)
}

/// JSON number; a non-negative value without fraction becomes an integer, so that it is accepted for a count.
pub fn number(value: f64) -> Value {
    if value.fract() == 0.0 && value >= 0.0 { json!(value as u64) } else { json!(value) }
}
