//! Sequence-to-sequence networks in `orator generate`: one sound or many, with and without transcripts, and the state over
//! seams; what is doubtful is said, what is wrong named.

use crate::fixtures::animation::captures::{tone, write_stereo};
use crate::fixtures::untrained::{generate, write_untrained_sequence, write_untrained_speaker};
use orator_base::types::sound::Sound;
use orator_formats::bvh::read::Bvh;
use orator_formats::transcript::{Word, WordSource};
use orator_formats::wav;
use orator_gesture::generate::seq2seq::SequenceGenerator;
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde_json::Value;
use std::path::Path;

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

/// Answer of a run that ends with 0.
fn run(dir: &Path, args: &str) -> Value {
    let output = generate(dir, &format!("--json {args}"));
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What a run that ends with 1 says.
fn refusal(dir: &Path, args: &str) -> String {
    let output = generate(dir, args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{args}: {said}");
    said
}

/// A word a second, in turn of these.
fn tsv(n: usize, words: &[&str]) -> String {
    (0..n).map(|t| format!("{t}.1\t{t}.6\t{}\n", words[t % words.len()])).collect()
}

#[test]
fn the_state_is_renewed_or_carried_and_both_jumps_are_told() {
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
        // The filter of nine frames reaches four back over the first seam.
        assert!(renewed.len() == 66 && renewed[..16] == carried[..16] && renewed[20..] != carried[20..], "{network}");
    }
    let output = generate(dir, "--checkpoint words.safetensors --audio talks/a.wav --out r.bvh");
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("mean step at segment boundaries") && said.contains("(with --carry-state "), "{said}");
}

#[test]
fn words_are_heard_and_none_is_as_no_transcript() {
    let folder = folder();
    let words = |n: usize| -> Vec<Word> {
        let word = |t: usize| Word {
            word: WORDS[t % 2].into(),
            start_secs: t as f64,
            end_secs: t as f64 + 0.5,
            source: WordSource::Given,
            confidence: None,
        };
        (0..n).map(word).collect()
    };
    for network in ["contextual", "words", "adversarial", "autoencoder"] {
        let speaker = SequenceGenerator::open(&folder.path().join(format!("{network}.safetensors"))).unwrap();
        let (sound, silence) = (tone(4.37, 0.0), Sound { rate: 16_000, samples: vec![0.0; 16_000 * 437 / 100] });
        let none = speaker.poses(&sound, &[]).unwrap().features;
        assert_eq!(none.nrows(), 87);
        // Words after the end, in any order, change nothing; those within it do.
        let mut late = words(40).split_off(8);
        late.reverse();
        assert_eq!(speaker.poses(&sound, &late).unwrap().features, none);
        let said = words(4);
        let backwards: Vec<Word> = said.iter().rev().cloned().collect();
        let spoken = speaker.poses(&sound, &said).unwrap().features;
        assert_eq!(
            (spoken != none, &speaker.poses(&sound, &backwards).unwrap().features),
            (speaker.reads_words(), &spoken)
        );
        // What is said later changes nothing before a segment may read it.
        let more = speaker.poses(&sound, &words(5)).unwrap().features;
        assert!(more.rows().into_iter().zip(spoken.rows()).take(30).all(|(a, b)| a == b), "{network}");
        // Silence is spoken too; the shortest sound has one frame, a shorter one none.
        let still = speaker.poses(&silence, &[]).unwrap();
        assert!(still.features.iter().all(|v| v.is_finite()) && still.features != none && still.features.nrows() == 87);
        assert_eq!(speaker.poses(&tone(0.05, 0.0), &[]).unwrap().features.nrows(), 1);
        let error = speaker.poses(&tone(0.049, 0.0), &[]).unwrap_err().to_string();
        assert!(error.contains("too short for one frame"), "{error}");
        let heard = speaker.prepare(&tone(0.9, 0.0), &[]).unwrap();
        let ways = [StateAtSeams::Renewed, StateAtSeams::Carried].map(|way| speaker.generate(&heard, way).unwrap());
        assert_eq!((&ways[0].features, ways[0].seam_jump), (&ways[1].features, [1.0, 1.0]), "one segment has no seam");
    }
}

