//! Tests of `orator_gesture::train::gan::speakers`.

use anyhow::Result;
use candle_core::{DType, Device};
use ndarray::Array2;
use orator_base::types::skeleton::{N_BONES, N_JOINTS};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{BoneLoss, NetworkPreset};
use orator_gesture::generate::model::SpeakerMetadata;
use orator_gesture::generate::normalisation::Normalisation;
use orator_gesture::generate::representation::Representation;
use orator_gesture::train::gan::speakers::{SpeakerSet, network};
use orator_nn::gan::generator::{Config, Preset};
use orator_test_support::gradcheck::pattern;

fn speaker(mean: f32, representation: Representation, n_speakers: usize) -> SpeakerMetadata {
    let table = |value: f32| Array2::from_shape_fn((N_JOINTS, 3), |(j, k)| value + 0.01 * (j + 2 * k) as f32);
    let normal = Normalisation::new(&table(mean), &table(0.3), vec![0.1 + mean; N_BONES]);
    let network = Config { n_speakers, ..Config::from_preset(Preset::Light, normal.n_features()) };
    SpeakerMetadata::new("host", FrameRate::new(15, 1), "", network, normal, representation)
}

#[test]
fn small_is_light_with_half_the_channels() {
    let [small, light] = [NetworkPreset::Small, NetworkPreset::Light].map(|preset| network(preset, 144));
    assert_eq!(small, Config { width: 128, ..light });
}

/// Windows of a mixed batch are decoded as by a network of one speaker.
#[test]
fn every_speaker_has_a_separate_decoder() -> Result<()> {
    let bones = || Representation::Bones { mean: vec![0.1; 3 * N_BONES], std: vec![0.5; 3 * N_BONES] };
    for representation in [bones, || Representation::Positions] {
        let two = |n_speakers| [0.1, 0.4].map(|mean| speaker(mean, representation(), n_speakers));
        let both = SpeakerSet::new(two(2).to_vec(), BoneLoss::Relative, &Device::Cpu)?;
        let alone: Vec<SpeakerSet> = two(0)
            .into_iter()
            .map(|of| SpeakerSet::new(vec![of], BoneLoss::Relative, &Device::Cpu))
            .collect::<Result<_>>()?;
        let raw = pattern(&[4, 3 * N_BONES, 6], 0.0)?.to_dtype(DType::F32)?;
        let speakers = [0, 1, 1, 0];
        let poses = both.poses(&raw, &speakers)?;
        let mut losses = 0.0;
        for (i, speaker) in speakers.into_iter().enumerate() {
            let of = &alone[speaker as usize];
            let expected = of.poses(&raw.narrow(0, i, 1)?, &[0])?;
            let own = poses.narrow(0, i, 1)?;
            assert_eq!(own.flatten_all()?.to_vec1::<f32>()?, expected.flatten_all()?.to_vec1::<f32>()?);
            let loss = of.bone_loss(&expected, &[0])?;
            losses += loss.map_or(Ok(0.0), |loss| loss.to_scalar::<f32>())? / 4.0;
        }
        let loss = both.bone_loss(&poses, &speakers)?.map_or(Ok(0.0), |loss| loss.to_scalar::<f32>())?;
        assert!((loss - losses).abs() <= 1e-5 * losses, "{loss} {losses}");
    }
    assert!(SpeakerSet::new(Vec::new(), BoneLoss::Relative, &Device::Cpu).is_err());
    let other = SpeakerMetadata { fps: FrameRate::new(25, 1), ..speaker(0.1, bones(), 2) };
    let error = SpeakerSet::new(vec![speaker(0.1, bones(), 2), other], BoneLoss::Relative, &Device::Cpu).err();
    assert!(error.is_some_and(|error| error.to_string().contains("25")));
    Ok(())
}
