//! Readers of motion capture: BVH, the authors' text format, hand labels, and the takes of an import; skeletons for
//! retargeting.

use crate::fixtures::figures::swinging;
use crate::fixtures::fuzzing::harness::{corpus, fixtures, folder, fuzz_bytes, fuzz_file};
use crate::foreign::retargeted::glb_file;
use orator_avatar::animate::retarget::bone_map::BoneMap;
use orator_avatar::animate::retarget::captured_body::CapturedBody;
use orator_avatar::animate::retarget::retargeted::RetargetRig;
use orator_avatar::animate::{AnimationOptions, Performance, perform};
use orator_base::types::time::FrameRate;
use orator_dataset::import::find::TakeFiles;
use orator_dataset::import::take::{ImportedTake, TakeLimits};
use orator_formats::authors_txt;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::mocap::captured::MotionKind;
use orator_formats::mocap::motion_file;
use orator_lab::mocap::fingers::files as fingers;
use orator_lab::mocap::upper_body;
use serde_json::{Value, json};
use std::path::Path;

const FPS: FrameRate = FrameRate::new(15, 1);

#[test]
fn bvh() {
    fuzz_bytes("bvh", &corpus("motion", "a.bvh"), |bytes| {
        if let Ok(bvh) = Bvh::from_bytes(bytes) {
            drop(bvh.positions(Positions::Auto));
        }
    });
}

#[test]
fn bvh_motion() {
    fuzz_file("bvh_motion", &corpus("motion", "a.bvh"), "a.bvh", |path| {
        let _ = (
            motion_file::read(path, None),
            upper_body::read(path),
            fingers::read(path),
            CapturedBody::read(path, None),
        );
    });
}

#[test]
fn authors_text() {
    fuzz_bytes("authors_text", &corpus("motion", "a.txt"), |bytes| {
        if let Ok(motion) = authors_txt::parse(&String::from_utf8_lossy(bytes), FPS) {
            let _ = motion.in_range();
        }
    });
}

#[test]
fn hand_labels() {
    fuzz_file("hand_labels", &corpus("motion", "labels"), "a.txt", |path| drop(fingers::read(path)));
}

#[test]
fn take() {
    let limits = TakeLimits { fps: FPS, min_frames: 1, max_difference_secs: 60.0, no_sound: true, units: None };
    let kinds = [
        (MotionKind::Authors, "a.txt"),
        (MotionKind::Bvh, "a.bvh"),
        (MotionKind::Ted, "capture-ted.npz"),
        (MotionKind::Smplx, "capture-seamless.npz"),
    ];
    let dir = folder();
    let files = kinds.map(|(_, name)| {
        let family = if name.ends_with("npz") { "arrays" } else { "motion" };
        std::fs::read(fixtures(family).join(name)).unwrap()
    });
    fuzz_bytes("take", &files, |bytes| {
        for (kind, name) in kinds {
            let motion = dir.path().join(name);
            std::fs::write(&motion, bytes).unwrap();
            let files = TakeFiles { kind, motion, sound: None, transcripts: Vec::new(), genea: None, origin: None };
            let _ = ImportedTake::read(&files, &limits, "host");
        }
    });
}

/// Joints of an upper body: index of the parent, name in VRM, offset in metres.
const UPPER_BODY: [(usize, &str, [f64; 3]); 10] = [
    (10, "hips", [0.0, 0.95, 0.0]),
    (0, "spine", [0.0, 0.2, 0.0]),
    (1, "neck", [0.0, 0.25, 0.0]),
    (2, "head", [0.0, 0.1, 0.02]),
    (1, "leftUpperArm", [0.18, 0.2, 0.0]),
    (4, "leftLowerArm", [0.28, 0.0, 0.0]),
    (5, "leftHand", [0.25, 0.0, 0.0]),
    (1, "rightUpperArm", [-0.18, 0.2, 0.0]),
    (7, "rightLowerArm", [-0.28, 0.0, 0.0]),
    (8, "rightHand", [-0.25, 0.0, 0.0]),
];

/// Skeletons of named joints below a node with a matrix, and of unnamed joints with the humanoids of VRM 1.0 and 0.x.
fn glb_skeletons() -> Vec<Vec<u8>> {
    let file = |has_names: bool, extensions: Value| {
        let children = |of: usize| {
            let joints = UPPER_BODY.iter().enumerate();
            joints.filter(|(_, (parent, _, _))| *parent == of).map(|(n, _)| n).collect::<Vec<_>>()
        };
        let node = |(n, (_, name, offset)): (usize, &(usize, &str, [f64; 3]))| {
            let name = if has_names { format!("rig:{name}_0{n}") } else { format!("N{n}") };
            json!({ "name": name, "translation": offset, "children": children(n) })
        };
        let mut nodes: Vec<Value> = UPPER_BODY.iter().enumerate().map(node).collect();
        nodes.push(json!({ "children": children(10), "matrix": [
            0.0, 0.0, -0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0, 1.0] }));
        let scene = json!({ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [10] }], "nodes": nodes,
            "extensions": extensions });
        glb_file(&scene, &[])
    };
    let bones = UPPER_BODY.iter().enumerate();
    let current = bones.clone().map(|(n, (_, name, _))| ((*name).to_owned(), json!({ "node": n })));
    let current = Value::Object(current.collect());
    let former: Vec<Value> = bones.map(|(n, (_, name, _))| json!({ "bone": name, "node": n })).collect();
    vec![
        file(true, json!({})),
        file(false, json!({ "VRMC_vrm": { "humanoid": { "humanBones": current } } })),
        file(false, json!({ "VRM": { "humanoid": { "humanBones": former } } })),
    ]
}

/// Moves the joints of a skeleton by a performance if the file has a usable one.
fn retarget(path: &Path, performance: &Performance) {
    let Ok(rig) = RetargetRig::open(path) else { return };
    let map = BoneMap::draft(rig.rig());
    drop(map.text(rig.rig(), &performance.rig.skeleton));
    if map.check(rig.rig()).is_ok() {
        let _ = rig.moved(performance, &map);
    }
}

#[test]
fn retarget_bvh() {
    let performance = perform(&swinging(5, 2), None, &AnimationOptions::default());
    fuzz_file("retarget_bvh", &corpus("motion", "a.bvh"), "a.bvh", |path| retarget(path, &performance));
}

#[test]
fn retarget_glb() {
    let performance = perform(&swinging(5, 2), None, &AnimationOptions::default());
    let (dir, files) = (folder(), glb_skeletons());
    for file in &files {
        let path = dir.path().join("a.glb");
        std::fs::write(&path, file).unwrap();
        BoneMap::detect(RetargetRig::open(&path).unwrap().rig()).unwrap();
    }
    fuzz_file("retarget_glb", &files, "a.glb", |path| retarget(path, &performance));
}

#[test]
fn bone_map() {
    let dir = folder();
    let path = dir.path().join("a.glb");
    std::fs::write(&path, &glb_skeletons()[0]).unwrap();
    let rig = RetargetRig::open(&path).unwrap();
    let ours = perform(&swinging(5, 2), None, &AnimationOptions::default()).rig.skeleton;
    let text = BoneMap::detect(rig.rig()).unwrap().text(rig.rig(), &ours);
    fuzz_bytes("bone_map", &[text.into_bytes()], |bytes| {
        let _ = BoneMap::parse(&String::from_utf8_lossy(bytes), rig.rig(), &ours);
    });
}
