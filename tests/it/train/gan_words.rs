//! The GAN with words on a small synthetic speaker whose pose depends on the word that is spoken, while the audio is
//! constant: it follows the words, resumes exactly, hands its words on to another training, and generates with and
//! without a transcript.

use crate::fixtures::faults::stop::{Shared, Stop, bytes};
use crate::fixtures::gesture_dataset::{FPS, dataset, sample};
use crate::fixtures::models::training::train_gan;
use crate::fixtures::models::untrained::generate;
use crate::fixtures::write_dataset::write_dataset;
use ndarray::{ArrayView2, Axis, s};
use orator_base::stage::progress::Silent;
use orator_base::types::sound::Sound;
use orator_dataset::config::{GanConfig, GanRecipe, MotionRepresentation, NetworkPreset};
use orator_dataset::{Dataset, Sample, Split};
use orator_formats::transcript::{Word, WordSource};
use orator_formats::word_vectors::{WordVectors, glove};
use orator_formats::{checkpoint, wav};
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::{BEST, GENERATOR};
use orator_gesture::train::gan::train::{TrainingStart, train};
use orator_nn::weights::Contents;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::Arc;

const WORDS: [&str; 2] = ["left", "right"];
/// Frames of a word, and the frame of [`sample`] whose pose each word has.
const WORD_FRAMES: usize = 12;
const POSES: [usize; 2] = [5, 30];
/// Random bits: the order of the words.
const ORDER: u64 = 0x9c6a_53b1_74d2_2e8b;

/// Words in an irregular order, one every 12 frames.
fn spoken(n_frames: usize, key: usize) -> Vec<Word> {
    let word = |n: usize| Word {
        word: WORDS[which(n, key)].to_owned(),
        start_secs: FPS.secs(n * WORD_FRAMES),
        end_secs: FPS.secs((n + 1) * WORD_FRAMES),
        source: WordSource::Given,
        confidence: None,
    };
    (0..n_frames / WORD_FRAMES).map(word).collect()
}

fn which(n: usize, key: usize) -> usize {
    usize::from((ORDER >> ((n + 13 * key) % 64)) & 1 == 1)
}

/// An interval with the pose of each word during the word, and constant audio.
fn with_words(name: &str, n_frames: usize, key: usize) -> Sample {
    let mut interval = sample(name, n_frames, 0.0);
    let poses = POSES.map(|t| interval.motion.joints.index_axis(Axis(0), t).to_owned());
    for (t, mut joints) in interval.motion.joints.outer_iter_mut().enumerate() {
        joints.assign(&poses[which((t / WORD_FRAMES).min(n_frames / WORD_FRAMES - 1), key)]);
    }
    interval.motion.mask.fill(true);
    interval.sound = Sound { samples: vec![0.1; interval.sound.samples.len()], ..interval.sound };
    interval.words = Some(spoken(n_frames, key));
    interval
}

fn dataset_of_words(folder: &Path) -> Dataset {
    let samples = [
        (Split::Train, with_words("a-00000000-000000", 192, 0)),
        (Split::Train, with_words("b-00000000-000000", 180, 1)),
        (Split::Validation, with_words("c-00000000-000000", 128, 2)),
    ];
    write_dataset(folder, "host", FPS, &samples).unwrap();
    Dataset::open(folder).unwrap()
}

fn settings(steps: usize) -> GanConfig {
    GanConfig {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Small,
        representation: MotionRepresentation::Bones,
        words: true,
        batch: 4.into(),
        window_frames: 32,
        steps: steps.into(),
        epoch_steps: steps.div_ceil(2).into(),
        learning_rate: 1e-3.into(),
        lambda_gan: 0.0.into(),
        checkpoint_every: 2,
        ..GanConfig::default()
    }
}

