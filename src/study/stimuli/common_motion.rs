//! Makes the motions of one clip comparable between conditions, so that films differ in the movement only: same bone
//! lengths, a joint is visible only where it is in all conditions, head and trunk only where all conditions have them,
//! same smoothing.

use super::condition_motion::ShownMotion;
use ndarray::{Array2, Array3, Axis, Zip, s};
use orator_avatar::animate::performance::perform_on;
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::animate::{AnimationOptions, Performance};
use orator_base::motion::bones;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::{N_BONES, N_JOINTS};
use orator_formats::mocap::motion_file::DEFAULT_FPS;

/// Visibility shared by all films of one clip.
#[derive(Clone, Debug)]
pub struct CommonVisibility {
    /// Mask [T, 49] of the joints that are visible in every condition.
    joints: Array2<bool>,
    /// Masks [T, 3] of the angles of head and trunk that every condition has.
    angles: [Array2<bool>; 2],
}

impl CommonVisibility {
    /// Intersection of the visibility of these motions, which must have equal lengths; `None` without motions.
    pub fn of(shown: &[&ShownMotion]) -> Option<Self> {
        let (n_frames, n_joints) = shown.first()?.motion.mask.dim();
        let mut joints = Array2::from_elem((n_frames, n_joints), true);
        let mut angles = [(); 2].map(|()| Array2::from_elem((n_frames, 3), true));
        let unseen = Posture::missing(n_frames);
        for ShownMotion { motion, posture, .. } in shown {
            let finite = motion.joints.map_axis(Axis(2), |coordinates| coordinates.iter().all(|v| v.is_finite()));
            Zip::from(&mut joints)
                .and(&motion.mask)
                .and(&finite)
                .for_each(|all, seen, finite| *all &= *seen && *finite);
            let posture = posture.as_ref().unwrap_or(&unseen);
            for (all, channel) in angles.iter_mut().zip(PostureChannel::ALL) {
                all.zip_mut_with(posture.channel(channel), |all, angle| *all &= angle.is_finite());
            }
        }
        Some(Self { joints, angles })
    }

    /// Number of visible joints of all frames.
    pub fn n_visible(&self) -> usize {
        self.joints.iter().filter(|seen| **seen).count()
    }

    /// Performance of a motion at its own rate, restricted to the common visibility and on the common body.
    pub fn performance(&self, shown: &ShownMotion, body: &CommonBody) -> Performance {
        let mut motion = shown.motion.clone();
        for ((frame, joint), seen) in self.joints.indexed_iter() {
            if !seen {
                motion.joints.slice_mut(s![frame, joint, ..]).fill(f32::NAN);
                motion.mask[[frame, joint]] = false;
            }
        }
        bones::with_lengths(&mut motion, &body.lengths);
        let posture = shown.posture.clone().map(|mut posture| {
            for (seen, channel) in self.angles.iter().zip(PostureChannel::ALL) {
                let angles = posture.channel_mut(channel);
                angles.zip_mut_with(seen, |angle, seen| *angle = if *seen { *angle } else { f32::NAN });
            }
            posture
        });
        let is_posed = self.angles.iter().flatten().any(|seen| *seen);
        let posture = posture.filter(|_| is_posed);
        perform_on(body.rig.clone(), &motion, posture.as_ref(), &AnimationOptions::default())
    }
}

/// Body shared by all films of a speaker.
#[derive(Clone, Debug)]
pub struct CommonBody {
    /// Bone lengths, metres; 0 keeps the length of the motion.
    lengths: [f32; N_BONES],
    rig: Rig,
}

impl CommonBody {
    /// Body with the stated bone lengths (metres), or, if none is known, those of the motion with the most measured
    /// bones; rig from all motions together.
    pub fn of(stated: &[f32], shown: &[&ShownMotion]) -> Self {
        let known = |lengths: &[f32; N_BONES]| lengths.iter().filter(|length| **length > 0.0).count();
        let stated = std::array::from_fn(|bone| stated.get(bone).copied().unwrap_or(0.0));
        let measured = shown.iter().map(|shown| bones::measure(&shown.motion)).filter(|_| known(&stated) == 0);
        let lengths =
            measured.fold(stated, |best, lengths| if known(&lengths) > known(&best) { lengths } else { best });
        let mut all = Array3::zeros((0, N_JOINTS, 3));
        let mut fps = DEFAULT_FPS;
        for shown in shown {
            let mut motion = shown.motion.clone();
            bones::with_lengths(&mut motion, &lengths);
            fps = motion.fps;
            // Cannot fail: the shapes match.
            let _ = all.append(Axis(0), motion.joints.view());
        }
        Self { lengths, rig: Rig::from_motion(&Motion::from_joints(fps, all)) }
    }
}
