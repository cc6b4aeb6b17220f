//! One network for several speakers, distinguished by an embedding: it generates as each of them, resumes bit-exactly,
//! and initialises the training of a new speaker.

use crate::fixtures::faults::stop::bytes;
use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::models::training::train_gan;
use crate::fixtures::write_dataset::write_dataset;
use candle_core::{Device, Tensor};
use ndarray::Array3;
use orator_base::stage::progress::Silent;
use orator_base::types::skeleton::{L_WRIST, parent};
use orator_base::types::sound::Sound;
use orator_dataset::config::GanConfig;
use orator_dataset::{Dataset, Split};
use orator_formats::{checkpoint, wav};
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::{BEST, GENERATOR, GenerationChoice};
use orator_gesture::train::epochs::ValidatedStep;
use orator_gesture::train::gan::pretrained::PretrainedModel;
use orator_gesture::train::gan::recipe::{self, InitialWeights, TrainingMaterial};
use orator_gesture::train::gan::speakers;
use orator_gesture::train::gan::train::{TrainingStart, train};
use orator_gesture::train::gan::windows::JoinedWindows;
use orator_gesture::train::gan::windows::WindowLoader;
use orator_nn::gan::speaker_layer::{SPEAKER, SPEAKER_EMBEDDING, SPEAKER_WEIGHT};
use orator_nn::weights::Contents;
use orator_test_support::project::ProgramAnswer;
use std::path::Path;
use std::process::Command;

const CONFIG: &str = r#"
[[speaker]]
name = "anna"
videos = ["videos/anna/*.mp4"]
[[speaker]]
name = "ben"
videos = ["videos/ben/*.mp4"]
[gan]
steps = 4
epoch_steps = 2
batch = 4
window_frames = 32
"#;

fn speaker(folder: &Path, name: &str, phase: f64, scale: f32) -> Dataset {
    let of = |split, number: u32, n_frames, phase| {
        let mut sample = sample(&format!("{name}-{number:08}-000000"), n_frames, phase);
        sample.motion.joints *= scale;
        (split, sample)
    };
    let samples = [of(Split::Train, 0, 128, phase), of(Split::Validation, 1, 64, phase + 1.0)];
    let dir = folder.join(name);
    write_dataset(&dir, name, FPS, &samples).unwrap();
    Dataset::open(&dir).unwrap()
}

fn settings() -> GanConfig {
    let gan = GanConfig { batch: 4.into(), window_frames: 32, checkpoint_every: 3, ..GanConfig::default() };
    GanConfig { steps: 6.into(), epoch_steps: 3.into(), warmup_steps: 0.into(), final_lr_ratio: 1.0.into(), ..gan }
}

fn orator(dir: &Path, args: &str) -> ProgramAnswer {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.arg("--json").args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    ProgramAnswer { code: output.status.code().unwrap_or(-1), json, errors }
}

fn as_speaker(folder: &Path, name: &str) -> anyhow::Result<GestureGenerator> {
    GestureGenerator::open_as(folder, &GenerationChoice { speaker: Some(name.to_owned()), seed: None }, &Device::Cpu)
}

