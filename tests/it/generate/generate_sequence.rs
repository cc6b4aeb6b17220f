//! Sequence-to-sequence networks in `orator generate`: one audio file or many, with and without transcripts, and the
//! state at seams; dubious input is reported, invalid input named.

use crate::fixtures::animation::captures::{tone, write_stereo};
use crate::fixtures::models::untrained::{generate, write_untrained_sequence, write_untrained_speaker};
use orator_base::types::sound::Sound;
use orator_formats::bvh::read::Bvh;
use orator_formats::transcript::{Word, WordSource};
use orator_formats::wav;
use orator_formats::word_vectors::{WordVectors, glove};
use orator_gesture::generate::seq2seq::SequenceGenerator;
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

const WORDS: [&str; 2] = ["hello", "world"];

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    for (name, architecture) in [
        ("contextual", Architecture::Contextual),
        ("words", Architecture::Words),
        ("adversarial", Architecture::Adversarial),
        ("autoencoder", Architecture::Autoencoder),
    ] {
        write_untrained_sequence(&dir.join(format!("{name}.safetensors")), architecture, true, &WORDS);
    }
    std::fs::create_dir_all(dir.join("talks/sub")).unwrap();
    wav::write(&dir.join("talks/a.wav"), &tone(3.3, 0.0)).unwrap();
    wav::write(&dir.join("talks/sub/b.wav"), &tone(2.0, 1.0)).unwrap();
    folder
}

/// JSON answer of a run with exit code 0.
fn run(dir: &Path, args: &str) -> Value {
    let output = generate(dir, &format!("--json {args}"));
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Error text of a run with exit code 1.
fn failure(dir: &Path, args: &str) -> String {
    let output = generate(dir, args);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{args}: {text}");
    text
}

/// A transcript with one word per second, cycling through `words`.
fn tsv(n: usize, words: &[&str]) -> String {
    (0..n).map(|t| format!("{t}.1\t{t}.6\t{}\n", words[t % words.len()])).collect()
}

/// One word per second.
fn spoken<'w>(words: impl IntoIterator<Item = &'w str>) -> Vec<Word> {
    let word = |(t, word): (usize, &str)| Word {
        word: word.into(),
        start_secs: t as f64,
        end_secs: t as f64 + 0.5,
        source: WordSource::Given,
        confidence: None,
    };
    words.into_iter().enumerate().map(word).collect()
}

#[test]
fn the_state_is_renewed_or_carried_and_both_jumps_are_reported() {
    let folder = folder();
    let dir = folder.path();
    let motion = |file: &str| Bvh::read(&dir.join(file)).unwrap().frames().map(<[f64]>::to_vec).collect::<Vec<_>>();
    for network in ["contextual", "words", "adversarial"] {
        let args = format!("--checkpoint {network}.safetensors --audio talks/a.wav");
        let (renewed, carried) =
            (run(dir, &format!("{args} --out r.bvh")), run(dir, &format!("{args} --carry-state --out c.bvh")));
        let of = |answer: &Value, key: &str| answer["segments"][key].clone();
        assert_eq!((of(&renewed, "state"), of(&carried, "state")), ("renewed".into(), "carried".into()));
        assert_eq!(of(&renewed, "seam_jump"), of(&carried, "other_seam_jump"));
        assert_eq!(of(&carried, "seam_jump"), of(&renewed, "other_seam_jump"));
        assert_ne!(of(&renewed, "seam_jump"), of(&carried, "seam_jump"));
        assert_eq!((renewed["n_frames"].as_u64(), renewed["next"].as_str()), (Some(66), None));
        let (renewed, carried) = (motion("r.bvh"), motion("c.bvh"));
        // The filter of nine frames extends four frames back over the first seam.
        assert!(renewed.len() == 66 && renewed[..16] == carried[..16] && renewed[20..] != carried[20..], "{network}");
    }
    let output = generate(dir, "--checkpoint words.safetensors --audio talks/a.wav --out r.bvh");
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("mean step at segment boundaries") && text.contains("(with --carry-state "), "{text}");
}

