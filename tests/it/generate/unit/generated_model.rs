//! Tests of `orator_gesture::generate::model`.

use candle_core::Device;
use orator_base::types::skeleton::N_BONES;
use orator_base::types::time::FrameRate;
use orator_gesture::generate::model::{GENERATOR, SpeakerMetadata, build};
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use std::collections::BTreeMap;

#[test]
fn implausible_metadata_is_rejected() {
    let table = vec![1.0; N_FEATURES];
    let normal =
        Normalisation { mean: table.clone(), std: table, bone_lengths: vec![0.1; N_BONES], channels: Vec::new() };
    let network = Config { width: 8, ..Config::from_preset(Preset::Light, N_FEATURES) };
    let facts =
        SpeakerMetadata::new("host", FrameRate::new(15, 1), "", network.clone(), normal, Representation::Positions);
    let mut params = Params::new(0);
    Generator::new(&mut params, &network).unwrap();
    let mut contents = Contents { facts: serde_json::json!({ "speaker": facts }), tensors: BTreeMap::new() };
    contents.add(GENERATOR, params.tensors().unwrap());
    build(&contents, &Device::Cpu).unwrap();
    for (pointer, value) in [
        ("/speaker/network/width", 1_000_000),
        ("/speaker/network/width", 0),
        ("/speaker/network/n_mels", 1_000_000),
        ("/speaker/network/vocabulary", 3),
        ("/speaker/fps/num", 4_000_000_000u32),
        ("/speaker/representation", 7),
        ("/speaker/fps/den", 0),
        ("/speaker/normalisation/std/3", 0),
    ] {
        let mut facts = contents.facts.clone();
        facts["speaker"]["network"]["vocabulary"] = 0.into();
        *facts.pointer_mut(pointer).unwrap() = value.into();
        let wrong = Contents { facts, tensors: contents.tensors.clone() };
        assert!(build(&wrong, &Device::Cpu).is_err(), "{pointer} {value}");
    }
    for (field, value) in [("bone_lengths", -0.1), ("std", -1.0), ("mean", 1e300)] {
        let mut facts = contents.facts.clone();
        facts["speaker"]["normalisation"][field][5] = value.into();
        let wrong = Contents { facts, tensors: contents.tensors.clone() };
        let text = format!("{:#}", build(&wrong, &Device::Cpu).err().unwrap());
        assert!(text.contains("normalisation"), "{field}: {text}");
    }
}
