//! Folders structured like those of the GENEA challenges of 2020, 2022 and 2023 become datasets: splits, words,
//! speakers, missing fingers, and the interlocutor's audio.

use super::import::{bvh, plan, samples, wav, write};
use orator_base::stage::progress::Silent;
use orator_base::types::skeleton::{L_HAND, R_HAND};
use orator_base::types::sound::Sound;
use orator_dataset::import::{Imported, import};
use orator_dataset::verify::verify::verify;
use orator_dataset::{Dataset, Sample, Split};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Joints of the challenges' skeleton since 2022: name, parent, offset in cm.
fn skeleton() -> Vec<(String, String, [f64; 3])> {
    let mut joints: Vec<(String, String, [f64; 3])> = Vec::new();
    let mut add = |name: &str, parent: &str, offset: [f64; 3]| joints.push((name.into(), parent.into(), offset));
    add("b_root", "body_world", [0.0, 95.0, 0.0]);
    let trunk = ["b_root", "b_spine0", "b_spine1", "b_spine2", "b_spine3", "b_neck0", "b_head"];
    trunk.windows(2).for_each(|pair| add(pair[1], pair[0], [0.0, 10.0, 0.5]));
    for (side, x) in [("l", 1.0), ("r", -1.0)] {
        let of = |name: &str| format!("b_{side}_{name}");
        add(&of("shoulder"), "b_spine3", [3.0 * x, 6.0, 0.0]);
        let arm = ["shoulder", "arm", "arm_twist", "forearm", "wrist_twist", "wrist"];
        arm.windows(2).for_each(|pair| add(&of(pair[1]), &of(pair[0]), [13.5 * x, 0.0, 0.0]));
        let thumb = ["wrist", "thumb0", "thumb1", "thumb2", "thumb3"];
        thumb.windows(2).for_each(|pair| add(&of(pair[1]), &of(pair[0]), [2.0 * x, -0.5, 1.5]));
        for (z, finger) in [(3.0, "index"), (1.0, "middle"), (-1.0, "ring"), (-3.0, "pinky")] {
            add(&of(&format!("{finger}1")), &of("wrist"), [8.5 * x, 0.0, z]);
            add(&of(&format!("{finger}2")), &of(&format!("{finger}1")), [3.5 * x, 0.0, 0.0]);
            add(&of(&format!("{finger}3")), &of(&format!("{finger}2")), [2.5 * x, 0.0, 0.0]);
        }
        add(&of("upleg"), "b_root", [9.0 * x, -5.0, 0.0]);
        add(&of("leg"), &of("upleg"), [0.0, -42.0, 0.0]);
        add(&of("foot"), &of("leg"), [0.0, -43.0, 0.0]);
    }
    joints
}

fn joint_text(joints: &[(String, String, [f64; 3])], parent: &str, text: &mut String, order: &mut Vec<String>) {
    let children: Vec<_> = joints.iter().filter(|(_, own, _)| own == parent).collect();
    if children.is_empty() {
        text.push_str("End Site\n{\nOFFSET 0 2 0\n}\n");
    }
    for (name, _, [x, y, z]) in children {
        writeln!(text, "JOINT {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS 3 Zrotation Xrotation Yrotation").unwrap();
        order.push(name.clone());
        joint_text(joints, name, text, order);
        text.push_str("}\n");
    }
}

/// A take with the challenges' joint names, arms hanging and swinging, 30 fps.
fn genea_bvh(n_frames: usize) -> String {
    let (mut text, mut order) = (String::from("HIERARCHY\nROOT body_world\n{\nOFFSET 0 0 0\n"), Vec::new());
    text.push_str("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n");
    joint_text(&skeleton(), "body_world", &mut text, &mut order);
    writeln!(text, "}}\nMOTION\nFrames: {n_frames}\nFrame Time: 0.0333333").unwrap();
    for t in 0..n_frames {
        let swing = 20.0 * (t as f64 / 12.0).sin();
        text.push_str("0 0 0 0 0 0");
        for name in &order {
            let z = match name.as_str() {
                "b_l_arm" => -60.0 + swing,
                "b_r_arm" => 60.0 + swing,
                _ => 0.0,
            };
            write!(text, " {z} 0 0").unwrap();
        }
        text.push('\n');
    }
    text
}

const FRAMES: usize = 160;

