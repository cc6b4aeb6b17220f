//! All motion formats contain the joints of the performance; a preset changes only the names of bones.

use crate::fixtures::animation::bvh::Bvh;
use crate::fixtures::figures::{FPS, swinging};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, Performance, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, norm, sub};
use orator_base::stage::progress::Silent;
use orator_formats::bvh::read::Positions;
use orator_formats::{authors_txt, npy};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn write(folder: &Path, performance: &Performance, file: &str, names: Names) -> PathBuf {
    let path = folder.join(file);
    let sources = ExportContent { names, ..ExportContent::default() };
    ExportFormat::from_path(&path).unwrap().write(&path, performance, &sources, &Silent).unwrap();
    path
}

fn vec3(value: &Value) -> Vec3 {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

#[test]
fn json_positions_and_rotations_are_consistent() {
    let folder = tempfile::tempdir().unwrap();
    let performance = perform(&swinging(2, 15), None, &AnimationOptions::default());
    let expected = performance.motion();
    let path = write(folder.path(), &performance, "motion.json", Names::Own);
    let file: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    assert_eq!(
        (&file["format"], &file["version"], &file["units"]),
        (&"orator motion".into(), &1.into(), &"metres".into())
    );
    assert_eq!((file["fps"][0].as_u64(), file["n_frames"].as_u64()), (Some(15), Some(15)));
    let parents: Vec<Option<usize>> =
        file["parents"].as_array().unwrap().iter().map(|p| p.as_u64().map(|p| p as usize)).collect();
    assert_eq!(file["names"].as_array().unwrap().len(), parents.len());
    let (mut worst_fk, mut worst): (f64, f64) = (0.0, 0.0);
    for frame in 0..15 {
        let (positions, rotations) = (&file["positions"][frame], &file["rotations"][frame]);
        let mut world: Vec<(Rotation, Vec3)> = Vec::new();
        for (joint, parent) in parents.iter().enumerate() {
            let q = &rotations[joint];
            let local = Rotation { w: q[3].as_f64().unwrap(), v: vec3(q) };
            world.push(match parent {
                None => (local, vec3(&positions[joint])),
                Some(parent) => {
                    let (turn, position) = world[*parent];
                    (turn * local, add(position, turn.turn(vec3(&file["offsets"][joint]))))
                }
            });
            worst_fk = worst_fk.max(1e3 * norm(sub(world[joint].1, vec3(&positions[joint]))));
        }
        let of = |joint: usize| vec3(&positions[file["joints49"][joint].as_u64().unwrap() as usize]);
        for joint in 0..49 {
            let [x, y, z] = sub(of(joint), of(0));
            let difference: Vec3 =
                [(0, x), (1, -y), (2, -z)].map(|(k, v)| v - f64::from(expected.joints[[frame, joint, k]]));
            worst = worst.max(1e3 * norm(difference));
        }
    }
    eprintln!("JSON: rotations give the positions within {worst_fk:.4} mm, these the joints within {worst:.4} mm");
    assert!(worst_fk < 0.1 && worst < 0.1);
}

#[test]
fn joint_files_contain_the_joints_of_the_performance() {
    let folder = tempfile::tempdir().unwrap();
    let performance = perform(&swinging(2, 12), None, &AnimationOptions::default());
    let expected = performance.motion();
    let read = [
        npy::read(&write(folder.path(), &performance, "motion.npy", Names::Own), FPS).unwrap(),
        authors_txt::read(&write(folder.path(), &performance, "motion.txt", Names::Own), FPS).unwrap(),
    ];
    for motion in read {
        assert_eq!(motion.joints.dim(), expected.joints.dim());
        assert!(motion.joints.iter().zip(&expected.joints).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}

#[test]
fn a_preset_changes_only_the_names_of_a_bvh() {
    let folder = tempfile::tempdir().unwrap();
    let performance = perform(&swinging(2, 5), None, &AnimationOptions::default());
    let text = |names: Names| {
        let path = write(folder.path(), &performance, &format!("{}.bvh", names.label()), names);
        std::fs::read_to_string(path).unwrap()
    };
    let own = text(Names::Own);
    let read = |text: &str| {
        let bvh = orator_formats::bvh::read::Bvh::parse(text).unwrap();
        (bvh.positions(Positions::Auto), bvh)
    };
    let (own_positions, own_bvh) = read(&own);
    for (names, hips) in Names::ALL.into_iter().zip(["Hips", "mixamorig:Hips", "Hips", "hips", "pelvis"]) {
        let text = text(names);
        let bvh = Bvh::parse(&text);
        assert_eq!((bvh.names[0].as_str(), bvh.frames.len()), (hips, 5));
        if names != Names::Mixamo {
            assert_eq!(text.split_once("MOTION").unwrap().1, own.split_once("MOTION").unwrap().1);
            continue;
        }
        // Mixamo has extra bones; the common bones keep their positions.
        let (positions, bvh) = read(&text);
        assert_eq!(bvh.joints.len(), own_bvh.joints.len() + 3);
        for (joint, bone) in own_bvh.joints.iter().enumerate() {
            let name = match bone.name.as_str() {
                "Chest" => "Spine1".to_owned(),
                name => name.replace("Foot_end", "ToeBase"),
            };
            let found = bvh.find(&format!("mixamorig:{name}")).unwrap_or_else(|| panic!("no {name}"));
            for frame in 0..5 {
                assert!(norm(sub(positions[frame][found], own_positions[frame][joint])) < 1e-3, "{name}");
            }
        }
    }
}