#[test]
fn a_model_with_words_follows_the_words() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset_of_words(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    train_gan(&dataset, &GanConfig { checkpoint_every: 100, ..settings(80) }, &out, &Silent).unwrap();
    let speaker = GestureGenerator::open(&out).unwrap();
    let held_out = with_words("d-00000000-000000", 240, 3);
    let poses = POSES.map(|t| sample("d-00000000-000000", 240, 0.0).motion.joints.index_axis(Axis(0), t).to_owned());
    let follows = |words: &[Word]| {
        let motion = speaker.motion(&held_out.sound, words).unwrap();
        let correct = (1..240 / WORD_FRAMES).filter(|n| {
            let generated = motion.joints.index_axis(Axis(0), n * WORD_FRAMES + WORD_FRAMES / 2).to_owned();
            let distance = |pose: ArrayView2<f32>| (&generated - &pose).iter().map(|v| v * v).sum::<f32>();
            let own = which(*n, 3);
            distance(poses[own].view()) < distance(poses[1 - own].view())
        });
        correct.count()
    };
    let own = spoken(240, 3);
    let swapped = |word: &Word| Word { word: WORDS[usize::from(word.word == WORDS[0])].to_owned(), ..word.clone() };
    let swapped: Vec<Word> = own.iter().map(swapped).collect();
    let [own, swapped, without] = [&own[..], &swapped, &[]].map(follows);
    assert!(own >= 17 && swapped <= 2 && (4..=15).contains(&without), "{own} {swapped} {without} of 19");
}

#[test]
fn a_training_with_words_resumes_exactly_and_stores_its_vocabulary() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset_of_words(&folder.path().join("dataset"));
    let out = |name: &str| folder.path().join(name);
    let stop = Stop::at(u64::MAX);
    train_gan(&dataset, &settings(6), &out("whole"), &Shared(stop.clone())).unwrap();
    assert!(stop.said.lock().unwrap().join("\n").contains("vocabulary of 2 words"));
    let progress = Shared(Stop::at(4));
    let stopped =
        std::panic::catch_unwind(AssertUnwindSafe(|| train_gan(&dataset, &settings(6), &out("part"), &progress)));
    assert!(stopped.is_err());
    train_gan(&dataset, &settings(6), &out("part"), &Silent).unwrap();
    for ((name, expected), (_, resumed)) in bytes(&out("whole")).iter().zip(bytes(&out("part"))) {
        assert!(*expected == resumed, "{name}");
    }
    let facts = |name: &str| checkpoint::facts(&out(name).join(BEST)).unwrap();
    assert_eq!(facts("whole")["speaker"]["words"]["vocabulary"], serde_json::json!(WORDS));
    assert_eq!(facts("whole")["speaker"]["network"]["vocabulary"], 4);
    // Without the key nothing in a checkpoint mentions words.
    train_gan(&dataset, &GanConfig { words: false, ..settings(2) }, &out("audio"), &Silent).unwrap();
    let audio = facts("audio");
    assert!(!audio.to_string().contains("word") && !audio.to_string().contains("vocabulary"), "{audio}");
}

#[test]
fn common_words_keep_their_vectors_in_another_training() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let anna = dataset_of_words(&dir.join("anna"));
    train_gan(&anna, &settings(2), &dir.join("of_anna"), &Silent).unwrap();
    let renamed = |mut interval: Sample| {
        let words = interval.words.as_mut().unwrap();
        words.iter_mut().filter(|word| word.word == "left").for_each(|word| word.word = "up".to_owned());
        interval
    };
    let samples = [
        (Split::Train, renamed(with_words("a-00000000-000000", 192, 0))),
        (Split::Validation, renamed(with_words("c-00000000-000000", 128, 2))),
    ];
    write_dataset(&dir.join("ben"), "ben", FPS, &samples).unwrap();
    let ben = Dataset::open(dir.join("ben")).unwrap();
    glove::convert(&b"up 1 2 3\nright 3 2 1\n"[..], &dir.join("table.safetensors")).unwrap();
    let table = WordVectors::open(&dir.join("table.safetensors")).unwrap();
    let start = |from: Option<&Path>, vectors: Option<&WordVectors>, out: &str| {
        let settings = GanConfig { learning_rate: 1e-9.into(), ..settings(2) };
        train(
            &[&ben],
            &settings,
            &TrainingStart { from, vectors, ..TrainingStart::default() },
            &dir.join(out),
            &Silent,
            &mut |_| (),
        )
        .unwrap();
    };
    let rows = |out: &str| {
        let contents = Contents::read(&dir.join(out).join(BEST)).unwrap();
        contents.part(GENERATOR)["words.embedding.weight"].to_vec2::<f32>().unwrap()
    };
    let is_near = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
    // The vocabularies are padding, unknown, left, right and padding, unknown, right, up.
    start(Some(&dir.join("of_anna")), None, "from");
    let (of_anna, of_ben) = (rows("of_anna"), rows("from"));
    assert!(is_near(&of_ben[2], &of_anna[3]) && is_near(&of_ben[1], &of_anna[1]));
    assert!(!is_near(&of_ben[3], &of_anna[2]));
    start(None, Some(&table), "vectors");
    let of_table = rows("vectors");
    assert!(is_near(&of_table[3], &[1.0, 2.0, 3.0]) && is_near(&of_table[0], &[0.0; 3]), "{of_table:?}");

    // Other words take their vectors from the table in a model that was trained with one only.
    let mut model = GestureGenerator::open(&dir.join("vectors")).unwrap();
    let renamed_word = |text: &str| vec![Word { word: text.to_owned(), ..spoken(24, 0)[0].clone() }];
    let sound = with_words("d-00000000-000000", 64, 3).sound;
    let motion = |model: &GestureGenerator, text: &str| model.motion(&sound, &renamed_word(text)).unwrap();
    glove::convert(&b"down 9 9 9\n"[..], &dir.join("other.safetensors")).unwrap();
    let other = Arc::new(WordVectors::open(&dir.join("other.safetensors")).unwrap());
    let unknown = motion(&model, "down");
    model.set_word_vectors(other.clone()).unwrap();
    assert_ne!(motion(&model, "down"), unknown);
    assert_eq!(motion(&model, "sideways"), unknown);
    let error = GestureGenerator::open(&dir.join("from")).unwrap().set_word_vectors(other.clone()).unwrap_err();
    assert!(error.to_string().contains("trained without a table"), "{error}");
}

