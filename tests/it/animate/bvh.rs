//! Motion to BVH: what is written, read back by a reader of this file's own and put through plain matrices, is the
//! motion again; left is left; gaps do no harm.

use crate::fixtures::figures::{FPS, swinging};
use ndarray::{Array3, s};
use orator::animate::rig::rig::Rig;
use orator::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform};
use orator::formats::authors_txt;
use orator::formats::bvh::write::Clip;
use orator::math::rotation::Rotation;
use orator::types::pose3d::Motion;
use orator::types::skeleton;
use orator::types::skeleton::{L_HAND, N_JOINTS, R_HAND};
use std::path::Path;

fn performed(motion: &Motion) -> Performance {
    perform(motion, None, &AnimationOptions::default())
}

fn text(motion: &Motion) -> String {
    performed(motion).clip.to_bvh()
}

fn clip(motion: &Motion) -> Clip {
    performed(motion).clip
}

type Matrix = [[f64; 3]; 3];

/// A BVH as its text tells it: joints in file order, each with parent, offset and number of channels.
pub struct Bvh {
    pub names: Vec<String>,
    parents: Vec<Option<usize>>,
    offsets: Vec<[f64; 3]>,
    channels: Vec<usize>,
    pub frame_secs: f64,
    pub frames: Vec<Vec<f64>>,
}

impl Bvh {
    pub fn parse(text: &str) -> Self {
        let (hierarchy, motion) = text.split_once("MOTION\n").expect("a MOTION part");
        let mut bvh =
            Self { names: vec![], parents: vec![], offsets: vec![], channels: vec![], frame_secs: 0.0, frames: vec![] };
        let (mut open, mut next) = (Vec::new(), String::new());
        for line in hierarchy.lines().skip(1) {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[0] {
                "ROOT" | "JOINT" => next = words[1].to_owned(),
                "End" => next = format!("{}End", bvh.names[*open.last().unwrap()]),
                "{" => {
                    bvh.names.push(next.clone());
                    bvh.parents.push(open.last().copied());
                    bvh.channels.push(0);
                    open.push(bvh.names.len() - 1);
                }
                "}" => drop(open.pop()),
                "OFFSET" => bvh.offsets.push(std::array::from_fn(|k| words[1 + k].parse().unwrap())),
                "CHANNELS" => {
                    *bvh.channels.last_mut().unwrap() = words[1].parse().unwrap();
                    assert!(line.ends_with("Zrotation Xrotation Yrotation"));
                }
                other => panic!("unexpected {other}"),
            }
        }
        let mut lines = motion.lines();
        let n_frames: usize = lines.next().unwrap().strip_prefix("Frames: ").unwrap().parse().unwrap();
        bvh.frame_secs = lines.next().unwrap().strip_prefix("Frame Time: ").unwrap().parse().unwrap();
        bvh.frames = lines.map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
        assert_eq!(bvh.frames.len(), n_frames);
        assert!(bvh.frames.iter().all(|frame| frame.len() == bvh.channels.iter().sum::<usize>()));
        bvh
    }

    /// Places of all joints in a frame, cm.
    pub fn places(&self, frame: usize) -> Vec<[f64; 3]> {
        let mut numbers = self.frames[frame].iter().copied();
        let (mut places, mut turns): (Vec<[f64; 3]>, Vec<Matrix>) = (vec![], vec![]);
        for joint in 0..self.names.len() {
            let mut place = self.offsets[joint];
            let mut turn = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            if self.channels[joint] == 6 {
                place = std::array::from_fn(|_| numbers.next().unwrap());
            }
            if self.channels[joint] > 0 {
                for axis in [2, 0, 1] {
                    turn = product(&turn, &about(axis, numbers.next().unwrap().to_radians()));
                }
            }
            if let Some(parent) = self.parents[joint] {
                let turned = apply(&turns[parent], place);
                place = std::array::from_fn(|k| places[parent][k] + turned[k]);
                turn = product(&turns[parent], &turn);
            }
            places.push(place);
            turns.push(turn);
        }
        places
    }

