//! Captured motion for the body lifter: nine points of the upper body in camera-like axes (a person at rest faces -z,
//! y down), in metres. Formats: BVH of any skeleton with known joint names (`joint_names`), y or z up, in any unit;
//! `.npz` of CMU joints ([T, 38, 3] per clip, millimetres, y up, `fps`) or of TED Expressive (`human_joints`); ground
//! truth of rendered persons. A take is one continuous excerpt: files are split where the body jumps, as after an
//! initial T-pose.

use super::neck::neck;
use crate::rendered_truth::{BODY_JOINTS, RenderedTruth};
use anyhow::{Context, Result, bail, ensure};
use orator_base::math::order::upper_median;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{COCO, N_POINTS, Pose};
use orator_base::text::counted;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::npz::Npz;
use orator_formats::search;
use orator_formats::skeleton::joint_names;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A continuous excerpt of captured motion.
#[derive(Clone, Debug)]
pub struct BodyTake {
    pub name: String,
    pub fps: f64,
    pub poses: Vec<Pose>,
    /// Whether it is the ground truth of a rendered person, whose bone lengths and head need no variation.
    pub rendered: bool,
}

impl BodyTake {
    /// Number of complete frames at another rate.
    pub fn n_frames_at(&self, fps: f64) -> usize {
        ((self.poses.len() as f64 - 1.0) / self.fps * fps + 1.0 + 1e-9) as usize
    }
}

/// Indices of the ten joints (`joint_names::ROLES`) among the 38 of the CMU `.npz`.
pub(super) const CMU_38: [usize; 10] = [17, 18, 30, 31, 32, 21, 22, 23, 8, 2];
/// Number of T-pose frames at the start of a CMU take, which are dropped.
pub(super) const T_POSE_FRAMES: usize = 1;
/// Largest mean displacement of the points between two frames at 60 frames/s, metres; a take is split at larger ones.
const LARGEST_JUMP: f64 = 0.1;
/// Length of upper arm and forearm of the mean adult, metres.
const ARM_METRES: f64 = 0.54;
/// Shortest duration of a take, seconds.
const SHORTEST_SECS: f64 = 1.0;

/// Reads all takes of `paths` (BVH or `.npz` files, or folders searched for them), sorted by file name.
///
/// # Errors
/// Nothing found; a file that cannot be read or has unknown joint names.
pub fn read_all(paths: &[PathBuf]) -> Result<Vec<BodyTake>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() { files.extend(search::below(path, &["bvh", "npz"])?) } else { files.push(path.clone()) }
    }
    ensure!(!files.is_empty(), "no .bvh or .npz file in {paths:?}");
    let takes = files.iter().map(|file| read(file)).collect::<Result<Vec<_>>>()?.concat();
    ensure!(!takes.is_empty(), "no continuous motion of at least {SHORTEST_SECS} s in {paths:?}");
    Ok(takes)
}

/// Reads the takes of one file, by its extension.
///
/// # Errors
/// An unknown extension; a file that cannot be read or has unknown joint names.
pub fn read(path: &Path) -> Result<Vec<BodyTake>> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("bvh") => read_bvh(path),
        Some("npz") => read_npz(path),
        _ => bail!("unsupported file {}: expected captured motion as .bvh or .npz", path.display()),
    }
}

/// A named set of takes; the name is the pattern that selected them.
pub type Set = (String, Vec<BodyTake>);

/// Splits takes into one set per pattern (`*` any characters, `?` one; the first matching pattern counts) and the
/// remaining takes.
///
/// # Errors
/// An invalid pattern, or one that matches nothing.
pub fn divide(mut takes: Vec<BodyTake>, patterns: &[String]) -> Result<(Vec<Set>, Vec<BodyTake>)> {
    let mut sets = Vec::new();
    for text in patterns {
        let pattern = glob::Pattern::new(text)
            .with_context(|| format!("invalid pattern `{text}`: expected a name with `*` and `?` as wildcards"))?;
        let (set, others): (Vec<BodyTake>, Vec<BodyTake>) =
            takes.into_iter().partition(|take| pattern.matches(&take.name));
        if set.is_empty() {
            let names: Vec<&str> = others.iter().take(8).map(|take| take.name.as_str()).collect();
            bail!(
                "no take matches `{text}`; there are {}, such as {}",
                counted(others.len(), "take"),
                names.join(", ")
            );
        }
        sets.push((text.clone(), set));
        takes = others;
    }
    Ok((sets, takes))
}