#[test]
fn each_speaker_is_generated_with_its_own_skeleton() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let (anna, ben) = (speaker(dir, "anna", 0.0, 1.0), speaker(dir, "ben", 1.5, 1.2));
    let ignore = &mut |_: ValidatedStep| ();
    let both = dir.join("both");
    train(&[&anna, &ben], &settings(), &TrainingStart::default(), &both, &Silent, ignore).unwrap();

    let audio = Sound { rate: 16_000, samples: (0..48_000).map(|n| (n as f32 * 0.05).sin() * 0.3).collect() };
    let motion = |name: &str| -> Array3<f32> {
        let generator = as_speaker(&both, name).unwrap();
        assert_eq!(generator.name(), name);
        generator.motion(&audio, &[]).unwrap().joints
    };
    let (of_anna, of_ben) = (motion("anna"), motion("ben"));
    let elbow = parent(L_WRIST).unwrap();
    let arm = |joints: &Array3<f32>| -> f32 {
        (0..3).map(|k| (joints[[9, L_WRIST, k]] - joints[[9, elbow, k]]).powi(2)).sum::<f32>().sqrt()
    };
    assert!((arm(&of_ben) / arm(&of_anna) - 1.2).abs() < 0.01, "{} {}", arm(&of_ben), arm(&of_anna));
    let error = format!("{:#}", GestureGenerator::open(&both).err().unwrap());
    assert!(error.contains("--speaker") && error.contains("anna, ben"), "{error}");
    let error = format!("{:#}", as_speaker(&both, "carl").err().unwrap());
    assert!(error.contains("\"carl\"") && error.contains("anna, ben"), "{error}");

    // Stopped and resumed, it ends with identical bytes.
    let parts = dir.join("parts");
    let half = GanConfig { steps: 3.into(), ..settings() };
    train(&[&anna, &ben], &half, &TrainingStart::default(), &parts, &Silent, ignore).unwrap();
    let error = train_gan(&anna, &settings(), &parts, &Silent).unwrap_err();
    assert!(format!("{error:#}").contains("2 speakers"), "{error:#}");
    train(&[&anna, &ben], &settings(), &TrainingStart::default(), &parts, &Silent, ignore).unwrap();
    let last = |out: &Path| std::fs::read(checkpoint::path(out, 6)).unwrap();
    assert!(last(&both) == last(&parts));
    let names = |out: &Path| bytes(out).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    assert_eq!(names(&both), names(&parts));

    // A new speaker is initialised from both, and is the only speaker of its network.
    let carl = speaker(dir, "carl", 0.7, 0.9);
    assert_starts_from_nearest_speaker(&both, &carl);
    let of_carl = dir.join("carl-gan");
    train(
        &[&carl],
        &settings(),
        &TrainingStart { from: Some(&both), ..TrainingStart::default() },
        &of_carl,
        &Silent,
        ignore,
    )
    .unwrap();
    let model = GestureGenerator::open(&of_carl).unwrap().metadata;
    assert_eq!((model.name.as_str(), model.network.n_speakers), ("carl", 1));
    let trained_on: Vec<&str> = model.videos.iter().map(|video| video.speaker.as_str()).collect();
    assert!(["anna", "ben", "carl"].iter().all(|name| trained_on.contains(name)), "{trained_on:?}");
    assert_trains_only_speaker_layer(&both, &carl, &dir.join("layer"));
    // Two speakers can also be initialised from a single one.
    train(
        &[&anna, &ben],
        &settings(),
        &TrainingStart { from: Some(&of_carl), ..TrainingStart::default() },
        &dir.join("all"),
        &Silent,
        ignore,
    )
    .unwrap();
    assert_eq!(as_speaker(&dir.join("all"), "ben").unwrap().metadata.network.n_speakers, 1);

    let error = train(&[&anna, &anna], &settings(), &TrainingStart::default(), &dir.join("twice"), &Silent, ignore)
        .unwrap_err();
    assert!(format!("{error:#}").contains("both of speaker anna"), "{error:#}");
}

/// The weights shared by all speakers do not change at a learning rate of 0.
fn assert_trains_only_speaker_layer(both: &Path, new: &Dataset, out: &Path) {
    let settings = GanConfig { shared_rate: 0.0.into(), ..settings() };
    train(
        &[new],
        &settings,
        &TrainingStart { from: Some(both), ..TrainingStart::default() },
        out,
        &Silent,
        &mut |_| (),
    )
    .unwrap();
    let initial = Contents::read(&both.join(BEST)).unwrap().part(GENERATOR);
    let trained = Contents::read(&checkpoint::path(out, 6)).unwrap().part("training.generator.");
    let values = |tensor: &Tensor| tensor.flatten_all().unwrap().to_vec1::<f32>().unwrap();
    for (name, tensor) in trained.iter().filter(|(name, _)| name.contains(".conv.") || name.starts_with("last")) {
        assert_eq!(values(tensor), values(&initial[name]), "{name}");
    }
    assert!(values(&trained[SPEAKER_WEIGHT]) != values(&initial[SPEAKER_WEIGHT].narrow(0, 0, 1).unwrap()));
}

