//! End-to-end training of the sequence-to-sequence networks on synthetic motion that follows the pitch of a tone: it
//! learns, resumes exactly, and its checkpoints generate for audio of any length.

use crate::fixtures::animation::captures::{bvh, tone, write_capture, write_stereo};
use crate::fixtures::faults::stop::{Shared, Stop, bytes};
use crate::fixtures::gesture_dataset::{dataset, sample};
use crate::fixtures::models::training::train_seq2seq;
use orator_base::stage::progress::Silent;
use orator_dataset::config::{Seq2seqConfig, SequenceNetwork};
use orator_formats::bvh::exponential_maps::JointMapping;
use orator_formats::bvh::read::Bvh;
use orator_formats::transcript::Transcript;
use orator_formats::word_vectors::{WordVectors, glove};
use orator_gesture::generate::model::BEST;
use orator_gesture::generate::seq2seq::SequenceGenerator;
use orator_gesture::train::seq2seq::captures::CaptureFolder;
use orator_gesture::train::seq2seq::source::TrainingSource;
use std::panic::AssertUnwindSafe;
use std::path::Path;

fn settings(network: SequenceNetwork) -> Seq2seqConfig {
    let schedule = Seq2seqConfig {
        steps: 6.into(),
        epoch_steps: 3.into(),
        checkpoint_every: 2,
        keep_checkpoints: 2,
        ..Default::default()
    };
    let settings = Seq2seqConfig { network, batch: 3.into(), hidden: 8, stride_frames: 5.into(), ..schedule };
    match network {
        SequenceNetwork::Audio => Seq2seqConfig { scheduled_sampling: 0.5, ..settings },
        SequenceNetwork::Adversarial => Seq2seqConfig { discriminator_blocks: 3, ..settings },
        SequenceNetwork::Autoencoder => Seq2seqConfig { autoencoder_steps: 3.into(), ..settings },
        SequenceNetwork::Contextual | SequenceNetwork::Words => settings,
    }
}

fn open(dir: &Path, hold_out: &[&str]) -> anyhow::Result<CaptureFolder> {
    let hold_out: Vec<String> = hold_out.iter().map(|name| (*name).to_owned()).collect();
    CaptureFolder::open(dir, &hold_out, JointMapping::default())
}

#[test]
fn a_training_stopped_at_a_step_resumes_to_identical_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let source = TrainingSource::Dataset(&dataset);
    for (network, stops) in [
        (SequenceNetwork::Contextual, vec![3, 4]),
        (SequenceNetwork::Words, vec![5]),
        (SequenceNetwork::Audio, vec![4]),
        (SequenceNetwork::Adversarial, vec![3]),
        (SequenceNetwork::Autoencoder, vec![2, 5]),
    ] {
        let settings = settings(network);
        let out = |part: &str| folder.path().join(format!("{network:?}-{part}"));
        let outcome = train_seq2seq(source, None, &settings, &out("whole"), &Silent).unwrap();
        // 99 and 64 frames: a segment of 8 + 15 frames every five frames.
        assert_eq!((outcome.steps, outcome.n_examples, outcome.n_words), (6, 16 + 9, 0));
        assert_eq!((outcome.validation.split.as_str(), outcome.validation.n_segments), ("validation", 8));
        let uninterrupted = bytes(&out("whole"));
        let names: Vec<&str> = uninterrupted.iter().map(|(name, _)| name.as_str()).collect();
        assert!(
            ["metrics.jsonl", BEST, "step-0000004.safetensors", "step-0000006.safetensors"]
                .iter()
                .all(|name| names.contains(name))
        );
        for stop in stops {
            let parts = out(&stop.to_string());
            let progress = Shared(Stop::at(stop));
            let run = || train_seq2seq(source, None, &settings, &parts, &progress);
            assert!(std::panic::catch_unwind(AssertUnwindSafe(run)).is_err());
            let resumed = train_seq2seq(source, None, &settings, &parts, &Silent).unwrap();
            assert_eq!((resumed.began_at, resumed.steps), ([0, 0, 2, 3, 4, 4][stop as usize - 1], 6));
            for ((name, expected), (_, resumed)) in uninterrupted.iter().zip(bytes(&parts)) {
                assert!(*expected == resumed, "{name} of {network:?} differs after a stop at step {stop}");
            }
        }
    }
    // A checkpoint is not resumed with other data; settings other than its own are reported.
    let captures = folder.path().join("captures");
    write_capture(&captures, "a", 4.0, 0.0, false);
    let captures = open(&captures, &[]).unwrap();
    let out = folder.path().join("Contextual-whole");
    let text =
        train_seq2seq(TrainingSource::Captures(&captures), None, &settings(SequenceNetwork::Contextual), &out, &Silent);
    assert!(format!("{:#}", text.unwrap_err()).contains("choose another --out"));
    let stop = Stop::at(u64::MAX);
    train_seq2seq(source, None, &settings(SequenceNetwork::Words), &out, &Shared(stop.clone())).unwrap();
    assert!(stop.said.lock().unwrap().join("\n").contains("seq2seq.network"));
}

