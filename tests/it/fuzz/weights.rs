//! Readers of weights: speaker checkpoints, lifters, motion embeddings.

use crate::fixtures::fuzzing::harness::{corpus, fuzz_bytes, fuzz_file};
use candle_core::Device;
use orator_gesture::generate::model::{self, GenerationChoice};
use orator_gesture::metrics::space::{basis::Basis, embedding};
use orator_nn::weights::Contents;
use orator_pipeline::lift::weights;

#[test]
fn checkpoint() {
    fuzz_bytes("checkpoint", &corpus("weights", ""), |bytes| drop(Contents::from_bytes(bytes)));
}

#[test]
fn speaker() {
    fuzz_file("speaker", &corpus("weights", "speaker"), "best.safetensors", |path| {
        drop(model::load(path, &GenerationChoice::default(), &Device::Cpu));
    });
}

#[test]
fn lifters() {
    fuzz_file("lifters", &corpus("weights", "lifter"), "a.safetensors", |path| {
        let _ = (weights::hands(path), weights::body(path));
    });
}

#[test]
fn motion_embeddings() {
    fuzz_bytes("motion_embeddings", &corpus("weights", ""), |bytes| {
        let _ = (Basis::parse(bytes), embedding::parse(bytes));
    });
}