/// One person's motion, audio and words; `motion` is false for the inputs of a test.
fn person(folder: &Path, stem: &str, seed: u64, motion: bool) {
    if motion {
        write(folder.join(format!("bvh/{stem}.bvh")), &genea_bvh(FRAMES));
    }
    wav(&folder.join(format!("wav/{stem}.wav")), FRAMES as f64 / 30.0, seed);
    write(folder.join(format!("tsv/{stem}.tsv")), "0.50\t0.75\tso\n1.25\t2.0\twe said\n");
}

const HEADER: &str = "prefix,main-agent_id,main-agent_has_fingers,interloctr_id,interloctr_has_fingers";

/// Folders of 2023: two takes for training, one for validation, and a test without the main agent's motion.
fn folders_2023(root: &Path) {
    for (n, (split, stem)) in [("trn", "000"), ("trn", "001"), ("val", "000"), ("tst", "000")].into_iter().enumerate() {
        let prefix = format!("{split}_2023_v0_{stem}");
        let (main, seed) = (root.join(split).join("main-agent"), 2 * n as u64);
        person(&main, &format!("{prefix}_main-agent"), seed, split != "tst");
        person(&root.join(split).join("interloctr"), &format!("{prefix}_interloctr"), seed + 1, true);
    }
    // The second interlocutor's audio is exact, and shorter than the take.
    let samples = (0..64_000).map(|n| (n % 2000) as f32 / 4096.0 - 0.25).collect();
    let shorter = root.join("trn/interloctr/wav/trn_2023_v0_001_interloctr.wav");
    orator_formats::wav::write(&shorter, &Sound { rate: 16_000, samples }).unwrap();
    let rows = "trn_2023_v0_000,01,fingers_incl,02,fingers_excl\ntrn_2023_v0_001,02,fingers_excl,01,fingers_incl\n";
    write(root.join("trn/metadata.csv"), &format!("{HEADER}\r\n{rows}"));
    write(root.join("val/metadata.csv"), &format!("{HEADER}\nval_2023_v0_000,1,finger_incl,3,finger_incl\n"));
    write(root.join("tst/metadata.csv"), &format!("{HEADER}\ntst_2023_v0_000,1,finger_incl,3,finger_incl\n"));
}

fn imported(sources: &[&Path], out: &Path, speaker_id: Option<u32>) -> anyhow::Result<Imported> {
    fs::create_dir_all(out).unwrap();
    let imported = import(&orator_dataset::import::ImportPlan { speaker_id, ..plan(sources) }, out, &Silent)?;
    assert_eq!(verify(out, true, &Silent).unwrap().problems, []);
    Ok(imported)
}

/// Samples by the name of their motion file, with their splits.
fn by_motion(dataset: &Dataset) -> BTreeMap<String, (Split, Sample)> {
    let refs = Split::ALL.into_iter().flat_map(|split| dataset.samples(split));
    let read = refs.map(|found| (found.split, dataset.read(&found).unwrap()));
    let name = |sample: &Sample| sample.meta["imported"]["motion"].as_str().unwrap().to_owned();
    read.map(|(split, sample)| (name(&sample), (split, sample))).collect()
}

fn fingers_seen(sample: &Sample) -> usize {
    let of_hand = |hand: usize| (hand + 1..hand + 21).filter(|joint| sample.motion.mask[[3, *joint]]);
    of_hand(L_HAND).chain(of_hand(R_HAND)).count()
}