#[test]
fn the_loss_falls_and_the_model_generates() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let settings = Seq2seqConfig {
        steps: 80.into(),
        batch: 8.into(),
        hidden: 24,
        learning_rate: 2e-3.into(),
        lambda_variance: 0.0,
        epoch_steps: 80.into(),
        checkpoint_every: 80,
        ..settings(SequenceNetwork::Contextual)
    };
    let out = folder.path().join("out");
    let validation =
        train_seq2seq(TrainingSource::Dataset(&dataset), None, &settings, &out, &Silent).unwrap().validation;
    assert!(validation.l1 < validation.mean_pose_l1 && validation.energy > 0.3, "{validation:?}");
    let log = std::fs::read_to_string(out.join("metrics.jsonl")).unwrap();
    let line = |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["l1"].as_f64();
    let l1: Vec<f64> = log.lines().filter_map(line).collect();
    let end = l1.iter().rev().take(4).sum::<f64>() / 4.0;
    assert!(l1.len() == 8 && end < 0.7 * l1[0], "{l1:?}");

    let speaker = SequenceGenerator::open(&out).unwrap();
    let poses = speaker.poses(&sample("a-00000000-000000", 99, 0.0).sound, &[]).unwrap();
    let motion = speaker.motion(&poses).unwrap();
    assert_eq!((motion.n_frames(), poses.features.dim()), (99, (99, 144)));
    assert!(motion.joints.iter().all(|v| v.is_finite()) && poses.seam_jump.iter().all(|jump| jump.is_finite()));
    assert!(speaker.bvh(&poses).is_err());
    assert!(speaker.poses(&orator_base::types::sound::Sound { rate: 8_000, samples: vec![0.0; 8_000] }, &[]).is_err());
}

#[test]
fn models_of_captures_generate_for_audio_of_any_length() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("captures");
    write_capture(&dir, "a", 6.0, 0.0, true);
    write_capture(&dir, "b", 4.0, 2.0, false);
    write_capture(&dir, "c", 4.0, 4.0, true);
    let captures = open(&dir, &["c"]).unwrap();
    for (network, audio_context) in
        [(SequenceNetwork::Contextual, false), (SequenceNetwork::Words, false), (SequenceNetwork::Words, true)]
    {
        let out = folder.path().join(format!("{network:?} {audio_context}"));
        let settings = Seq2seqConfig { audio_context, ..settings(network) };
        let outcome = train_seq2seq(TrainingSource::Captures(&captures), None, &settings, &out, &Silent).unwrap();
        assert_eq!((outcome.validation.split.as_str(), outcome.n_words), ("validation", 2));
        let speaker = SequenceGenerator::open(&out).unwrap();
        let words = Transcript::read(&dir.join("a.tsv")).unwrap().words;
        assert_eq!((words.len(), speaker.metadata.vocabulary.number("World")), (6, 3));
        for (secs, n_frames) in [(0.9, 18), (7.33, 146), (70.0, 1400)] {
            let sound = tone(secs, 1.0);
            let (without_words, with_words) =
                (speaker.poses(&sound, &[]).unwrap(), speaker.poses(&sound, &words).unwrap());
            assert_eq!((without_words.features.nrows(), with_words.features.nrows()), (n_frames, n_frames));
            assert!(with_words.features != without_words.features, "{network:?} does not depend on words");
            for poses in [without_words, with_words] {
                assert!(poses.features.iter().all(|v| v.is_finite()));
                let back = Bvh::parse(&speaker.bvh(&poses).unwrap()).unwrap();
                assert_eq!((back.n_frames, back.joints[0].name.as_str()), (n_frames, "Hips"));
                assert!(speaker.motion(&poses).is_err());
            }
        }
        assert!(speaker.poses(&tone(0.01, 0.0), &[]).is_err());
    }
}

