//! Statistics file `stats.json`. Means and standard deviations are those of visible joints in the training split;
//! seconds and windows are counted over all splits.

use super::joint_stats::JointMoments;
use super::write::entry::VideoEntry;
use super::{STRIDE_FRAMES, WINDOW_FRAMES};
use anyhow::{Result, ensure};
use ndarray::Array2;
use orator_base::stage::ledger::WordCount;
use orator_base::types::interval::Interval;
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::split::Split;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Largest plausible magnitude of a coordinate or angle, metres or radians.
const MAX_MAGNITUDE: f64 = 1000.0;

/// Contents of `stats.json`. Rows are joints, columns x, y, z in metres; the row of a joint that is never visible is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetStats {
    /// Number of frames of the training split in which each joint is visible.
    #[serde(rename = "n_seen")]
    pub n_visible: Vec<u64>,
    pub mean: Vec<[f64; 3]>,
    /// Population standard deviation.
    pub std: Vec<[f64; 3]>,
    pub min: Vec<[f64; 3]>,
    pub max: Vec<[f64; 3]>,
    pub windows: WindowCount,
    pub footage: FootageCount,
    /// Statistics of the angles of head and trunk; `None`: no sample has angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posture: Option<BTreeMap<PostureChannel, AngleStats>>,
}

/// Statistics of the angles (yaw, pitch, roll) of head or trunk in the training split, radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AngleStats {
    /// Number of frames in which each angle is visible.
    #[serde(rename = "n_seen")]
    pub n_visible: [u64; 3],
    pub mean: [f64; 3],
    /// Population standard deviation.
    pub std: [f64; 3],
    pub min: [f64; 3],
    pub max: [f64; 3],
}

/// Number of windows in each split.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WindowCount {
    pub n_frames: usize,
    pub stride: usize,
    /// Windows at `stride`, by split.
    pub strided: BTreeMap<String, usize>,
    /// Windows without overlap, by split.
    pub apart: BTreeMap<String, usize>,
}

/// Seconds of the speaker's footage; `accepted_secs`, `rejected_secs` and `failed_secs` add up to `secs`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FootageCount {
    pub n_videos: usize,
    pub n_intervals: usize,
    pub secs: f64,
    #[serde(rename = "kept_secs")]
    pub accepted_secs: f64,
    #[serde(rename = "refused_secs")]
    pub rejected_secs: BTreeMap<String, f64>,
    pub failed_secs: f64,
    /// Number of videos that failed before their length was known.
    pub n_of_unknown_length: usize,
    /// Seconds of silence appended where the sound ended before the motion.
    pub padded_sound_secs: f64,
    /// Word counts of the transcripts; `None`: no transcripts were requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<WordCount>,
}

impl DatasetStats {
    /// Mean of each joint coordinate, [49, 3], metres.
    pub fn mean(&self) -> Array2<f32> {
        table(&self.mean)
    }

    /// Standard deviation of each joint coordinate, [49, 3], metres; 0 for the neck and joints that are never visible.
    pub fn std(&self) -> Array2<f32> {
        table(&self.std)
    }

    /// Checks the tables.
    ///
    /// # Errors
    /// A table without one row per joint, values out of range, negative standard deviations.
    pub(crate) fn check(&self) -> Result<()> {
        ensure!(self.n_visible.len() == N_JOINTS, "`n_seen` has {} rows, expected {N_JOINTS}", self.n_visible.len());
        let tables = [("mean", &self.mean), ("std", &self.std), ("min", &self.min), ("max", &self.max)];
        for (name, rows) in tables {
            ensure!(rows.len() == N_JOINTS, "`{name}` has {} rows, expected {N_JOINTS}", rows.len());
            check_numbers(name, rows.iter().flatten())?;
        }
        for (channel, AngleStats { mean, std, .. }) in self.posture.iter().flatten() {
            for (table, angles) in [("mean", mean), ("std", std)] {
                let field = format!("posture.{}.{table}", channel.name());
                check_numbers(&field, angles.iter())?;
            }
        }
        Ok(())
    }
}

