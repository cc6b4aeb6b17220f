//! Comparison of two results. Values are compared if their definitions agree; otherwise the differences are reported.

use super::result::{StoredMetric, StoredResult};
use crate::evaluate::baseline::baselines::PredictorKind;
use orator_base::math::estimate::Estimate;
use orator_base::text::counted;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Metric that is present in both results.
#[derive(Clone, Debug, Serialize)]
pub struct MetricPair {
    pub name: String,
    pub unit: String,
    pub hash: String,
    pub a: Option<Estimate>,
    pub b: Option<Estimate>,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Comparison {
    /// Warning if the results have different ground truth.
    pub warning: Option<String>,
    pub pairs: Vec<MetricPair>,
    /// Messages for metrics with equal names but different definitions.
    pub rejected: Vec<String>,
    /// Metrics that are only present in A, or only in B.
    pub only_in_a: Vec<String>,
    pub only_in_b: Vec<String>,
}

pub fn compare(a: &StoredResult, b: &StoredResult) -> Comparison {
    let warning = format!(
        "A has {} and B {}, and their ground truth differs: better values may come from easier clips",
        counted(a.n_clips, "clip"),
        b.n_clips
    );
    let mut compared = Comparison { warning: (a.truth != b.truth).then_some(warning), ..Comparison::default() };
    let mut rest: Vec<&StoredMetric> = b.metrics.iter().collect();
    let mut unmatched: Vec<&StoredMetric> = Vec::new();
    for metric in &a.metrics {
        match rest.iter().position(|other| other.hash == metric.hash) {
            Some(at) => {
                let other = rest.remove(at);
                compared.pairs.push(MetricPair {
                    name: metric.plain_name.clone(),
                    unit: metric.unit.clone(),
                    hash: metric.hash.clone(),
                    a: metric.value(PredictorKind::Prediction),
                    b: other.value(PredictorKind::Prediction),
                });
            }
            None => unmatched.push(metric),
        }
    }
    for metric in unmatched {
        match rest.iter().position(|other| (&other.name, &other.part) == (&metric.name, &metric.part)) {
            Some(at) => compared.rejected.push(mismatch(metric, rest.remove(at))),
            None => compared.only_in_a.push(metric.plain_name.clone()),
        }
    }
    compared.only_in_b = rest.iter().map(|metric| metric.plain_name.clone()).collect();
    compared
}

/// Message such as `mpjpe (all), joint error, is not comparable: fps is 15.0 in A and 30.0 in B (hash ... and ...)`.
fn mismatch(a: &StoredMetric, b: &StoredMetric) -> String {
    let mut differ = Vec::new();
    differences("", &a.parameters, &b.parameters, &mut differ);
    if a.definition != b.definition {
        differ.push("the definitions differ".to_owned());
    }
    if a.unit != b.unit {
        differ.push(format!("the unit is {} in A and {} in B", a.unit, b.unit));
    }
    if differ.is_empty() {
        differ.push("the hash does not match the definition: the file was changed".to_owned());
    }
    let differ = differ.join("; ");
    format!("{} ({}), {}, is not comparable: {differ} (hash {} and {})", a.name, a.part, a.plain_name, a.hash, b.hash)
}

fn differences(path: &str, a: &Value, b: &Value, differ: &mut Vec<String>) {
    match (a, b) {
        (Value::Object(of_a), Value::Object(of_b)) => {
            let keys: BTreeSet<&String> = of_a.keys().chain(of_b.keys()).collect();
            for key in keys {
                let key_path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                let of = |map: &serde_json::Map<String, Value>| map.get(key).cloned().unwrap_or(Value::Null);
                differences(&key_path, &of(of_a), &of(of_b), differ);
            }
        }
        _ if a == b => {}
        _ => {
            let [a, b] = [a, b].map(|value| if value.is_null() { "not set".to_owned() } else { value.to_string() });
            differ.push(format!("{path} is {a} in A and {b} in B"));
        }
    }
}

pub fn text(compared: &Comparison) -> String {
    let cell = |estimate: &Option<Estimate>| match estimate {
        Some(Estimate { value, interval }) if interval.low.is_finite() => {
            format!("  {value:.4} [{:.4}, {:.4}]", interval.low, interval.high)
        }
        Some(e) => format!("{:.4}", e.value),
        None => "-".to_owned(),
    };
    let mut text = String::new();
    if let Some(warning) = &compared.warning {
        let _ = writeln!(text, "WARNING: {warning}\n");
    }
    let width = compared.pairs.iter().map(|row| row.name.chars().count() + row.unit.len() + 3).max().unwrap_or(0);
    if !compared.pairs.is_empty() {
        let _ = writeln!(text, "{:width$}{:>34}{:>34}", "", "A", "B");
    }
    for row in &compared.pairs {
        let name = if row.unit == "1" { row.name.clone() } else { format!("{} ({})", row.name, row.unit) };
        let _ = writeln!(text, "{name:width$}{:>34}{:>34}", cell(&row.a), cell(&row.b));
    }
    for mismatch in &compared.rejected {
        let _ = writeln!(text, "rejected: {mismatch}");
    }
    for (names, which) in [(&compared.only_in_a, "A"), (&compared.only_in_b, "B")] {
        if !names.is_empty() {
            let _ = writeln!(text, "only in {which}: {}", names.join("; "));
        }
    }
    text
}
