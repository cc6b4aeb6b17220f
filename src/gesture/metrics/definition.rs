//! What a number means: its name, its part of the body, its formula and every parameter, with a hash over all of it.
//! Values under different hashes are different things. And what every metric is: sums that add, and numbers from them.

use super::pair::PairedFrames;
use super::sums::BlockSums;
use serde::Serialize;
use serde_json::{Map, Value};

/// Which way a value is good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    Higher,
    Lower,
    /// Better the nearer it is to the metric of the ground truth, which is the definition `<name>_of_real` of the same part.
    NearerTruth,
    /// A metric of the ground truth alone: says nothing of the predicted one.
    Neither,
}

/// One number exactly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Definition {
    /// For instance `pck_3d`, `mpjpe`, `frechet_pose`.
    pub name: &'static str,
    /// `all`: the 48 joints without the neck (the two hand roots, which are the wrists again, included). `body`: shoulders,
    /// elbows, wrists. `hands`: the 40 finger joints. More in `part`.
    pub part: &'static str,
    /// `1` for a share or a ratio.
    pub unit: &'static str,
    pub better: Better,
    /// The exact definition in words: g ground truth, p predicted, t frame, j joint.
    pub formula: &'static str,
    /// When there is no value (NaN).
    pub undefined: &'static str,
    /// All that can be set, and what it is set to.
    pub parameters: Value,
}

impl Definition {
    /// A number without parameters, whose formula the caller adds.
    pub fn new(name: &'static str, part: &'static str, unit: &'static str, better: Better) -> Self {
        Self { name, part, unit, better, formula: "", undefined: "", parameters: Value::Object(Map::new()) }
    }

    /// First 16 hexadecimal digits of blake3 over name, part, unit, formula and parameters (keys in order).
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for word in [self.name, self.part, self.unit, self.formula, &canonical(&self.parameters)] {
            hasher.update(word.as_bytes());
            hasher.update(&[0]);
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// This definition and, under the name `of_real`, the same number of the ground truth.
    pub fn with_truth(self, of_real: &'static str) -> [Self; 2] {
        let truth = Self { name: of_real, better: Better::Neither, ..self.clone() };
        [self, truth]
    }

    /// For people: name, what it is set to where one name has several, part; `pck_3d@0.2 hands`.
    pub fn label(&self) -> String {
        match self.parameters.get("alpha") {
            Some(alpha) => format!("{}@{alpha} {}", self.name, self.part),
            None => format!("{} {}", self.name, self.part),
        }
    }
}

/// JSON without spaces, keys sorted.
fn canonical(value: &Value) -> String {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(key, _)| *key);
            let entries: Vec<_> = entries
                .into_iter()
                .map(|(key, value)| format!("{}:{}", Value::from(key.as_str()), canonical(value)))
                .collect();
            format!("{{{}}}", entries.join(","))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(canonical).collect::<Vec<_>>().join(",")),
        _ => value.to_string(),
    }
}

/// Adds one interval to the sums of its blocks, which start at 0. What belongs to several frames goes to the block of
/// the first.
type IntervalMeasure = Box<dyn Fn(&PairedFrames, &mut BlockSums) + Send + Sync>;
/// The numbers from added sums; NaN where undefined.
type SumValues = Box<dyn Fn(&[f64]) -> Vec<f64> + Send + Sync>;

/// A family of numbers that share their sums.
pub(crate) struct MetricFamily {
    /// What `values` gives, in order.
    pub definitions: Vec<Definition>,
    /// How many sums it takes.
    pub n_sums: usize,
    pub measure: IntervalMeasure,
    pub values: SumValues,
    /// Whether the sums are large and the numbers slow (matrices): fewer draws.
    pub is_costly: bool,
}

impl MetricFamily {
    pub(crate) fn new(
        definitions: Vec<Definition>,
        n_sums: usize,
        measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
        values: impl Fn(&[f64]) -> Vec<f64> + Send + Sync + 'static,
    ) -> Self {
        Self { definitions, n_sums, measure: Box::new(measure), values: Box::new(values), is_costly: false }
    }

    /// One number: the first sum over the second.
    pub(crate) fn mean(
        definition: Definition,
        measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
    ) -> Self {
        Self::new(vec![definition], 2, measure, |sums| vec![sums[0] / sums[1]])
    }

    /// A number of the prediction and that of the ground truth: the first two sums over the third.
    pub(crate) fn mean_of_both(
        definitions: [Definition; 2],
        measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
    ) -> Self {
        Self::new(definitions.into(), 3, measure, |sums| vec![sums[0] / sums[2], sums[1] / sums[2]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_hash_sees_all_but_the_order_of_keys() {
        let definition = |parameters| Definition {
            formula: "share",
            undefined: "never",
            parameters,
            ..Definition::new("pck_3d", "all", "1", Better::Higher)
        };
        let one = definition(json!({"alpha": 0.2, "fps": [15, 1]}));
        assert_eq!(one.hash(), definition(json!({"fps": [15, 1], "alpha": 0.2})).hash());
        assert_ne!(one.hash(), definition(json!({"alpha": 0.1, "fps": [15, 1]})).hash());
        assert_ne!(one.hash(), Definition { part: "body", ..one.clone() }.hash());
        assert_ne!(one.hash(), Definition { formula: "part", ..one.clone() }.hash());
        assert_eq!((one.hash().len(), one.label()), (16, "pck_3d@0.2 all".into()));
    }
}
