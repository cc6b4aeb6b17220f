//! Rotations of a VRM humanoid from network output, pose by pose.

use anyhow::Result;
use ndarray::{Array2, Axis, concatenate, s};
use orator_avatar::animate::performance::{AnimationOptions, perform_on};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::rig::rig::{CM, Rig};
use orator_avatar::animate::solve::smoothing::Smoothing;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub};
use orator_base::motion::fk::Joint;
use orator_base::types::skeleton::{L_SHOULDER, R_SHOULDER};
use orator_gesture::generate::model::SpeakerMetadata;
use std::sync::Arc;

/// Number of poses before the current one that are solved with it: where a hand turns far, its rotation follows from
/// earlier poses.
const N_BEFORE: usize = 15;
/// Elbow angle, 0 if straight, from which a pose determines the roll of the upper arm (`solve::roll`).
const BENT_DEGREES: f64 = 20.0;

/// Bone of a humanoid.
#[derive(Clone, Debug, PartialEq)]
pub struct HumanoidBone {
    /// Name in VRM 1.0, such as `leftUpperArm`.
    pub vrm: String,
    /// Name in Unity's `HumanBodyBones`, which VMC uses, such as `LeftUpperArm`.
    pub unity: String,
    /// Position at rest relative to the parent, or to the floor below the hips, metres; y up, facing +z, x to the left of
    /// the body.
    pub offset: Vec3,
}

/// Pose of a humanoid whose rest pose is the T-pose with all rotations 0, as in VRM 1.0.
#[derive(Clone, Debug, PartialEq)]
pub struct HumanoidPose {
    /// Position of the hips, metres; soles at y = 0 at rest.
    pub hips: Vec3,
    /// Rotation of each bone relative to its parent.
    pub rotations: Vec<Rotation>,
}

impl HumanoidPose {
    /// Pose at `share` (0..=1) of the way to `next`.
    pub fn towards(&self, next: &Self, share: f64) -> Self {
        let rotations = self.rotations.iter().zip(&next.rotations).map(|(a, b)| a.slerp(*b, share)).collect();
        Self { hips: add(scale(self.hips, 1.0 - share), scale(next.hips, share)), rotations }
    }
}

/// A body that performs network output.
pub struct LiveBody<'a> {
    metadata: &'a SpeakerMetadata,
    pub rig: Rig,
    pub bones: Arc<[HumanoidBone]>,
    /// Network output of the last poses, [features, up to `N_BEFORE` + 1].
    last: Array2<f32>,
    /// Number of earlier poses, and the last ones of them with a bent left and right elbow, [features, 1]: the roll of a
    /// straight arm follows from them.
    n_left: usize,
    bent: [Option<(usize, Array2<f32>)>; 2],
}

impl<'a> LiveBody<'a> {
    /// Body with the speaker's bone lengths.
    pub fn new(metadata: &'a SpeakerMetadata) -> Self {
        let rest = Array2::zeros((metadata.network.n_out, 1));
        let rig = Rig::from_motion(&metadata.motion(rest.view()));
        let joints = &rig.skeleton.joints;
        let names = [Names::Vrm, Names::UnityHumanoid].map(|names| names.of(&rig.skeleton));
        let [vrm, unity] = names.map(Vec::into_iter);
        let bone = |((joint, vrm), unity)| HumanoidBone { vrm, unity, offset: scale(joint, 1.0 / CM) };
        let offset = |joint: &Joint| if joint.parent.is_some() { joint.offset } else { rig.root };
        let all = joints.iter().map(offset).zip(vrm).zip(unity).map(bone);
        let bones = all.zip(joints).filter(|(_, joint)| !joint.end).map(|(bone, _)| bone).collect();
        Self { metadata, rig, bones, last: Array2::zeros((metadata.network.n_out, 0)), n_left: 0, bent: [None, None] }
    }

    /// Pose for the network output [features, 1], blended with the speaker's mean pose: `weight` 1 is the output alone.
    pub fn pose(&mut self, features: &Array2<f32>, weight: f32) -> Result<HumanoidPose> {
        let column = features * weight;
        let first = self.last.ncols().saturating_sub(N_BEFORE);
        if first > 0 {
            self.remember(self.last.slice(s![.., ..first]).to_owned());
        }
        self.last = concatenate(Axis(1), &[self.last.slice(s![.., first..]), column.view()])?;
        let mut before: Vec<&(usize, Array2<f32>)> = self.bent.iter().flatten().collect();
        before.sort_by_key(|(number, _)| *number);
        let parts: Vec<_> = before.iter().map(|(_, column)| column.view()).chain([self.last.view()]).collect();
        let window = concatenate(Axis(1), &parts)?;
        let motion = self.metadata.motion(window.view());
        let posture = self.metadata.normalisation.posture(window.view());
        let options = AnimationOptions { smoothing: Smoothing::None, ..AnimationOptions::default() };
        let clip = perform_on(self.rig.clone(), &motion, posture.as_ref(), &options).clip;
        let t = clip.n_frames() - 1;
        let travel = clip.travel.get(t).copied().unwrap_or_default();
        let joints = clip.skeleton.joints.iter().zip(&clip.local[t]).filter(|(joint, _)| !joint.end);
        Ok(HumanoidPose {
            hips: scale(add(clip.root, travel), 1.0 / CM),
            rotations: joints.map(|(_, rotation)| *rotation).collect(),
        })
    }

    /// Keeps a pose that leaves the last ones, [features, 1], if an elbow is bent.
    fn remember(&mut self, column: Array2<f32>) {
        let motion = self.metadata.motion(column.view());
        self.n_left += 1;
        for (shoulder, bent) in [L_SHOULDER, R_SHOULDER].into_iter().zip(&mut self.bent) {
            let at = |joint: usize| std::array::from_fn(|axis| f64::from(motion.joints[[0, joint, axis]]));
            let [upper, fore]: [Vec3; 2] = [0, 1].map(|i| sub(at(shoulder + i + 1), at(shoulder + i)));
            let cos = dot(upper, fore) / (norm(upper) * norm(fore)).max(1e-9);
            if cos < BENT_DEGREES.to_radians().cos() {
                *bent = Some((self.n_left, column.clone()));
            }
        }
    }
}