#[test]
fn errors_in_captures_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let error_of = |case: &str, hold_out: &[&str], damage: &dyn Fn(&Path)| {
        let dir = dir.join(case);
        write_capture(&dir, "a", 3.0, 0.0, false);
        write_capture(&dir, "b", 3.0, 1.0, false);
        damage(&dir);
        let settings = settings(SequenceNetwork::Contextual);
        let out = dir.join("out");
        let trained = open(&dir, hold_out)
            .and_then(|captures| train_seq2seq(TrainingSource::Captures(&captures), None, &settings, &out, &Silent));
        format!("{:#}", trained.unwrap_err())
    };
    let write = |dir: &Path, text: String| std::fs::write(dir.join("b.bvh"), text).unwrap();
    let valid = bvh(3.0, 1.0);
    let text = error_of("skeleton", &[], &|dir| write(dir, valid.replace("LeftHand", "LeftPaw")));
    assert!(text.contains("b.bvh") && text.contains("other joints"), "{text}");
    let text = error_of("held-out", &["b"], &|dir| write(dir, valid.replace("LeftHand", "LeftPaw")));
    assert!(text.contains("b.bvh") && text.contains("other joints"), "{text}");
    let line = valid.lines().nth_back(9).unwrap().to_owned();
    let text = error_of("nan", &[], &|dir| write(dir, valid.replace(&line, &line.replacen("0 ", "NaN ", 1))));
    assert!(text.contains("b.bvh"), "{text}");
    let text = error_of("no-motion", &[], &|dir| std::fs::remove_file(dir.join("b.bvh")).unwrap());
    assert!(text.contains("b.wav has no motion"), "{text}");
    let text = error_of("no-sound", &[], &|dir| std::fs::remove_file(dir.join("b.wav")).unwrap());
    assert!(text.contains("b.bvh has no audio"), "{text}");
    let text = error_of("damaged-sound", &[], &|dir| std::fs::write(dir.join("b.wav"), "no sound").unwrap());
    assert!(text.contains("b.wav"), "{text}");
    let other = |dir: &Path| {
        for file in ["a.bvh", "b.bvh"].map(|name| dir.join(name)) {
            std::fs::write(&file, std::fs::read_to_string(&file).unwrap().replace("LeftHand", "LeftPaw")).unwrap();
        }
    };
    let text = error_of("joint", &[], &other);
    assert!(text.contains("a.bvh") && text.contains("no joint LeftHand") && text.contains("LeftPaw"), "{text}");
    let text =
        error_of("short", &[], &|dir| ["a", "b"].iter().for_each(|name| write_capture(dir, name, 1.0, 0.0, false)));
    assert!(text.contains("no training motion is as long as a segment (30 frames)"), "{text}");
    let text = error_of("unknown", &["z"], &|_| ());
    assert!(text.contains("no z.bvh"), "{text}");
    assert!(error_of("all", &["a", "b"], &|_| ()).contains("none remains"));
}

/// Log of a training.
fn training_log(captures: &CaptureFolder, vectors: Option<&WordVectors>, out: &Path) -> anyhow::Result<String> {
    let stop = Stop::at(u64::MAX);
    let settings = settings(SequenceNetwork::Words);
    train_seq2seq(TrainingSource::Captures(captures), vectors, &settings, out, &Shared(stop.clone()))?;
    let log = stop.said.lock().unwrap().join("\n");
    Ok(log)
}

