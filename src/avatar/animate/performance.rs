//! Pipeline from joint positions to an animation: the motion is smoothed, solved as rotations of a rig, resampled to
//! the requested rate and clamped to the joint limits. Every exported file is written from its result.

use super::retarget::captured_body::{CapturedBody, CapturedPart};
use super::rig::constraints::{ClampCounter, Clamps, Constraints};
use super::rig::rig::{CM, Rig};
use super::solve::arm::{SolveFilters, rotations};
use super::solve::hand_fit::with_fitted_hands;
use super::solve::legs::Legs;
use super::solve::positions::JointPositions;
use super::solve::smoothing::Smoothing;
use super::solve::track::RotationTrack;
use super::solve::{head, trunk};
use ndarray::{Array2, Array3, ArrayView1};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, scale};
use orator_base::motion::jerk;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, N_HAND_JOINTS, N_JOINTS, NECK, R_HAND, R_SHOULDER};
use orator_base::types::time::FrameRate;
use orator_formats::bvh::write::BvhClip;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// Largest share of clamped finger angles of a clip with usable fingers; clips of real hands have at most 10 %.
pub const MAX_FINGER_CLAMPS: f64 = 0.25;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnimationOptions {
    pub smoothing: Smoothing,
    /// Joint limits to apply.
    pub constraints: Constraints,
    pub yaw: Yaw,
    /// Treatment of the lower body.
    pub legs: Legs,
    /// Whether the chest breathes; joint positions relative to the neck do not change.
    pub breath: bool,
    /// Frame rate of the output; `None` for the rate of the motion.
    pub fps: Option<FrameRate>,
}

/// Treatment of the shoulders' yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Yaw {
    /// Yaw turns the spine and the chest.
    #[default]
    Spine,
    /// Yaw is removed: the rig always faces +z.
    Removed,
}

/// Statistics of the processing of a motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AnimationReport {
    pub n_frames: usize,
    /// Jerk of the arms at the motion's own rate, over frames in which they were detected.
    pub arms: Jerk,
    /// Jerk of the fingers relative to their wrist.
    pub hands: Jerk,
    /// Clamps by kind of the unsmoothed joints, at the motion's own rate.
    pub clamps: Vec<Clamps>,
    /// Number of frames in which the head was detected; `None` without a posture.
    pub face_frames: Option<usize>,
    /// Share of the finger angles that exceeded their limits, and whether it is above [`MAX_FINGER_CLAMPS`].
    pub finger_clamps: f64,
    pub fingers_unusable: bool,
    /// Number of frames in which each limb was detected.
    pub detected: DetectedFrames,
    /// Joints that were detected, [T, 49], at the motion's own rate.
    #[serde(skip)]
    pub visible: Array2<bool>,
    /// Parts that move as in the capture the motion was read from.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub captured: Vec<CapturedPart>,
}

/// Number of frames, at the motion's rate, in which a body part was detected; in all others it is interpolated or held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DetectedFrames {
    /// Shoulder, elbow and wrist.
    pub left_arm: usize,
    /// Shoulder, elbow and wrist.
    pub right_arm: usize,
    /// At least half of the hand's joints.
    pub left_hand: usize,
    /// At least half of the hand's joints.
    pub right_hand: usize,
}

impl DetectedFrames {
    /// Counts the frames of `visible` [T, 49].
    fn count(visible: &Array2<bool>) -> Self {
        let [left_arm, right_arm, left_hand, right_hand] =
            LIMBS.each_ref().map(|limb| visible.outer_iter().filter(|frame| limb.is_visible(frame.view())).count());
        Self { left_arm, right_arm, left_hand, right_hand }
    }
}

/// A limb, which is visible if at least `min_joints` of its joints are.
struct DetectedLimb {
    name: &'static str,
    joints: Range<usize>,
    min_joints: usize,
}

static LIMBS: [DetectedLimb; 4] = [
    DetectedLimb { name: "left arm", joints: L_SHOULDER..L_SHOULDER + 3, min_joints: 3 },
    DetectedLimb { name: "right arm", joints: R_SHOULDER..R_SHOULDER + 3, min_joints: 3 },
    DetectedLimb { name: "left hand", joints: L_HAND + 1..L_HAND + N_HAND_JOINTS, min_joints: N_HAND_JOINTS / 2 },
    DetectedLimb { name: "right hand", joints: R_HAND + 1..R_HAND + N_HAND_JOINTS, min_joints: N_HAND_JOINTS / 2 },
];

impl DetectedLimb {
    fn is_visible(&self, frame: ArrayView1<bool>) -> bool {
        self.joints.clone().filter(|&joint| frame[joint]).count() >= self.min_joints
    }
}

