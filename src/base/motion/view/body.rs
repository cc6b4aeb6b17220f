//! Input of the body lifter: a window of frames centred on the neck, normalised to one scale, with body proportions
//! measured over a longer range. Training and lifting both build it here, so that the network sees identical input.
//! The scale is the largest apparent bone of the range (a shoulder width would collapse when the speaker turns); the
//! largest apparent length of each bone type gives the proportions, and thereby how far a bone points at the camera.

use crate::math::order::Ordered;
use crate::math::vec3;
use crate::motion::upper_body::{
    BodyPoints, HandDirections, L_HIP, L_SHOULDER, MIRROR, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER,
};
use crate::types::skeleton::BODY_BONES;

/// Number of frames before and after the middle one over which the proportions are measured.
const AROUND: isize = 40;
/// Maximum length of a bone as a multiple of the second largest bone, so that a keypoint that is wrong for a long time
/// does not change the scale. For rendered persons 1 in 100 ranges exceeds 1.28, 1 in 1,000 exceeds 1.53.
const LARGEST_BY_SECOND: f32 = 1.4;
/// Number of bone types with a maximum input length: shoulders, upper arm, forearm, neck to nose, neck to pelvis.
const N_KINDS: usize = 5;
/// Input channels per frame without hands: x, y and visibility of each point, then the constant bone types.
pub const N_BODY_IN: usize = 3 * N_POINTS + N_KINDS;
/// Channels of one hand: x, y, z of its direction and whether it is known.
const N_OF_HAND: usize = 4;
/// Input channels per frame with the right and the left hand. Networks of `N_BODY_IN` channels do not use the hands.
pub const N_IN: usize = N_BODY_IN + 2 * N_OF_HAND;
/// Output channels per frame: x, y, z of each point.
pub const N_OUT: usize = 3 * N_POINTS;

/// Input window of the network.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyView {
    /// [N_IN][window]: channel `3 * point + k` over time; k: x, y, visible (1) or copied from the nearest frame (0);
    /// then the bone types and the hands.
    pub numbers: Vec<f32>,
    /// px per unit of `numbers`.
    pub scale: f32,
}

impl BodyView {
    /// Builds the input for frame `t`: `window` frames (an odd number), `step` frames apart, interpolated if that is
    /// not an integer; the end frames are repeated beyond the ends. `hands` has the directions of the hands in every
    /// frame, or is empty if none is known. `None` if a shoulder is never visible in the window or all points coincide.
    pub fn around(seen: &[BodyPoints], hands: &[HandDirections], t: usize, window: usize, step: f64) -> Option<Self> {
        let last = seen.len().checked_sub(1)? as f64;
        let source_time = |d: isize| t as f64 + d as f64 * step;
        let half = window as isize / 2;
        let times = (-half..=half).map(|d| source_time(d).clamp(0.0, last));
        let frames: Vec<BodyPoints> = times.clone().map(|time| at(seen, time)).collect();
        let nearest = |time: f64| hands.get(time.round() as usize).copied().unwrap_or_default();
        let hands: Vec<HandDirections> = times.map(nearest).collect();
        let inside = |d: &isize| (0.0..=last).contains(&source_time(*d));
        let half_range = AROUND.max(half);
        let range: Vec<BodyPoints> =
            (-half_range..=half_range).filter(inside).map(|d| at(seen, source_time(d))).collect();
        Self::from_frames(&frames, &hands, &longest(&range))
    }

    /// Builds the input from `frames` and the largest apparent bone lengths. A point that is not visible is copied,
    /// relative to the neck, from the nearest frame in which it is; one that is never visible is put on the neck. Hands
    /// are copied likewise; an unknown one has no direction.
    fn from_frames(frames: &[BodyPoints], hands: &[HandDirections], longest: &[f32; N_KINDS]) -> Option<Self> {
        let n = frames.len();
        let right = held(frames.iter().map(|f| f[R_SHOULDER]).collect())?;
        let left = held(frames.iter().map(|f| f[L_SHOULDER]).collect())?;
        let neck: Vec<[f32; 2]> = (0..n).map(|t| [0, 1].map(|k| (right[t][k] + left[t][k]) / 2.0)).collect();
        let scale = longest[..3].iter().copied().fold(0.0, f32::max);
        if !(scale > 1e-6 && scale.is_finite()) {
            return None;
        }
        let mut numbers = vec![0.0; N_IN * n];
        for point in 0..N_POINTS {
            let from_neck = |t: usize| frames[t][point].map(|p| [p[0] - neck[t][0], p[1] - neck[t][1]]);
            let track = match point {
                R_SHOULDER => (0..n).map(|t| [right[t][0] - neck[t][0], right[t][1] - neck[t][1]]).collect(),
                L_SHOULDER => (0..n).map(|t| [left[t][0] - neck[t][0], left[t][1] - neck[t][1]]).collect(),
                _ => held((0..n).map(from_neck).collect()).unwrap_or_else(|| vec![[0.0; 2]; n]),
            };
            for t in 0..n {
                numbers[(3 * point) * n + t] = track[t][0] / scale;
                numbers[(3 * point + 1) * n + t] = track[t][1] / scale;
                numbers[(3 * point + 2) * n + t] = f32::from(frames[t][point].is_some());
            }
        }
        for (kind, length) in longest.iter().enumerate() {
            numbers[(3 * N_POINTS + kind) * n..][..n].fill(length / scale);
        }
        for side in 0..2 {
            let track = held(hands.iter().map(|hands| hands[side]).collect()).unwrap_or_else(|| vec![[0.0; 3]; n]);
            let channels = &mut numbers[(N_BODY_IN + N_OF_HAND * side) * n..][..N_OF_HAND * n];
            for t in 0..n {
                (0..3).for_each(|k| channels[k * n + t] = track[t][k]);
                channels[3 * n + t] = f32::from(hands[t][side].is_some());
            }
        }
        Some(Self { numbers, scale })
    }

