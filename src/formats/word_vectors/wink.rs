//! JSON of the npm packages `wink-embeddings-*`: GloVe vectors by word, each followed by its norm and its index.

use super::writer::TableWriter;
use anyhow::{Context, Result};
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use std::fmt;
use std::io::Read;
use std::path::Path;

/// Converts the JSON to the table `path` and returns the number of words. Memory: one vector, and the words.
///
/// # Errors
///
/// The JSON has another structure; a vector with too few numbers.
pub fn convert(json: impl Read, path: &Path) -> Result<usize> {
    let mut writer = None;
    let mut json = serde_json::Deserializer::from_reader(json);
    json.deserialize_map(Package { path, writer: &mut writer }).context("it is not wink-embeddings JSON")?;
    json.end()?;
    writer.context("expected `dimensions`, then `vectors`")?.finish()
}

struct Package<'a> {
    path: &'a Path,
    writer: &'a mut Option<TableWriter>,
}

impl<'de> Visitor<'de> for Package<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with `dimensions` and `vectors`")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<(), M::Error> {
        while let Some(key) = map.next_key::<String>()? {
            match (key.as_str(), &mut *self.writer) {
                ("dimensions", writer) => {
                    *writer = Some(TableWriter::new(self.path, map.next_value()?).map_err(M::Error::custom)?);
                }
                ("vectors", Some(writer)) => map.next_value_seed(Vectors(writer))?,
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(())
    }
}

struct Vectors<'a>(&'a mut TableWriter);

impl<'de> DeserializeSeed<'de> for Vectors<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Vectors<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("vectors by word")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<(), M::Error> {
        while let Some((word, numbers)) = map.next_entry::<String, Vec<f64>>()? {
            let vector: Vec<f32> = numbers.iter().take(self.0.dim()).map(|number| *number as f32).collect();
            self.0.push(&word, &vector).map_err(M::Error::custom)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::WordVectors;
    use super::*;

    #[test]
    fn package_json_is_converted_to_a_table() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("w.safetensors");
        let json = r#"{"precision": 8, "l2NormIndex": 2, "size": 2, "dimensions": 2, "words": ["the", "so"],
            "vectors": {"the": [0.5, -1, 1.118, 0], "so": [1, 2, 2.236, 1]}, "unkVector": [0, 0, 0, -1]}"#;
        assert_eq!(convert(json.as_bytes(), &path).unwrap(), 2);
        let table = WordVectors::open(&path).unwrap();
        assert_eq!(table.vector(table.index("so")).unwrap(), [1.0, 2.0]);
        for end in 0..json.len() {
            assert!(convert(&json.as_bytes()[..end], &path).is_err(), "{end}");
        }
        let short = json.replace("[0.5, -1, 1.118, 0]", "[0.5]");
        assert!(
            format!("{:#}", convert(short.as_bytes(), &path).unwrap_err()).contains("`the` has 1 number, expected 2")
        );
    }
}
