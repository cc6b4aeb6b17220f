//! Windows that are read from the shards one by one are those of intervals held in memory, to the bit.

use crate::fixtures::gesture_dataset::{dataset_of, with_posture};
use orator_base::types::posture::PostureChannel;
use orator_dataset::Split;
use orator_dataset::config::{GanConfig, GanRecipe};
use orator_gesture::train::gan::augment::changes;
use orator_gesture::train::gan::recipe::{self, InitialWeights, TrainingMaterial};
use orator_gesture::train::gan::speaker_metadata::normalisation_with_channels;
use orator_gesture::train::gan::windows::{WindowBatch, WindowLoader};

fn values(batch: &WindowBatch) -> Vec<Vec<f32>> {
    let of = |tensor: &candle_core::Tensor| tensor.flatten_all().unwrap().to_vec1().unwrap();
    [&batch.mels, &batch.poses, &batch.mask].map(of).into()
}

#[test]
fn windows_from_shards_are_those_from_memory() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset_of(folder.path(), with_posture);
    let normal = normalisation_with_channels(&dataset, &PostureChannel::ALL).unwrap();
    let load = |most_bytes| WindowLoader::load_within(most_bytes, &dataset, Split::Train, &normal, 32, 3).unwrap();
    let (held, read) = (load(usize::MAX), load(0));
    assert_eq!(held.len(), read.len());
    let which: Vec<usize> = (0..held.len()).collect();
    assert_eq!(values(&held.batch(&which).unwrap()), values(&read.batch(&which).unwrap()));
    let material = TrainingMaterial::measure(&[&dataset], 32);
    let config = GanConfig {
        recipe: GanRecipe::Auto,
        channels: PostureChannel::ALL.to_vec(),
        batch: 16.into(),
        augment_speed: 0.3.into(),
        augment_mirror: 0.5,
        ..GanConfig::default()
    };
    let settings = recipe::settings(&config, &material, InitialWeights::Random).unwrap();
    for step in 0..20 {
        let changes = changes(&settings, step, dataset.info().fps);
        // First, last and others.
        let which: Vec<usize> = (0..changes.len()).map(|i| (i * 7 + step) % held.len()).collect();
        let [held, read] = [&held, &read].map(|loader| loader.batch_changed(&which, &changes).unwrap());
        assert!(!changes.is_empty());
        assert_eq!(values(&held), values(&read), "step {step}");
    }
    for (interval, frames) in held.parts(50) {
        let [held, read] = [&held, &read].map(|loader| loader.part(interval, frames.clone()).unwrap());
        assert_eq!(values(&held), values(&read), "{interval} {frames:?}");
    }
    let poses = |loader: &WindowLoader| loader.poses(50).map(|pose| pose.unwrap()).collect::<Vec<_>>();
    assert_eq!(poses(&held), poses(&read));
}
