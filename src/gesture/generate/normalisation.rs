//! Normalised features of generator and discriminator: the coordinates of 48 joints (all but the neck), and optionally
//! the angles of head and trunk, each with mean 0 and standard deviation 1 over the training split; and the conversion
//! back to metres and radians.

use anyhow::ensure;
use ndarray::{Array2, Array3, ArrayView2};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_BONES, N_JOINTS, NECK, R_HAND, R_WRIST, is_duplicate};
use serde::{Deserialize, Serialize};

/// Features of a pose's joints, before those of the channels. Feature `3 * (joint - 1) + k` is coordinate k of a joint.
pub const N_FEATURES: usize = 3 * N_BONES;
/// Smallest standard deviation of a coordinate, metres, so that joints that hardly move are not amplified.
const MIN_STD: f32 = 0.01;
/// Smallest standard deviation of an angle, radians.
const MIN_STD_RADIANS: f32 = 0.01;

/// Mean and standard deviation of every feature, metres, and the speaker's bone lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normalisation {
    pub mean: Vec<f32>,
    pub std: Vec<f32>,
    /// Length of the bone from joint `n + 1` to its parent, metres; 0 if it was never measured.
    pub bone_lengths: Vec<f32>,
    /// Posture channels, three features each, which follow those of the joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<ChannelNormalisation>,
}

/// Mean and standard deviation of the angles of a channel, radians; a deviation of 0 marks an angle that was never
/// visible and is not trained. Angles are not converted to sine and cosine: those of a speaker facing a camera stay far
/// from the jump at half a turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelNormalisation {
    pub channel: PostureChannel,
    pub mean: [f32; 3],
    pub std: [f32; 3],
}

impl ChannelNormalisation {
    /// Normalisation from mean and standard deviation (radians) of the angles; `n_visible` frames show each angle.
    pub fn new(channel: PostureChannel, n_visible: [u64; 3], mean: [f64; 3], std: [f64; 3]) -> Self {
        let std = |k: usize| if n_visible[k] > 0 { (std[k] as f32).max(MIN_STD_RADIANS) } else { 0.0 };
        Self { channel, mean: mean.map(|v| v as f32), std: std::array::from_fn(std) }
    }
}

impl Normalisation {
    /// Normalisation from the statistics of a dataset, [49, 3] each.
    pub fn new(mean: &Array2<f32>, std: &Array2<f32>, bone_lengths: Vec<f32>) -> Self {
        let features = |table: &Array2<f32>| table.iter().skip(3).copied().collect::<Vec<f32>>();
        let std = features(std).into_iter().map(|v| v.max(MIN_STD)).collect();
        Self { mean: features(mean), std, bone_lengths, channels: Vec::new() }
    }

    /// Fails unless the tables have the expected lengths and plausible values, and the channels are sorted and unique.
    pub fn check(&self) -> anyhow::Result<()> {
        let lengths = [self.mean.len(), self.std.len(), self.bone_lengths.len()];
        ensure!(
            lengths == [N_FEATURES, N_FEATURES, N_BONES],
            "invalid normalisation: mean, std and bone lengths have {lengths:?} values"
        );
        let mut metres = self.mean.iter().chain(&self.std).chain(&self.bone_lengths);
        ensure!(metres.all(|v| v.abs() <= 100.0), "invalid normalisation: values beyond 100 m");
        let mut radians = self.channels.iter().flat_map(|channel| channel.mean.into_iter().chain(channel.std));
        ensure!(radians.all(|v| v.abs() <= 100.0), "invalid normalisation: angles beyond 100 rad");
        let positive = |std: &[f32], least: f32| std.iter().all(|v| *v >= least);
        ensure!(positive(&self.std, f32::MIN_POSITIVE), "invalid `normalisation.std`: expected values > 0");
        ensure!(positive(&self.bone_lengths, 0.0), "invalid `normalisation.bone_lengths`: expected values >= 0");
        let of_channels = self.channels.iter().all(|channel| positive(&channel.std, 0.0));
        ensure!(of_channels, "invalid `normalisation.channels`: expected standard deviations >= 0");
        let is_once = self.channels.is_sorted_by(|a, b| a.channel < b.channel);
        ensure!(is_once, "invalid `normalisation.channels`: expected head, trunk, each at most once");
        Ok(())
    }

