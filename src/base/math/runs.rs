//! Runs of equal values.

use std::ops::Range;

/// Ranges of neighbouring values that are true, in order.
pub fn true_ranges(values: &[bool]) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    let runs = values.chunk_by(|a, b| a == b).map(move |run| {
        let start = end;
        end += run.len();
        (run[0], start..end)
    });
    runs.filter_map(|(is_true, range)| is_true.then_some(range))
}
