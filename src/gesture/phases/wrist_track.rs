//! Position of a wrist relative to the trunk. The axes of the trunk are the line of the shoulders, smoothed over time
//! because its noise would be multiplied by the length of the arm, and the vertical direction.

use ndarray::Array3;
use orator_base::math::gaussian::gaussian;
use orator_base::math::order;
use orator_base::math::vec3::{Vec3, cross, dot, norm, scale, sub, unit};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{ARMS, Side};
use orator_base::types::time::FrameRate;

/// The sides with their names.
pub const HANDS: [(Side, &str); 2] = [(Side::Left, "left"), (Side::Right, "right")];
/// Standard deviation of the Gaussian that smooths the line of the shoulders, seconds.
const SHOULDERS_SIGMA_SECS: f64 = 0.35;
/// Longest run of frames in which the wrist was not detected but filled, seconds; a longer one counts as missing.
const MAX_FILLED_SECS: f64 = 0.25;
/// Length of upper arm and forearm, metres, if no frame shows them.
pub(super) const ARM_METRES: f64 = 0.54;

/// Wrist of one hand in an interval of motion.
#[derive(Clone, Debug, PartialEq)]
pub struct WristTrack {
    pub fps: FrameRate,
    /// Position by frame, metres from the midpoint of the shoulders: to the left, down, backwards; `None`: missing.
    pub(super) positions: Vec<Option<Vec3>>,
    /// Whether the wrist was detected in the frame.
    pub(super) is_visible: Vec<bool>,
    /// Median length of upper arm and forearm, metres; `None`: no frame shows them.
    pub(super) arm_metres: Option<f64>,
}

impl WristTrack {
    /// Track of the hand on `side` in joints [T, 49, 3], metres. Frames without the wrist or a shoulder are missing, as
    /// are runs of more than 0.25 s in which the wrist is masked.
    pub fn new(motion: &Motion, side: Side) -> Self {
        let [right, left] = ARMS;
        let [shoulder, elbow, wrist] = if side == Side::Right { right } else { left };
        let n_frames = motion.n_frames();
        let joint =
            |t: usize, joint: usize| -> Vec3 { std::array::from_fn(|k| f64::from(motion.joints[[t, joint, k]])) };
        let mut across = Array3::<f32>::zeros((n_frames, 1, 3));
        for t in 0..n_frames {
            let line = sub(joint(t, left[0]), joint(t, right[0]));
            // All coordinates of a missing frame are missing, because each is smoothed separately.
            let is_finite = line.iter().all(|v| v.is_finite());
            (0..3).for_each(|k| across[[t, 0, k]] = if is_finite { line[k] as f32 } else { f32::NAN });
        }
        gaussian(across.view_mut(), SHOULDERS_SIGMA_SECS * motion.fps.per_sec());
        let position = |t: usize| {
            let x = unit(std::array::from_fn(|k| f64::from(across[[t, 0, k]])), 1e-6)?;
            let z = unit(cross(x, [0.0, 1.0, 0.0]), 1e-6)?;
            let [a, b] = [left[0], right[0]].map(|shoulder| joint(t, shoulder));
            let from_middle = sub(joint(t, wrist), scale(std::array::from_fn(|k| a[k] + b[k]), 0.5));
            let position = [x, cross(z, x), z].map(|axis| dot(from_middle, axis));
            position.iter().all(|v| v.is_finite()).then_some(position)
        };
        let is_visible: Vec<bool> = (0..n_frames).map(|t| motion.mask[[t, wrist]]).collect();
        let mut positions: Vec<Option<Vec3>> = (0..n_frames).map(position).collect();
        let mut start = 0;
        for run in is_visible.chunk_by(|a, b| a == b) {
            if !run[0] && motion.fps.secs(run.len()) > MAX_FILLED_SECS {
                positions[start..start + run.len()].fill(None);
            }
            start += run.len();
        }
        let arm =
            |t: usize| norm(sub(joint(t, elbow), joint(t, shoulder))) + norm(sub(joint(t, wrist), joint(t, elbow)));
        let arm_metres = order::median((0..n_frames).map(arm)).filter(|metres| *metres > 0.0);
        Self { fps: motion.fps, positions, is_visible, arm_metres }
    }
}