#[test]
fn settings_and_data_that_do_not_fit_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    let error = train_gan(&dataset, &settings(2), &out, &Silent).unwrap_err().to_string();
    assert!(error.contains("has no words") && error.contains("gan.words = false"), "{error}");
    let table = folder.path().join("table.safetensors");
    glove::convert(&b"up 1 2\n"[..], &table).unwrap();
    let (table, audio) = (WordVectors::open(&table).unwrap(), GanConfig { words: false, ..settings(2) });
    let error = train(
        &[&dataset],
        &audio,
        &TrainingStart { vectors: Some(&table), ..TrainingStart::default() },
        &out,
        &Silent,
        &mut |_| (),
    )
    .unwrap_err();
    assert!(error.to_string().contains("set gan.words = true"), "{error}");
}

#[test]
fn the_program_and_evaluations_pass_words_on() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let dataset = dataset_of_words(&dir.join("dataset"));
    train_gan(&dataset, &settings(4), &dir.join("model"), &Silent).unwrap();
    let held_out = with_words("d-00000000-000000", 96, 3);
    wav::write(&dir.join("speech.wav"), &held_out.sound).unwrap();
    let row = |word: &Word| format!("{}\t{}\t{}\n", word.start_secs, word.end_secs, word.word);
    let words = spoken(96, 3);
    std::fs::write(dir.join("speech.tsv"), words.iter().map(row).collect::<String>()).unwrap();
    std::fs::write(dir.join("other.tsv"), "0.1\t0.5\tgelb\n").unwrap();
    let run = |args: &str| {
        let output = generate(dir, &format!("--checkpoint model --audio speech.wav {args}"));
        assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
    };
    assert!(run("--out without.npy").contains("no words were given"));
    assert!(!run("--transcript speech.tsv --out with.npy").contains("note:"));
    assert!(run("--transcript other.tsv --out other.npy").contains("no word of the transcript"));
    let file = |name: &str| std::fs::read(dir.join(name)).unwrap();
    assert_ne!(file("with.npy"), file("without.npy"));

    // A batch finds the transcript beside the sound.
    let batch = generate(dir, "--checkpoint model --audio-folder . --out-folder made --format npy");
    assert!(batch.status.success(), "{}", String::from_utf8_lossy(&batch.stderr));
    assert_eq!(file("made/speech.npy"), file("with.npy"));

    let [evaluated] = &EvaluatedCheckpoint::open_all(&[dir.join("model")], "host").unwrap()[..] else { panic!() };
    assert!(evaluated.speaker.reads_words() && evaluated.speaker.n_words() == 2);
    let motion = |words: &[Word]| evaluated.motion(&held_out.sound, words, 96, FPS).unwrap().0;
    let speaker = GestureGenerator::open(&dir.join("model")).unwrap();
    let mut padded = held_out.sound.clone();
    padded.samples.push(0.0);
    assert_eq!(motion(&words).joints, speaker.motion(&padded, &words).unwrap().joints.slice(s![..96, .., ..]));
    assert_ne!(motion(&words), motion(&[]));
}
