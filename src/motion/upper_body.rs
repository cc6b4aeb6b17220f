//! The nine points of the upper body that the body lifter sees, and the numbers it sees them as. Training and lifting
//! meet here, so that both show the network the same thing: a window of frames centred on its neck and divided by its
//! largest apparent bone (a shoulder width would collapse where the speaker turns).

use super::vec3::{self, Vec3};

/// Nose, right shoulder, elbow, wrist, left the same, right hip, left hip.
pub const N_POINTS: usize = 9;
pub const NOSE: usize = 0;
pub const R_SHOULDER: usize = 1;
pub const R_ELBOW: usize = 2;
pub const R_WRIST: usize = 3;
pub const L_SHOULDER: usize = 4;
pub const L_ELBOW: usize = 5;
pub const L_WRIST: usize = 6;
pub const R_HIP: usize = 7;
pub const L_HIP: usize = 8;

/// The same point of the other side.
pub const MIRROR: [usize; N_POINTS] = [NOSE, L_SHOULDER, L_ELBOW, L_WRIST, R_SHOULDER, R_ELBOW, R_WRIST, L_HIP, R_HIP];

/// The bones that give a window its scale.
const BONES: [(usize, usize); 5] =
    [(R_SHOULDER, L_SHOULDER), (R_SHOULDER, R_ELBOW), (L_SHOULDER, L_ELBOW), (R_ELBOW, R_WRIST), (L_ELBOW, L_WRIST)];

/// Nine points in camera axes (x right, y down, z away) relative to the neck, the middle of the shoulders.
pub type Pose = [Vec3; N_POINTS];

/// Nine points of a picture, x and y in px; `None`: not seen.
pub type Seen = [Option<[f32; 2]>; N_POINTS];

/// Frames the lifter looks at to place the middle one.
pub const WINDOW: usize = 27;
/// Numbers a frame goes in with: x, y and whether it was seen, a point.
pub const N_IN: usize = 3 * N_POINTS;
/// Numbers a frame comes out with: x, y, z a point.
pub const N_OUT: usize = 3 * N_POINTS;

/// Every body is given this size (`size`) in metres: a picture does not tell how large a person is.
pub const REFERENCE_SIZE: f64 = 0.90;

/// A window as the network sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// [N_IN][WINDOW]: channel `3 * point + k` over time; k: x, y, seen (1) or held from the nearest frame (0).
    pub numbers: Vec<f32>,
    /// px that are 1 in `numbers`.
    pub scale: f32,
}

impl View {
    /// The view of `frames` (WINDOW of them). A point not seen is held from the nearest frame that shows it, moving
    /// with the neck; one never seen lies on the neck. `None` when a shoulder is never seen, or everything is one spot.
    pub fn of(frames: &[Seen]) -> Option<Self> {
        let n = frames.len();
        let right = held(frames.iter().map(|f| f[R_SHOULDER]).collect())?;
        let left = held(frames.iter().map(|f| f[L_SHOULDER]).collect())?;
        let neck: Vec<[f32; 2]> = (0..n).map(|t| [0, 1].map(|k| (right[t][k] + left[t][k]) / 2.0)).collect();
        let scale = scale(frames);
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
        Some(Self { numbers, scale })
    }

    /// The same window in the mirror: what the network sees of a speaker whose left is their right.
    pub fn mirrored(&self) -> Self {
        let n = self.numbers.len() / N_IN;
        let mut numbers = Vec::with_capacity(self.numbers.len());
        for other in MIRROR {
            let channels = &self.numbers[3 * other * n..3 * (other + 1) * n];
            numbers.extend(channels[..n].iter().map(|x| -x));
            numbers.extend_from_slice(&channels[n..]);
        }
        Self { numbers, scale: self.scale }
    }

