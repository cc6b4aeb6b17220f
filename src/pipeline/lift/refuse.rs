//! Intervals and ledger once more: frames that lifting refuses are taken out, and pieces that this leaves too short.

use crate::stage::ledger::{Kept, Ledger, Refused};
use crate::types::interval::{Interval, Intervals};
use anyhow::{Result, ensure};

/// Why a frame is refused, with what was measured and the threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    reason: &'static str,
    measured: f64,
    threshold: f64,
    unit: &'static str,
}

impl Mark {
    /// A bone off its length in the video, both as shares of that length.
    pub const fn bones(measured: f64, threshold: f64) -> Self {
        Self { reason: "bones", measured, threshold, unit: "bone lengths" }
    }

    /// Joints that stayed open.
    pub const fn open(n_joints: f64) -> Self {
        Self { reason: "open", measured: n_joints, threshold: 0.0, unit: "joints" }
    }

    const fn too_short(secs: f64, least: f64) -> Self {
        Self { reason: "too short", measured: secs, threshold: least, unit: "s" }
    }

    fn says(&self) -> String {
        let (m, t) = (self.measured, self.threshold);
        match self.reason {
            "bones" => format!("a bone was lifted {m:.2} off its length in the video, {t:.2} is allowed"),
            "open" => format!("{m:.0} of the joints are not seen for longer than can be filled"),
            _ => format!("too short: {m:.1} s between refused stretches, an interval needs {t:.1} s"),
        }
    }
}

/// Takes the marked frames out of `intervals` and moves their seconds in `ledger` from kept to refused. The ledger keeps
/// one stretch an interval, in the same order. Errors: it does not.
pub fn amend(
    intervals: &Intervals,
    ledger: &Ledger,
    marks: &[Option<Mark>],
    min_frames: usize,
) -> Result<(Intervals, Ledger)> {
    let fps = intervals.fps;
    ensure!(
        ledger.kept.len() == intervals.intervals.len(),
        "{} intervals, but {} stretches kept in the ledger: run the stage segment again",
        intervals.intervals.len(),
        ledger.kept.len()
    );
    let mut left = Vec::new();
    let mut amended = Ledger { kept: Vec::new(), ..ledger.clone() };
    for (interval, kept) in intervals.intervals.iter().zip(&ledger.kept) {
        for (piece, mark) in pieces(*interval, marks) {
            let start_secs = if piece.start == interval.start { kept.start_secs } else { fps.secs(piece.start) };
            let end_secs = if piece.end == interval.end { kept.end_secs } else { fps.secs(piece.end) };
            let short = piece.n_frames() < min_frames && piece != *interval;
            let too_short = || short.then(|| Mark::too_short(fps.secs(piece.n_frames()), fps.secs(min_frames)));
            match mark.or_else(too_short) {
                None => {
                    left.push(piece);
                    amended.kept.push(Kept { start_secs, end_secs });
                }
                Some(mark) => amended.refused.push(Refused {
                    start_secs,
                    end_secs,
                    reason: mark.reason.to_owned(),
                    measured: mark.measured,
                    threshold: mark.threshold,
                    unit: mark.unit.to_owned(),
                    says: mark.says(),
                }),
            }
        }
    }
    amended.refused.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
    Ok((Intervals::new(fps, intervals.n_frames, left), amended))
}

/// An interval as pieces end to end, each unmarked, or marked with one reason and the mean of what was measured.
fn pieces(interval: Interval, marks: &[Option<Mark>]) -> Vec<(Interval, Option<Mark>)> {
    let Interval { start, end } = interval;
    let reason = |mark: &Option<Mark>| mark.map(|mark| mark.reason);
    let mut at = start;
    let runs = marks[start..end].chunk_by(|a, b| reason(a) == reason(b)).map(|run| {
        let piece = Interval { start: at, end: at + run.len() };
        at = piece.end;
        let measured = run.iter().flatten().map(|mark| mark.measured).sum::<f64>() / run.len() as f64;
        (piece, run[0].map(|mark| Mark { measured, ..mark }))
    });
    runs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::time::FrameRate;

    #[test]
    fn marked_frames_go_and_every_second_stays_accounted_for() {
        let fps = FrameRate::new(15, 1);
        let intervals =
            Intervals::new(fps, 300, vec![Interval { start: 0, end: 100 }, Interval { start: 120, end: 300 }]);
        let silent = Refused {
            start_secs: fps.secs(100),
            end_secs: 8.0,
            reason: "quiet".into(),
            measured: -70.0,
            threshold: -50.0,
            unit: "dB".into(),
            says: String::new(),
        };
        let kept = [(0.0, fps.secs(100)), (8.0, 19.99)].map(|(start_secs, end_secs)| Kept { start_secs, end_secs });
        let ledger = Ledger { duration_secs: 19.99, kept: kept.to_vec(), refused: vec![silent], ..Ledger::default() };
        let mut marks = vec![None; 300];
        let same = amend(&intervals, &ledger, &marks, 64).unwrap();
        assert_eq!(same, (intervals.clone(), ledger.clone()));
        marks[150..160].fill(Some(Mark::bones(0.75, 0.5)));
        marks[299] = Some(Mark::open(3.0));
        let (left, amended) = amend(&intervals, &ledger, &marks, 64).unwrap();
        assert_eq!(left.intervals, [Interval { start: 0, end: 100 }, Interval { start: 160, end: 299 }]);
        assert!(amended.is_whole());
        let reasons: Vec<(&str, f64)> = amended.refused.iter().map(|r| (r.reason.as_str(), r.measured)).collect();
        assert_eq!(reasons, [("quiet", -70.0), ("too short", 2.0), ("bones", 0.75), ("open", 3.0)]);
        assert!(amend(&intervals, &Ledger { kept: vec![], ..ledger }, &marks, 64).is_err());
    }
}
