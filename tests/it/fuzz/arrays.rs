//! Readers of arrays: `.npy` and `.npz`.

use crate::fixtures::fuzzing::harness::{corpus, fuzz_bytes, fuzz_file};
use orator_avatar::animate::retarget::captured_body::CapturedBody;
use orator_base::types::time::FrameRate;
use orator_dataset::sample::N_KEYPOINTS;
use orator_formats::mocap::motion_file;
use orator_formats::npy::{Element, Layout};
use orator_formats::npz::Npz;
use orator_formats::timeline_npz::Timeline;
use orator_formats::{joints_npz, keypoints, keypoints_npz, npy};
use orator_lab::mocap::fingers::files as fingers;
use orator_lab::mocap::upper_body;
use orator_pipeline::segment::Measures;

#[test]
fn npy() {
    let files = ["motion", "keypoints.npy", "keypoints-coco"].map(|name| corpus("arrays", name)).concat();
    fuzz_file("npy", &files, "a.npy", |path| {
        let _ = npy::read(path, FrameRate::new(15, 1));
        let _ = keypoints::read(path);
    });
}

#[test]
fn npy_slice() {
    let files = corpus("arrays", "slice");
    fuzz_bytes("npy_slice", &files, |bytes| {
        let _ = Layout::parse(bytes, bytes.len() as u64, Element::F32, &[N_KEYPOINTS, 3]);
        let _ = Layout::parse(bytes, bytes.len() as u64, Element::Bool, &[49]);
    });
}

#[test]
fn npz() {
    fuzz_file("npz", &corpus("arrays", ""), "a.npz", |path| {
        let Ok(mut npz) = Npz::open(path) else { return };
        for name in npz.names().to_vec() {
            let _ = (npz.numbers(&name, &[]), npz.floats(&name, &[]), npz.bools(&name, &[]));
            let _ = (npz.frame_rate(&name), npz.text(&name));
        }
    });
}

#[test]
fn pipeline_npz() {
    let files = ["joints", "keypoints.npz", "timeline", "measures"].map(|name| corpus("arrays", name)).concat();
    fuzz_file("pipeline_npz", &files, "a.npz", |path| {
        let _ = (joints_npz::read(path), keypoints_npz::read_noting(path), keypoints_npz::read_extras(path));
        let _ = (Timeline::read(path), Measures::read(path), keypoints::read(path), motion_file::read(path, None));
    });
}

#[test]
fn mocap_npz() {
    let files = corpus("arrays", "capture");
    fuzz_file("mocap_npz", &files, "a.npz", |path| {
        let _ = (orator_formats::mocap::ted::read(path), upper_body::read(path), fingers::read(path));
        let fps = Some(FrameRate::new(15, 1));
        let _ = (motion_file::read_at(path, fps, None), CapturedBody::read(path, None));
    });
}