#[test]
fn words_change_the_motion_only_of_networks_that_read_words() {
    let folder = folder();
    let words = |n: usize| spoken(WORDS.into_iter().cycle().take(n));
    for network in ["contextual", "words", "adversarial", "autoencoder"] {
        let speaker = SequenceGenerator::open(&folder.path().join(format!("{network}.safetensors"))).unwrap();
        let (sound, silence) = (tone(4.37, 0.0), Sound { rate: 16_000, samples: vec![0.0; 16_000 * 437 / 100] });
        let none = speaker.poses(&sound, &[]).unwrap().features;
        assert_eq!(none.nrows(), 87);
        // Words after the end have no effect, in any order; words before the end do.
        let mut late = words(40).split_off(8);
        late.reverse();
        assert_eq!(speaker.poses(&sound, &late).unwrap().features, none);
        let four = words(4);
        let backwards: Vec<Word> = four.iter().rev().cloned().collect();
        let spoken = speaker.poses(&sound, &four).unwrap().features;
        assert_eq!(
            (spoken != none, &speaker.poses(&sound, &backwards).unwrap().features),
            (speaker.reads_words(), &spoken)
        );
        // A later word has no effect before the segments that may read it.
        let more = speaker.poses(&sound, &words(5)).unwrap().features;
        assert!(more.rows().into_iter().zip(spoken.rows()).take(30).all(|(a, b)| a == b), "{network}");
        // Silence is valid audio; the shortest audio has one frame, and shorter audio is an error.
        let mute = speaker.poses(&silence, &[]).unwrap();
        assert!(mute.features.iter().all(|v| v.is_finite()) && mute.features != none && mute.features.nrows() == 87);
        assert_eq!(speaker.poses(&tone(0.05, 0.0), &[]).unwrap().features.nrows(), 1);
        let error = speaker.poses(&tone(0.049, 0.0), &[]).unwrap_err().to_string();
        assert!(error.contains("too short for one frame"), "{error}");
        let prepared = speaker.prepare(&tone(0.9, 0.0), &[]).unwrap();
        let runs =
            [StateAtSeams::Renewed, StateAtSeams::Carried].map(|state| speaker.generate(&prepared, state).unwrap());
        assert_eq!((&runs[0].features, runs[0].seam_jump), (&runs[1].features, [1.0, 1.0]), "one segment has no seam");
    }
}

#[test]
fn dubious_transcripts_are_reported() {
    let folder = folder();
    let dir = folder.path();
    let write = |file: &str, text: &str| std::fs::write(dir.join(file), text).unwrap();
    let args =
        |file: &str| format!("--checkpoint words.safetensors --audio talks/a.wav --transcript {file} --out out.bvh");
    let line = |n: u32| format!("{}\t{}\thello\n", f64::from(n) * 0.4, f64::from(n) * 0.4 + 0.3);
    let many: String = (0..100_000).map(line).collect();
    write("good.tsv", &tsv(3, &["Hello", "world.", "so"]));
    write("other.tsv", &tsv(40, &WORDS));
    write("foreign.tsv", &tsv(3, &["hallo", "welt"]));
    write("empty.srt", "");
    write("plain.txt", "hello world");
    write("many.tsv", &many);
    for (file, words, note) in [
        ("good.tsv", [3, 2], ""),
        (
            "other.tsv",
            [40, 40],
            "36 of 40 words are said after the end of the sound (3.30 s), the first `hello` at 4.10 s",
        ),
        ("foreign.tsv", [3, 0], "no word of the transcript (3 words)"),
        ("empty.srt", [0, 0], "the transcript holds no word"),
        ("plain.txt", [0, 0], "the transcript has no times"),
        ("many.tsv", [100_000, 100_000], "99991 of 100000 words are said after the end"),
    ] {
        let answer = run(dir, &args(file));
        assert_eq!(answer["segments"]["words"], serde_json::json!(words), "{file}");
        assert!(answer["note"].as_str().unwrap_or_default().contains(note), "{file}: {answer}");
        assert_eq!(answer["note"].is_null(), note.is_empty(), "{file}: {answer}");
    }
    let text = String::from_utf8_lossy(&generate(dir, &args("good.tsv")).stderr).into_owned();
    let text = String::from_utf8_lossy(&generate(dir, &args("good.tsv")).stdout).into_owned() + &text;
    assert!(text.contains("2 of 3 words of the transcript are in the vocabulary of the model"), "{text}");
    let answer = run(dir, &args("good.tsv").replace("words.saf", "adversarial.saf"));
    assert!(answer["note"].as_str().unwrap().contains("does not use words: good.tsv was ignored"), "{answer}");

    write("broken.json", "{\"segments\": [");
    write("times.tsv", "0\t1\thello\n2\t1\tworld\n");
    for (file, words) in [
        ("broken.json", "broken.json is not a valid transcript"),
        ("times.tsv", "line 2: invalid times 2.00 to 1.00 s of `world`"),
        ("gone.tsv", "gone.tsv"),
    ] {
        let text = failure(dir, &args(file));
        assert!(text.contains(words), "{file}: {text}");
    }
    write_untrained_speaker(&dir.join("host.safetensors"));
    for (more, words) in [("--transcript good.tsv", "omit --transcript"), ("--carry-state", "omit --carry-state")] {
        let text = failure(dir, &format!("--checkpoint host.safetensors --audio talks/a.wav {more} --out a.npy"));
        assert!(text.contains(words), "{text}");
    }
}