    /// Length of the bone from joint `n + 1` to its parent, metres; 0: unknown.
    pub fn lengths(&self) -> [f32; N_BONES] {
        std::array::from_fn(|bone| self.bone_lengths.get(bone).copied().unwrap_or(0.0))
    }

    /// Number of features per pose, including those of the channels.
    pub fn n_features(&self) -> usize {
        N_FEATURES + 3 * self.channels.len()
    }

    /// Converts motion [T, 49, 3] to features [144, T] and a mask [48, T] of the joints (all but the neck) to train on:
    /// those that are visible, without the hand roots. Missing features are 0.
    pub fn features(&self, motion: &Motion) -> (Array2<f32>, Array2<bool>) {
        let n_frames = motion.n_frames();
        let mut features = Array2::zeros((N_FEATURES, n_frames));
        let mut mask = Array2::from_elem((N_BONES, n_frames), false);
        for (joint, t) in (1..N_JOINTS).flat_map(|joint| (0..n_frames).map(move |t| (joint, t))) {
            let value = |k: usize| {
                let i = 3 * (joint - 1) + k;
                (motion.joints[[t, joint, k]] - self.mean[i]) / self.std[i]
            };
            let values = [value(0), value(1), value(2)];
            if values.iter().all(|v| v.is_finite()) {
                (0..3).for_each(|k| features[[3 * (joint - 1) + k, t]] = values[k]);
                mask[[joint - 1, t]] = motion.mask[[t, joint]] && !is_duplicate(joint);
            }
        }
        (features, mask)
    }

    /// Like `features`, followed by the channels of `posture`: features [`n_features`, T] and a mask
    /// [48 + 3 x channels, T] of the joints and angles to train on.
    pub fn features_with_channels(&self, motion: &Motion, posture: Option<&Posture>) -> (Array2<f32>, Array2<bool>) {
        let (mut features, mut mask) = self.features(motion);
        let n_frames = motion.n_frames();
        for of in &self.channels {
            let angles = posture.map(|posture| posture.channel(of.channel));
            let value = |k: usize, t: usize| match of.std[k] {
                0.0 => f32::NAN,
                std => angles.map_or(f32::NAN, |angles| (angles[[t, k]] - of.mean[k]) / std),
            };
            let values = Array2::from_shape_fn((3, n_frames), |(k, t)| value(k, t));
            features = stacked(&features, &values.mapv(|v| if v.is_finite() { v } else { 0.0 }));
            mask = stacked(&mask, &values.mapv(f32::is_finite));
        }
        (features, mask)
    }

    /// Angles of the channels in features [`n_features`, T], NaN for untrained ones; `None` if there are no channels.
    pub fn posture(&self, features: ArrayView2<f32>) -> Option<Posture> {
        if self.channels.is_empty() {
            return None;
        }
        let mut posture = Posture::missing(features.ncols());
        for (of, n) in self.channels.iter().zip((N_FEATURES..).step_by(3)) {
            let angle = |(t, k): (usize, usize)| match of.std[k] {
                0.0 => f32::NAN,
                std => features[[n + k, t]] * std + of.mean[k],
            };
            let angles = Array2::from_shape_fn((features.ncols(), 3), angle);
            *posture.channel_mut(of.channel) = angles;
        }
        Some(posture)
    }

    /// Converts features [144, T] to joints [T, 49, 3] in metres, with the neck at 0 and the hand roots at the wrists.
    pub fn joints(&self, features: ArrayView2<f32>) -> Array3<f32> {
        Array3::from_shape_fn((features.ncols(), N_JOINTS, 3), |(t, joint, k)| {
            let joint = match joint {
                NECK => return 0.0,
                L_HAND => L_WRIST,
                R_HAND => R_WRIST,
                other => other,
            };
            let i = 3 * (joint - 1) + k;
            features[[i, t]] * self.std[i] + self.mean[i]
        })
    }
}

/// Stacks the rows of two arrays with equal numbers of columns.
fn stacked<T: Clone>(above: &Array2<T>, below: &Array2<T>) -> Array2<T> {
    let (n, n_below, n_frames) = (above.nrows(), below.nrows(), above.ncols());
    Array2::from_shape_fn((n + n_below, n_frames), |(i, t)| {
        if i < n { above[[i, t]].clone() } else { below[[i - n, t]].clone() }
    })
}