#[test]
fn folders_of_2023_keep_splits_speakers_fingers_and_interlocutors() {
    let dir = tempfile::tempdir().unwrap();
    let (root, out) = (dir.path().join("genea2023"), dir.path().join("out"));
    folders_2023(&root);
    let answer = imported(&[&root], &out, None).unwrap();
    assert!(answer.lines.iter().all(|line| line.outcome == "kept") && answer.lines.len() == 3, "{:?}", answer.lines);
    let notes = [
        "passed over 1 recording of tst without motion: tst_2023_v0_000_main-agent",
        "passed over 8 files of interlocutors (interloctr/): only their audio is imported",
    ];
    assert_eq!(answer.notes, notes);
    assert!(answer.lines[1].message.contains("interloctr.wav differs by 1."), "{}", answer.lines[1].message);

    let dataset = Dataset::open(&out).unwrap();
    let found = by_motion(&dataset);
    let split = |name: &str| found[&format!("{name}_main-agent.bvh")].0;
    let splits = ["trn_2023_v0_000", "trn_2023_v0_001", "val_2023_v0_000"].map(split);
    assert_eq!(splits, [Split::Train, Split::Train, Split::Validation]);
    let (with, without) = (&found["trn_2023_v0_000_main-agent.bvh"].1, &found["trn_2023_v0_001_main-agent.bvh"].1);
    assert!(with.key.starts_with("trn-2023-v0-000-main-agent-"), "{}", with.key);
    let fact = |sample: &Sample, key: &str| sample.meta["imported"][key].clone();
    let keys = ["speaker_id", "has_fingers", "interlocutor_id", "interlocutor"];
    assert_eq!(
        keys.map(|key| fact(with, key)),
        serde_json::json!([1, true, 2, "trn_2023_v0_000_interloctr.wav"]).as_array().unwrap()[..]
    );
    assert_eq!(
        keys[..3].iter().map(|key| fact(without, key)).collect::<Vec<_>>(),
        serde_json::json!([2, false, 1]).as_array().unwrap()[..]
    );
    assert!(fingers_seen(with) >= 30 && fingers_seen(without) == 0, "{} {}", fingers_seen(with), fingers_seen(without));
    assert!(without.motion.joints.slice(ndarray::s![.., L_HAND + 1..L_HAND + 21, ..]).iter().all(|v| v.is_nan()));
    let words: Vec<_> = with.words.as_ref().unwrap().iter().map(|word| (word.word.as_str(), word.start_secs)).collect();
    assert_eq!(words[..2], [("so", 0.5), ("we", 1.25)]);

    let second = with.interlocutor.as_ref().unwrap();
    assert!(second.samples.len() == with.sound.samples.len() && second.samples != with.sound.samples);
    let exact = &without.interlocutor.as_ref().unwrap().samples;
    let expected = |n: usize| if n < 64_000 { (n % 2000) as f32 / 4096.0 - 0.25 } else { 0.0 };
    assert!(exact.iter().enumerate().all(|(n, v)| (v - expected(n)).abs() < 1e-4), "padded with silence");
    assert_eq!(dataset.info().members["interlocutor.wav"].element, "int16");

    // Shards outside a dataset folder, and the dataset itself, keep the second sound.
    drop(dataset);
    let tars = dir.path().join("tars");
    fs::create_dir(&tars).unwrap();
    for file in fs::read_dir(&out).unwrap().map(|file| file.unwrap().path()) {
        if file.extension().is_some_and(|ending| ending == "tar") {
            fs::copy(&file, tars.join(file.file_name().unwrap())).unwrap();
        }
    }
    for (source, to) in [(&tars, "of-tars"), (&out, "of-dataset")] {
        let to = dir.path().join(to);
        imported(&[source], &to, None).unwrap();
        assert!(samples(&to).iter().all(|(key, (sample, _))| {
            let first = found.values().find(|(_, first)| first.key == *key).unwrap();
            first.1.interlocutor == sample.interlocutor && sample.interlocutor.is_some()
        }));
    }

    // One speaker; an ID that no take has.
    let one = imported(&[&root], &dir.path().join("one"), Some(2)).unwrap();
    assert!(one.lines.len() == 1 && one.lines[0].file.ends_with("001_main-agent.bvh"), "{:?}", one.lines);
    assert!(one.notes.contains(&"passed over 2 takes of other speakers than 2".to_owned()), "{:?}", one.notes);
    let error = imported(&[&root], &dir.path().join("none"), Some(9)).unwrap_err();
    assert_eq!(error.to_string(), "no take of speaker 9; the speakers of the sources: 1, 2");
}

