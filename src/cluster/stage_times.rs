//! How long the stages take on a machine, from times of excerpts, and what that means for complete videos and several
//! workers, by the bound of list scheduling.

use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::workdir;
use orator_pipeline::extract::spans;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the file in the work folder.
const FILE: &str = "stage_times.json";

/// Times of the stages on one machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageTimes {
    /// Program, settings, models and machine that were timed; with others the times do not count.
    pub made_with: String,
    /// The processor by its name.
    pub processor: String,
    /// Videos worked on side by side while the time was taken.
    pub jobs: usize,
    /// Excerpts, and how long they were together, seconds.
    pub n_excerpts: usize,
    pub excerpt_secs: f64,
    /// Cost of each stage, by its name.
    pub stages: BTreeMap<String, StageCost>,
    /// Most memory of a process of a unit, MiB, where it could be seen.
    pub peak_mib: Option<f64>,
}

/// What a stage takes for a video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Seconds whatever the video, and seconds for each of its seconds.
    pub fixed_secs: f64,
    pub secs_per_sec: f64,
    /// Bytes of files for each second of video.
    pub bytes_per_sec: f64,
}

impl StageCost {
    /// The cost that fits times of excerpts, (length, seconds of work) each: least squares, every excerpt weighed by the
    /// inverse of its length, neither part below 0.
    pub fn fit(times: &[(f64, f64)]) -> Self {
        let sum = |f: fn(f64, f64) -> f64| -> f64 {
            times.iter().map(|(length, secs)| f(*length, *secs) / length.max(1e-3)).sum()
        };
        let (n, length, square) = (sum(|_, _| 1.0), sum(|length, _| length), sum(|length, _| length * length));
        let (secs, product) = (sum(|_, secs| secs), sum(|length, secs| length * secs));
        let spread = n * square - length * length;
        // Excerpts of one length tell nothing of the fixed part.
        let slope = if spread > 1e-9 * n * square { (n * product - length * secs) / spread } else { f64::INFINITY };
        let (fixed_secs, secs_per_sec) = match secs - slope * length {
            _ if square <= 0.0 => (0.0, 0.0),
            _ if slope < 0.0 => (secs / n, 0.0),
            fixed if fixed < 0.0 => (0.0, product / square),
            fixed => (fixed / n, slope),
        };
        Self { fixed_secs, secs_per_sec, bytes_per_sec: 0.0 }
    }

    /// Seconds of work for a video of this length.
    pub fn secs(&self, length_secs: f64) -> f64 {
        self.fixed_secs + self.secs_per_sec * length_secs
    }
}

impl StageTimes {
    /// The file of a work folder.
    pub fn path(work: &Path) -> PathBuf {
        work.join(FILE)
    }

    /// The times on record in a work folder; none where there are none that can be read.
    pub fn read(work: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(Self::path(work)).ok()?).ok()
    }

    /// Keeps the times in a work folder.
    pub fn write(&self, work: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        workdir::write_file(&Self::path(work), &bytes)
    }

    /// Cost of a stage; nothing where it was not timed.
    pub fn cost(&self, stage: StageName) -> StageCost {
        self.stages.get(stage.as_str()).copied().unwrap_or_default()
    }

    /// Seconds of work on a video at all of its stages.
    pub fn video_secs(&self, length_secs: f64) -> f64 {
        StageName::OF_VIDEOS.into_iter().map(|stage| self.cost(stage).secs(length_secs)).sum()
    }

    /// Seconds of work at a stage on videos of these lengths.
    pub fn stage_secs(&self, stage: StageName, lengths: &[f64]) -> f64 {
        lengths.iter().map(|length| self.cost(stage).secs(*length)).sum()
    }

    /// Seconds until `workers` have worked on videos of these lengths.
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
                n_pieces: sum.n_pieces + n_spans,
            }
        })
    }

    /// Hours after which a worker of so many may be ended: twice what the work takes, since machines differ, and half an
    /// hour to begin and for the datasets.
    pub fn limit_hours(&self, lengths: &[f64], workers: usize) -> f64 {
        0.5 + 2.0 * self.wall_secs(lengths, workers) / 3600.0
    }

    /// The fewest workers that are done with videos of these lengths within so many seconds; none: the longest video with a
    /// worker for each of its spans takes longer.
    pub fn workers_within(&self, lengths: &[f64], secs: f64) -> Option<usize> {
        let work = self.workload(lengths);
        (1..=work.n_pieces).find(|workers| work.wall_secs(*workers) <= secs)
    }
}