impl AnimationReport {
    /// Visible joints [49] in a frame of a clip that has `n_frames` frames for the complete motion.
    fn frame(&self, frame_idx: usize, n_frames: usize) -> Option<ArrayView1<'_, bool>> {
        let last = self.visible.nrows().checked_sub(1)?;
        Some(self.visible.row((frame_idx * (last + 1) / n_frames.max(1)).min(last)))
    }

    /// Limbs that were not detected in a frame of a clip that has `n_frames` frames for the complete motion.
    pub fn hidden_limbs(&self, frame_idx: usize, n_frames: usize) -> Vec<&'static str> {
        let Some(frame) = self.frame(frame_idx, n_frames) else { return Vec::new() };
        LIMBS.iter().filter(|limb| !limb.is_visible(frame)).map(|limb| limb.name).collect()
    }

    /// Frames [start, end) in which each limb was not detected, in a clip of `n_frames` frames; others are left out.
    pub fn hidden_ranges(&self, n_frames: usize) -> BTreeMap<&'static str, Vec<[usize; 2]>> {
        let mut hidden = BTreeMap::<&'static str, Vec<[usize; 2]>>::new();
        for frame_idx in 0..n_frames {
            for limb in self.hidden_limbs(frame_idx, n_frames) {
                let ranges = hidden.entry(limb).or_default();
                match ranges.last_mut() {
                    Some([_, end]) if *end == frame_idx => *end += 1,
                    _ => ranges.push([frame_idx, frame_idx + 1]),
                }
            }
        }
        hidden
    }
}

/// Mean norm of the third derivative, m/s^3; `None` if no four consecutive frames were detected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Jerk {
    /// Jerk of the input motion.
    pub before: Option<f64>,
    /// Jerk of the motion on the rig.
    pub after: Option<f64>,
}

#[derive(Clone, Debug)]
pub struct Performance {
    /// The skeleton with its bone lengths.
    pub rig: Rig,
    pub clip: BvhClip,
    pub report: AnimationReport,
}

/// Animates a motion on a rig of its lengths; a `posture` turns head and trunk without moving joints from the neck.
///
/// Joint limits are applied before directions are smoothed, so that a misplaced joint does not distort neighbouring
/// frames, and again after smoothing and at the output rate, so that they hold in every written frame. Noise of hands
/// is reduced before, since limits would add to the error of noisy fingers; the report counts the input's angles.
pub fn perform(motion: &Motion, posture: Option<&Posture>, options: &AnimationOptions) -> Performance {
    perform_on(Rig::from_motion(motion), motion, posture, options)
}

/// Animates a motion as [`perform`] does, with the head, trunk and legs of the capture that it was read from, which are
/// neither smoothed nor limited.
pub fn perform_captured(motion: &Motion, body: &CapturedBody, options: &AnimationOptions) -> Performance {
    let mut rig = Rig::from_motion(motion);
    body.fit(&mut rig);
    animate(rig, motion, None, Some(body), options)
}

/// Animates a motion on a given rig, for example one shared by several motions of a speaker.
pub fn perform_on(rig: Rig, motion: &Motion, posture: Option<&Posture>, options: &AnimationOptions) -> Performance {
    animate(rig, motion, posture, None, options)
}

