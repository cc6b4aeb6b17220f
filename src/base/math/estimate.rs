//! A value with its confidence interval.

use serde::Serialize;

/// Bounds of a confidence interval, in the unit of the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ConfidenceInterval {
    pub low: f64,
    pub high: f64,
}

/// A value with its confidence interval; serialised as `value`, `low` and `high`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    pub value: f64,
    #[serde(flatten)]
    pub interval: ConfidenceInterval,
}

impl ConfidenceInterval {
    /// Returns whether 0 lies outside the interval.
    pub fn excludes_zero(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }

    /// Returns whether both bounds are finite.
    pub fn is_finite(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }
}

impl Estimate {
    /// Creates an estimate of `value` with the interval from `low` to `high`.
    pub const fn new(value: f64, low: f64, high: f64) -> Self {
        Self { value, interval: ConfidenceInterval { low, high } }
    }
}
