//! Tests of `orator_gesture::generate::seq2seq::metadata`.

use orator_base::types::time::FrameRate;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_gesture::generate::seq2seq::architecture::{Architecture, Vocabulary, network_config};
use orator_gesture::generate::seq2seq::metadata::{KIND, SequenceMetadata};
use orator_gesture::generate::seq2seq::poses::PoseFormat;

#[test]
fn the_number_of_discriminator_blocks_is_free_from_two_to_six() {
    let fps = FrameRate::new(15, 1);
    let values = |value: f32| vec![value; N_FEATURES];
    let bone_lengths = vec![0.1; N_FEATURES / 3];
    let normalisation = Normalisation { mean: values(0.0), std: values(1.0), bone_lengths, channels: Vec::new() };
    let representation = Representation::Bones { mean: values(0.0), std: values(1.0) };
    let stored = serde_json::json!({
        "kind": KIND,
        "name": "",
        "fps": fps,
        "rate": 16_000,
        "architecture": Architecture::Adversarial,
        "network": network_config(fps, N_FEATURES, Vocabulary::default().n_indices(), [8, 8]),
        "poses": PoseFormat::Joints { normalisation, representation },
        "vocabulary": Vocabulary::default(),
        "dataset": "",
    });
    let check = |n_blocks: Option<usize>| {
        let mut stored = stored.clone();
        if let Some(n_blocks) = n_blocks {
            stored["network"]["score_blocks"] = n_blocks.into();
        }
        serde_json::from_value::<SequenceMetadata>(stored).unwrap().check()
    };
    // Checkpoints of earlier versions do not state the number.
    for n_blocks in [None, Some(2), Some(3), Some(6)] {
        check(n_blocks).unwrap();
    }
    for n_blocks in [0, 1, 7] {
        assert!(check(Some(n_blocks)).unwrap_err().to_string().contains("expected 2..=6"));
    }
}