/// Work on several videos.
#[derive(Clone, Copy, Default)]
struct Workload {
    /// Seconds of work on all videos.
    total: f64,
    /// Seconds of the video that takes longest with a worker for each of its spans.
    longest: f64,
    /// Videos and spans that workers take one by one.
    n_pieces: usize,
}

impl Workload {
    /// Seconds that list scheduling takes at most (Graham 1969): the longest chain, and a share of the rest. With a worker
    /// for each piece nothing waits.
    fn wall_secs(&self, workers: usize) -> f64 {
        let rest = if workers < self.n_pieces { self.total - self.longest } else { 0.0 };
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
    fn costs_are_fitted_and_never_below_nothing() {
        let line: Vec<(f64, f64)> = [2.0, 10.0, 9.0].map(|length| (length, 1.5 + 0.8 * length)).to_vec();
        let cost = StageCost::fit(&line);
        assert!((cost.fixed_secs - 1.5).abs() < 1e-9 && (cost.secs_per_sec - 0.8).abs() < 1e-9, "{cost:?}");
        let falling = StageCost::fit(&[(2.0, 4.0), (10.0, 2.0)]);
        assert!(falling.secs_per_sec == 0.0 && falling.fixed_secs > 2.0, "{falling:?}");
        let steep = StageCost::fit(&[(2.0, 0.1), (10.0, 10.0)]);
        assert!(steep.fixed_secs == 0.0 && (0.8..1.1).contains(&steep.secs_per_sec), "{steep:?}");
        let alike = StageCost::fit(&[(10.0, 20.0), (10.0, 22.0)]);
        assert!(alike.fixed_secs == 0.0 && (alike.secs_per_sec - 2.1).abs() < 1e-9, "{alike:?}");
        assert_eq!(StageCost::fit(&[]), StageCost::default());
    }

    #[test]
    fn workers_share_all_but_the_longest_chain() {
        let times = times(1.0, 2.0);
        // 600 s are 5 spans of 241 s.
        for (lengths, sum, chain) in [(&[10.0, 40.0, 20.0, 10.0][..], 164.0, 81.0), (&[600.0, 10.0], 1226.0, 241.0)] {
            let walls: Vec<f64> = (1..=8).map(|workers| times.wall_secs(lengths, workers)).collect();
            assert_eq!((walls[0], walls[7], times.wall_secs(lengths, usize::MAX)), (sum, chain, chain));
            assert!(walls.is_sorted_by(|fewer, more| fewer >= more), "{walls:?}");
            for (workers, wall) in (1..).zip(&walls) {
                assert!(*wall >= chain && *wall >= sum / f64::from(workers), "{workers}: {wall}");
                let least = 1 + walls.iter().position(|other| other <= wall).unwrap();
                assert_eq!(times.workers_within(lengths, *wall), Some(least));
            }
            assert_eq!(times.workers_within(lengths, chain - 1.0), None);
            assert_eq!(times.limit_hours(lengths, 2), 0.5 + 2.0 * walls[1] / 3600.0);
        }
        assert_eq!(times.wall_secs(&[10.0, 40.0, 20.0, 10.0], 2), 81.0 + 83.0 / 2.0);
        assert_eq!(times.wall_secs(&[], 1), 0.0);
    }

    #[test]
    fn what_is_kept_is_read_again() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(StageTimes::read(dir.path()), None);
        let times = times(0.25, 1.5);
        times.write(dir.path()).unwrap();
        assert_eq!(StageTimes::read(dir.path()), Some(times));
    }
}
