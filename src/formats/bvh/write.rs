//! BVH writer: a skeleton with local rotations over time. The root has six channels, every other joint three, in the
//! order Z X Y; bone ends become `End Site`. The caller chooses the skeleton, axes and units.

use super::read::{Bvh, Channel};
use super::skeleton::{BvhSkeleton, JointChannels};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};
use orator_base::motion::fk::{Joint, Skeleton};
use orator_base::types::time::FrameRate;
use std::fmt::Write as _;
use std::io;

/// Animation of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhClip {
    pub skeleton: Skeleton,
    pub fps: FrameRate,
    /// Rest position of the root.
    pub root: Vec3,
    /// Translation of the root from `root`, per frame; empty if the root does not move.
    pub travel: Vec<Vec3>,
    /// One local rotation per frame and joint; those of bone ends are ignored.
    pub local: Vec<Vec<Rotation>>,
}

impl BvhClip {
    pub fn n_frames(&self) -> usize {
        self.local.len()
    }

    pub fn root_at(&self, frame_idx: usize) -> Vec3 {
        self.travel.get(frame_idx).map_or(self.root, |&translation| add(self.root, translation))
    }

    pub fn positions(&self, frame_idx: usize) -> Vec<Vec3> {
        self.skeleton.positions(self.root_at(frame_idx), &self.local[frame_idx])
    }

    /// Motion resampled to `fps`: cubic rotations that pass through the given frames with continuous velocity, linear
    /// root translation; the last frame is held.
    pub fn resampled(&self, fps: FrameRate) -> Self {
        let n_frames = if self.local.is_empty() { 0 } else { fps.frames_in(self.fps.secs(self.n_frames())) };
        let last = self.n_frames().saturating_sub(1);
        let at = |frame: usize| (fps.secs(frame) * self.fps.per_sec()).min(last as f64);
        let local = (0..n_frames).map(|frame| {
            let at = at(frame);
            let before = at.floor() as usize;
            let neighbours = [before.saturating_sub(1), before, (before + 1).min(last), (before + 2).min(last)];
            let fraction = at - before as f64;
            let between = |joint: usize| Rotation::cubic(neighbours.map(|t| self.local[t][joint]), fraction);
            (0..self.skeleton.joints.len()).map(between).collect()
        });
        let translation = |frame: usize| {
            let (before, fraction) = (at(frame).floor() as usize, at(frame).fract());
            let [from, to] = [before, (before + 1).min(last)].map(|t| self.travel.get(t).copied().unwrap_or_default());
            add(scale(from, 1.0 - fraction), scale(to, fraction))
        };
        let travel = if self.travel.is_empty() { Vec::new() } else { (0..n_frames).map(translation).collect() };
        Self { local: local.collect(), fps, skeleton: self.skeleton.clone(), root: self.root, travel }
    }

    /// The motion as the contents of a file, without rounding, with the joints in their order.
    pub fn to_file(&self) -> Bvh {
        let joint = |joint: &Joint| {
            let parent_name = || joint.parent.map_or("", |parent| self.skeleton.joints[parent].name.as_str());
            let name = if joint.end { format!("{}_end", parent_name()) } else { joint.name.clone() };
            let channels = channels(joint.end, joint.parent.is_none());
            JointChannels { name, parent: joint.parent, offset: joint.offset, channels }
        };
        let joints: Vec<JointChannels> = self.skeleton.joints.iter().map(joint).collect();
        let n_channels = joints.iter().map(|joint| joint.channels.len()).sum();
        let mut values = Vec::with_capacity(self.n_frames() * n_channels);
        for (frame_idx, local) in self.local.iter().enumerate() {
            values.extend(self.root_at(frame_idx));
            let moving = joints.iter().zip(local).filter(|(joint, _)| !joint.channels.is_empty());
            values.extend(moving.flat_map(|(_, rotation)| rotation.euler_zxy_degrees()));
        }
        let (frame_secs, n_frames) = (self.fps.secs(1), self.n_frames());
        Bvh { joints, frame_secs, n_frames, notes: Vec::new(), values, n_channels }
    }

    /// Text of a BVH file. Lengths are rounded to 1e-6 of their unit, angles to 1e-5 degrees.
    pub fn to_bvh(&self) -> String {
        let mut text = Vec::new();
        // Writing to memory cannot fail, and the bytes are valid UTF-8.
        let _ = self.write_bvh(&mut text);
        String::from_utf8(text).unwrap_or_default()
    }

    /// Writes the text of [`Self::to_bvh`] frame by frame.
    pub fn write_bvh(&self, out: &mut dyn io::Write) -> io::Result<()> {
        let order = self.written_order();
        let written_idx = |joint: usize| order.iter().position(|&written| written == joint);
        let joint = |&joint: &usize| {
            let Joint { name, parent, offset, end } = self.skeleton.joints[joint].clone();
            JointChannels {
                name,
                parent: parent.and_then(written_idx),
                offset,
                channels: channels(end, parent.is_none()),
            }
        };
        let written = BvhSkeleton { joints: order.iter().map(joint).collect() };
        let mut text = written.head(self.fps, self.n_frames());
        let moving: Vec<usize> = order.into_iter().filter(|&joint| !self.skeleton.joints[joint].end).collect();
        for (frame_idx, local) in self.local.iter().enumerate() {
            let [x, y, z] = self.root_at(frame_idx);
            let _ = write!(text, "{x:.6} {y:.6} {z:.6}");
            for &joint in &moving {
                let [z, x, y] = local[joint].euler_zxy_degrees();
                let _ = write!(text, " {z:.5} {x:.5} {y:.5}");
            }
            text.push('\n');
            out.write_all(text.as_bytes())?;
            text.clear();
        }
        out.write_all(text.as_bytes())
    }

    /// Joints in depth-first order, in which BVH lists joints and channels.
    fn written_order(&self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.skeleton.joints.len());
        let mut stack: Vec<usize> = (0..self.skeleton.joints.len().min(1)).collect();
        while let Some(joint) = stack.pop() {
            order.push(joint);
            let children: Vec<usize> = self.skeleton.children(joint).collect();
            stack.extend(children.into_iter().rev());
        }
        order
    }
}

fn channels(is_end: bool, is_root: bool) -> Vec<Channel> {
    let positions = if is_root { [0, 1, 2].map(Channel::Position).to_vec() } else { Vec::new() };
    if is_end { Vec::new() } else { [positions, [2, 0, 1].map(Channel::Rotation).to_vec()].concat() }
}
