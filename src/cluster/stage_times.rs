//! Duration of the stages on a machine, fitted to times of excerpts, and the predicted duration for complete videos and
//! several workers, by the bound of list scheduling.

use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::workdir;
use orator_pipeline::extract::spans;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const FILE: &str = "stage_times.json";

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageTimes {
    /// Hash of the program, settings, models and machine that were timed; the times are invalid for any other.
    #[serde(alias = "made_with")]
    pub fingerprint: String,
    pub processor: String,
    /// Number of videos processed in parallel during the measurement.
    pub jobs: usize,
    /// Number of excerpts, and their total duration, seconds.
    pub n_excerpts: usize,
    pub excerpt_secs: f64,
    /// Cost of each stage, by stage name.
    pub stages: BTreeMap<String, StageCost>,
    /// Peak memory of a unit's process, MiB, if known.
    pub peak_mib: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Seconds independent of the length of the video, and seconds of work for each second of video.
    pub fixed_secs: f64,
    pub secs_per_sec: f64,
    /// Bytes of output for each second of video.
    pub bytes_per_sec: f64,
}

impl StageCost {
    /// Fits the cost to the times of excerpts, (length, working time) in seconds each: least squares with each excerpt
    /// weighted by the inverse of its length, both parts at least 0.
    pub fn fit(times: &[(f64, f64)]) -> Self {
        let sum = |f: fn(f64, f64) -> f64| -> f64 {
            times.iter().map(|(length, secs)| f(*length, *secs) / length.max(1e-3)).sum()
        };
        let (n, length, square) = (sum(|_, _| 1.0), sum(|length, _| length), sum(|length, _| length * length));
        let (secs, product) = (sum(|_, secs| secs), sum(|length, secs| length * secs));
        let spread = n * square - length * length;
        // Excerpts of equal length do not determine the fixed part.
        let slope = if spread > 1e-9 * n * square { (n * product - length * secs) / spread } else { f64::INFINITY };
        let (fixed_secs, secs_per_sec) = match secs - slope * length {
            _ if square <= 0.0 => (0.0, 0.0),
            _ if slope < 0.0 => (secs / n, 0.0),
            fixed if fixed < 0.0 => (0.0, product / square),
            fixed => (fixed / n, slope),
        };
        Self { fixed_secs, secs_per_sec, bytes_per_sec: 0.0 }
    }

    /// Seconds of work for a video of this length (seconds).
    pub fn secs(&self, length_secs: f64) -> f64 {
        self.fixed_secs + self.secs_per_sec * length_secs
    }
}

impl StageTimes {
    pub fn path(work: &Path) -> PathBuf {
        work.join(FILE)
    }

    /// Reads the times saved in a work folder; `None` if there are none or they cannot be read.
    pub fn read(work: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(Self::path(work)).ok()?).ok()
    }

    pub fn write(&self, work: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        workdir::write_file(&Self::path(work), &bytes)
    }

    /// Cost of a stage; zero if it was not timed.
    pub fn cost(&self, stage: StageName) -> StageCost {
        self.stages.get(stage.as_str()).copied().unwrap_or_default()
    }

    /// Stages that were timed or always run, in order.
    pub fn timed_stages(&self) -> impl Iterator<Item = StageName> {
        let is_timed = |stage: &StageName| self.stages.contains_key(stage.as_str());
        StageName::ALL.into_iter().filter(move |stage| *stage != StageName::Transcribe || is_timed(stage))
    }

    /// Seconds of work on a video in all its stages.
    pub fn video_secs(&self, length_secs: f64) -> f64 {
        StageName::OF_VIDEOS.into_iter().map(|stage| self.cost(stage).secs(length_secs)).sum()
    }

    /// Seconds of work in a stage on videos of these lengths (seconds).
    pub fn stage_secs(&self, stage: StageName, lengths: &[f64]) -> f64 {
        lengths.iter().map(|length| self.cost(stage).secs(*length)).sum()
    }

    /// Seconds until `workers` workers have processed videos of these lengths.
    pub fn wall_secs(&self, lengths: &[f64], workers: usize) -> f64 {
        self.workload(lengths).wall_secs(workers)
    }

    fn workload(&self, lengths: &[f64]) -> Workload {
        let pose2d = self.cost(StageName::Pose2d);
        lengths.iter().fold(Workload::default(), |sum, length| {
            // Workers share the spans of one stage; the other stages of a video run one after the other.
            let n_spans = spans::count(*length);
            let (others, span) =
                (self.video_secs(*length) - pose2d.secs(*length), pose2d.secs(length / n_spans as f64));
            Workload {
                total: sum.total + others + n_spans as f64 * span,
                longest: sum.longest.max(others + span),
                n_spans: sum.n_spans + n_spans,
            }
        })
    }

    /// Time limit for each of `workers` workers, hours: twice the predicted duration, since machines differ, plus half
    /// an hour for startup and the datasets.
    pub fn limit_hours(&self, lengths: &[f64], workers: usize) -> f64 {
        0.5 + 2.0 * self.wall_secs(lengths, workers) / 3600.0
    }

    /// The smallest number of workers that process videos of these lengths within `secs` seconds; `None` if the longest
    /// video takes longer even with one worker for each of its spans.
    pub fn workers_within(&self, lengths: &[f64], secs: f64) -> Option<usize> {
        let work = self.workload(lengths);
        (1..=work.n_spans).find(|workers| work.wall_secs(*workers) <= secs)
    }
}

