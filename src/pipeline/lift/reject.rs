//! Removal of rejected frames from intervals and ledger, and of pieces then too short. The report's sliders use them.

use super::gaps::long_gaps;
use anyhow::{Result, ensure};
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::counted;
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::time::FrameRate;
use orator_dataset::config;

/// Longest gap of the body that is filled, in complete frames.
pub fn max_gap_frames(rules: &config::SegmentConfig, fps: FrameRate) -> usize {
    (rules.max_body_gap_secs * fps.per_sec() + 1e-6) as usize
}

/// Rejects the frames of runs longer than `max_gap` in which a bone deviates by more than `most`. `bone_change` [T] is
/// the largest relative deviation of a bone in each frame; NaN: unknown, not rejected.
pub fn bone_rejections(bone_change: &[f32], most: f64, max_gap: usize) -> Vec<Option<FrameRejection>> {
    let fine: Vec<bool> = bone_change.iter().map(|&change| !exceeds(change, most)).collect();
    let long = long_gaps(&fine, max_gap);
    let rejected =
        |(&change, &long): (&f32, &bool)| long.then(|| FrameRejection::new(Rejection::Bones, f64::from(change), most));
    bone_change.iter().zip(&long).map(rejected).collect()
}

/// Whether a relative deviation `change` exceeds `most`.
pub fn exceeds(change: f32, most: f64) -> bool {
    f64::from(change.abs()) > most
}

/// Removes the rejected frames from `intervals` and moves their seconds in `ledger` from accepted to rejected.
///
/// # Errors
/// The ledger does not contain one accepted stretch per interval, in the same order.
pub fn exclude_frames(
    intervals: &Intervals,
    ledger: &Ledger,
    rejections: &[Option<FrameRejection>],
    min_frames: usize,
) -> Result<(Intervals, Ledger)> {
    let fps = intervals.fps;
    ensure!(
        ledger.accepted.len() == intervals.intervals.len(),
        "{}, but {} accepted in the ledger: run the stage segment again",
        counted(intervals.intervals.len(), "interval"),
        ledger.accepted.len()
    );
    let mut left = Vec::new();
    let mut reduced = Ledger { accepted: Vec::new(), ..ledger.clone() };
    for (interval, accepted) in intervals.intervals.iter().zip(&ledger.accepted) {
        for (piece, rejected) in pieces(*interval, rejections) {
            let start_secs = if piece.start == interval.start { accepted.start_secs } else { fps.secs(piece.start) };
            let end_secs = if piece.end == interval.end { accepted.end_secs } else { fps.secs(piece.end) };
            let short = piece.n_frames() < min_frames && piece != *interval;
            let (secs, least) = (fps.secs(piece.n_frames()), fps.secs(min_frames));
            let too_short = || short.then(|| FrameRejection::new(Rejection::TooShort, secs, least));
            match rejected.or_else(too_short) {
                None => {
                    left.push(piece);
                    reduced.accepted.push(AcceptedInterval { start_secs, end_secs });
                }
                Some(why) => reduced.rejected.push(RejectedInterval::new(start_secs, end_secs, why)),
            }
        }
    }
    reduced.rejected.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
    let left = Intervals::new(fps, intervals.n_frames, left).with_resting(&intervals.resting);
    let reduced = reduced.with_resting(left.resting_intervals());
    Ok((left, reduced))
}

/// Splits an interval into pieces, each accepted (`None`) or rejected for one reason with the mean measured value.
fn pieces(interval: Interval, rejections: &[Option<FrameRejection>]) -> Vec<(Interval, Option<FrameRejection>)> {
    let Interval { start, end } = interval;
    let reason = |rejected: &Option<FrameRejection>| rejected.map(|rejected| rejected.rejection);
    let mut at = start;
    let runs = rejections[start..end].chunk_by(|a, b| reason(a) == reason(b)).map(|run| {
        let piece = Interval { start: at, end: at + run.len() };
        at = piece.end;
        let measured = FrameRejection::mean_measured(run);
        (piece, run[0].map(|rejected| FrameRejection { measured, ..rejected }))
    });
    runs.collect()
}
