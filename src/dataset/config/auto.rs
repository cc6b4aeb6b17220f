//! Type of numeric settings that the program may choose: `"auto"`, or a number.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn auto_and_numbers_are_parsed() {
        let read = |value| serde_json::from_value::<Auto<usize>>(value).map_err(|error| error.to_string());
        assert_eq!(read(json!("auto")), Ok(Auto::Chosen));
        assert_eq!(read(json!(7)), Ok(Auto::Given(7)));
        for wrong in [json!("seven"), json!(-1), json!(1.5)] {
            assert!(read(wrong).unwrap_err().contains("expected \"auto\" or a number"));
        }
        assert_eq!(serde_json::from_value::<Auto<f64>>(json!(7)).unwrap(), Auto::Given(7.0));
        assert_eq!(serde_json::to_value([Auto::Chosen, Auto::Given(0.5)]).unwrap(), json!(["auto", 0.5]));
        assert_eq!((Auto::<usize>::Chosen.given(), Auto::Given(4).given()), (None, Some(4)));
    }
}