    /// Index in this file of each of the 49 joints.
    pub fn of_motion(&self) -> [usize; N_JOINTS] {
        std::array::from_fn(|joint| {
            let name = match joint {
                skeleton::NECK => "Neck".to_owned(),
                1..L_HAND => {
                    let side = if joint < 4 { "Right" } else { "Left" };
                    format!("{side}{}", ["Arm", "ForeArm", "Hand"][(joint - 1) % 3])
                }
                _ => {
                    let (side, root) = if joint < R_HAND { ("Left", L_HAND) } else { ("Right", R_HAND) };
                    let finger = |k: usize| ["Thumb", "Index", "Middle", "Ring", "Pinky"][(k - 1) / 4];
                    match joint - root {
                        0 => format!("{side}Hand"),
                        k if k % 4 == 0 => format!("{side}Hand{}3End", finger(k)),
                        k => format!("{side}Hand{}{}", finger(k), (k - 1) % 4 + 1),
                    }
                }
            };
            self.names.iter().position(|found| *found == name).unwrap_or_else(|| panic!("no {name}"))
        })
    }
}

fn about(axis: usize, angle: f64) -> Matrix {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = [[0.0; 3]; 3];
    m[axis][axis] = 1.0;
    m[i][i] = angle.cos();
    m[j][j] = angle.cos();
    m[i][j] = -angle.sin();
    m[j][i] = angle.sin();
    m
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn apply(a: &Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| a[i][k] * v[k]).sum())
}

/// The greatest distance in mm between a motion and the joints of its BVH (`places` of a frame, in the order of the
/// file, cm), the necks laid on each other.
pub fn worst_mm(motion: &Motion, bvh: &Bvh, places: impl Fn(usize) -> Vec<[f64; 3]>) -> f64 {
    let of_motion = bvh.of_motion();
    let mut worst = 0.0f64;
    for frame in 0..motion.n_frames() {
        let places = places(frame);
        let neck = places[of_motion[skeleton::NECK]];
        for joint in 0..N_JOINTS {
            let ours: [f64; 3] = std::array::from_fn(|k| f64::from(motion.joints[[frame, joint, k]]));
            let theirs: [f64; 3] = std::array::from_fn(|k| (places[of_motion[joint]][k] - neck[k]) / 100.0);
            let apart = (ours[0] - theirs[0]).hypot(-ours[1] - theirs[1]).hypot(-ours[2] - theirs[2]);
            assert!(apart.is_finite());
            worst = worst.max(1000.0 * apart);
        }
    }
    worst
}

#[test]
fn the_bvh_gives_back_the_joints_within_a_tenth_of_a_millimetre() {
    for seed in 0..4 {
        let performance = performed(&swinging(seed, 60));
        let bvh = Bvh::parse(&performance.clip.to_bvh());
        assert!((bvh.frame_secs - 1.0 / FPS.per_sec()).abs() < 1e-7);
        let worst = worst_mm(&performance.motion(), &bvh, |frame| bvh.places(frame));
        assert!(worst < 0.1, "seed {seed}: {worst} mm");
    }
}

#[test]
fn a_t_pose_is_the_rest_pose_facing_plus_z() {
    let figure = Rig::from_motion(&swinging(0, 8));
    let local = vec![Rotation::IDENTITY; figure.skeleton.joints.len()];
    let places = figure.skeleton.positions(figure.root, &local);
    let neck = places[figure.places[skeleton::NECK]];
    let joints = Array3::from_shape_fn((2, N_JOINTS, 3), |(_, joint, k)| {
        let sign = if k == 0 { 1.0 } else { -1.0 };
        (sign * (places[figure.places[joint]][k] - neck[k]) / 100.0) as f32
    });
    assert!(joints[[0, skeleton::L_WRIST, 0]] > 0.5, "the left wrist is at the right of the picture");
    let clip = clip(&Motion::from_joints(FPS, joints));
    // The hand's axis runs to the middle of the knuckles, a degree beside the rest axis; all else is at rest.
    for (joint, rotation) in clip.skeleton.joints.iter().zip(&clip.local[0]) {
        let degrees = rotation.angle().to_degrees();
        assert!(degrees < 3.0, "{} is turned by {degrees} degrees", joint.name);
    }
    let soles = places.iter().map(|place| place[1]).fold(f64::MAX, f64::min);
    assert!(soles.abs() < 1e-9, "the figure stands on the floor");
}