fn animate(
    rig: Rig,
    motion: &Motion,
    posture: Option<&Posture>,
    body: Option<&CapturedBody>,
    options: &AnimationOptions,
) -> Performance {
    let clip_of = |tracks: &[RotationTrack]| {
        let local = (0..motion.n_frames()).map(|t| tracks.iter().map(|track| track[t]).collect()).collect();
        BvhClip { root: rig.root, travel: Vec::new(), skeleton: rig.skeleton.clone(), fps: motion.fps, local }
    };
    let constrained = |mut clip: BvhClip, counter: &mut ClampCounter| {
        clip.local.iter_mut().for_each(|frame| options.constraints.apply(&rig, frame, counter));
        clip
    };
    let mut counter = ClampCounter::default();
    let filters = SolveFilters::new(options.smoothing, motion.fps);
    let mut positions = with_fitted_hands(JointPositions::from_motion(motion), &filters.fingers);
    if options.constraints != Constraints::NONE {
        let limited = |positions: &JointPositions, counter: &mut ClampCounter| {
            let unfiltered = SolveFilters::new(Smoothing::None, motion.fps);
            constrained(clip_of(&rotations(positions, &rig, &unfiltered)), counter)
        };
        limited(&JointPositions::from_motion(motion), &mut counter);
        let within = limited(&positions, &mut ClampCounter::default());
        let frames: Vec<Vec<Vec3>> = (0..within.n_frames()).map(|t| within.positions(t)).collect();
        positions = positions.with_positions(|t, joint| scale(frames[t][rig.positions[joint]], 1.0 / CM));
    }
    let mut tracks = rotations(&positions, &rig, &filters);
    let face_frames = posture.map(|posture| head::turn(posture, &rig, &filters, &mut tracks));
    if options.yaw == Yaw::Removed {
        for joint in [rig.spine, rig.chest] {
            tracks[joint].fill(Rotation::IDENTITY);
        }
    }
    let mut free = clip_of(&tracks);
    match body {
        Some(body) => body.apply(&rig, &mut free),
        None => trunk::turn(posture, options.legs, options.breath, &rig, &filters, &mut free),
    }
    let captured = body.map(CapturedBody::parts).unwrap_or_default();
    let resampled = options.fps.filter(|&fps| fps != motion.fps).map(|fps| free.resampled(fps));
    let planted = |clip: BvhClip| {
        let mut clip = constrained(clip, &mut ClampCounter::default());
        if !captured.contains(&CapturedPart::Legs) {
            options.legs.plant(&rig, &mut clip);
        }
        clip
    };
    let (resampled, clip) = (resampled.map(planted), planted(free));

    let after = joints(&rig, &clip);
    let jerk = |joints: &[(usize, usize)]| {
        let of = |positions: &Array3<f32>| {
            jerk::mean(positions.view(), finite_joints(motion).view(), motion.fps.per_sec(), joints)
        };
        Jerk { before: of(&motion.joints), after: of(&after) }
    };
    let arms = [R_SHOULDER, L_SHOULDER].into_iter().flat_map(|shoulder| (shoulder..shoulder + 3).map(|j| (j, NECK)));
    let hands = [R_HAND, L_HAND].into_iter().flat_map(|root| (root + 1..root + 21).map(move |j| (j, root)));
    let (visible, finger_clamps) = (detected_joints(motion), counter.finger_share());
    let report = AnimationReport {
        n_frames: motion.n_frames(),
        arms: jerk(&arms.collect::<Vec<_>>()),
        hands: jerk(&hands.collect::<Vec<_>>()),
        clamps: if options.constraints == Constraints::NONE { Vec::new() } else { counter.clamps() },
        face_frames,
        finger_clamps,
        fingers_unusable: finger_clamps > MAX_FINGER_CLAMPS,
        detected: DetectedFrames::count(&visible),
        visible,
        captured,
    };
    Performance { clip: resampled.unwrap_or(clip), rig, report }
}

impl Performance {
    /// The performance at another rate: rotations are interpolated spherically, existing frames are unchanged.
    pub fn resampled(&self, fps: FrameRate) -> Self {
        Self { rig: self.rig.clone(), clip: self.clip.resampled(fps), report: self.report.clone() }
    }

    /// Joints [T, 49, 3] of the rig (metres, axes of `types::skeleton`, neck at the origin) at the clip's rate; the
    /// mask has the joints that were detected.
    pub fn motion(&self) -> Motion {
        let mut motion = Motion::from_joints(self.clip.fps, joints(&self.rig, &self.clip));
        let n_frames = motion.n_frames();
        for (frame_idx, mut mask) in motion.mask.outer_iter_mut().enumerate() {
            if let Some(visible) = self.report.frame(frame_idx, n_frames) {
                mask.assign(&visible);
            }
        }
        motion
    }
}

fn joints(rig: &Rig, clip: &BvhClip) -> Array3<f32> {
    let mut joints = Array3::zeros((clip.n_frames(), N_JOINTS, 3));
    for (frame_idx, mut frame) in joints.outer_iter_mut().enumerate() {
        let positions = clip.positions(frame_idx);
        let neck = positions[rig.positions[NECK]];
        for (joint, &index) in rig.positions.iter().enumerate() {
            for (axis, sign) in [1.0, -1.0, -1.0].into_iter().enumerate() {
                frame[[joint, axis]] = (sign * (positions[index][axis] - neck[axis]) / 100.0) as f32;
            }
        }
    }
    joints
}

/// Mask [T, 49] of the joints with finite coordinates, detected or filled.
fn finite_joints(motion: &Motion) -> Array2<bool> {
    motion.joints.map_axis(ndarray::Axis(2), |position| position.iter().all(|v| v.is_finite()))
}

/// Mask [T, 49] of the joints that were detected: with finite coordinates, and not filled.
fn detected_joints(motion: &Motion) -> Array2<bool> {
    let mut detected = finite_joints(motion);
    for (at, is_detected) in detected.indexed_iter_mut() {
        *is_detected &= motion.mask.get(at).is_none_or(|&is_visible| is_visible);
    }
    detected
}
