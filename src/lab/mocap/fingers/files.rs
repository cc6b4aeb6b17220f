//! Reads captured or labelled fingers from files and folders: `.bvh` by joint names; `.npz` with rotations of SMPL-X
//! on an assumed rest hand, or with `human_joints` [T, 43, 3] of TED speakers, without tips; `.txt` labels
//! (`labels`) with 48 numbers per line (ICVL, bone midpoints) or 42 (NYU, no knuckles, aligned errors only);
//! `people.json` of rendered persons. Reference lengths: middle proximal phalanx 48 mm; TED wrist to middle knuckle
//! 93.2 mm; NYU the middle finger's last two bones 51.3 mm.

use super::labels;
use super::take::{FingerTake, Fingers, Size};
use crate::evaluate::people::clips::ListedClip;
use crate::rendered_truth::RenderedTruth;
use anyhow::{Context, Result, bail, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, sub};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::{L_HAND, R_HAND, Side};
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::mocap::motion_file::DEFAULT_FPS;
use orator_formats::mocap::smplx::body::{self, FINGERS, WRISTS};
use orator_formats::mocap::smplx::motion::{SmplxMotion, is_smplx};
use orator_formats::mocap::{fingers, ted};
use orator_formats::npz::Npz;
use orator_formats::search;
use std::path::{Path, PathBuf};

/// The fingers of one file or folder.
pub struct FingerSet {
    /// Name of the file or folder.
    pub name: String,
    pub takes: Vec<FingerTake>,
}

/// Reads one set per path. Files without fingers in a folder are skipped.
///
/// # Errors
/// A file given by name without fingers; a folder in which no file has fingers (with the reason for the first one).
pub fn read_all(paths: &[PathBuf]) -> Result<Vec<FingerSet>> {
    paths.iter().map(|path| read_set(path)).collect()
}

