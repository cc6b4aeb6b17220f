//! Removal of rejected frames from intervals and ledger, and of pieces that become too short. The sliders of the
//! report use the same functions.

use super::gaps::long_gaps;
use anyhow::{Result, ensure};
use orator_base::stage::ledger::{Kept, Ledger, Refused};
use orator_base::stage::refusal::{FrameRefusal, Refusal};
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
pub fn bone_refusals(bone_change: &[f32], most: f64, max_gap: usize) -> Vec<Option<FrameRefusal>> {
    let fine: Vec<bool> = bone_change.iter().map(|&change| !exceeds(change, most)).collect();
    let long = long_gaps(&fine, max_gap);
    let refused =
        |(&change, &long): (&f32, &bool)| long.then(|| FrameRefusal::new(Refusal::Bones, f64::from(change), most));
    bone_change.iter().zip(&long).map(refused).collect()
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
    refusals: &[Option<FrameRefusal>],
    min_frames: usize,
) -> Result<(Intervals, Ledger)> {
    let fps = intervals.fps;
    ensure!(
        ledger.kept.len() == intervals.intervals.len(),
        "{}, but {} accepted in the ledger: run the stage segment again",
        counted(intervals.intervals.len(), "interval"),
        ledger.kept.len()
    );
    let mut left = Vec::new();
    let mut reduced = Ledger { kept: Vec::new(), ..ledger.clone() };
    for (interval, kept) in intervals.intervals.iter().zip(&ledger.kept) {
        for (piece, refused) in pieces(*interval, refusals) {
            let start_secs = if piece.start == interval.start { kept.start_secs } else { fps.secs(piece.start) };
            let end_secs = if piece.end == interval.end { kept.end_secs } else { fps.secs(piece.end) };
            let short = piece.n_frames() < min_frames && piece != *interval;
            let (secs, least) = (fps.secs(piece.n_frames()), fps.secs(min_frames));
            let too_short = || short.then(|| FrameRefusal::new(Refusal::TooShort, secs, least));
            match refused.or_else(too_short) {
                None => {
                    left.push(piece);
                    reduced.kept.push(Kept { start_secs, end_secs });
                }
                Some(why) => reduced.refused.push(Refused::new(start_secs, end_secs, why)),
            }
        }
    }
    reduced.refused.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
    let left = Intervals::new(fps, intervals.n_frames, left).with_resting(&intervals.resting);
    let reduced = reduced.with_resting(left.resting_intervals());
    Ok((left, reduced))
}

/// Splits an interval into consecutive pieces, each accepted (`None`) or rejected for one reason with the mean of the
/// measured value.
fn pieces(interval: Interval, refusals: &[Option<FrameRefusal>]) -> Vec<(Interval, Option<FrameRefusal>)> {
    let Interval { start, end } = interval;
    let reason = |refused: &Option<FrameRefusal>| refused.map(|refused| refused.refusal);
    let mut at = start;
    let runs = refusals[start..end].chunk_by(|a, b| reason(a) == reason(b)).map(|run| {
        let piece = Interval { start: at, end: at + run.len() };
        at = piece.end;
        let measured = FrameRefusal::mean_measured(run);
        (piece, run[0].map(|refused| FrameRefusal { measured, ..refused }))
    });
    runs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejected_frames_are_removed_and_every_second_is_accounted_for() {
        let fps = FrameRate::new(15, 1);
        let intervals =
            Intervals::new(fps, 300, vec![Interval { start: 0, end: 100 }, Interval { start: 120, end: 300 }]);
        let silent = Refused::new(fps.secs(100), 8.0, FrameRefusal::new(Refusal::Quiet, -70.0, -50.0));
        let kept = [(0.0, fps.secs(100)), (8.0, 19.99)].map(|(start_secs, end_secs)| Kept { start_secs, end_secs });
        let ledger = Ledger { duration_secs: 19.99, kept: kept.to_vec(), refused: vec![silent], ..Ledger::default() };
        let mut refusals = vec![None; 300];
        let same = exclude_frames(&intervals, &ledger, &refusals, 64).unwrap();
        assert_eq!(same, (intervals.clone(), ledger.clone()));
        refusals[150..160].fill(Some(FrameRefusal::new(Refusal::Bones, 0.75, 0.5)));
        refusals[299] = Some(FrameRefusal::new(Refusal::MissingJoints, 3.0, 0.0));
        let (left, reduced) = exclude_frames(&intervals, &ledger, &refusals, 64).unwrap();
        assert_eq!(left.intervals, [Interval { start: 0, end: 100 }, Interval { start: 160, end: 299 }]);
        assert!(reduced.is_whole());
        let reasons: Vec<(&str, f64)> = reduced.refused.iter().map(|r| (r.reason.as_str(), r.measured)).collect();
        assert_eq!(reasons, [("quiet", -70.0), ("too short", 2.0), ("bones", 0.75), ("open", 3.0)]);
        assert!(exclude_frames(&intervals, &Ledger { kept: vec![], ..ledger }, &refusals, 64).is_err());
    }
}
