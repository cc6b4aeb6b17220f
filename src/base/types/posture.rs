//! What a speaker's trunk and head do beside the 49 joints.

use ndarray::{Array2, s};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Angles of trunk and head, frame by frame, in the axes of the motion they belong to, radians; NaN where they are not
/// seen. Both are of the world, not of one against the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture {
    /// [T, 3]: yaw to the person's left, pitch downwards, roll towards the right shoulder. Of the head, 0 when it looks
    /// into the camera as it does in the clip's median.
    pub head: Array2<f32>,
    /// [T, 3]: the same of the trunk, from the hips to the neck; pitch is the lean forward.
    pub trunk: Array2<f32>,
}

/// Part of the body whose angles a posture holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PostureChannel {
    /// Angles of the head.
    Head,
    /// Angles of the trunk.
    Trunk,
}

impl PostureChannel {
    /// Both, in the order in which they are stored.
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
    /// Posture of `n_frames` in which nothing is seen.
    pub fn unseen(n_frames: usize) -> Self {
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

    /// Angles [T, 3] of a channel, to be changed.
    pub fn channel_mut(&mut self, channel: PostureChannel) -> &mut Array2<f32> {
        match channel {
            PostureChannel::Head => &mut self.head,
            PostureChannel::Trunk => &mut self.trunk,
        }
    }

    /// The frames `frames` alone.
    pub fn slice(&self, frames: Range<usize>) -> Self {
        let [head, trunk] = [&self.head, &self.trunk].map(|of| of.slice(s![frames.clone(), ..]).to_owned());
        Self { head, trunk }
    }
}
