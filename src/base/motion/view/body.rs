//! The body lifter's input: a window of frames centred on its neck, in one scale, beside what a longer stretch tells
//! about the body. Training and lifting meet here, so that both show the network the same thing. The scale is the
//! largest apparent bone of the stretch (a shoulder width would collapse where the speaker turns); the longest
//! appearance of each kind of bone tells the body's proportions, and with them how far a bone points at the camera.

use crate::math::order::Ordered;
use crate::math::vec3;
use crate::motion::upper_body::{L_HIP, L_SHOULDER, MIRROR, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER, SeenBody};
use crate::types::skeleton::BODY_BONES;

/// Frames of the stretch before and after the middle one.
const AROUND: isize = 40;
/// A bone of an arm is no larger than this many times the second largest: a point that stays elsewhere for long does not
/// stretch a body. Of rendered people 1 in 100 stretches have more than 1.28, 1 in 1,000 more than 1.53.
const LARGEST_BY_SECOND: f32 = 1.4;
/// Kinds of bone whose longest appearance goes in: shoulders, upper arm, forearm, neck to nose, neck to pelvis.
const N_KINDS: usize = 5;
/// Numbers a frame goes in with: x, y and whether it was seen, a point; then the kinds of bone, the same in all frames.
pub const N_IN: usize = 3 * N_POINTS + N_KINDS;
/// Numbers a frame comes out with: x, y, z a point.
pub const N_OUT: usize = 3 * N_POINTS;

/// A window as the network sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyView {
    /// [N_IN][window]: channel `3 * point + k` over time; k: x, y, seen (1) or held from the nearest frame (0).
    pub numbers: Vec<f32>,
    /// px that are 1 in `numbers`.
    pub scale: f32,
}

impl BodyView {
    /// The view of frame `t`: `window` frames (an odd number), `step` apart, between two frames where that is no whole
    /// number; before the first and after the last frame the body stands still. `None` when a shoulder is never seen
    /// in the window, or everything is one spot.
    pub fn around(seen: &[SeenBody], t: usize, window: usize, step: f64) -> Option<Self> {
        let last = seen.len().checked_sub(1)? as f64;
        let place = |d: isize| t as f64 + d as f64 * step;
        let half = window as isize / 2;
        let frames: Vec<SeenBody> = (-half..=half).map(|d| at(seen, place(d).clamp(0.0, last))).collect();
        let inside = |d: &isize| (0.0..=last).contains(&place(*d));
        let reach = AROUND.max(half);
        let stretch: Vec<SeenBody> = (-reach..=reach).filter(inside).map(|d| at(seen, place(d))).collect();
        Self::from_frames(&frames, &longest(&stretch))
    }

    /// The view of `frames` of a body whose bones appear at most so long. A point not seen is held from the nearest
    /// frame that shows it, moving with the neck; one never seen lies on the neck.
    fn from_frames(frames: &[SeenBody], longest: &[f32; N_KINDS]) -> Option<Self> {
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
        Some(Self { numbers, scale })
    }