#[test]
fn doubtful_transcripts_and_changed_captures_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("captures");
    write_capture(&dir, "a", 4.0, 0.0, true);
    write_capture(&dir, "b", 3.0, 1.0, false);
    // Stereo at 44.1 kHz beside mono at 16 kHz.
    write_stereo(&dir.join("b.wav"), 3.0, 1.0);
    let words = |n: usize, word: &str| -> String { (0..n).map(|t| format!("{t}.2\t{t}.7\t{word}\n")).collect() };
    std::fs::write(dir.join("b.tsv"), words(9, "hello")).unwrap();
    let table = |text: &str| {
        let path = folder.path().join("vectors.safetensors");
        glove::convert(text.as_bytes(), &path).unwrap();
        WordVectors::open(&path)
    };
    let (open, out) = (|| open(&dir, &[]).unwrap(), |name: &str| folder.path().join(name));
    let english = table("hello 1 2 3\nso 4 5 6\n").unwrap();
    let log = training_log(&open(), Some(&english), &out("a")).unwrap();
    let late = "b.tsv: 6 of 9 words are said after the end of the sound (3.00 s), the first `hello` at 3.20 s";
    assert!(log.contains(late) && log.contains("1 of 2 words have pretrained vectors"), "{log}");
    assert_eq!(open().rate, 16_000);
    assert!(SequenceGenerator::open(&out("a")).unwrap().metadata.vocabulary.words() == ["hello", "world"]);
    assert!(SequenceGenerator::open(&out("a")).unwrap().metadata.has_word_vectors);
    let audio = settings(SequenceNetwork::Audio);
    let rejected = train_seq2seq(TrainingSource::Captures(&open()), Some(&english), &audio, &out("audio"), &Silent);
    assert!(rejected.unwrap_err().to_string().contains("the network \"audio\" does not read words: omit --words"));
    let german = table("hallo 1 2\n").unwrap();
    assert!(training_log(&open(), Some(&german), &out("b")).unwrap().contains("0 of 2 words have pretrained vectors"));
    let error = format!("{:#}", training_log(&open(), Some(&german), &out("a")).unwrap_err());
    assert!(error.contains("have 2 dimensions") && error.contains("those of the checkpoint"), "{error}");
    std::fs::write(folder.path().join("vectors.safetensors"), "cut").unwrap();
    assert!(WordVectors::open(&folder.path().join("vectors.safetensors")).is_err());

    // An empty transcript, and one of a hundred thousand words.
    for (text, note) in
        [(String::new(), "b.tsv: the transcript holds no word"), (words(100_000, "hello"), "99997 of 100000")]
    {
        std::fs::write(dir.join("b.tsv"), text).unwrap();
        let log = training_log(&open(), None, &out(&note.len().to_string())).unwrap();
        assert!(log.contains(note), "{log}");
    }

    // A transcript that cannot be read costs no capture: the next one of that name is read.
    std::fs::write(dir.join("b.tsv"), "so").unwrap();
    std::fs::write(dir.join("b.json"), r#"[{"word": "hello", "start": 0.5, "end": 1.0}]"#).unwrap();
    let log = training_log(&open(), None, &out("next")).unwrap();
    assert!(log.contains("b.tsv is not a valid transcript") && log.contains("b.json was read instead"), "{log}");
    std::fs::write(dir.join("b.json"), "{").unwrap();
    let log = training_log(&open(), None, &out("none")).unwrap();
    assert!(log.contains("b.json is not a valid transcript") && !log.contains("read instead"), "{log}");

    // Equal length, different content.
    std::fs::write(dir.join("b.tsv"), words(3, "hello")).unwrap();
    training_log(&open(), None, &out("c")).unwrap();
    assert!(!training_log(&open(), None, &out("c")).unwrap().contains("have changed"));
    std::fs::write(dir.join("b.tsv"), words(3, "hullo")).unwrap();
    assert!(training_log(&open(), None, &out("c")).unwrap().contains("the data have changed"));
    let file = dir.join("b.bvh");
    std::fs::write(&file, std::fs::read_to_string(&file).unwrap().replace("LeftHand", "LeftPaw")).unwrap();
    let error = format!("{:#}", training_log(&open(), None, &out("c")).unwrap_err());
    assert!(error.contains("b.bvh") && error.contains("other joints"), "{error}");
}