    /// x and y of a point in the middle frame, in units of `scale`.
    pub fn middle(&self, point: usize) -> [f32; 2] {
        let n = self.numbers.len() / N_IN;
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

/// Width of the shoulders, a mean upper arm and a mean forearm together.
pub fn size(pose: &Pose) -> f64 {
    let bone = |(a, b): (usize, usize)| vec3::norm(vec3::sub(pose[a], pose[b]));
    bone(BONES[0]) + (bone(BONES[1]) + bone(BONES[2]) + bone(BONES[3]) + bone(BONES[4])) / 2.0
}

/// Metres a unit of `poses`, such that their median size is `REFERENCE_SIZE`; 1 when there is nothing to measure.
pub fn metres_per_unit(poses: &[Pose]) -> f64 {
    let mut sizes: Vec<f64> = poses.iter().map(size).filter(|s| s.is_finite() && *s > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).map_or(1.0, |s| REFERENCE_SIZE / s)
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

/// The largest bone as it appears, each bone taken at the tenth of the frames where it is largest: one stray point
/// does not shrink a window.
fn scale(frames: &[Seen]) -> f32 {
    let largest = |&(a, b): &(usize, usize)| {
        let length = |f: &Seen| Some((f[a]?[0] - f[b]?[0]).hypot(f[a]?[1] - f[b]?[1]));
        let mut lengths: Vec<f32> = frames.iter().filter_map(length).collect();
        lengths.sort_by(f32::total_cmp);
        lengths.len().checked_sub(1 + lengths.len() / 10).map_or(0.0, |i| lengths[i])
    };
    BONES.iter().map(largest).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(shift: f32) -> Seen {
        let points = [
            [0., -40.],
            [-50., 0.],
            [-55., 60.],
            [-40., 110.],
            [50., 0.],
            [55., 60.],
            [40., 110.],
            [-30., 120.],
            [30., 120.],
        ];
        points.map(|[x, y]: [f32; 2]| Some([x + 300.0 + shift, y + 200.0]))
    }

    #[test]
    fn a_view_forgets_place_and_size() {
        let frames: Vec<Seen> = (0..WINDOW).map(|t| frame(t as f32)).collect();
        let twice: Vec<Seen> =
            frames.iter().map(|f| f.map(|p| p.map(|[x, y]| [2.0 * x + 7.0, 2.0 * y - 9.0]))).collect();
        let (a, b) = (View::of(&frames).unwrap(), View::of(&twice).unwrap());
        assert_eq!((a.scale, b.scale), (100.0, 200.0));
        assert!(a.numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
        assert_eq!(a.middle(R_SHOULDER), [-0.5, 0.0]);
        let pose = a.pose(&[0.0; N_OUT]);
        assert!((pose[L_WRIST][0] - 40.0).abs() < 1e-3 && (pose[L_WRIST][1] - 110.0).abs() < 1e-3);
    }

    #[test]
    fn the_mirror_swaps_the_sides_and_back() {
        let frames: Vec<Seen> = (0..WINDOW).map(|t| frame(3.0 * t as f32)).collect();
        let flipped: Vec<Seen> = frames.iter().map(|f| MIRROR.map(|j| f[j].map(|[x, y]| [900.0 - x, y]))).collect();
        let (a, b) = (View::of(&frames).unwrap(), View::of(&flipped).unwrap());
        assert!(a.mirrored().numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
        let output: Vec<f32> = (0..N_OUT).map(|i| (i * i) as f32).collect();
        let there: Vec<f32> =
            MIRROR.iter().flat_map(|&j| [-output[3 * j], output[3 * j + 1], output[3 * j + 2]]).collect();
        assert_eq!(mirror_mean(&output, &there), output);
    }

    #[test]
    fn what_is_not_seen_is_held_beside_the_neck() {
        let mut frames: Vec<Seen> = (0..WINDOW).map(|t| frame(10.0 * t as f32)).collect();
        for f in &mut frames[5..] {
            f[R_WRIST] = None;
        }
        frames[3][R_SHOULDER] = None;
        frames.iter_mut().for_each(|f| f[R_HIP] = None);
        let view = View::of(&frames).unwrap();
        assert!((view.middle(R_WRIST)[0] + 0.4).abs() < 1e-6);
        assert_eq!(view.numbers[(3 * R_WRIST + 2) * WINDOW..][..7], [1., 1., 1., 1., 1., 0., 0.]);
        assert_eq!(view.middle(R_HIP), [0.0, 0.0]);
        frames.iter_mut().for_each(|f| f[R_SHOULDER] = None);
        assert!(View::of(&frames).is_none());
        assert!(View::of(&[[Some([3.0, 3.0]); N_POINTS]; WINDOW]).is_none());
        assert!(View::of(&[]).is_none());
    }

    #[test]
    fn metres_give_the_reference_size() {
        let pose: Pose =
            std::array::from_fn(|j| frame(0.0)[j].map(|[x, y]| [f64::from(x), f64::from(y), 1.0]).unwrap());
        let grow = metres_per_unit(&[pose]);
        assert!((size(&pose.map(|p| vec3::scale(p, grow))) - REFERENCE_SIZE).abs() < 1e-12);
        assert_eq!(metres_per_unit(&[]), 1.0);
    }
}