    /// Window in the mirror: what the network sees of a speaker whose left is their right.
    pub fn mirrored(&self) -> Self {
        let n = self.n_frames();
        let mut numbers = Vec::with_capacity(self.numbers.len());
        for other in MIRROR {
            let channels = &self.numbers[3 * other * n..3 * (other + 1) * n];
            numbers.extend(channels[..n].iter().map(|x| -x));
            numbers.extend_from_slice(&channels[n..]);
        }
        numbers.extend_from_slice(&self.numbers[3 * N_POINTS * n..]);
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

    /// The middle frame's pose in px from the network's `output` (N_OUT numbers): x and y are what it adds to the
    /// input, z is its own; the neck is put back between the shoulders.
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

/// The mean of a window's output and that of the window in the mirror: left and right are lifted alike.
pub fn mirror_mean(output: &[f32], of_mirrored: &[f32]) -> Vec<f32> {
    let mut mean = Vec::with_capacity(N_OUT);
    for (j, other) in MIRROR.into_iter().enumerate() {
        let (own, back) = (&output[3 * j..3 * j + 3], &of_mirrored[3 * other..3 * other + 3]);
        mean.extend([(own[0] - back[0]) / 2.0, (own[1] + back[1]) / 2.0, (own[2] + back[2]) / 2.0]);
    }
    mean
}

/// The points at a place between two frames: in proportion where both show a point, else as in the nearer one.
fn at(seen: &[SeenBody], place: f64) -> SeenBody {
    let (before, after) = (&seen[place.floor() as usize], &seen[place.ceil() as usize]);
    let share = place.fract() as f32;
    std::array::from_fn(|j| match (before[j], after[j]) {
        (Some(a), Some(b)) => Some([0, 1].map(|k| a[k] + share * (b[k] - a[k]))),
        (a, _) if share < 0.5 => a,
        (_, b) => b,
    })
}

/// Each gap filled from the nearest frame that is there, the earlier of two; `None` when there is none.
fn held(mut track: Vec<Option<[f32; 2]>>) -> Option<Vec<[f32; 2]>> {
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

/// Largest apparent length of each kind of bone, in px: of each bone the tenth of the frames where it is largest is left
/// out, so that one stray point does not stretch a body. 0: never seen.
fn longest(frames: &[SeenBody]) -> [f32; N_KINDS] {
    let apart = |a: Option<[f32; 2]>, b: Option<[f32; 2]>| Some((a?[0] - b?[0]).hypot(a?[1] - b?[1]));
    let middle = |a: Option<[f32; 2]>, b: Option<[f32; 2]>| Some([(a?[0] + b?[0]) / 2.0, (a?[1] + b?[1]) / 2.0]);
    let neck = |f: &SeenBody| middle(f[R_SHOULDER], f[L_SHOULDER]);
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

/// The value that a tenth of the values exceed; 0 of none.
fn large(lengths: impl Iterator<Item = f32>) -> f32 {
    Ordered::new(lengths).high_end(10).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::upper_body::{L_WRIST, R_WRIST};

    const WINDOW: usize = 27;

    fn middle_view(frames: &[SeenBody]) -> Option<BodyView> {
        BodyView::around(frames, frames.len() / 2, WINDOW, 1.0)
    }

    fn frame(shift: f32) -> SeenBody {
        let xs: [f32; N_POINTS] = [0.0, -50.0, -55.0, -40.0, 50.0, 55.0, 40.0, -30.0, 30.0];
        let ys: [f32; N_POINTS] = [-40.0, 0.0, 60.0, 110.0, 0.0, 60.0, 110.0, 120.0, 120.0];
        std::array::from_fn(|j| Some([xs[j] + 300.0 + shift, ys[j] + 200.0]))
    }

    #[test]
    fn a_view_forgets_place_and_size() {
        let frames: Vec<SeenBody> = (0..WINDOW).map(|t| frame(t as f32)).collect();
        let twice: Vec<SeenBody> =
            frames.iter().map(|f| f.map(|p| p.map(|[x, y]| [2.0 * x + 7.0, 2.0 * y - 9.0]))).collect();
        let (a, b) = (middle_view(&frames).unwrap(), middle_view(&twice).unwrap());
        assert_eq!((a.scale, b.scale), (100.0, 200.0));
        assert!(a.numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
        assert_eq!(a.middle(R_SHOULDER), [-0.5, 0.0]);
        let pose = a.pose(&[0.0; N_OUT]);
        assert!((pose[L_WRIST][0] - 40.0).abs() < 1e-3 && (pose[L_WRIST][1] - 110.0).abs() < 1e-3);
    }

    #[test]
    fn the_mirror_swaps_the_sides_and_back() {
        let frames: Vec<SeenBody> = (0..WINDOW).map(|t| frame(3.0 * t as f32)).collect();
        let flipped: Vec<SeenBody> = frames.iter().map(|f| MIRROR.map(|j| f[j].map(|[x, y]| [900.0 - x, y]))).collect();
        let (a, b) = (middle_view(&frames).unwrap(), middle_view(&flipped).unwrap());
        assert!(a.mirrored().numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
        let output: Vec<f32> = (0..N_OUT).map(|i| (i * i) as f32).collect();
        let there: Vec<f32> =
            MIRROR.iter().flat_map(|&j| [-output[3 * j], output[3 * j + 1], output[3 * j + 2]]).collect();
        assert_eq!(mirror_mean(&output, &there), output);
    }

    #[test]
    fn what_is_not_seen_is_held_beside_the_neck() {
        let mut frames: Vec<SeenBody> = (0..WINDOW).map(|t| frame(10.0 * t as f32)).collect();
        for f in &mut frames[5..] {
            f[R_WRIST] = None;
        }
        frames[3][R_SHOULDER] = None;
        frames.iter_mut().for_each(|f| f[R_HIP] = None);
        let view = middle_view(&frames).unwrap();
        assert!((view.middle(R_WRIST)[0] + 0.4).abs() < 1e-6);
        assert_eq!(view.numbers[(3 * R_WRIST + 2) * WINDOW..][..7], [1., 1., 1., 1., 1., 0., 0.]);
        assert_eq!(view.middle(R_HIP), [0.0, 0.0]);
        frames.iter_mut().for_each(|f| f[R_SHOULDER] = None);
        assert!(middle_view(&frames).is_none());
        assert!(middle_view(&[[Some([3.0, 3.0]); N_POINTS]; WINDOW]).is_none());
        assert!(middle_view(&[]).is_none());
    }

    #[test]
    fn between_two_frames_points_lie_in_proportion() {
        let frames: Vec<SeenBody> = vec![[Some([0.0, 4.0]); 9], [Some([2.0, 8.0]); 9], [None; 9]];
        assert_eq!(at(&frames, 0.25)[0], Some([0.5, 5.0]));
        assert_eq!((at(&frames, 1.4)[0], at(&frames, 1.6)[0]), (Some([2.0, 8.0]), None));
    }

    #[test]
    fn a_point_that_stays_elsewhere_does_not_stretch_the_body() {
        let mut frames: Vec<SeenBody> = (0..71).map(|_| frame(0.0)).collect();
        frames[40..65].iter_mut().for_each(|f| f[L_WRIST] = Some([800.0, 310.0]));
        let scale = middle_view(&frames).unwrap().scale;
        assert!((scale - 1.4 * 100.0).abs() < 1e-3, "{scale}");
    }

    #[test]
    fn a_longer_stretch_tells_the_proportions() {
        let mut frames: Vec<SeenBody> = (0..71).map(|_| frame(0.0)).collect();
        // the left forearm is stretched for a while, outside the window of the middle frame
        frames[55..67].iter_mut().for_each(|f| f[L_WRIST] = Some([355.0, 380.0]));
        frames[20][L_WRIST] = Some([3550.0, 380.0]);
        let view = middle_view(&frames).unwrap();
        assert_eq!(view.scale, 120.0);
        let kind = |k: usize| view.numbers[(3 * N_POINTS + k) * WINDOW + 5];
        assert!((kind(0) - 100.0 / 120.0).abs() < 1e-6 && kind(2) == 1.0 && (kind(3) - 40.0 / 120.0).abs() < 1e-6);
    }
}