#[test]
fn what_is_doubtful_about_a_transcript_is_said() {
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
    let said = String::from_utf8_lossy(&generate(dir, &args("good.tsv")).stderr).into_owned();
    let printed = String::from_utf8_lossy(&generate(dir, &args("good.tsv")).stdout).into_owned() + &said;
    assert!(printed.contains("2 of 3 words of the transcript were trained with"), "{printed}");
    let answer = run(dir, &args("good.tsv").replace("words.saf", "adversarial.saf"));
    assert!(answer["note"].as_str().unwrap().contains("does not use words: good.tsv was ignored"), "{answer}");

    write("broken.json", "{\"segments\": [");
    write("times.tsv", "0\t1\thello\n2\t1\tworld\n");
    for (file, words) in [
        ("broken.json", "broken.json is not a valid transcript"),
        ("times.tsv", "line 2: invalid times 2.00 to 1.00 s of `world`"),
        ("gone.tsv", "gone.tsv"),
    ] {
        let said = refusal(dir, &args(file));
        assert!(said.contains(words), "{file}: {said}");
    }
    write_untrained_speaker(&dir.join("host.safetensors"));
    for (more, words) in
        [("--transcript good.tsv", "leave out --transcript"), ("--carry-state", "leave out --carry-state")]
    {
        let said = refusal(dir, &format!("--checkpoint host.safetensors --audio talks/a.wav {more} --out a.npy"));
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn a_hundred_thousand_words_of_a_long_sound_take_no_longer_than_their_poses() {
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
        let said = speaker.metadata.vocabulary.numbered(&(0..100_000).map(word).collect::<Vec<_>>());
        // 30,000 s of segments: words looked for among all others would take minutes here
        let read: usize = (0..30_000).map(|i| speaker.metadata.words_of_segment(&said, 20 * i).concat().len()).sum();
        assert!(read > 300_000, "{network}: {read} words read");
    }
}

#[test]
fn many_sounds_find_their_transcripts_and_are_made_once() {
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
    // A transcript that is new or changed makes its sound again, one that is none fails it.
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

    // A GAN hears sound alone, and does not read what lies beside it.
    write_untrained_speaker(&dir.join("host.safetensors"));
    let args = "--checkpoint host.safetensors --audio-folder talks/sub --out-folder others";
    assert!(run(dir, args)["sounds"][0]["segments"].is_null());
    assert!(refusal(dir, &format!("{args} --transcript said")).contains("remove --transcript"));
    let args = "--checkpoint words.safetensors --audio-folder talks/sub --out-folder others";
    assert!(refusal(dir, &format!("{args} --transcript talks/sub/b.srt")).contains("b.srt is not a folder"));
    let (code, said) = {
        let output = generate(dir, &format!("{args} --format npy"));
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    assert!(code == Some(2) && said.contains("expected a .bvh file"), "{said}");
}

#[test]
fn sounds_of_other_rates_are_heard_and_joints_written_in_every_format() {
    let folder = folder();
    let dir = folder.path();
    write_stereo(&dir.join("stereo.wav"), 3.3, 0.0);
    let made = run(dir, "--checkpoint contextual.safetensors --audio stereo.wav --out stereo.bvh");
    assert_eq!(made["n_frames"], 66);
    write_untrained_sequence(&dir.join("joints.safetensors"), Architecture::Words, false, &WORDS);
    let made = run(dir, "--checkpoint joints.safetensors --audio stereo.wav --carry-state --out a.npy a.bvh a.glb");
    assert_eq!((made["speaker"].as_str(), made["outputs"].as_array().map(Vec::len)), (Some("talker"), Some(3)));
    assert!(made["next"].as_str().unwrap().contains(" --carry-state --out a.mp4"), "{made}");
    for (file, words) in [("gone.wav", "gone.wav does not exist"), ("words.safetensors", "words.safetensors")] {
        let said = refusal(dir, &format!("--checkpoint words.safetensors --audio {file} --out x.bvh"));
        assert!(said.contains(words), "{said}");
    }
    wav::write(&dir.join("short.wav"), &tone(0.01, 0.0)).unwrap();
    let said = refusal(dir, "--checkpoint words.safetensors --audio short.wav --out x.bvh");
    assert!(said.contains("short.wav") && said.contains("too short"), "{said}");
}