/// Writes tables of vectors of 4 and of 2 numbers.
fn write_tables(dir: &Path) {
    let write = |file: &str, text: &str| glove::convert(text.as_bytes(), &dir.join(file)).unwrap();
    write("table.safetensors", "blue -2 1 1 0\nhello 9 9 9 9\nred 1 -1 0.5 2\n");
    write("other.safetensors", "red 1 2\n");
}

#[test]
fn words_outside_the_vocabulary_take_their_vectors_from_a_table() {
    let folder = folder();
    let dir = folder.path();
    write_tables(dir);
    let vectors = Arc::new(WordVectors::open(&dir.join("table.safetensors")).unwrap());
    let sound = tone(3.3, 0.0);
    for network in ["contextual", "words"] {
        let open = || SequenceGenerator::open(&dir.join(format!("{network}.safetensors"))).unwrap();
        let (without, mut with) = (open(), open());
        with.set_word_vectors(vectors.clone()).unwrap();
        let poses = |speaker: &SequenceGenerator, words: &[&str]| {
            speaker.poses(&sound, &spoken(words.iter().copied())).unwrap().features
        };
        let unknown = poses(&without, &["hello", "gray"]);
        for word in ["red", "blue", "Red."] {
            assert_eq!(poses(&without, &["hello", word]), unknown, "{network}");
        }
        let [red, blue, gray] = ["red", "blue", "gray"].map(|word| poses(&with, &["hello", word]));
        assert!(red != blue && red != unknown && blue != unknown, "{network}");
        assert_eq!((&gray, &poses(&with, &["hello", "Red."])), (&unknown, &red), "{network}");
        // The same bytes for known words, also beside a new word that is spoken after the end of the audio.
        assert_eq!(poses(&with, &WORDS), poses(&without, &WORDS), "{network}");
        let late = ["hello", "world", "hello", "world", "hello", "world", "hello", "red"];
        assert_eq!(poses(&with, &late), poses(&without, &late), "{network}");
        let swapped =
            |speaker: &SequenceGenerator| [["red", "blue"], ["blue", "red"]].map(|words| poses(speaker, &words));
        let [one, other] = swapped(&with);
        assert!(one != other && swapped(&without)[0] == swapped(&without)[1], "{network}");
    }
}

