//! How long the stages take on a machine, from times of excerpts, and what that means for whole videos and several workers:
//! a simulation of the order in which the runner gives out work.

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
    ///
    /// # Errors
    /// The file cannot be written.
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
        wall_secs(&self.video_work(lengths), workers)
    }

    /// The work on videos of these lengths in the order of a run, the longest first.
    fn video_work(&self, lengths: &[f64]) -> Vec<VideoWork> {
        let mut lengths = lengths.to_vec();
        lengths.sort_by(|a, b| b.total_cmp(a));
        lengths.into_iter().map(|length| self.work(length)).collect()
    }

    /// The work on a video, with the spans of the stage that has parts.
    fn work(&self, length_secs: f64) -> VideoWork {
        let secs = |stages: &[StageName]| stages.iter().map(|stage| self.cost(*stage).secs(length_secs)).sum();
        let n_spans = spans::count(length_secs);
        let stages = StageName::OF_VIDEOS;
        match stages.iter().position(|stage| *stage == StageName::Pose2d).filter(|_| n_spans > 1) {
            None => VideoWork { before: self.video_secs(length_secs), span: 0.0, n_spans: 0, after: 0.0 },
            Some(parted) => VideoWork {
                before: secs(&stages[..parted]),
                span: self.cost(StageName::Pose2d).secs(length_secs / n_spans as f64),
                n_spans,
                after: secs(&stages[parted + 1..]),
            },
        }
    }

    /// Hours after which a worker of so many may be ended: twice what the work takes, since machines differ, and half an
    /// hour to begin and for the datasets.
    pub fn limit_hours(&self, lengths: &[f64], workers: usize) -> f64 {
        0.5 + 2.0 * self.wall_secs(lengths, workers) / 3600.0
    }

    /// The fewest workers that are done with videos of these lengths within so many seconds; none: the longest video with a
    /// worker for each of its spans takes longer.
    pub fn workers_within(&self, lengths: &[f64], secs: f64) -> Option<usize> {
        let videos = self.video_work(lengths);
        let most: usize = videos.iter().map(|video| video.n_spans.max(1)).sum();
        let least = (wall_secs(&videos, 1) / secs).floor().max(1.0) as usize;
        (least..=most).find(|workers| wall_secs(&videos, *workers) <= secs)
    }
}

/// Work on one video, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct VideoWork {
    /// Work before the spans that workers share; the total where there are no spans.
    before: f64,
    /// Work on each span.
    span: f64,
    /// Number of spans; 0: one worker processes the video alone.
    n_spans: usize,
    /// Work after the last span.
    after: f64,
}

/// A video that a worker has begun.
struct BegunVideo {
    work: VideoWork,
    /// When its spans can be taken.
    since: f64,
    /// Spans that nobody has taken.
    n_left: usize,
    /// When the last one taken is done.
    ends: f64,
}

impl BegunVideo {
    /// A worker that is free at `now` takes a span; when it is done.
    fn take(&mut self, now: f64) -> f64 {
        self.n_left -= 1;
        let done = now + self.work.span;
        self.ends = self.ends.max(done);
        done
    }
}

/// Seconds until `workers` have worked on all videos. Whoever is free takes the next video and its spans; where no video is
/// left, spans of others.
fn wall_secs(videos: &[VideoWork], workers: usize) -> f64 {
    let n_pieces: usize = videos.iter().map(|video| video.n_spans.max(1)).sum();
    let mut waiting = videos.iter();
    let mut begun: Vec<BegunVideo> = Vec::new();
    // When each worker is free, and the video that it has.
    let mut crew: Vec<(f64, Option<usize>)> = vec![(0.0, None); workers.clamp(1, n_pieces.max(1))];
    let mut wall = 0.0f64;
    while let Some(at) = (0..crew.len()).min_by(|a, b| crew[*a].0.total_cmp(&crew[*b].0)) {
        let (now, own) = crew[at];
        if let Some(idx) = own {
            let video = &mut begun[idx];
            if video.n_left > 0 {
                crew[at].0 = video.take(now);
            } else {
                let done = video.ends + video.work.after;
                wall = wall.max(done);
                crew[at] = (done, None);
            }
        } else if let Some(&work) = waiting.next() {
            let since = now + work.before;
            begun.push(BegunVideo { work, since, n_left: work.n_spans, ends: since });
            crew[at] = (since, Some(begun.len() - 1));
        } else if let Some(video) = begun.iter_mut().find(|video| video.n_left > 0 && video.since <= now) {
            crew[at].0 = video.take(now);
        } else if let Some(later) =
            begun.iter().filter(|video| video.n_left > 0).map(|video| video.since).min_by(f64::total_cmp)
        {
            crew[at].0 = later;
        } else {
            crew.swap_remove(at);
        }
    }
    wall
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
    fn workers_take_the_longest_that_is_left() {
        let (times, lengths) = (times(1.0, 2.0), [10.0, 40.0, 20.0, 10.0]);
        assert_eq!(times.wall_secs(&lengths, 1), 164.0);
        assert_eq!(times.wall_secs(&lengths, 2), 83.0);
        assert_eq!(times.wall_secs(&lengths, 99), 81.0);
        assert_eq!(times.workers_within(&lengths, 83.0), Some(2));
        assert_eq!((times.workers_within(&lengths, 200.0), times.workers_within(&lengths, 80.0)), (Some(1), None));
        assert_eq!(times.limit_hours(&lengths, 2), 0.5 + 2.0 * 83.0 / 3600.0);
        // A long one is shared: ten minutes in five spans.
        assert_eq!(times.wall_secs(&[600.0], 1), 5.0 * 241.0);
        assert_eq!(times.wall_secs(&[600.0], 5), 241.0);
    }

    #[test]
    fn what_is_kept_is_read_again() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(StageTimes::read(dir.path()), None);
        let times = times(0.25, 1.5);
        times.write(dir.path()).unwrap();
        assert_eq!(StageTimes::read(dir.path()), Some(times));
    }

    const LONG: VideoWork = VideoWork { before: 10.0, span: 100.0, n_spans: 3, after: 20.0 };
    const SHORT: VideoWork = VideoWork { before: 40.0, span: 0.0, n_spans: 0, after: 0.0 };

    #[test]
    fn one_worker_takes_the_sum() {
        assert_eq!(wall_secs(&[], 1), 0.0);
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT], 1), 330.0 + 80.0);
    }

    #[test]
    fn spans_wait_for_what_is_before_and_the_rest_for_the_last_span() {
        // 10, then spans 10..110 twice and 110..210, then 20 more.
        assert_eq!(wall_secs(&[LONG], 2), 230.0);
        assert_eq!(wall_secs(&[LONG], 3), 130.0);
        assert_eq!(wall_secs(&[LONG], 99), 130.0);
    }

    #[test]
    fn who_has_no_video_helps() {
        // The second worker has SHORT until 40 and a span until 140; the first spans until 110 and 210.
        assert_eq!(wall_secs(&[LONG, SHORT], 2), 230.0);
        // Two short ones until 80, a span until 180.
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT], 2), 230.0);
        // Four until 160, and the third span until 260; the first is done with the second at 210.
        assert_eq!(wall_secs(&[LONG, SHORT, SHORT, SHORT, SHORT], 2), 280.0);
    }
}
