//! Rotations of a VRM humanoid from network output, pose by pose.

use anyhow::Result;
use ndarray::{Array2, s};
use orator_avatar::animate::performance::{AnimationOptions, perform_on};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::rig::rig::{CM, Rig};
use orator_avatar::animate::solve::smoothing::Smoothing;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};
use orator_base::motion::fk::Joint;
use orator_gesture::generate::model::SpeakerMetadata;
use std::sync::Arc;

/// Number of poses before the current one that are solved with it: where an arm is straight, or a hand turns far, the
/// rotation follows from earlier poses.
const N_BEFORE: usize = 15;

/// Bone of a humanoid.
#[derive(Clone, Debug, PartialEq)]
pub struct HumanoidBone {
    /// Name in VRM 1.0, such as `leftUpperArm`.
    pub vrm: String,
    /// Name in Unity's `HumanBodyBones`, which VMC uses, such as `LeftUpperArm`.
    pub unity: String,
    /// Position at rest, metres, relative to the parent, or to the floor for the hips; y up, facing +z, x to the left of the body.
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
        Self { metadata, rig, bones, last: Array2::zeros((metadata.network.n_out, 0)) }
    }

    /// Pose for the network output [features, 1] with this weight; the rest of it is the mean pose of the speaker.
    pub fn pose(&mut self, features: &Array2<f32>, weight: f32) -> Result<HumanoidPose> {
        let column = features * weight;
        let first = (self.last.ncols() + 1).saturating_sub(N_BEFORE + 1);
        self.last = ndarray::concatenate(ndarray::Axis(1), &[self.last.slice(s![.., first..]), column.view()])?;
        let motion = self.metadata.motion(self.last.view());
        let posture = self.metadata.normalisation.posture(self.last.view());
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
}
