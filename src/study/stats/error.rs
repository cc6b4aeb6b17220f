//! Why a statistic does not exist for the given numbers, and the checks that find out.

use std::ops::RangeInclusive;

/// Reason for which a statistic cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StatisticsError {
    #[error("{found} {what}, at least {least} are needed")]
    TooFew { what: &'static str, least: usize, found: usize },
    #[error("{what} are all the same: their spread cannot be estimated")]
    NoSpread { what: &'static str },
    #[error("{what} is {value}, expected {least} to {most}")]
    OutOfRange { what: &'static str, value: f64, least: f64, most: f64 },
    #[error("{what} hold a number that is not finite")]
    NotFinite { what: &'static str },
    #[error("{what} fall into groups of which one never loses to the other: their difference is not finite")]
    Unconnected { what: &'static str },
}

/// Refuses fewer than `least` things.
pub(super) fn at_least(what: &'static str, least: usize, found: usize) -> Result<(), StatisticsError> {
    if found < least { Err(StatisticsError::TooFew { what, least, found }) } else { Ok(()) }
}

/// Refuses a number outside `range`, NaN too.
pub(super) fn within(what: &'static str, value: f64, range: RangeInclusive<f64>) -> Result<(), StatisticsError> {
    let (least, most) = (*range.start(), *range.end());
    if range.contains(&value) { Ok(()) } else { Err(StatisticsError::OutOfRange { what, value, least, most }) }
}

/// Refuses NaN and infinite numbers.
pub(super) fn finite(what: &'static str, values: &[f64]) -> Result<(), StatisticsError> {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(StatisticsError::NotFinite { what }) }
}

/// Share of probability at each end outside an interval of `confidence`, which must lie between 0 and 1.
pub(super) fn tail(confidence: f64) -> Result<f64, StatisticsError> {
    within("confidence", confidence, f64::EPSILON..=1.0 - f64::EPSILON)?;
    Ok((1.0 - confidence) / 2.0)
}
