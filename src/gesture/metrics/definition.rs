//! Definition of a metric: name, part of the body, formula and all parameters, with a hash over them; values with
//! different hashes are not comparable. Also the common structure of all metrics: additive sums, and values computed
//! from them. Parts of the body over which metrics are measured.

use super::pair::PairedFrames;
use super::sums::BlockSums;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_SHOULDER, R_WRIST, is_duplicate};
use serde::Serialize;
use serde_json::{Map, Value};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    Higher,
    Lower,
    /// Better the nearer it is to the value of the ground truth, which is the metric `<name>_of_real` of the same part.
    NearerTruth,
    /// A metric of the ground truth only, which does not rate the prediction.
    Neither,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Definition {
    /// Name such as `pck_3d`, `mpjpe`, `frechet_pose`.
    pub name: &'static str,
    /// Part of the body. `all`: the 48 joints without the neck, including the two hand roots, which duplicate the
    /// wrists. `body`: shoulders, elbows, wrists. `hands`: the 40 finger joints. All parts: [`BodyPart`].
    pub part: &'static str,
    /// Unit; `1` for a share or a ratio.
    pub unit: &'static str,
    pub better: Better,
    /// Exact definition as text: g ground truth, p predicted, t frame, j joint.
    pub formula: &'static str,
    /// Condition under which there is no value (NaN).
    pub undefined: &'static str,
    pub parameters: Value,
}

impl Definition {
    /// Definition without parameters; the caller adds `formula` and `undefined`.
    pub fn new(name: &'static str, part: &'static str, unit: &'static str, better: Better) -> Self {
        Self { name, part, unit, better, formula: "", undefined: "", parameters: Value::Object(Map::new()) }
    }

    /// First 16 hexadecimal digits of the BLAKE3 hash of name, part, unit, formula and parameters (with sorted keys).
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for word in [self.name, self.part, self.unit, self.formula, &canonical(&self.parameters)] {
            hasher.update(word.as_bytes());
            hasher.update(&[0]);
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// This definition and, with the name `of_real`, that of the same metric of the ground truth.
    pub fn with_truth(self, of_real: &'static str) -> [Self; 2] {
        let truth = Self { name: of_real, better: Better::Neither, ..self.clone() };
        [self, truth]
    }

    /// Short label of name, alpha (for PCK) and part, such as `pck_3d@0.2 hands`.
    pub fn label(&self) -> String {
        match self.parameters.get("alpha") {
            Some(alpha) => format!("{}@{alpha} {}", self.name, self.part),
            None => format!("{} {}", self.name, self.part),
        }
    }
}

/// JSON without spaces and with sorted keys.
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

/// Function that adds an interval to the sums of its blocks, which start at 0. Values over several frames belong to the
/// block of the first frame.
type IntervalMeasure = Box<dyn Fn(&PairedFrames, &mut BlockSums) + Send + Sync>;
/// Function that computes values from added sums; NaN if undefined.
type SumValues = Box<dyn Fn(&[f64]) -> Vec<f64> + Send + Sync>;

/// A family of metrics that share their sums.
pub(crate) struct MetricFamily {
    /// Definitions of `values`, in the same order.
    pub definitions: Vec<Definition>,
    pub n_sums: usize,
    pub measure: IntervalMeasure,
    pub values: SumValues,
    /// Whether the sums are large and the values slow to compute (matrices), so that fewer draws are taken.
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

    /// Family of one metric: the first sum divided by the second.
    pub(crate) fn mean(
        definition: Definition,
        measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
    ) -> Self {
        Self::new(vec![definition], 2, measure, |sums| vec![sums[0] / sums[1]])
    }

    /// Family of a metric of the prediction and of the ground truth: the first two sums divided by the third.
    pub(crate) fn mean_of_both(
        definitions: [Definition; 2],
        measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
    ) -> Self {
        Self::new(definitions.into(), 3, measure, |sums| vec![sums[0] / sums[2], sums[1] / sums[2]])
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPart {
    /// The 48 joints without the neck, including the two hand roots, which duplicate the wrists.
    All,
    /// All 49 joints, including the neck, which is static.
    WithNeck,
    /// Shoulders, elbows, wrists: joints 1 to 6.
    Body,
    /// The 40 finger joints: 8 to 48 without 28.
    Hands,
    /// The two wrists: joints 3 and 6.
    Wrists,
    /// The 40 finger joints, each measured from the wrist of its own side.
    FingersFromWrist,
}

/// A joint, and the joint that its position is relative to (`None`: the neck, at the origin).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasuredPoint {
    pub joint: usize,
    pub origin: Option<usize>,
}

impl BodyPart {
    pub const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::WithNeck => "all_and_neck",
            Self::Body => "body",
            Self::Hands => "hands",
            Self::Wrists => "wrists",
            Self::FingersFromWrist => "fingers_from_wrist",
        }
    }

    pub fn joints(self) -> Vec<usize> {
        match self {
            Self::All => (NECK + 1..N_JOINTS).collect(),
            Self::WithNeck => (0..N_JOINTS).collect(),
            Self::Body => (R_SHOULDER..=L_WRIST).collect(),
            Self::Hands | Self::FingersFromWrist => (L_HAND..N_JOINTS).filter(|joint| !is_duplicate(*joint)).collect(),
            Self::Wrists => vec![R_WRIST, L_WRIST],
        }
    }

    /// Joints of the part with their origins.
    pub fn points(self) -> Vec<MeasuredPoint> {
        let origin = |joint| match self {
            Self::FingersFromWrist if joint < R_HAND => Some(L_WRIST),
            Self::FingersFromWrist => Some(R_WRIST),
            _ => None,
        };
        self.joints().into_iter().map(|joint| MeasuredPoint { joint, origin: origin(joint) }).collect()
    }
}
