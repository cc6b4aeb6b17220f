//! A number of the configuration that may be left to the program: `"auto"`, or the number itself.

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// The word that stands for a number which the program chooses.
pub const AUTO: &str = "auto";

/// A number, or the word `"auto"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Auto<T> {
    /// The program chooses.
    #[default]
    Chosen,
    Given(T),
}

impl<T> Auto<T> {
    /// The number given, else `chosen`.
    pub fn or(self, chosen: T) -> T {
        match self {
            Self::Chosen => chosen,
            Self::Given(value) => value,
        }
    }

    /// The number given; `None`: the program chooses.
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

impl<T: Serialize> Serialize for Auto<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Chosen => serializer.serialize_str(AUTO),
            Self::Given(value) => value.serialize(serializer),
        }
    }
}

/// Numbers that a setting may be.
pub trait Number: Sized {
    /// From a number of the file; `None`: it does not fit.
    fn from_f64(value: f64) -> Option<Self>;
    const EXPECTED: &str;
}

impl Number for f64 {
    fn from_f64(value: f64) -> Option<Self> {
        Some(value)
    }
    const EXPECTED: &str = "\"auto\" or a number";
}

impl Number for usize {
    fn from_f64(value: f64) -> Option<Self> {
        // Whole numbers that f64 holds exactly.
        let is_whole = value.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&value);
        is_whole.then_some(value as usize)
    }
    const EXPECTED: &str = "\"auto\" or a whole number from 0 up";
}

impl<'de, T: Number> Deserialize<'de> for Auto<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AutoVisitor(PhantomData))
    }
}

struct AutoVisitor<T>(PhantomData<T>);

impl<T: Number> Visitor<'_> for AutoVisitor<T> {
    type Value = Auto<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::EXPECTED)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Auto<T>, E> {
        if text == AUTO { Ok(Auto::Chosen) } else { Err(E::custom(format!("expected {}", T::EXPECTED))) }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Auto<T>, E> {
        T::from_f64(value).map(Auto::Given).ok_or_else(|| E::custom(format!("expected {}", T::EXPECTED)))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Auto<T>, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Auto<T>, E> {
        self.visit_f64(value as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_word_or_a_number() {
        let read = |value| serde_json::from_value::<Auto<usize>>(value).map_err(|error| error.to_string());
        assert_eq!(read(json!("auto")), Ok(Auto::Chosen));
        assert_eq!(read(json!(7)), Ok(Auto::Given(7)));
        for wrong in [json!("seven"), json!(-1), json!(1.5)] {
            assert!(read(wrong).unwrap_err().contains("expected \"auto\" or a whole number"));
        }
        assert_eq!(serde_json::to_value([Auto::Chosen, Auto::Given(0.5)]).unwrap(), json!(["auto", 0.5]));
        assert_eq!((Auto::Chosen.or(3), Auto::Given(4).or(3)), (3, 4));
    }
}
