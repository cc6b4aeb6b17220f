//! A user's skeleton in a BVH file, and motion written to it; joints, offsets, channels and their order are preserved.

use super::user_rig::{UserJoint, UserRig};
use anyhow::{Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::read::Bvh;
use orator_formats::bvh::skeleton::{BvhSkeleton, JointChannels};

/// Skeleton of a BVH file with the initial values of its channels.
#[derive(Clone, Debug)]
pub struct BvhRig {
    skeleton: BvhSkeleton,
    /// Channel values of the first frame, from which positions of the root and other joints are copied.
    first: Vec<f64>,
}

impl BvhRig {
    /// Reads the skeleton of a file.
    ///
    /// # Errors
    /// A joint does not have three rotation channels about different axes.
    pub fn new(bvh: &Bvh) -> Result<Self> {
        let skeleton = BvhSkeleton::of(bvh);
        skeleton.check()?;
        for joint in skeleton.joints.iter().filter(|joint| !joint.channels.is_empty()) {
            ensure!(
                joint.rotation_order().is_some(),
                "joint {}: expected three rotation channels about different axes",
                joint.name
            );
        }
        let first = bvh.frames().next().map_or_else(|| vec![0.0; skeleton.n_channels()], <[f64]>::to_vec);
        Ok(Self { skeleton, first })
    }

    /// The skeleton at rest: no rotations, joints at their offsets.
    pub fn rig(&self) -> UserRig {
        let joint = |joint: &JointChannels| UserJoint {
            name: joint.name.clone(),
            parent: joint.parent,
            offset: joint.offset,
            rest: Rotation::IDENTITY,
            scale: 1.0,
            scale_error: None,
            moves: !joint.channels.is_empty(),
        };
        let joints = self.skeleton.joints.iter().map(joint).collect();
        UserRig { joints, standing_pose: self.local(&self.first), ..UserRig::default() }
    }

    /// Text of the file with new motion: the local rotations of all joints for each frame.
    pub fn text(&self, fps: FrameRate, frames: impl ExactSizeIterator<Item = Vec<Rotation>>) -> String {
        self.skeleton.to_bvh(fps, frames.map(|local| self.channels(&local)))
    }

    /// Local rotations of all joints for the channel values of a frame.
    pub fn local(&self, values: &[f64]) -> Vec<Rotation> {
        let joints = self.skeleton.joints.iter().zip(self.skeleton.first_channels());
        joints.map(|(joint, first)| joint.rotation(&values[first..]).unwrap_or(Rotation::IDENTITY)).collect()
    }

    fn channels(&self, local: &[Rotation]) -> Vec<f64> {
        let mut values = self.first.clone();
        let joints = self.skeleton.joints.iter().zip(self.skeleton.first_channels());
        joints.zip(local).for_each(|((joint, first), turn)| joint.set_rotation(*turn, &mut values[first..]));
        values
    }
}