fn read_bvh(path: &Path) -> Result<Vec<BodyTake>> {
    let bvh = Bvh::read(path)?;
    let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
    let joints = named_joints(&names).with_context(|| path.display().to_string())?;
    let placed = bvh.positions(Positions::Auto);
    let mut bodies: Vec<[Vec3; 10]> = placed.iter().map(|p| joints.map(|j| p[j])).collect();
    ensure!(
        bodies.iter().flatten().flatten().all(|v| v.is_finite()),
        "{} contains positions that are not finite",
        path.display()
    );
    y_up(&mut bodies);
    in_metres(&mut bodies).with_context(|| path.display().to_string())?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    Ok(split_at_jumps(&name, 1.0 / bvh.frame_secs, bodies.iter().map(|p| upper_body(p)).collect()))
}

/// Index in `names` (root first) of each joint of `joint_names::ROLES`; the root replaces both hips if the skeleton
/// has none. The error lists the missing joints and the existing names.
pub(super) fn named_joints(names: &[&str]) -> Result<[usize; 10]> {
    let mut found = joint_names::find(names);
    if found[8..] == [None, None] {
        found[8..].fill(Some(0));
    }
    let missing: Vec<&str> =
        joint_names::ROLES.iter().zip(&found).filter_map(|(role, f)| f.is_none().then_some(*role)).collect();
    if !missing.is_empty() {
        let there: Vec<&str> = names.iter().copied().take(40).collect();
        bail!(
            "no joint found for {}: expected names such as Neck, Head, LeftArm, LeftForeArm, LeftHand, LeftUpLeg (or \
             l_shoulder, UpperArm_L, ...); joints of the file: {}",
            missing.join(", "),
            there.join(" ")
        );
    }
    Ok(std::array::from_fn(|role| found[role].unwrap_or_default()))
}

/// Rotates bodies whose up axis is z to y up.
fn y_up(bodies: &mut [[Vec3; 10]]) {
    let hips = |p: &[Vec3; 10]| vec3::scale(vec3::add(p[8], p[9]), 0.5);
    let up = bodies.iter().fold([0.0; 3], |sum, p| vec3::add(sum, vec3::sub(p[0], hips(p))));
    if up[2].abs() > up[1].abs() {
        bodies.iter_mut().for_each(|p| *p = p.map(|[x, y, z]| if up[2] > 0.0 { [x, z, -y] } else { [x, -z, y] }));
    }
}

/// Scales to metres: files do not specify their unit, so the arm length of the mean adult is assumed.
fn in_metres(bodies: &mut [[Vec3; 10]]) -> Result<()> {
    let bone = |p: &[Vec3; 10], a: usize, b: usize| vec3::norm(vec3::sub(p[a], p[b]));
    let arm = |p: &[Vec3; 10]| (bone(p, 2, 3) + bone(p, 3, 4) + bone(p, 5, 6) + bone(p, 6, 7)) / 2.0;
    let Some(arm) = upper_median(bodies.iter().map(arm)) else { return Ok(()) };
    ensure!(arm > 1e-6, "the arms have zero length");
    let grow = ARM_METRES / arm;
    bodies.iter_mut().for_each(|p| *p = p.map(|q| vec3::scale(q, grow)));
    Ok(())
}

fn read_npz(path: &Path) -> Result<Vec<BodyTake>> {
    let npz = Npz::open(path)?;
    if npz.has(BODY_JOINTS) {
        read_rendered(path)
    } else if npz.has("human_joints") {
        read_ted(path, npz)
    } else {
        read_cmu(npz)
    }
}

