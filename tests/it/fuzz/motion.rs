//! Readers of motion capture: BVH, the authors' text format, hand labels, and the takes of an import.

use crate::fixtures::fuzzing::harness::{corpus, fixtures, folder, fuzz_bytes, fuzz_file};
use orator_avatar::animate::retarget::captured_body::CapturedBody;
use orator_base::types::time::FrameRate;
use orator_dataset::import::find::TakeFiles;
use orator_dataset::import::take::{ImportedTake, TakeLimits};
use orator_formats::authors_txt;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::mocap::captured::MotionKind;
use orator_formats::mocap::motion_file;
use orator_lab::mocap::fingers::files as fingers;
use orator_lab::mocap::upper_body;

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
    let kinds = [(MotionKind::Authors, "a.txt"), (MotionKind::Bvh, "a.bvh"), (MotionKind::Ted, "capture-ted.npz")];
    let dir = folder();
    let files = kinds.map(|(_, name)| {
        let family = if name.ends_with("npz") { "arrays" } else { "motion" };
        std::fs::read(fixtures(family).join(name)).unwrap()
    });
    fuzz_bytes("take", &files, |bytes| {
        for (kind, name) in kinds {
            let motion = dir.path().join(name);
            std::fs::write(&motion, bytes).unwrap();
            let files = TakeFiles { kind, motion, sound: None, transcripts: Vec::new() };
            let _ = ImportedTake::read(&files, &limits, "host");
        }
    });
}
