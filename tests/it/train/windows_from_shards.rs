//! Windows from_shards from the shards one by one are bit-identical to those of intervals in memory.

use crate::fixtures::gesture_dataset::{dataset_of, with_posture};
use orator_base::types::posture::PostureChannel;
use orator_dataset::Split;
use orator_dataset::config::{GanConfig, GanRecipe};
use orator_gesture::train::gan::augment::changes;
use orator_gesture::train::gan::recipe::{self, InitialWeights, TrainingMaterial};
use orator_gesture::train::gan::speakers::normalisation_with_channels;
use orator_gesture::train::gan::windows::{WindowBatch, WindowLoader};

fn values(batch: &WindowBatch) -> Vec<Vec<f32>> {
    let of = |tensor: &candle_core::Tensor| tensor.flatten_all().unwrap().to_vec1().unwrap();
    [&batch.mels, &batch.poses, &batch.mask].map(of).into()
}

#[test]
fn windows_from_shards_equal_those_from_memory() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset_of(folder.path(), with_posture);
    let normal = normalisation_with_channels(&dataset, &PostureChannel::ALL).unwrap();
    let load = |max_bytes| WindowLoader::load_within(max_bytes, &dataset, Split::Train, &normal, 32, 3).unwrap();
    let (in_memory, from_shards) = (load(usize::MAX), load(0));
    assert_eq!(in_memory.len(), from_shards.len());
    let indices: Vec<usize> = (0..in_memory.len()).collect();
    assert_eq!(values(&in_memory.batch(&indices).unwrap()), values(&from_shards.batch(&indices).unwrap()));
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
        let indices: Vec<usize> = (0..changes.len()).map(|i| (i * 7 + step) % in_memory.len()).collect();
        let [in_memory, from_shards] =
            [&in_memory, &from_shards].map(|loader| loader.batch_changed(&indices, &changes).unwrap());
        assert!(!changes.is_empty());
        assert_eq!(values(&in_memory), values(&from_shards), "step {step}");
    }
    for (interval, frames) in in_memory.parts(50) {
        let [in_memory, from_shards] =
            [&in_memory, &from_shards].map(|loader| loader.part(interval, frames.clone()).unwrap());
        assert_eq!(values(&in_memory), values(&from_shards), "{interval} {frames:?}");
    }
    let poses = |loader: &WindowLoader| loader.poses(50).map(|pose| pose.unwrap()).collect::<Vec<_>>();
    assert_eq!(poses(&in_memory), poses(&from_shards));
}
