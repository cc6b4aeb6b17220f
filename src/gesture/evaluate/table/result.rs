//! The table as JSON. Each value has its definition, parameters and their hash; values of equal hash are comparable.

use super::table::{PredictorRow, Table};
use crate::evaluate::baseline::baselines::PredictorKind;
use crate::evaluate::conclusion::conclusion::{better_than_constant_pose, depends_on_audio};
use crate::evaluate::conclusion::labels;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::math::estimate::Estimate;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::path::Path;

pub const VERSION: u64 = 1;

/// Result as JSON. The keys of the first checkpoint are those of a single one; those of the others end in their number.
pub fn json(table: &Table) -> Value {
    let metrics = (0..table.definitions.len()).map(|index| metric(table, index));
    let predictors = table.rows.iter().map(|row| {
        let mut predictor = json!({ "name": row.key(), "description": row.description });
        if let Some(of) = &row.checkpoint {
            predictor["checkpoint"] = json!(of.name);
        }
        predictor
    });
    let conclusions = |own: &PredictorRow| {
        json!({
            "predictor": own.key(),
            "better_than_constant_pose": better_than_constant_pose(table, own),
            "depends_on_audio": depends_on_audio(table, own),
        })
    };
    let own = table.predictions().next().map(conclusions).unwrap_or_default();
    let mut result = json!({
        "evaluation": VERSION,
        "convention": table.settings.convention,
        "fps": table.settings.fps,
        "n_clips": table.n_clips,
        "n_frames": table.n_frames,
        "n_blocks": table.n_blocks,
        "block_secs": table.block_length.secs,
        "decorrelation_secs": table.block_length.decorrelation_secs,
        "secs": table.secs,
        "with_sound": table.with_sound,
        "truth": table.truth,
        "trained_on_these_clips": table.trained_on,
        "notes": table.notes,
        "predictors": predictors.collect::<Vec<_>>(),
        "metrics": metrics.collect::<Vec<_>>(),
        "better_than_constant_pose": own["better_than_constant_pose"],
        "depends_on_audio": own["depends_on_audio"],
    });
    if table.predictions().count() > 1 {
        result["conclusions"] = table.predictions().map(conclusions).collect();
    }
    result
}

fn metric(table: &Table, index: usize) -> Value {
    let definition = &table.definitions[index];
    let mut values = Map::new();
    for row in &table.rows {
        let estimate = &row.values[index];
        let value = match (estimate.value.is_finite(), row.reasons[index].as_str()) {
            (true, _) => json!(estimate),
            (false, "") => json!({ "value": null }),
            (false, reason) => json!({ "value": null, "undefined": reason }),
        };
        values.insert(row.key(), value);
    }
    json!({
        "name": definition.name,
        "part": definition.part,
        "plain_name": labels::name(definition),
        "unit": definition.unit,
        "better": definition.better,
        "definition": definition.formula,
        "parameters": definition.parameters,
        "hash": definition.hash(),
        "values": values,
    })
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct StoredMetric {
    pub name: String,
    pub part: String,
    pub plain_name: String,
    pub unit: String,
    pub definition: String,
    pub parameters: Value,
    pub hash: String,
    values: Map<String, Value>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct StoredResult {
    evaluation: u64,
    /// Hash of the ground truth.
    pub truth: String,
    pub n_clips: usize,
    pub metrics: Vec<StoredMetric>,
}

impl StoredResult {
    /// Reads the output of `orator evaluate --json`.
    ///
    /// # Errors
    /// A missing file, other JSON, another version, or a hash that does not match its definition.
    pub fn read(path: &Path) -> Result<Self> {
        let text =
            input::read_text(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let stored: Self = serde_json::from_str(&text).with_context(|| {
            format!(
                "{} is not an evaluation result: create one with `orator evaluate --json ... > FILE`",
                path.display()
            )
        })?;
        ensure!(
            stored.evaluation == VERSION,
            "{} has version {}, expected {VERSION}: run `orator evaluate` again",
            path.display(),
            stored.evaluation
        );
        Ok(stored)
    }
}

impl StoredMetric {
    /// Value of a predictor with its interval, if any.
    pub fn value(&self, kind: PredictorKind) -> Option<Estimate> {
        let value = self.values.get(&kind.key())?;
        let number = |key: &str| value.get(key).and_then(Value::as_f64);
        let [low, high] = ["low", "high"].map(|key| number(key).unwrap_or(f64::NAN));
        Some(Estimate::new(number("value")?, low, high))
    }
}
