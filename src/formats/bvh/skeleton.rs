//! The skeleton of a BVH file (joints, offsets and channels), stored so that other motion can be written with it.

use super::read::{Bvh, Channel, Positions};
use anyhow::{Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// A joint, or an end site, which has no channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointChannels {
    pub name: String,
    pub parent: Option<usize>,
    /// Offset from the parent, in the file's unit.
    pub offset: Vec3,
    pub channels: Vec<Channel>,
}

impl JointChannels {
    /// Axes of the rotation channels in channel order; `None` unless there are exactly three about different axes.
    pub fn rotation_order(&self) -> Option<[usize; 3]> {
        let axes: Vec<usize> = self
            .channels
            .iter()
            .filter_map(|channel| match channel {
                Channel::Rotation(axis) => Some(*axis),
                Channel::Position(_) => None,
            })
            .collect();
        let order: [usize; 3] = axes.try_into().ok()?;
        (order[0] != order[1] && order[1] != order[2] && order[0] != order[2]).then_some(order)
    }

    /// Rotation for the channel values at the start of `values`; `None` if [`Self::rotation_order`] is.
    pub fn rotation(&self, values: &[f64]) -> Option<Rotation> {
        let rotation_channels =
            self.channels.iter().zip(values).filter(|(channel, _)| matches!(channel, Channel::Rotation(_)));
        let mut angles = rotation_channels.map(|(_, degrees)| degrees.to_radians());
        Some(Rotation::from_euler(self.rotation_order()?, std::array::from_fn(|_| angles.next().unwrap_or(0.0))))
    }

    /// Writes a rotation to the channel values at the start of `values`.
    pub fn set_rotation(&self, turn: Rotation, values: &mut [f64]) {
        let angles = self.rotation_order().map(|order| turn.euler(order));
        let rotation_channels =
            self.channels.iter().zip(values).filter(|(channel, _)| matches!(channel, Channel::Rotation(_)));
        rotation_channels.zip(angles.into_iter().flatten()).for_each(|((_, value), angle)| *value = angle.to_degrees());
    }
}

/// Joints in the order of the file, parents before children.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct BvhSkeleton {
    pub joints: Vec<JointChannels>,
}

impl BvhSkeleton {
    pub fn of(bvh: &Bvh) -> Self {
        Self { joints: bvh.joints.clone() }
    }

    /// Number of channel values per frame.
    pub fn n_channels(&self) -> usize {
        self.joints.iter().map(|joint| joint.channels.len()).sum()
    }

    /// Index of each joint's first channel in a frame.
    pub fn first_channels(&self) -> Vec<usize> {
        let mut next = 0;
        self.joints
            .iter()
            .map(|joint| {
                next += joint.channels.len();
                next - joint.channels.len()
            })
            .collect()
    }

    /// Checks that the joints form a tree with parents before children, finite offsets and valid channels, as in BVH.
    pub fn check(&self) -> Result<()> {
        for (at, joint) in self.joints.iter().enumerate() {
            ensure!(
                joint.parent.is_none() == (at == 0),
                "joint {}: expected exactly one root, as the first joint",
                joint.name
            );
            ensure!(joint.parent.is_none_or(|parent| parent < at), "joint {}: the parent comes after it", joint.name);
            ensure!(joint.offset.iter().all(|v| v.is_finite()), "joint {}: the offset is not finite", joint.name);
            let axis = |channel: &Channel| match channel {
                Channel::Position(axis) | Channel::Rotation(axis) => *axis,
            };
            ensure!(
                joint.channels.iter().all(|channel| axis(channel) < 3),
                "joint {}: a channel has an axis other than x, y and z",
                joint.name
            );
            ensure!(!joint.name.contains(char::is_whitespace), "joint {:?}: the name contains a space", joint.name);
        }
        Ok(())
    }

    /// Joint positions for a frame's channel values, in the file's unit; position channels are added to the offset.
    pub fn positions(&self, frame: &[f64]) -> Vec<Vec3> {
        joint_positions(&self.joints, frame, Positions::Add)
    }

    /// BVH file with this skeleton and the channel values of `frames`.
    pub fn to_bvh(&self, fps: FrameRate, frames: impl ExactSizeIterator<Item: AsRef<[f64]>>) -> String {
        let mut text = self.head(fps, frames.len());
        for frame in frames {
            let numbers: Vec<String> = frame.as_ref().iter().map(|value| format!("{value:.6}")).collect();
            text.push_str(&numbers.join(" "));
            text.push('\n');
        }
        text
    }

    /// Text of the file before the values of its first frame.
    pub(super) fn head(&self, fps: FrameRate, n_frames: usize) -> String {
        let mut text = String::from("HIERARCHY\n");
        let mut open: Vec<usize> = Vec::new();
        for (at, joint) in self.joints.iter().enumerate() {
            while open.last().copied() != joint.parent && open.pop().is_some() {
                let _ = writeln!(text, "{}}}", "\t".repeat(open.len()));
            }
            let indent = "\t".repeat(open.len());
            let is_end = joint.channels.is_empty() && at > 0;
            let title = match (at, is_end) {
                (0, _) => format!("ROOT {}", joint.name),
                (_, true) => "End Site".to_owned(),
                (_, false) => format!("JOINT {}", joint.name),
            };
            let [x, y, z] = joint.offset;
            let _ = writeln!(text, "{indent}{title}\n{indent}{{\n{indent}\tOFFSET {x:.6} {y:.6} {z:.6}");
            if !is_end {
                let names: Vec<String> = joint.channels.iter().map(channel_name).collect();
                let _ = writeln!(text, "{indent}\tCHANNELS {} {}", names.len(), names.join(" "));
            }
            open.push(at);
        }
        while open.pop().is_some() {
            let _ = writeln!(text, "{}}}", "\t".repeat(open.len()));
        }
        let _ = write!(text, "MOTION\nFrames: {n_frames}\nFrame Time: {:.8}\n", 1.0 / fps.per_sec());
        text
    }
}

/// Positions of joints, in which parents precede children, for the channel values of a frame, in the file's unit.
pub(super) fn joint_positions(joints: &[JointChannels], frame: &[f64], positions: Positions) -> Vec<Vec3> {
    let mut global_rotations = vec![Rotation::IDENTITY; joints.len()];
    let mut global_positions = vec![[0.0; 3]; joints.len()];
    let mut values = frame.iter();
    for (at, joint) in joints.iter().enumerate() {
        let (mut step, mut turn) = (joint.offset, Rotation::IDENTITY);
        for (channel, &value) in joint.channels.iter().zip(values.by_ref()) {
            match *channel {
                Channel::Position(axis) if positions == Positions::Replace => step[axis] = value,
                Channel::Position(axis) => step[axis] += value,
                Channel::Rotation(axis) => {
                    let mut about = [0.0; 3];
                    about[axis] = 1.0;
                    turn = turn * Rotation::about(about, value.to_radians());
                }
            }
        }
        (global_rotations[at], global_positions[at]) = match joint.parent {
            Some(parent) => (
                global_rotations[parent] * turn,
                vec3::add(global_positions[parent], global_rotations[parent].turn(step)),
            ),
            None => (turn, step),
        };
    }
    global_positions
}

fn channel_name(channel: &Channel) -> String {
    let (axis, kind) = match channel {
        Channel::Position(axis) => (axis, "position"),
        Channel::Rotation(axis) => (axis, "rotation"),
    };
    format!("{}{kind}", ["X", "Y", "Z"][*axis])
}
