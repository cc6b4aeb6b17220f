//! Training with a limited look-ahead.

use crate::fixtures::gesture_dataset::{dataset_of, with_posture};
use crate::fixtures::models::training::train_gan;
use orator_base::stage::progress::Silent;
use orator_dataset::Split;
use orator_dataset::config::GanConfig;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::train::gan::augment::WindowChange;
use orator_gesture::train::gan::speakers::normalisation_with_channels;
use orator_gesture::train::gan::train::{TrainingStart, train};
use orator_gesture::train::gan::windows::WindowLoader;
use orator_nn::gan::look_ahead::LookAhead;

fn values(tensor: &candle_core::Tensor) -> Vec<f32> {
    tensor.flatten_all().unwrap().to_vec1().unwrap()
}

#[test]
fn windows_have_the_sound_of_later_frames() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let dataset = dataset_of(folder.path(), with_posture);
    let normal = normalisation_with_channels(&dataset, &[])?;
    let load = |bytes| WindowLoader::load_within(bytes, &dataset, Split::Train, &normal, 32, 3);
    // Three frames at 15 fps are 20 spectrogram frames.
    let look_ahead = LookAhead { secs: 0.5, shift: 20, encoded_per_frame: (20, 24) };
    let same = WindowChange { speed: 1.0, ..WindowChange::default() };
    for bytes in [0, usize::MAX] {
        let (plain, moved) = (load(bytes)?, load(bytes)?.with_look_ahead(Some(look_ahead)));
        assert_eq!(plain.len(), moved.len());
        let [first, second] = [[0], [1]].map(|which| plain.batch(&which).unwrap());
        for batch in
            [moved.batch(&[0])?, moved.batch_changed(&[0], std::slice::from_ref(&same))?, moved.part(0, 0..32)?]
        {
            let seen = |of: &candle_core::Tensor| values(&(of * &first.mask).unwrap());
            assert!(seen(&batch.poses) == seen(&first.poses), "the motion has moved");
            let (found, expected) = (batch.mels.narrow(2, 0, 213)?, second.mels.narrow(2, 0, 213)?);
            let off = (found - expected)?.abs()?.max_all()?.to_scalar::<f32>()?;
            assert!(off < 1e-5, "{off}");
        }
        // 1.6 s of the future are known in fewer windows.
        let far = load(bytes)?.with_look_ahead(Some(LookAhead { shift: 160, ..look_ahead }));
        assert!(far.len() < plain.len() && !far.is_empty());
    }
    Ok(())
}

#[test]
fn a_training_stores_its_look_ahead_and_refuses_others() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let dataset = dataset_of(folder.path(), with_posture);
    let settings = GanConfig {
        batch: 4.into(),
        window_frames: 32,
        steps: 3.into(),
        epoch_steps: 3.into(),
        look_ahead_secs: 0.5,
        ..GanConfig::default()
    };
    let out = folder.path().join("bounded");
    train_gan(&dataset, &settings, &out, &Silent)?;
    let generator = GestureGenerator::open(&out)?;
    assert_eq!((generator.look_ahead()?.secs, generator.look_ahead()?.shift), (0.5, 10));
    let start = TrainingStart { from: Some(&out), ..TrainingStart::default() };
    let complete = GanConfig { look_ahead_secs: 0.0, ..settings.clone() };
    let other = folder.path().join("other");
    let error = train(&[&dataset], &complete, &start, &other, &Silent, &mut |_| ()).unwrap_err().to_string();
    assert!(error.contains("set gan.look_ahead_secs = 0.5"), "{error}");
    for wrong in [GanConfig { look_ahead_secs: 0.1, ..settings.clone() }, GanConfig { words: true, ..settings.clone() }]
    {
        let error = train_gan(&dataset, &wrong, &other, &Silent).unwrap_err().to_string();
        assert!(error.contains("gan.look_ahead_secs"), "{error}");
    }
    Ok(())
}