/// Reads the ground truth of a rendered person, rotated upright, since its camera may be tilted.
fn read_rendered(path: &Path) -> Result<Vec<BodyTake>> {
    let truth = RenderedTruth::read(path)?;
    let up = vec3::unit(truth.up.map(f64::from), 1e-6)
        .with_context(|| format!("invalid array `up` in {}: expected a vector that is not zero", path.display()))?;
    let upright = Rotation::between(up, [0.0, -1.0, 0.0]);
    let pose = |frame: ndarray::ArrayView2<f32>| -> Pose {
        COCO.map(|point| upright.turn(std::array::from_fn(|k| f64::from(frame[[point, k]]))))
    };
    let poses: Vec<Pose> = truth.body_joints.outer_iter().map(pose).collect();
    ensure!(
        poses.iter().flatten().flatten().all(|v| v.is_finite()),
        "{} contains positions that are not finite",
        path.display()
    );
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut takes = split_at_jumps(&name, truth.fps.per_sec(), poses);
    takes.iter_mut().for_each(|take| take.rendered = true);
    Ok(takes)
}

/// Reads TED Expressive: `human_joints` [T, 43, 3] in metres, y down, and `fps`. Point 0 is the spine, 0.26 m below
/// the neck (1); there are no hips, so they are extrapolated along the spine.
fn read_ted(path: &Path, mut npz: Npz) -> Result<Vec<BodyTake>> {
    let fps = npz.frame_rate("fps")?.per_sec();
    let joints = npz.numbers("human_joints", &[None, Some(43), Some(3)])?;
    let pose = |t: usize| -> Pose {
        let point = |j: usize| -> Vec3 { std::array::from_fn(|k| joints[[t, j, k]]) };
        let (right, left) = (point(3), point(2));
        let neck = neck(right, left);
        let spine = vec3::scale(vec3::sub(point(0), point(1)), 0.5 / 0.26);
        let half = vec3::scale(vec3::sub(left, right), 0.25);
        let hips = [vec3::sub(spine, half), vec3::add(spine, half)].map(|p| vec3::add(p, neck));
        let points = [point(38), right, point(5), point(7), left, point(4), point(6), hips[0], hips[1]];
        points.map(|p| vec3::sub(p, neck))
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    Ok(split_at_jumps(&name, fps, (0..joints.shape()[0]).map(pose).collect()))
}

fn read_cmu(mut npz: Npz) -> Result<Vec<BodyTake>> {
    let fps = npz.frame_rate("fps")?.per_sec();
    let mut names: Vec<String> =
        npz.names().iter().filter(|n| !["fps", "parents", "offsets_mm"].contains(&n.as_str())).cloned().collect();
    names.sort();
    let mut takes = Vec::new();
    for name in names {
        let joints = npz.numbers(&name, &[None, Some(38), Some(3)])?;
        let point = |t: usize, j: usize| std::array::from_fn(|k| joints[[t, j, k]] * 0.001);
        let poses = (T_POSE_FRAMES..joints.shape()[0]).map(|t| upper_body(&CMU_38.map(|j| point(t, j)))).collect();
        takes.extend(split_at_jumps(&name, fps, poses));
    }
    Ok(takes)
}

/// Converts ten joints (order of `joint_names::ROLES`; y up, a person at rest facing +z) to a pose. The nose is placed
/// 6 cm above and 11 cm in front of the head joint, perpendicular to the shoulders, because the sources lack the
/// head's orientation.
fn upper_body(joints: &[Vec3]) -> Pose {
    let neck = neck(joints[2], joints[5]);
    let across = vec3::sub(joints[5], joints[2]);
    let up = vec3::sub(joints[1], joints[0]);
    let ahead = vec3::unit(vec3::cross(across, up), 1e-9).unwrap_or([0.0, 0.0, 1.0]);
    let up = vec3::unit(up, 1e-9).unwrap_or([0.0, 1.0, 0.0]);
    let nose = vec3::add(vec3::add(joints[1], vec3::scale(up, 0.06)), vec3::scale(ahead, 0.11));
    // A skeleton without legs has its root as both hips.
    let hip_offset = if joints[8] == joints[9] { vec3::scale(across, 0.3) } else { [0.0; 3] };
    let hips = [vec3::sub(joints[8], hip_offset), vec3::add(joints[9], hip_offset)];
    let order = [nose, joints[2], joints[3], joints[4], joints[5], joints[6], joints[7], hips[0], hips[1]];
    order.map(|p| {
        let [x, y, z] = vec3::sub(p, neck);
        [x, -y, -z]
    })
}

/// Ranges of at least a second without jumps.
pub(super) fn continuous(fps: f64, poses: &[Pose]) -> Vec<Range<usize>> {
    let limit = LARGEST_JUMP * 60.0 / fps * N_POINTS as f64;
    let jump = |a: &Pose, b: &Pose| a.iter().zip(b).map(|(a, b)| vec3::norm(vec3::sub(*a, *b))).sum::<f64>();
    let mut end = 0;
    let ranges = poses.chunk_by(|a, b| jump(a, b) <= limit).map(|part| {
        end += part.len();
        end - part.len()..end
    });
    ranges.filter(|range| range.len() as f64 >= SHORTEST_SECS * fps).collect()
}

/// Splits poses at jumps; excerpts that are too short are dropped.
fn split_at_jumps(name: &str, fps: f64, poses: Vec<Pose>) -> Vec<BodyTake> {
    let take = |(i, part): (usize, Range<usize>)| BodyTake {
        name: format!("{name}#{i}"),
        fps,
        poses: poses[part].to_vec(),
        rendered: false,
    };
    continuous(fps, &poses).into_iter().enumerate().map(take).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, arr0};
    use ndarray_npy::NpzWriter;
    use orator_base::motion::upper_body::{L_HIP, NOSE, R_ELBOW, R_HIP, R_SHOULDER, R_WRIST};

    /// A person at rest, arms to the sides, facing +z, y up, millimetres; the first frame is elsewhere.
    fn standing(n_frames: usize) -> Array3<f32> {
        let at = [[0., 500., 0.], [0., 600., 0.], [-200., 480., 0.], [-480., 480., 0.], [-700., 480., 0.]];
        Array3::from_shape_fn((n_frames, 38, 3), |(t, j, k)| {
            if t == 0 {
                return 0.0;
            }
            let i = CMU_38.iter().position(|&c| c == j);
            match i {
                Some(i) if i < 5 => at[i][k],
                Some(i) if i < 8 => {
                    if k == 0 {
                        -at[i - 3][0]
                    } else {
                        at[i - 3][k]
                    }
                }
                Some(i) => [if i == 8 { -100. } else { 100. }, 0., 0.][k],
                None => 0.0,
            }
        })
    }

    #[test]
    fn the_root_stands_for_missing_hips_and_other_missing_joints_are_named() {
        let legless = "Pelvis Neck Head LeftArm LeftForeArm LeftHand RightArm RightForeArm RightHand";
        let names: Vec<&str> = legless.split_whitespace().collect();
        assert_eq!(named_joints(&names).unwrap()[8..], [0, 0]);
        let names = ["Neck", "Head", "LeftShoulder", "LeftArm", "RightArm", "LeftLeg", "Tail"];
        let text = named_joints(&names).unwrap_err().to_string();
        assert!(text.contains("right elbow") && text.contains("right hip") && text.contains("Tail"), "{text}");
        assert!(!text.contains("left shoulder,"), "{text}");
    }

    #[test]
    fn axes_turn_to_the_camera_and_the_t_pose_goes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.npz");
        let mut npz = NpzWriter::new(std::fs::File::create(&path).unwrap());
        let mut jumping = standing(200);
        jumping.slice_mut(ndarray::s![100.., .., 1]).mapv_inplace(|v| -v);
        npz.add_array("jumping", &jumping).unwrap();
        npz.add_array("still", &standing(80)).unwrap();
        npz.add_array("fps", &arr0(60f32)).unwrap();
        npz.finish().unwrap();
        let takes = read_all(&[dir.path().to_owned()]).unwrap();
        let lengths: Vec<_> = takes.iter().map(|t| (t.name.as_str(), t.poses.len())).collect();
        assert_eq!(lengths, [("jumping#0", 99), ("jumping#1", 100), ("still#0", 79)]);
        let pose = takes[2].poses[0];
        assert!(pose[R_SHOULDER][0] < 0.0 && pose[R_WRIST][0] < pose[R_ELBOW][0], "the speaker's right is image left");
        assert!(pose[NOSE][1] < -0.1 && pose[NOSE][2] < -0.05, "the nose is up and towards the camera");
        assert!(pose[R_HIP][1] > 0.4 && pose[L_HIP][0] > 0.0);
    }

    /// A person at rest as BVH, 70 frames, with axes and unit converted by `place`.
    fn bvh(place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        let offset = |p: [f64; 3]| place(p).map(|v| format!("{v:.4}")).join(" ");
        let joint = |name: &str, p: [f64; 3], inner: &str| {
            format!("JOINT {name} {{ OFFSET {} CHANNELS 3 Zrotation Xrotation Yrotation {inner} }}\n", offset(p))
        };
        let arm = |side: &str, x: f64| {
            let hand = joint(&format!("{side}Hand"), [x * 0.25, 0.0, 0.0], "");
            let fore = joint(&format!("{side}ForeArm"), [x * 0.29, 0.0, 0.0], &hand);
            joint(&format!("{side}Arm"), [x * 0.18, -0.05, 0.0], &fore)
        };
        let head = joint("Neck", [0.0, 0.5, 0.0], &joint("Head", [0.0, 0.12, 0.0], ""));
        let legs = joint("LeftUpLeg", [0.1, 0.0, 0.0], "") + &joint("RightUpLeg", [-0.1, 0.0, 0.0], "");
        let chest = joint("Spine", [0.0, 0.45, 0.0], &(arm("Left", 1.0) + &arm("Right", -1.0)));
        let n_channels = 6 + 3 * 11;
        let frames = format!("{}\n", vec!["0"; n_channels].join(" ")).repeat(70);
        format!(
            "HIERARCHY ROOT Hips {{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
             {head}{legs}{chest} }}\nMOTION Frames: 70 Frame Time: 0.0333333\n{frames}"
        )
    }

    #[test]
    fn a_bvh_of_any_unit_and_upright_axis_is_the_same_person() {
        let dir = tempfile::tempdir().unwrap();
        let read_as = |name: &str, text: String| {
            let path = dir.path().join(name);
            std::fs::write(&path, text).unwrap();
            read(&path).unwrap()[0].poses[3]
        };
        let metres = read_as("metres.bvh", bvh(|p| p));
        let z_up_inches = read_as("inches.bvh", bvh(|[x, y, z]| [x, -z, y].map(|v| v / 0.0254)));
        for (a, b) in metres.iter().zip(&z_up_inches) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-4), "{a:?} {b:?}");
        }
        assert!(metres[R_WRIST][0] < -0.6 && metres[NOSE][1] < -0.1 && metres[NOSE][2] < -0.05, "{metres:?}");
        assert!(metres[R_HIP][1] > 0.3, "{metres:?}");
        let cut = &bvh(|p| p)[..5000];
        let path = dir.path().join("cut.bvh");
        std::fs::write(&path, cut).unwrap();
        let text = format!("{:#}", read(&path).unwrap_err());
        assert!(text.contains("cut.bvh") && text.contains("states 70: expected one line of 39 values"), "{text}");
    }

    #[test]
    fn takes_are_divided_by_their_names() {
        let take = |name: &str| BodyTake { name: name.into(), fps: 30.0, poses: Vec::new(), rendered: false };
        let takes = || ["walk#0", "walk#1", "wave#0"].map(take).to_vec();
        let (sets, others) = divide(takes(), &["*#1".into(), "wave*".into()]).unwrap();
        let names: Vec<&str> = sets.iter().flat_map(|(_, set)| set).map(|t| t.name.as_str()).collect();
        assert_eq!((names, others.len()), (vec!["walk#1", "wave#0"], 1));
        let text = divide(takes(), &["run*".into()]).unwrap_err().to_string();
        assert!(text.contains("run*") && text.contains("walk#0"), "{text}");
    }

    #[test]
    fn unknown_files_say_what_is_known() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read_all(&[dir.path().to_owned()]).is_err());
        let path = dir.path().join("a.bvh");
        std::fs::write(&path, "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 0 } MOTION Frames: 0 Frame Time: 0.1").unwrap();
        let text = format!("{:#}", read_all(&[path]).unwrap_err());
        assert!(text.contains("a.bvh") && text.contains("LeftForeArm"), "{text}");
        assert!(read(Path::new("motion.fbx")).is_err());
    }
}
