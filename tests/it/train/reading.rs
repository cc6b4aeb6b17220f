//! The readings of FineMotion's paper and code: values of every key, length of a training, keys without effect.

use orator_base::types::time::FrameRate;
use orator_dataset::config::{
    ContinuityLoss, DistanceLoss, FineMotionReading, SeamState, Seq2seqConfig, Seq2seqSettings, SequenceNetwork,
    VarianceLoss,
};
use orator_gesture::train::seq2seq::reading::{self, check, line, set_length, settings};

/// Settings for `n_segments` at 20 fps.
fn resolved(requested: &Seq2seqConfig, n_segments: usize) -> Seq2seqSettings {
    let mut settings = settings(requested).unwrap();
    set_length(&mut settings, requested, n_segments, 20, FrameRate::new(20, 1)).unwrap();
    settings
}

fn requested(reading: FineMotionReading, network: SequenceNetwork) -> Seq2seqConfig {
    Seq2seqConfig { reading, network, ..Seq2seqConfig::default() }
}

/// Both readings in numbers, for FineMotion's 3 h 28 min. Sources: `READING_ROWS`.
#[test]
fn both_readings_set_every_value() {
    // Contextual: 12,480 segments of one second; words: one at every frame of 20 per second.
    for (network, n_segments, batch, stride_frames, per_epoch) in [
        (SequenceNetwork::Contextual, 12_480, 50, 0, 250),
        (SequenceNetwork::Words, 249_600, 512, 1, 488),
        (SequenceNetwork::Audio, 249_600, 512, 1, 488),
        (SequenceNetwork::Adversarial, 12_480, 50, 0, 250),
        (SequenceNetwork::Autoencoder, 12_480, 50, 0, 250),
    ] {
        let shared = Seq2seqSettings {
            network,
            batch,
            stride_frames,
            epochs: 100,
            steps: 100 * per_epoch,
            epoch_steps: per_epoch,
            autoencoder_steps: 50 * per_epoch,
            learning_rate: if network == SequenceNetwork::Autoencoder { 3e-4 } else { 1e-3 },
            lambda_continuity: 0.01,
            lambda_variance: 1.0,
            scheduled_sampling: 1.0,
            rollout_previous: 0.0,
            word_dropout: 0.0,
            hidden: 150,
            patience: 0,
            decay_start: 0,
            ..Seq2seqSettings::default()
        };
        let paper = Seq2seqSettings {
            reading: FineMotionReading::Paper,
            distance: DistanceLoss::Mse,
            continuity: ContinuityLoss::Poses,
            variance_loss: VarianceLoss::Variance,
            words_around_secs: 0.5,
            state_at_seams: match network {
                SequenceNetwork::Autoencoder => SeamState::Renewed,
                _ => SeamState::Carried,
            },
            lambda_adversarial: 0.1,
            ..shared.clone()
        };
        let code = Seq2seqSettings {
            reading: FineMotionReading::Code,
            distance: DistanceLoss::L1,
            continuity: ContinuityLoss::Numbers,
            variance_loss: VarianceLoss::Norm,
            words_around_secs: 2.0,
            state_at_seams: SeamState::Renewed,
            lambda_adversarial: 0.01,
            ..shared
        };
        for expected in [paper, code] {
            assert_eq!(resolved(&requested(expected.reading, network), n_segments), expected);
        }
    }
    // Single keys override the reading.
    let overridden = Seq2seqConfig {
        distance: DistanceLoss::L1,
        epochs: 3.into(),
        batch: 100.into(),
        ..requested(FineMotionReading::Paper, SequenceNetwork::Contextual)
    };
    let settings = resolved(&overridden, 1_000);
    assert_eq!((settings.distance, settings.steps, settings.epoch_steps), (DistanceLoss::L1, 30, 100));
    assert_eq!(settings.continuity, ContinuityLoss::Poses);
}

#[test]
fn the_length_of_a_training_follows_from_its_data() {
    let auto = |n_segments| resolved(&Seq2seqConfig::default(), n_segments);
    let length = |settings: Seq2seqSettings| (settings.epochs, settings.steps, settings.epoch_steps);
    // 2, 10 and 30 minutes, and 3 h 28 min.
    assert_eq!(length(auto(120)), (400, 1_200, 102));
    assert_eq!(length(auto(600)), (200, 2_400, 108));
    assert_eq!(length(auto(1_800)), (100, 3_600, 108));
    assert_eq!(length(auto(12_480)), (80, 20_000, 250));
    assert_eq!((auto(1).epochs, auto(100_000).epochs), (400, 80));
    // A segment at every frame of 20 is 20 times the segments of as many minutes.
    let overlapping = Seq2seqConfig { stride_frames: 1.into(), ..Seq2seqConfig::default() };
    assert_eq!(length(resolved(&overlapping, 12_000)), (10, 2_400, 240));
    let given = Seq2seqConfig { steps: 50.into(), epoch_steps: 20.into(), ..Seq2seqConfig::default() };
    assert_eq!(length(resolved(&given, 600)), (5, 50, 20));
    assert!(line(&auto(600)).contains("2400 steps of 50 segments (200 epochs)"), "{}", line(&auto(600)));
    let error = |settings: Seq2seqConfig| {
        let mut resolved = reading::settings(&settings).unwrap();
        let length = set_length(&mut resolved, &settings, 600, 20, FrameRate::new(20, 1));
        length.err().map(|error| error.to_string()).unwrap_or_default()
    };
    let of = |network| Seq2seqConfig { steps: 50.into(), network, ..Seq2seqConfig::default() };
    let text = "seq2seq.decay_start is 50, expected fewer than the 50 steps of the training";
    assert_eq!(error(Seq2seqConfig { decay_start: 50, ..of(SequenceNetwork::Words) }), text);
    let autoencoder = of(SequenceNetwork::Autoencoder);
    assert!(error(Seq2seqConfig { autoencoder_steps: 60.into(), ..autoencoder.clone() }).contains("60"));
    assert_eq!(resolved(&autoencoder, 600).autoencoder_steps, 25);
}

#[test]
fn keys_without_effect_are_errors() {
    let of = |network| requested(FineMotionReading::Auto, network);
    let error = |settings: Seq2seqConfig| check(&settings).err().map(|error| error.to_string());
    use SequenceNetwork::{Adversarial, Audio, Autoencoder, Contextual, Words};
    for network in [Contextual, Words, Audio, Adversarial, Autoencoder] {
        assert_eq!(error(of(network)), None);
    }
    let text = error(Seq2seqConfig { distance: DistanceLoss::Mse, ..of(Adversarial) }).unwrap();
    assert_eq!(
        text,
        "seq2seq.distance has no effect on the network \"adversarial\": remove it (it applies to \"contextual\", \
         \"words\", \"audio\")"
    );
    assert!(error(Seq2seqConfig { lambda_variance: 0.5, ..of(Adversarial) }).is_some());
    assert!(error(Seq2seqConfig { continuity: ContinuityLoss::Poses, ..of(Autoencoder) }).is_some());
    assert!(error(Seq2seqConfig { word_dropout: 0.1, ..of(Autoencoder) }).is_some());
    assert!(error(Seq2seqConfig { word_dropout: 0.1, ..of(Words) }).is_none());
    assert!(error(Seq2seqConfig { discriminator_blocks: 3, ..of(Contextual) }).is_some());
    let both = Seq2seqConfig { steps: 4.into(), epochs: 4.into(), ..of(Words) };
    assert!(error(both).unwrap().contains("both given"));
}