/// A new speaker starts from the layer of a known speaker, or their mean, with the least error.
fn assert_starts_from_nearest_speaker(both: &Path, new: &Dataset) {
    let normal = speakers::normalisation(new).unwrap();
    let loader = WindowLoader::load(new, Split::Train, &normal, 32, 5).unwrap();
    let of =
        recipe::settings(&settings(), &TrainingMaterial::measure(&[new], 32), InitialWeights::SeveralSpeakers).unwrap();
    let metadata = speakers::metadata(new, &normal, &loader, &of, 1).unwrap();
    let windows = JoinedWindows::new(vec![loader]);
    let trainer =
        PretrainedModel::read(both).unwrap().trainer(vec![metadata], of, None, &windows, &orator::Device::Cpu).unwrap();
    let batch = windows.batch_changed(&(0..windows.len()).collect::<Vec<_>>(), &[]).unwrap();
    let initial_error = trainer.error(&batch).unwrap();

    let model = Contents::read(&both.join(BEST)).unwrap();
    let mut layers = model.part(GENERATOR);
    layers.retain(|name, _| name.starts_with(SPEAKER));
    assert_eq!(layers.keys().collect::<Vec<_>>(), [SPEAKER_EMBEDDING, SPEAKER_WEIGHT]);
    let of: [fn(&Tensor) -> candle_core::Result<Tensor>; 3] =
        [|table| table.narrow(0, 0, 1), |table| table.narrow(0, 1, 1), |table| table.mean_keepdim(0)];
    let errors = of.map(|of| {
        let layer = layers.iter().map(|(name, table)| (name.clone(), of(table).unwrap())).collect();
        trainer.initialise_from(&model, Some(&layer)).unwrap();
        trainer.error(&batch).unwrap()
    });
    let least = errors.into_iter().fold(f64::INFINITY, f64::min);
    assert!(initial_error == least && errors.iter().any(|error| *error > least), "{initial_error} of {errors:?}");
}

#[test]
fn the_commands_train_all_speakers_and_generate_and_evaluate_each() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let datasets = dir.join("work/dataset");
    std::fs::create_dir_all(&datasets).unwrap();
    let _two = (speaker(&datasets, "anna", 0.0, 1.0), speaker(&datasets, "ben", 1.5, 1.2));
    std::fs::write(dir.join("pipeline.toml"), CONFIG).unwrap();
    let trained = orator(dir, "train gan --speaker all");
    assert_eq!((trained.code, trained.json["speaker"].as_str()), (0, Some("anna, ben")), "{}", trained.errors);
    assert!(trained.json["next"].as_str().is_some_and(|next| next.contains("--speaker anna")), "{}", trained.json);
    let again = orator(dir, "train gan --dataset work/dataset/anna work/dataset/ben --out again");
    let best = |folder: &str| std::fs::read(dir.join(folder).join("best.safetensors")).unwrap();
    assert!(again.code == 0 && best("again") == best("work/gan/all"), "{}", again.errors);

    let samples = (0..32_000).map(|n| (n as f32 * 0.05).sin() * 0.3).collect();
    wav::write(&dir.join("speech.wav"), &Sound { rate: 16_000, samples }).unwrap();
    let generate = |more: &str| {
        orator(dir, &format!("generate --checkpoint work/gan/all --audio speech.wav --out motion.bvh {more}"))
    };
    let unnamed = generate("");
    assert!(unnamed.code != 0 && unnamed.errors.contains("--speaker"), "{}", unnamed.errors);
    let named = generate("--speaker ben");
    assert_eq!((named.code, named.json["speaker"].as_str()), (0, Some("ben")), "{}", named.errors);
    for name in ["anna", "ben"] {
        let evaluated = orator(
            dir,
            &format!("evaluate --dataset work/dataset/{name} --checkpoint work/gan/all --split validation"),
        );
        assert_eq!(evaluated.code, 0, "{}", evaluated.errors);
    }
}