fn read_set(path: &Path) -> Result<FingerSet> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    if !path.is_dir() {
        return Ok(FingerSet { name, takes: read(path)? });
    }
    let files = search::below(path, &["bvh", "npz", "txt"])?;
    ensure!(!files.is_empty(), "no .bvh, .npz or .txt file in {}", path.display());
    let (mut takes, mut first_error) = (Vec::new(), None);
    for file in files {
        match read(&file) {
            Ok(found) => takes.extend(found),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    match first_error {
        Some(error) if takes.is_empty() => {
            Err(error.context(format!("no file with finger joints in {}", path.display())))
        }
        _ => Ok(FingerSet { name, takes }),
    }
}

/// Reads the hands of one file.
///
/// # Errors
/// An unknown extension; a file that cannot be read or has no fingers.
pub fn read(path: &Path) -> Result<Vec<FingerTake>> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("bvh") => of_bvh(path),
        Some("npz") if is_smplx(&Npz::open(path)?) => of_smplx(path),
        Some("npz") => of_ted(path),
        Some("txt") => Ok(vec![labels::read(path)?]),
        Some("json") => of_rendered(path),
        _ => bail!("unsupported file {}: expected fingers as .bvh, .npz, .txt or people.json", path.display()),
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Reads the hands of a file for which it has finger joints. The error of a file without finger joints lists the joint
/// names.
fn of_bvh(path: &Path) -> Result<Vec<FingerTake>> {
    let bvh = Bvh::read(path)?;
    let found: Vec<(Side, [Option<usize>; N_HAND])> =
        [Side::Left, Side::Right].into_iter().filter_map(|side| Some((side, fingers::hand(&bvh, side)?))).collect();
    if found.is_empty() {
        let names: Vec<&str> = bvh.joints.iter().map(|j| j.name.as_str()).take(40).collect();
        bail!(
            "no finger joints in {}: expected names with a side (left, right, l, r) and a finger (thumb, index, \
             middle, ring, pinky, little), such as LeftHandIndex1, b_l_index1 or thumb_01_r; found {}",
            path.display(),
            names.join(" ")
        );
    }
    let positions = bvh.positions(Positions::Auto);
    let take = |(side, joints): (Side, [Option<usize>; N_HAND])| {
        let frames: Vec<Fingers> = positions.iter().map(|p| joints.map(|j| j.map(|j| p[j]))).collect();
        let size = if joints[9].is_some() && joints[10].is_some() { Size::Phalanx } else { Size::Palm };
        FingerTake::all_counted(&stem(path), side, frames, size)
    };
    Ok(found.into_iter().map(take).collect())
}

/// Reads both hands in the axes of the T-pose: left fingers along +x, palms down, thumbs towards +z. The file does not
/// contain the rest hand, which is ASSUMED to be that of `body`; no mean hand pose is added to the rotations.
fn of_smplx(path: &Path) -> Result<Vec<FingerTake>> {
    // The frame rate does not matter here.
    let motion = SmplxMotion::read(path, Some(DEFAULT_FPS))?;
    let skeleton = body::skeleton(&motion.rest);
    let take = |(at_side, side): (usize, Side)| {
        let hand = |rotations| {
            let mut local = body::local(rotations);
            local[..FINGERS[0]].fill(Rotation::IDENTITY);
            let at = skeleton.positions([0.0; 3], &local);
            let mut hand: [Option<Vec3>; N_HAND] = [Some([0.0; 3]); N_HAND];
            body::hand_points(at_side).for_each(|(point, joint)| {
                hand[point] = Some(sub(at[joint], at[WRISTS[at_side]]));
            });
            hand
        };
        FingerTake::all_counted(&stem(path), side, motion.rotations.iter().map(hand).collect(), Size::Phalanx)
    };
    Ok([(0, Side::Left), (1, Side::Right)].map(take).into())
}

/// Reads both hands of a TED speaker. In this skeleton, which was regressed, the palm is three times as long as the
/// proximal phalanges, so the size is derived from the palm.
fn of_ted(path: &Path) -> Result<Vec<FingerTake>> {
    let joints = Npz::open(path)?.numbers("human_joints", &[None, Some(ted::N_TED), Some(3)])?;
    let take = |side| {
        let hand = ted::hand(side);
        let point = |t: usize, j: usize| std::array::from_fn(|k| joints[[t, j, k]]);
        let frames = (0..joints.shape()[0]).map(|t| hand.map(|j| Some(point(t, j?)))).collect();
        FingerTake::all_counted(&stem(path), side, frames, Size::Palm)
    };
    Ok([Side::Left, Side::Right].map(take).into())
}

/// Reads the true hands of rendered persons: the middle part of the clips listed in `people.json`, without generated
/// fingers on captured motion.
fn of_rendered(path: &Path) -> Result<Vec<FingerTake>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let list: Vec<ListedClip> = serde_json::from_str(&text)
        .with_context(|| format!("{} is not a list of rendered persons (people.json)", path.display()))?;
    let mut takes = Vec::new();
    for clip in list.iter().filter(|clip| clip.part == "middle") {
        let truth = path.with_file_name(&clip.truth);
        let joints = RenderedTruth::read(&truth)?.joints;
        for (side, root) in [(Side::Left, L_HAND), (Side::Right, R_HAND)] {
            if clip.generated_joints.contains(&(root + 9)) {
                continue;
            }
            let point = |t: usize, j: usize| std::array::from_fn(|k| f64::from(joints[[t, root + j, k]]));
            let frames = (0..joints.shape()[0]).map(|t| std::array::from_fn(|j| Some(point(t, j)))).collect();
            takes.push(FingerTake::all_counted(&stem(&truth), side, frames, Size::Phalanx));
        }
    }
    ensure!(!takes.is_empty(), "no clip of the part `middle` with fingers in {}", path.display());
    Ok(takes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;

    /// A left hand with a thumb and a middle finger.
    const HAND: &str = "HIERARCHY ROOT Hips { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftHand { OFFSET 50 0 0 CHANNELS 0
          JOINT LeftHandThumb1 { OFFSET 3 0 2 CHANNELS 0 JOINT LeftHandThumb2 { OFFSET 4 0 1 CHANNELS 0
            JOINT LeftHandThumb3 { OFFSET 3 0 0 CHANNELS 0 End Site { OFFSET 2 0 0 } } } }
          JOINT LeftHandMiddle1 { OFFSET 9 0 0 CHANNELS 0 JOINT LeftHandMiddle2 { OFFSET 4.5 0 0 CHANNELS 0
            JOINT LeftHandMiddle3 { OFFSET 2.5 0 0 CHANNELS 0 End Site { OFFSET 2 0 0 } } } } } }
        MOTION Frames: 2 Frame Time: 0.04 0 0 0 90 0 0";

    #[test]
    fn a_hand_of_a_bvh_gets_the_reference_size_and_a_rig_without_fingers_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bvh");
        std::fs::write(&path, HAND).unwrap();
        let takes = read(&path).unwrap();
        let frame = takes[0].frames[0];
        assert_eq!((takes.len(), frame[0], frame[4]), (1, Some([50.0, 0.0, 0.0]), Some([62.0, 0.0, 3.0])));
        let truths = takes[0].truths().unwrap();
        assert!((truths[0].hand[9][0] + 0.096).abs() < 1e-6, "mirrored, the phalanx 48 mm");
        std::fs::write(&path, HAND.replace("LeftHand", "Tail")).unwrap();
        assert!(format!("{:#}", read(&path).unwrap_err()).contains("TailMiddle1"));
    }

    #[test]
    fn hands_of_a_ted_speaker_are_both_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let joints = ndarray::Array3::from_shape_fn((2, 43, 3), |(_, j, k)| (j * (k + 1)) as f32);
        let write = |name: &str| orator_formats::npz::write(&path, |npz| npz.add_array(name, &joints)).unwrap();
        write("human_joints");
        let takes = read(&path).unwrap();
        assert_eq!(takes[0].frames[0][17], Some([14.0, 28.0, 42.0]));
        assert_eq!(takes[1].frames[1][1], Some([35.0, 70.0, 105.0]));
        write("other");
        assert!(format!("{:#}", read(&path).unwrap_err()).contains("other"));
    }

    #[test]
    fn hands_of_rendered_persons_are_those_of_the_middle_part_with_captured_fingers() {
        let dir = tempfile::tempdir().unwrap();
        let truth = exact().truth;
        truth.write(&dir.path().join("a.npz")).unwrap();
        let path = dir.path().join("people.json");
        let clip = |part: &str, truth: &str, generated: &[usize]| {
            serde_json::json!({
                "video": "a.mp4", "truth": truth, "condition": "front", "part": part, "generated_joints": generated,
            })
        };
        let generated: Vec<usize> = (1..N_HAND).map(|j| L_HAND + j).collect();
        let clips = [clip("last", "none.npz", &[]), clip("middle", "a.npz", &[]), clip("middle", "a.npz", &generated)];
        std::fs::write(&path, serde_json::json!(clips).to_string()).unwrap();
        let takes = read(&path).unwrap();
        assert_eq!(takes.iter().map(|take| take.side).collect::<Vec<_>>(), [Side::Left, Side::Right, Side::Right]);
        let knuckle = [0, 1, 2].map(|k| f64::from(truth.joints[[3, R_HAND + 9, k]]));
        assert_eq!((takes[1].frames.len(), takes[1].frames[3][9]), (truth.n_frames(), Some(knuckle)));
    }

    #[test]
    fn the_error_of_a_folder_without_fingers_has_a_reason() {
        let dir = tempfile::tempdir().unwrap();
        let error = |paths: &[PathBuf]| format!("{:#}", read_all(paths).err().unwrap());
        assert!(error(&[dir.path().to_owned()]).contains("no .bvh"));
        std::fs::write(dir.path().join("a.txt"), "1 2 3").unwrap();
        assert!(error(&[dir.path().to_owned()]).contains("3 numbers per line"));
        assert!(error(&[dir.path().join("a.fbx")]).contains("a.fbx"));
        std::fs::write(dir.path().join("people.json"), "[]").unwrap();
        assert!(error(&[dir.path().join("people.json")]).contains("no clip of the part"));
        assert!(error(&[dir.path().join("none.txt")]).contains("none.txt"));
    }
}