#[derive(Clone, Copy, Default)]
struct Workload {
    /// Seconds of work on all videos.
    total: f64,
    /// Seconds for the longest video with one worker for each of its spans.
    longest: f64,
    /// Number of spans, the largest useful number of workers.
    n_spans: usize,
}

impl Workload {
    /// Upper bound of the duration under list scheduling (Graham 1969), seconds: the longest chain plus an equal share
    /// of the rest. With one worker per span, nothing waits.
    fn wall_secs(&self, workers: usize) -> f64 {
        let rest = if workers < self.n_spans { self.total - self.longest } else { 0.0 };
        self.longest + rest / workers.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(fixed_secs: f64, secs_per_sec: f64) -> StageTimes {
        let cost = StageCost { fixed_secs, secs_per_sec, bytes_per_sec: 0.0 };
        StageTimes { stages: BTreeMap::from([("pose2d".to_owned(), cost)]), ..StageTimes::default() }
    }

    #[test]
    fn costs_are_fitted_and_never_negative() {
        let line: Vec<(f64, f64)> = [2.0, 10.0, 9.0].map(|length| (length, 1.5 + 0.8 * length)).to_vec();
        let cost = StageCost::fit(&line);
        assert!((cost.fixed_secs - 1.5).abs() < 1e-9 && (cost.secs_per_sec - 0.8).abs() < 1e-9, "{cost:?}");
        let falling = StageCost::fit(&[(2.0, 4.0), (10.0, 2.0)]);
        assert!(falling.secs_per_sec == 0.0 && falling.fixed_secs > 2.0, "{falling:?}");
        let steep = StageCost::fit(&[(2.0, 0.1), (10.0, 10.0)]);
        assert!(steep.fixed_secs == 0.0 && (0.8..1.1).contains(&steep.secs_per_sec), "{steep:?}");
        let equal = StageCost::fit(&[(10.0, 20.0), (10.0, 22.0)]);
        assert!(equal.fixed_secs == 0.0 && (equal.secs_per_sec - 2.1).abs() < 1e-9, "{equal:?}");
        assert_eq!(StageCost::fit(&[]), StageCost::default());
    }

    #[test]
    fn workers_share_all_work_but_the_longest_chain() {
        let times = times(1.0, 2.0);
        // A video of 600 s has 5 spans that cost 241 s each.
        for (lengths, sum, chain) in [(&[10.0, 40.0, 20.0, 10.0][..], 164.0, 81.0), (&[600.0, 10.0], 1226.0, 241.0)] {
            let walls: Vec<f64> = (1..=8).map(|workers| times.wall_secs(lengths, workers)).collect();
            assert_eq!((walls[0], walls[7], times.wall_secs(lengths, usize::MAX)), (sum, chain, chain));
            assert!(walls.is_sorted_by(|fewer, more| fewer >= more), "{walls:?}");
            for (workers, wall) in (1..).zip(&walls) {
                assert!(*wall >= chain && *wall >= sum / f64::from(workers), "{workers}: {wall}");
                let min_workers = 1 + walls.iter().position(|other| other <= wall).unwrap();
                assert_eq!(times.workers_within(lengths, *wall), Some(min_workers));
            }
            assert_eq!(times.workers_within(lengths, chain - 1.0), None);
            assert_eq!(times.limit_hours(lengths, 2), 0.5 + 2.0 * walls[1] / 3600.0);
        }
        assert_eq!(times.wall_secs(&[10.0, 40.0, 20.0, 10.0], 2), 81.0 + 83.0 / 2.0);
        assert_eq!(times.wall_secs(&[], 1), 0.0);
    }

    #[test]
    fn saved_times_are_read_back() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(StageTimes::read(dir.path()), None);
        let times = times(0.25, 1.5);
        times.write(dir.path()).unwrap();
        assert_eq!(StageTimes::read(dir.path()), Some(times));
    }
}