/// Checks the values of the field `name`, metres or radians; those of a field that ends in `std` must not be negative.
fn check_numbers<'a>(name: &str, mut numbers: impl Iterator<Item = &'a f64>) -> Result<()> {
    let lower_bound = if name.ends_with("std") { 0.0 } else { -MAX_MAGNITUDE };
    let invalid = numbers.find(|number| !(lower_bound..=MAX_MAGNITUDE).contains(*number));
    ensure!(
        invalid.is_none(),
        "`{name}` contains {:?}, expected {lower_bound} to {MAX_MAGNITUDE}",
        invalid.unwrap_or(&0.0)
    );
    Ok(())
}

fn table(rows: &[[f64; 3]]) -> Array2<f32> {
    Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| rows.get(joint).map_or(0.0, |row| row[k] as f32))
}

/// Accumulator of the statistics over the videos of a dataset.
pub struct StatsCollector {
    moments: JointMoments,
    posture: Option<JointMoments>,
    windows: WindowCount,
    footage: FootageCount,
}

impl Default for StatsCollector {
    fn default() -> Self {
        let zeros = || Split::ALL.map(|split| (split.name().to_owned(), 0)).into();
        let (strided, apart) = (zeros(), zeros());
        let windows = WindowCount { n_frames: WINDOW_FRAMES, stride: STRIDE_FRAMES, strided, apart };
        Self { moments: JointMoments::default(), posture: None, windows, footage: FootageCount::default() }
    }
}

impl StatsCollector {
    pub fn push(&mut self, entry: &VideoEntry) {
        // The moments of a video in several splits are those of its training samples.
        let is_training = entry.split.map_or(!entry.samples.is_empty(), |split| split == Split::Train);
        if is_training {
            self.moments.merge(&entry.moments);
        }
        if let Some(posture) = &entry.posture {
            let moments = self.posture.get_or_insert_with(JointMoments::of_posture);
            if is_training {
                moments.merge(posture);
            }
        }
        for sample in &entry.samples {
            let interval = Interval { start: 0, end: sample.n_frames };
            let add = |counts: &mut BTreeMap<String, usize>, n| {
                *counts.entry(sample.split.name().to_owned()).or_default() += n;
            };
            add(&mut self.windows.strided, interval.n_windows(WINDOW_FRAMES, STRIDE_FRAMES));
            add(&mut self.windows.apart, interval.n_windows(WINDOW_FRAMES, WINDOW_FRAMES));
        }
        let footage = &mut self.footage;
        footage.n_videos += 1;
        footage.n_intervals += entry.samples.len();
        footage.secs += entry.ledger.duration_secs;
        footage.accepted_secs += entry.ledger.accepted_secs();
        footage.failed_secs += entry.ledger.failed_secs();
        footage.n_of_unknown_length += usize::from(entry.ledger.duration_secs == 0.0 && entry.failure.is_some());
        footage.padded_sound_secs += entry.padded_sound_secs;
        if let Some(words) = &entry.ledger.words {
            *footage.words.get_or_insert_default() += words.count;
        }
        for (reason, secs) in entry.ledger.rejected_secs() {
            *footage.rejected_secs.entry(reason).or_default() += secs;
        }
    }

    pub fn finish(self) -> DatasetStats {
        let std = self.moments.std();
        let JointMoments { n_visible, mean, min, max, .. } = self.moments;
        let posture = self.posture.map(|moments| {
            let std = moments.std();
            let of = |(channel, first): (PostureChannel, usize)| {
                let angles = |rows: &[[f64; 3]]| std::array::from_fn(|k| rows[first + k][0]);
                let (mean, std) = (angles(&moments.mean), angles(&std));
                let n_visible = std::array::from_fn(|k| moments.n_visible[first + k]);
                (channel, AngleStats { n_visible, mean, std, min: angles(&moments.min), max: angles(&moments.max) })
            };
            PostureChannel::ALL.into_iter().zip([0, 3]).map(of).collect()
        });
        DatasetStats { n_visible, mean, std, min, max, windows: self.windows, footage: self.footage, posture }
    }
}