#[test]
fn gaps_are_bridged_and_a_hand_never_seen_is_relaxed() {
    let whole = swinging(2, 60);
    let mut motion = whole.clone();
    motion.joints.slice_mut(s![.., L_HAND..R_HAND, ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![20..24, .., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![..3, 1.., ..]).fill(f32::NAN);
    let clip = clip(&motion);
    let at = |name: &str| clip.skeleton.find(name).unwrap();
    let finger = at("LeftHandMiddle2");
    for frame in 0..60 {
        assert!(clip.local[frame].iter().all(|r| r.angle().is_finite()));
        assert!((clip.local[frame][finger].angle().to_degrees() - 26.0).abs() < 1e-9);
    }
    assert_eq!(clip.local[0][at("RightArm")], clip.local[3][at("RightArm")]);
    let step = |frame: usize| {
        let arm = at("RightForeArm");
        (clip.local[frame][arm].inverse() * clip.local[frame + 1][arm]).angle().to_degrees()
    };
    assert!((19..24).map(step).fold(0.0, f64::max) < 30.0);

    for n_frames in [0, 1] {
        let nothing = Motion::from_joints(FPS, Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN));
        assert_eq!(Bvh::parse(&text(&nothing)).frames.len(), n_frames);
    }
}

#[test]
fn a_straightening_arm_does_not_spin() {
    // The left arm held to the side; the elbow passes through straight and bends back a degree the wrong way.
    let bend = |t: usize| 2.0 * (t as f64 - 30.0).abs() - 1.0;
    let mut motion = swinging(3, 60);
    for frame in 0..60 {
        let angle = bend(frame).to_radians();
        let shoulder = [0.17, 0.05, 0.0];
        let elbow = [shoulder[0] + 0.28, 0.15, 0.0];
        let wrist = [elbow[0] + 0.25 * angle.cos(), 0.15, -0.25 * angle.sin()];
        for (joint, place) in [(4, shoulder), (5, elbow), (6, wrist)] {
            (0..3).for_each(|k| motion.joints[[frame, joint, k]] = place[k] as f32);
        }
    }
    let clip = clip(&motion);
    let upper = clip.skeleton.find("LeftArm").unwrap();
    for frame in 0..59 {
        let step = (clip.local[frame].get(upper).unwrap().inverse() * clip.local[frame + 1][upper]).angle();
        assert!(step.to_degrees() < 15.0, "frame {frame}: {} degrees", step.to_degrees());
    }
}

#[test]
fn the_released_clips_keep_their_gesture() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/released_clips");
    if !folder.exists() {
        eprintln!("SKIPPED: the_released_clips_keep_their_gesture: {} is not there", folder.display());
        return;
    }
    let motion = authors_txt::read(&folder.join("gt_interval_102571.txt"), FPS).unwrap();
    let untouched =
        AnimationOptions { smoothing: Smoothing::None, constraints: Constraints::NONE, ..AnimationOptions::default() };
    let clip = perform(&motion, None, &untouched).clip;
    // The clip's bones vary by some percent of their length: the file keeps directions and gives each one length.
    let figure = Rig::from_motion(&motion);
    let mut apart = Vec::new();
    for frame in 0..motion.n_frames() {
        let places = clip.positions(frame);
        let neck = places[figure.places[0]];
        for joint in 1..N_JOINTS {
            let place = places[figure.places[joint]];
            let along =
                |k: usize, sign: f64| (place[k] - neck[k]) / 100.0 - sign * f64::from(motion.joints[[frame, joint, k]]);
            apart.push(along(0, 1.0).hypot(along(1, -1.0)).hypot(along(2, -1.0)));
        }
    }
    let mean = apart.iter().sum::<f64>() / apart.len() as f64;
    assert!(mean < 0.03, "{mean} m");
    let jumps = (1..motion.n_frames())
        .flat_map(|t| figure.arms.iter().flat_map(move |arm| [arm.upper, arm.fore].map(|joint| (t, joint))))
        .filter(|&(t, joint)| (clip.local[t - 1][joint].inverse() * clip.local[t][joint]).angle() > 1.2)
        .count();
    assert!(jumps < 8, "{jumps} sudden turns of an arm in {} frames", motion.n_frames());
}
