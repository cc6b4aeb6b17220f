//! Posture of a speaker's trunk and head, which are not part of the 49 joints.

use ndarray::{Array2, s};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Angles of trunk and head per frame, in the axes of the corresponding motion, radians; NaN if not visible. Both are
/// absolute, not relative to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture {
    /// [T, 3]: yaw to the person's left, pitch downwards, roll towards the right shoulder; 0 for the head's median
    /// orientation in the clip, which is taken as looking into the camera.
    pub head: Array2<f32>,
    /// [T, 3]: yaw, pitch and roll of the trunk, from the hips to the neck; pitch is the forward lean.
    pub trunk: Array2<f32>,
}

/// Body part whose angles a posture contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PostureChannel {
    Head,
    Trunk,
}

impl PostureChannel {
    /// All channels, in the order in which they are stored.
    pub const ALL: [Self; 2] = [Self::Head, Self::Trunk];

    /// Name in files and in the configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Trunk => "trunk",
        }
    }
}

impl Posture {
    /// Creates a posture of `n_frames` in which nothing is visible.
    pub fn missing(n_frames: usize) -> Self {
        let nothing = Array2::from_elem((n_frames, 3), f32::NAN);
        Self { head: nothing.clone(), trunk: nothing }
    }

    /// Angles [T, 3] of a channel.
    pub fn channel(&self, channel: PostureChannel) -> &Array2<f32> {
        match channel {
            PostureChannel::Head => &self.head,
            PostureChannel::Trunk => &self.trunk,
        }
    }

    /// Mutable angles [T, 3] of a channel.
    pub fn channel_mut(&mut self, channel: PostureChannel) -> &mut Array2<f32> {
        match channel {
            PostureChannel::Head => &mut self.head,
            PostureChannel::Trunk => &mut self.trunk,
        }
    }

    pub fn slice(&self, frames: Range<usize>) -> Self {
        let [head, trunk] = [&self.head, &self.trunk].map(|of| of.slice(s![frames.clone(), ..]).to_owned());
        Self { head, trunk }
    }
}