    /// Mirrors the window: the input for a speaker whose left and right are exchanged.
    pub fn mirrored(&self) -> Self {
        let n = self.n_frames();
        let mut numbers = Vec::with_capacity(self.numbers.len());
        for other in MIRROR {
            let channels = &self.numbers[3 * other * n..3 * (other + 1) * n];
            numbers.extend(channels[..n].iter().map(|x| -x));
            numbers.extend_from_slice(&channels[n..]);
        }
        numbers.extend_from_slice(&self.numbers[3 * N_POINTS * n..N_BODY_IN * n]);
        for side in [1, 0] {
            let channels = &self.numbers[(N_BODY_IN + N_OF_HAND * side) * n..][..N_OF_HAND * n];
            numbers.extend(channels[..n].iter().map(|x| -x));
            numbers.extend_from_slice(&channels[n..]);
        }
        Self { numbers, scale: self.scale }
    }

    fn n_frames(&self) -> usize {
        self.numbers.len() / N_IN
    }

    /// x and y of a point in the middle frame, in units of `scale`.
    pub fn middle(&self, point: usize) -> [f32; 2] {
        let n = self.n_frames();
        [self.numbers[3 * point * n + n / 2], self.numbers[(3 * point + 1) * n + n / 2]]
    }

    /// Returns the middle frame's pose in px for the network's `output` (N_OUT numbers): x and y are residuals to the
    /// input, z is absolute; the neck is moved back to the midpoint of the shoulders.
    pub fn pose(&self, output: &[f32]) -> Pose {
        let mut pose: Pose = std::array::from_fn(|j| {
            let [x, y] = self.middle(j);
            [x + output[3 * j], y + output[3 * j + 1], output[3 * j + 2]].map(|v| f64::from(v * self.scale))
        });
        let neck = vec3::scale(vec3::add(pose[R_SHOULDER], pose[L_SHOULDER]), 0.5);
        pose.iter_mut().for_each(|p| *p = vec3::sub(*p, neck));
        pose
    }
}

/// Averages the output for a window with that for the mirrored window, so that left and right are treated equally.
pub fn mirror_mean(output: &[f32], of_mirrored: &[f32]) -> Vec<f32> {
    let mut mean = Vec::with_capacity(N_OUT);
    for (j, other) in MIRROR.into_iter().enumerate() {
        let (own, back) = (&output[3 * j..3 * j + 3], &of_mirrored[3 * other..3 * other + 3]);
        mean.extend([(own[0] - back[0]) / 2.0, (own[1] + back[1]) / 2.0, (own[2] + back[2]) / 2.0]);
    }
    mean
}

/// Interpolates points at `time` between two frames linearly; a point visible in one only is the nearer frame's.
pub fn at(seen: &[BodyPoints], time: f64) -> BodyPoints {
    let (before, after) = (&seen[time.floor() as usize], &seen[time.ceil() as usize]);
    let share = time.fract() as f32;
    std::array::from_fn(|j| match (before[j], after[j]) {
        (Some(a), Some(b)) => Some([0, 1].map(|k| a[k] + share * (b[k] - a[k]))),
        (a, _) if share < 0.5 => a,
        (_, b) => b,
    })
}

/// Fills each gap from the nearest frame with a value, the earlier of two; `None` if there is no value.
fn held<T: Copy>(mut track: Vec<Option<T>>) -> Option<Vec<T>> {
    let seen: Vec<usize> = (0..track.len()).filter(|&t| track[t].is_some()).collect();
    let mut next = 0;
    for t in 0..track.len() {
        while next + 1 < seen.len() && seen[next + 1].abs_diff(t) < seen[next].abs_diff(t) {
            next += 1;
        }
        if track[t].is_none() {
            track[t] = track[*seen.get(next)?];
        }
    }
    track.into_iter().collect()
}

/// Largest apparent length of each bone type in px. The largest tenth of each bone's lengths is ignored, so that a
/// single outlier does not change the scale. 0: never visible.
fn longest(frames: &[BodyPoints]) -> [f32; N_KINDS] {
    let apart = |a: Option<[f32; 2]>, b: Option<[f32; 2]>| Some((a?[0] - b?[0]).hypot(a?[1] - b?[1]));
    let middle = |a: Option<[f32; 2]>, b: Option<[f32; 2]>| Some([(a?[0] + b?[0]) / 2.0, (a?[1] + b?[1]) / 2.0]);
    let neck = |f: &BodyPoints| middle(f[R_SHOULDER], f[L_SHOULDER]);
    let bones = BODY_BONES.map(|(a, b)| large(frames.iter().filter_map(|f| apart(f[a], f[b]))));
    let second = Ordered::new(bones).high_end(bones.len()).filter(|&second| second > 0.0);
    let [_, right_upper, left_upper, right_fore, left_fore] =
        second.map_or(bones, |second| bones.map(|length| length.min(LARGEST_BY_SECOND * second)));
    [
        bones[0],
        right_upper.max(left_upper),
        right_fore.max(left_fore),
        large(frames.iter().filter_map(|f| apart(f[NOSE], neck(f)))),
        large(frames.iter().filter_map(|f| apart(middle(f[R_HIP], f[L_HIP]), neck(f)))),
    ]
}

/// Returns the value that a tenth of the values exceed; 0 if there are none.
fn large(lengths: impl Iterator<Item = f32>) -> f32 {
    Ordered::new(lengths).high_end(10).unwrap_or(0.0)
}
