//! What other thresholds would keep, exactly: the rules are applied again to the stored measures, with one threshold at each
//! value of its grid and the others as they are configured. What lifting refused stays refused; frames that were never
//! lifted count as good ones.

use super::thresholds::THRESHOLDS;
use crate::config::Segment;
use crate::formats::media_json::MediaInfo;
use crate::pipeline::segment;
use crate::pipeline::segment::Measures;
use crate::stage::ledger::Ledger;
use rayon::prelude::*;

/// Seconds kept of one video: by threshold, by value of its grid.
pub type Kept = Vec<Vec<f64>>;

/// A video as far as the rules look at it.
pub struct Judged<'a> {
    pub measures: &'a Measures,
    pub video: &'a MediaInfo,
    /// Frames that lifting refused.
    pub refused_by_lift: &'a [bool],
}

impl Judged<'_> {
    /// Seconds kept under `rules`.
    pub fn kept_secs(&self, rules: &Segment) -> f64 {
        let (intervals, ledger) = segment::judge(self.measures, self.video, rules);
        let fps = self.video.fps;
        let mut secs = 0.0;
        for (interval, kept) in intervals.intervals.iter().zip(&ledger.kept) {
            let refused = |t: usize| self.refused_by_lift.get(t).copied().unwrap_or(false);
            let mut start = interval.start;
            for t in interval.start..=interval.end {
                if t < interval.end && !refused(t) {
                    continue;
                }
                let whole = (start, t) == (interval.start, interval.end);
                if t > start && (whole || t - start >= rules.min_frames) {
                    let from = if start == interval.start { kept.start_secs } else { fps.secs(start) };
                    let to = if t == interval.end { kept.end_secs } else { fps.secs(t) };
                    secs += to - from;
                }
                start = t + 1;
            }
        }
        secs
    }

    /// Seconds kept at every value of every threshold, on all cores.
    pub fn table(&self, rules: &Segment) -> Kept {
        let row = |threshold: &super::thresholds::ThresholdGrid| -> Vec<f64> {
            let (grid, _) = threshold.grid(rules);
            grid.into_par_iter().map(|value| self.kept_secs(&threshold.with(rules, value))).collect()
        };
        THRESHOLDS.par_iter().map(row).collect()
    }
}

/// The frames of stretches that lifting refused for what it saw.
pub fn refused_by_lift(ledger: &Ledger, video: &MediaInfo) -> Vec<bool> {
    let mut refused = vec![false; video.n_frames];
    for stretch in ledger.refused.iter().filter(|stretch| ["bones", "open"].contains(&stretch.reason.as_str())) {
        let frame = |secs: f64| ((secs * video.fps.per_sec()).round() as usize).min(video.n_frames);
        // The last frame may be cut off by the video's end.
        let end = if stretch.end_secs == video.duration_secs { video.n_frames } else { frame(stretch.end_secs) };
        refused[frame(stretch.start_secs).min(end)..end].fill(true);
    }
    refused
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::ledger::Refused;
    use crate::types::time::FrameRate;

    /// 300 good frames but for a jump at 200.
    fn measures() -> Measures {
        let of = |value: f32| vec![value; 300];
        let mut jump = of(0.0);
        jump[200] = 1.0;
        Measures {
            sound: of(1.0),
            sound_db: of(-20.0),
            frame_difference: of(5.0),
            person: of(0.9),
            shoulder_px: of(120.0),
            face: of(0.9),
            facing: of(2.0),
            nose_off: of(0.0),
            arms: of(0.9),
            left_hand: of(0.9),
            right_hand: of(0.9),
            n_people: of(1.0),
            jump,
            identity: of(0.0),
            shot_score: of(0.0),
        }
    }

    #[test]
    fn other_thresholds_keep_what_the_rules_say_and_what_lifting_refused_stays_out() {
        let video = MediaInfo::new(19.99, 300, FrameRate::new(15, 1));
        let (measures, rules) = (measures(), Segment::default());
        let refused = Refused {
            start_secs: 10.0,
            end_secs: 11.0,
            reason: "bones".to_owned(),
            measured: 0.0,
            threshold: 0.0,
            unit: String::new(),
            says: String::new(),
        };
        let ledger = Ledger { refused: vec![refused], ..Ledger::default() };
        let none = Judged { measures: &measures, video: &video, refused_by_lift: &[] };
        assert!((none.kept_secs(&rules) - (19.99 - 1.0 / 15.0)).abs() < 1e-9);
        let marks = refused_by_lift(&ledger, &video);
        assert_eq!((marks.iter().filter(|mark| **mark).count(), marks[150], marks[165]), (15, true, false));
        let some = Judged { refused_by_lift: &marks, ..none };
        // frames 0..150 and 201..300: what is left between 165 and 200 is too short
        assert!((some.kept_secs(&rules) - (10.0 + 19.99 - 201.0 / 15.0)).abs() < 1e-9);
        let table = some.table(&rules);
        for (threshold, row) in THRESHOLDS.iter().zip(&table) {
            let (grid, at) = threshold.grid(&rules);
            assert_eq!((row.len(), row[at]), (grid.len(), some.kept_secs(&rules)), "{}", threshold.key);
        }
        let jump = THRESHOLDS.iter().position(|threshold| threshold.key == "max_jump").unwrap();
        assert!((table[jump].last().unwrap() - 18.99).abs() < 1e-9);
    }
}