#[test]
fn folders_of_2022_have_a_table_without_header() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("genea2022");
    person(&root.join("trn"), "trn_2022_v1_000", 1, true);
    person(&root.join("trn"), "trn_2022_v1_001", 2, true);
    person(&root.join("val"), "val_2022_v1_000", 3, true);
    person(&root.join("tst"), "tst_2022_v1_000", 4, true);
    write(root.join("trn/trn_2022_v1_metadata.csv"), "trn_2022_v1_000,finger_excl,17\n");
    write(root.join("val/val_2022_v1_metadata.csv"), "val_2022_v1_000,finger_incl,3\n");
    let out = dir.path().join("out");
    let answer = imported(&[&root], &out, None).unwrap();
    assert_eq!(answer.notes, [""; 0]);
    let unlisted = "trn_2022_v1_metadata.csv does not list this take: its speaker is unknown";
    assert!(answer.lines[1].message.contains(unlisted), "{:?}", answer.lines);
    let dataset = Dataset::open(&out).unwrap();
    let found = by_motion(&dataset);
    let facts = |name: &str| {
        let (split, sample) = &found[&format!("{name}_2022_v1_000.bvh")];
        (*split, sample.meta["imported"]["speaker_id"].as_u64(), fingers_seen(sample) > 0)
    };
    let expected = [(Split::Train, Some(17), false), (Split::Validation, Some(3), true), (Split::Test, None, true)];
    assert_eq!(["trn", "val", "tst"].map(facts), expected);
    assert!(found.values().all(|(_, sample)| sample.interlocutor.is_none() && sample.words.is_some()));
    // Without interlocutors, nothing mentions them.
    assert!(!dataset.info().members.contains_key("interlocutor.wav"));
    assert!(!fs::read_to_string(out.join("index.jsonl")).unwrap().contains("interlocutor"));
}

#[test]
fn folders_of_2020_have_transcripts_of_a_recogniser() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("GENEA_Challenge_2020_data_release");
    let words = r#"[{"alternatives":[{"transcript":"so it goes","words":[
        {"start_time":"0.500s","end_time":"0.900s","word":"so"},
        {"start_time":"1.200s","end_time":"1.400s","word":"it"}]}]}]"#;
    for (folder, stem, motion) in [("Training_data", "Recording_001", true), ("Test_data", "TestSeq001", false)] {
        let at = root.join(folder);
        wav(&at.join(format!("Audio/{stem}.wav")), FRAMES as f64 / 30.0, 7);
        write(at.join(format!("Transcripts/{stem}.json")), words);
        if motion {
            write(at.join(format!("Motion/{stem}.bvh")), &bvh(FRAMES));
        }
    }
    let out = dir.path().join("out");
    let answer = imported(&[&root], &out, None).unwrap();
    assert_eq!(answer.notes, ["passed over 1 recording of Test_data without motion: TestSeq001"]);
    let found = by_motion(&Dataset::open(&out).unwrap());
    let (split, sample) = &found["Recording_001.bvh"];
    assert_eq!((*split, sample.words.as_ref().unwrap()[1].start_secs), (Split::Train, 1.2));
    assert!(sample.meta["imported"].get("speaker_id").is_none());
    // A released motion of the test is imported as such.
    write(root.join("Test_data/Motion/TestSeq001.bvh"), &bvh(FRAMES));
    wav(&root.join("Test_data/Audio/TestSeq001.wav"), FRAMES as f64 / 30.0, 8);
    imported(&[&root], &dir.path().join("both"), None).unwrap();
    let found = by_motion(&Dataset::open(dir.path().join("both")).unwrap());
    assert_eq!(found["TestSeq001.bvh"].0, Split::Test);
}

#[test]
fn invalid_tables_of_speakers_are_errors_with_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("genea2023");
    person(&root.join("trn/main-agent"), "trn_2023_v0_000_main-agent", 1, true);
    let row = "trn_2023_v0_000,1,finger_incl,2,finger_incl";
    for (n, (table, expected)) in [
        ("prefix,main-agent_id\ntrn_2023_v0_000,1\n".to_owned(), "there is no column `main-agent_has_fingers`"),
        (format!("{HEADER}\ntrn_2023_v0_000,1\n"), "line 2: 2 cells, expected 5"),
        (format!("{HEADER}\n{}\n", row.replace(",1,", ",one,")), "line 2: the speaker is \"one\", expected a number"),
        (format!("{HEADER}\n{}\n", row.replace(",finger_incl,2", ",yes,2")), "line 2: the fingers are \"yes\""),
        (format!("{HEADER}\n{row}\n{row}\n"), "line 3: trn_2023_v0_000 is listed twice"),
        (" \n".to_owned(), "the table of speakers is empty"),
    ]
    .into_iter()
    .enumerate()
    {
        write(root.join("trn/metadata.csv"), &table);
        let error = imported(&[&root], &dir.path().join(n.to_string()), None).unwrap_err();
        let text = format!("{error:#}");
        assert!(text.contains("trn/metadata.csv") && text.contains(expected), "{text}");
    }
}
