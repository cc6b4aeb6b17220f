//! A number of the configuration that may be left to the program: `"auto"`, or the number itself.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The word that stands for a number which the program chooses.
pub const AUTO: &str = "auto";

/// A number, or the word `"auto"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"auto\" or a number of this kind")]
pub enum Auto<T> {
    /// The program chooses.
    #[default]
    #[serde(serialize_with = "write_word", deserialize_with = "read_word")]
    Chosen,
    Given(T),
}

fn write_word<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(AUTO)
}

fn read_word<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
    if String::deserialize(deserializer)? == AUTO { Ok(()) } else { Err(D::Error::custom("another word")) }
}

impl<T> Auto<T> {
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
            assert!(read(wrong).unwrap_err().contains("expected \"auto\" or a number"));
        }
        assert_eq!(serde_json::from_value::<Auto<f64>>(json!(7)).unwrap(), Auto::Given(7.0));
        assert_eq!(serde_json::to_value([Auto::Chosen, Auto::Given(0.5)]).unwrap(), json!(["auto", 0.5]));
        assert_eq!((Auto::<usize>::Chosen.given(), Auto::Given(4).given()), (None, Some(4)));
    }
}