#[test]
fn a_table_of_word_vectors_is_read_by_the_program() {
    let folder = folder();
    let dir = folder.path();
    write_tables(dir);
    let bytes = |file: &str| std::fs::read(dir.join(file)).unwrap();
    for (file, words) in [("talks/a.tsv", &["hello", "red", "gray"][..]), ("red.tsv", &["red"][..])] {
        std::fs::write(dir.join(file), tsv(3, words)).unwrap();
    }
    let args = "--checkpoint words.safetensors --audio talks/a.wav --transcript talks/a.tsv --out one.bvh";
    let table = "--words table.safetensors";
    let without = run(dir, args);
    let before = bytes("one.bvh");
    let with = run(dir, &format!("{args} {table}"));
    assert_ne!(bytes("one.bvh"), before);
    let counts = |answer: &Value| (answer["segments"]["words"].clone(), answer["segments"]["words_from_table"].clone());
    assert_eq!(counts(&without), (serde_json::json!([3, 1]), Value::Null));
    assert_eq!(counts(&with), (serde_json::json!([3, 1]), 1.into()));
    let output = generate(dir, &format!("{args} {table}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("in the vocabulary of the model, 1 of the others in the table of word vectors"), "{text}");
    let red = args.replace("talks/a.tsv", "red.tsv");
    assert!(run(dir, &red)["note"].as_str().unwrap().contains("no word of the transcript"));
    assert!(run(dir, &format!("{red} {table}"))["note"].is_null());

    // A batch gives the same bytes; it is generated again when the table changes.
    let batch = |more: &str| {
        let args = "--checkpoint words.safetensors --audio-folder talks --out-folder made";
        run(dir, &format!("{args} {more}"))["created"].as_u64()
    };
    assert_eq!((batch(""), batch(table), batch(table)), (Some(2), Some(2), Some(0)));
    run(dir, &format!("{args} {table}"));
    assert_eq!(bytes("made/a.bvh"), bytes("one.bvh"));
    glove::convert("red 3 3 3 3\n".as_bytes(), &dir.join("table.safetensors")).unwrap();
    assert_eq!(batch(table), Some(2));
    assert_ne!(bytes("made/a.bvh"), bytes("one.bvh"));

    write_untrained_speaker(&dir.join("host.safetensors"));
    let no_words = "does not read words: omit --words";
    for (checkpoint, table, words) in [
        ("host", "table", no_words),
        ("adversarial", "table", no_words),
        ("words", "other", "other.safetensors have 2 dimensions, those of the model of talker 4"),
        ("words", "gone", "gone.safetensors"),
        ("words", "words", "words.safetensors is not a valid table of word vectors"),
    ] {
        for output in ["--audio talks/a.wav --out x.bvh", "--audio-folder talks --out-folder others"] {
            let args = format!("--checkpoint {checkpoint}.safetensors --words {table}.safetensors {output}");
            let text = failure(dir, &args);
            assert!(text.contains(words), "{args}: {text}");
        }
    }
}

#[test]
fn a_hundred_thousand_words_are_assigned_to_segments_quickly() {
    let folder = folder();
    for network in ["contextual", "words"] {
        let speaker = SequenceGenerator::open(&folder.path().join(format!("{network}.safetensors"))).unwrap();
        let word = |n: usize| Word {
            word: "hello".into(),
            start_secs: n as f64 * 0.3,
            end_secs: n as f64 * 0.3 + 0.2,
            source: WordSource::Given,
            confidence: None,
        };
        let ids = speaker.metadata.vocabulary.numbered(&(0..100_000).map(word).collect::<Vec<_>>());
        // 30,000 s of segments: a linear search for the words of each would take minutes.
        let read: usize = (0..30_000).map(|i| speaker.metadata.words_of_segment(&ids, 20 * i).concat().len()).sum();
        assert!(read > 300_000, "{network}: {read} words read");
    }
}

#[test]
fn batches_find_their_transcripts_and_are_generated_once() {
    let folder = folder();
    let dir = folder.path();
    std::fs::write(dir.join("talks/a.tsv"), tsv(3, &WORDS)).unwrap();
    std::fs::write(dir.join("talks/broken.wav"), "no sound").unwrap();
    let batch = |args: &str| {
        let output = generate(dir, &format!("--json --checkpoint words.safetensors {args} --out-folder made"));
        let facts: Value = serde_json::from_slice(&output.stdout).unwrap();
        let counts = ["created", "up_to_date", "failed"].map(|key| facts[key].as_u64().unwrap_or(99));
        assert_eq!(output.status.code(), Some(if counts[2] > 0 { 2 } else { 0 }), "{facts}");
        (counts, facts)
    };
    let bytes = |file: &str| std::fs::read(dir.join(file)).unwrap();
    let (counts, facts) = batch("--audio-folder talks");
    assert_eq!(counts, [2, 0, 1]);
    let of = |facts: &Value, name: &str| {
        facts["sounds"].as_array().unwrap().iter().find(|sound| sound["out"] == name).unwrap().clone()
    };
    assert_eq!(of(&facts, "a")["segments"]["words"], serde_json::json!([3, 3]));
    assert!(of(&facts, "sub/b")["segments"]["words"].is_null() && of(&facts, "broken")["error"].is_string());
    run(dir, "--checkpoint words.safetensors --audio talks/a.wav --transcript talks/a.tsv --out one.bvh");
    assert_eq!(bytes("made/a.bvh"), bytes("one.bvh"));

    assert_eq!(batch("--audio-folder talks").0, [0, 2, 1]);
    // A new or changed transcript regenerates its audio; an invalid transcript is a failure.
    std::fs::write(dir.join("talks/sub/b.srt"), "1\n00:00:00,500 --> 00:00:01,000\nhello\n").unwrap();
    assert_eq!(batch("--audio-folder talks").0, [1, 1, 1]);
    std::fs::write(dir.join("talks/a.tsv"), tsv(3, &["world"])).unwrap();
    assert_eq!(batch("--audio-folder talks").0, [1, 1, 1]);
    assert_ne!(bytes("made/a.bvh"), bytes("one.bvh"));
    std::fs::write(dir.join("talks/a.tsv"), "0 1 hello\n").unwrap();
    let (counts, facts) = batch("--audio-folder talks");
    assert!(counts == [0, 1, 2] && of(&facts, "a")["error"].as_str().unwrap().contains("a.tsv"), "{facts}");
    assert_eq!(batch("--audio-folder talks --carry-state").0, [1, 0, 2]);

    // A folder of transcripts, and a table that names one.
    std::fs::create_dir_all(dir.join("said/sub")).unwrap();
    std::fs::write(dir.join("said/sub/b.tsv"), tsv(2, &WORDS)).unwrap();
    let (counts, facts) = batch("--audio-folder talks --transcript said");
    assert!(counts == [2, 0, 1] && of(&facts, "a")["segments"]["words"].is_null(), "{facts}");
    assert_eq!(of(&facts, "sub/b")["segments"]["words"], serde_json::json!([2, 2]));
    std::fs::write(dir.join("talks/list.csv"), "audio,out,transcript\na.wav,x,../said/sub/b.tsv\nsub/b.wav,y,\n")
        .unwrap();
    let (counts, facts) = batch("--batch talks/list.csv");
    assert_eq!(counts, [2, 0, 0]);
    let words = ["x", "y"].map(|name| of(&facts, name)["segments"]["words"].to_string());
    assert_eq!(words, ["[2,2]", "[1,1]"]);

    // A GAN uses audio only and ignores transcripts next to the audio.
    write_untrained_speaker(&dir.join("host.safetensors"));
    let args = "--checkpoint host.safetensors --audio-folder talks/sub --out-folder others";
    assert!(run(dir, args)["sounds"][0]["segments"].is_null());
    assert!(failure(dir, &format!("{args} --transcript said")).contains("omit --transcript"));
    let args = "--checkpoint words.safetensors --audio-folder talks/sub --out-folder others";
    assert!(failure(dir, &format!("{args} --transcript talks/sub/b.srt")).contains("b.srt is not a folder"));
    let (code, text) = {
        let output = generate(dir, &format!("{args} --format npy"));
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    assert!(code == Some(2) && text.contains("expected a .bvh file"), "{text}");
}

#[test]
fn audio_of_other_rates_is_resampled_and_joints_have_all_formats() {
    let folder = folder();
    let dir = folder.path();
    write_stereo(&dir.join("stereo.wav"), 3.3, 0.0);
    let answer = run(dir, "--checkpoint contextual.safetensors --audio stereo.wav --out stereo.bvh");
    assert_eq!(answer["n_frames"], 66);
    write_untrained_sequence(&dir.join("joints.safetensors"), Architecture::Words, false, &WORDS);
    let answer = run(dir, "--checkpoint joints.safetensors --audio stereo.wav --carry-state --out a.npy a.bvh a.glb");
    assert_eq!((answer["speaker"].as_str(), answer["outputs"].as_array().map(Vec::len)), (Some("talker"), Some(3)));
    assert!(answer["next"].as_str().unwrap().contains(" --carry-state --out a.mp4"), "{answer}");
    for (file, words) in [("gone.wav", "gone.wav does not exist"), ("words.safetensors", "words.safetensors")] {
        let text = failure(dir, &format!("--checkpoint words.safetensors --audio {file} --out x.bvh"));
        assert!(text.contains(words), "{text}");
    }
    wav::write(&dir.join("short.wav"), &tone(0.01, 0.0)).unwrap();
    let text = failure(dir, "--checkpoint words.safetensors --audio short.wav --out x.bvh");
    assert!(text.contains("short.wav") && text.contains("too short"), "{text}");
}
