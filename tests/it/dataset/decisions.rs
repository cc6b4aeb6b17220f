//! Decisions of users: the file, its errors, and corrected hands and words in a dataset.

use crate::fixtures::media::lifted_videos::{settings, video};
use ndarray::s;
use orator_base::stage::progress::Silent;
use orator_base::stage::workdir::{BusyFolder, FolderLock};
use orator_base::stage::{Stage, Unit};
use orator_base::types::pose2d::coco;
use orator_base::types::time::FrameRate;
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{self, Settings};
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_dataset::words::VideoWords;
use orator_dataset::{Dataset, Split};
use orator_formats::transcript::{Transcript, TranscriptChoice};
use orator_formats::{keypoints_npz, npz};
use orator_pipeline::Pipeline;
use orator_pipeline::dataset::stage::{DatasetInputs, DatasetStage};
use orator_test_support::project::files_under;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Decision without a pixel and a word.
pub(crate) fn decision(video: &str, action: DecisionAction, (start_secs, end_secs): (f64, f64)) -> Decision {
    let [id, time] = [const { String::new() }; 2];
    let (speaker, video, author) = ("host".to_owned(), video.to_owned(), "ana".to_owned());
    Decision { id, speaker, video, action, start_secs, end_secs, x: None, y: None, text: None, author, time }
}

fn word(video: &str, range: (f64, f64), text: &str) -> Decision {
    Decision { text: Some(text.to_owned()), ..decision(video, DecisionAction::Word, range) }
}

#[test]
fn the_file_is_written_read_and_removed_with_its_last_decision() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("pipeline.toml");
    assert_eq!(decisions::read(&config).unwrap(), []);
    let speaker = Decision {
        x: Some(640.0),
        y: Some(300.5),
        author: String::new(),
        ..decision("talk-1a2b3c4d", DecisionAction::Speaker, (0.0, 2.5))
    };
    let given = [
        decision("talk-1a2b3c4d", DecisionAction::Reject, (12.4, 15.0)),
        decision("talk-1a2b3c4d", DecisionAction::Accept, (0.0, 1e9)),
        decision("b", DecisionAction::SwapHands, (1.0, 2.0)),
        speaker,
        word("b", (3.0, 4.0), "h\u{e9}llo\"'\\"),
        word("b", (3.0, 4.0), ""),
        word("b", (3.0, 4.0), ""),
    ];
    let added: Vec<Decision> = given.iter().map(|one| decisions::add(&config, one).unwrap()).collect();
    let read = decisions::read(&config).unwrap();
    assert_eq!(read, added);
    for (read, given) in read.iter().zip(&given) {
        assert_eq!(Decision { id: String::new(), time: String::new(), ..read.clone() }, *given);
    }
    let ids: std::collections::BTreeSet<&String> = read.iter().map(|one| &one.id).collect();
    assert_eq!(ids.len(), given.len());
    let text = fs::read_to_string(decisions::path(&config)).unwrap();
    assert_eq!(text.matches("[[decision]]").count(), given.len(), "{text}");
    assert!(text.contains("action = \"swap-hands\"") && text.contains("video = \"talk-1a2b3c4d\""), "{text}");
    let unknown = decisions::remove(&config, "zz").unwrap_err().to_string();
    assert!(unknown.contains("no decision `zz`") && unknown.contains("decisions.toml"), "{unknown}");
    assert_eq!(fs::read_to_string(decisions::path(&config)).unwrap(), text);
    // Removing and adding the last one again changes only its identity and time.
    assert_eq!(decisions::remove(&config, &added[2].id).unwrap(), added[2]);
    assert_eq!(decisions::read(&config).unwrap(), [&added[..2], &added[3..]].concat());
    for one in added.iter().filter(|one| one.id != added[2].id) {
        decisions::remove(&config, &one.id).unwrap();
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0, "neither a file nor a lock is left");
}

#[test]
fn invalid_entries_are_named_with_what_was_expected() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("pipeline.toml");
    let valid = "id = \"0000000a\"\nspeaker = \"host\"\nvideo = \"a\"\naction = \"reject\"\nstart_secs = 1\n\
                 end_secs = 2.5\nauthor = \"ana\"\ntime = \"2026-11-28T15:20:00Z\"\n";
    let long = "a".repeat(81);
    let cases = [
        ("end_secs = 2.5", "end_secs = 1.0", "0 <= start_secs < end_secs"),
        ("start_secs = 1", "start_secs = -1", "0 <= start_secs < end_secs"),
        ("start_secs = 1", "start_secs = nan", "0 <= start_secs < end_secs"),
        ("end_secs = 2.5", "end_secs = inf", "0 <= start_secs < end_secs"),
        ("end_secs = 2.5", "end_secs = \"2.5\"", "end_secs"),
        ("end_secs = 2.5\n", "", "end_secs"),
        ("\"reject\"", "\"refuse\"", "swap-hands"),
        ("author", "writer", "unknown field `writer`"),
        ("\"0000000a\"", "\"0000000G\"", "8 hex digits"),
        ("\"0000000a\"", "\"\"", "expected an `id`"),
        ("15:20:00Z", "15:20:00", "`time`: expected UTC"),
        ("\"host\"", "\"\"", "`speaker` is empty"),
        ("\"a\"", "\"\"", "`video` is empty"),
        ("\"ana\"", &format!("{long:?}"), "at most 80 characters"),
        ("\"ana\"", "\"a\\nb\"", "on one line"),
        ("end_secs = 2.5", "end_secs = 2.5\nx = 1.0", "`x` and `y`"),
        ("\"reject\"", "\"speaker\"\nx = 1.0", "`x` and `y`"),
        ("\"reject\"", "\"speaker\"\nx = 1.0\ny = -1.0", "`x` and `y`"),
        ("\"reject\"", "\"word\"", "`text`"),
        ("\"reject\"", "\"word\"\ntext = \"two words\"", "`text`: expected a word"),
        ("end_secs = 2.5", "end_secs = 2.5\ntext = \"a\"", "`text`"),
    ];
    let write = |text: &str| fs::write(decisions::path(&config), text).unwrap();
    let entry = |text: &str| format!("[[decision]]\n{}\n", text.replace("0000000a", "0000000b"));
    write(&(entry(valid) + &format!("[[decision]]\n{valid}")));
    assert_eq!(decisions::read(&config).unwrap().len(), 2);
    for (from, to, expected) in cases {
        assert!(valid.contains(from), "{from}");
        write(&(entry(valid) + &format!("[[decision]]\n{}", valid.replacen(from, to, 1))));
        let error = format!("{:#}", decisions::read(&config).unwrap_err());
        let named = error.contains("decisions.toml") && error.contains("decision 2 (") && error.contains(expected);
        assert!(named, "{to}: {error}");
        // The file is not replaced while it is invalid.
        assert!(decisions::add(&config, &decision("a", DecisionAction::Accept, (0.0, 1.0))).is_err());
    }
    write(&(entry(valid) + &entry(valid)));
    assert!(format!("{:#}", decisions::read(&config).unwrap_err()).contains("no other decision"));
    for (text, expected) in [
        ("decision = 1", "expected [[decision]] tables"),
        ("[[decisions]]\nid = \"a\"\n", "unknown keys"),
        ("[[decision]\n", "expected [[decision]] tables"),
    ] {
        write(text);
        let error = format!("{:#}", decisions::read(&config).unwrap_err());
        assert!(error.contains("decisions.toml") && error.contains(expected), "{error}");
    }
    fs::write(decisions::path(&config), vec![b'#'; (4 << 20) + 1]).unwrap();
    assert!(format!("{:#}", decisions::read(&config).unwrap_err()).contains("exceeds the limit of 4 MiB"));
    fs::remove_file(decisions::path(&config)).unwrap();
    fs::create_dir(decisions::path(&config)).unwrap();
    assert!(format!("{:#}", decisions::read(&config).unwrap_err()).contains("expected a regular file"));
    assert!(decisions::add(&config, &decision("a", DecisionAction::Reject, (2.0, 1.0))).is_err());
}

#[test]
fn concurrent_changes_are_all_retained_or_rejected() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("pipeline.toml");
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let config = &config;
            scope.spawn(move || {
                for n in 0..5 {
                    let video = format!("video-{thread}-{n}");
                    decisions::add(config, &decision(&video, DecisionAction::Reject, (0.0, 1.0))).unwrap();
                }
            });
        }
    });
    assert_eq!(decisions::read(&config).unwrap().len(), 20);
    let before = fs::read(decisions::path(&config)).unwrap();
    let held = FolderLock::exclusive(&decisions::path(&config)).unwrap();
    let error = decisions::add(&config, &decision("a", DecisionAction::Reject, (0.0, 1.0))).unwrap_err();
    assert!(error.is::<BusyFolder>(), "{error:#}");
    assert_eq!(fs::read(decisions::path(&config)).unwrap(), before);
    drop(held);
}

/// Expected values of `date -u -d @SECS +%FT%TZ`.
#[test]
fn times_are_utc_in_rfc_3339() {
    let expected = [
        (0, "1970-01-01T00:00:00Z"),
        (951_782_400, "2000-02-29T00:00:00Z"),
        (1_709_251_199, "2024-02-29T23:59:59Z"),
        (1_735_689_599, "2024-12-31T23:59:59Z"),
        (4_107_542_400, "2100-03-01T00:00:00Z"),
    ];
    for (secs, text) in expected {
        assert_eq!(decisions::time_text(secs), text);
    }
}

#[test]
fn a_range_has_the_frames_that_it_overlaps() {
    let frames = |start, end, n| decision("a", DecisionAction::Reject, (start, end)).frames(FrameRate::new(15, 1), n);
    let secs = |frame: f64| frame / 15.0;
    assert_eq!(frames(secs(30.0), secs(45.0), 100), 30..45);
    assert_eq!(frames(secs(29.98), secs(45.02), 100), 30..45, "rounded times");
    assert_eq!(frames(secs(30.5), secs(44.5), 100), 30..45);
    assert_eq!(frames(secs(30.2), secs(30.21), 100), 30..31);
    assert_eq!(frames(secs(90.0), 1e9, 100), 90..100);
    assert_eq!(frames(secs(100.0), 1e9, 100), 100..100);
    assert_eq!(frames(0.0, 1e-12, 0), 0..0);
}

#[test]
fn decisions_without_effect_are_reported_and_invalid_files_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("talk.mp4"), "").unwrap();
    let text = "[[speaker]]\nname = \"host\"\nvideos = [\"talk.mp4\"]\n";
    let file = dir.path().join("pipeline.toml");
    fs::write(&file, text).unwrap();
    let open = || Pipeline::open(config::load(&file, &[]).unwrap());
    let unit = open().unwrap().videos(&[]).unwrap()[0].units[0].clone();
    let valid = decisions::add(&file, &decision(&unit.video, DecisionAction::Reject, (1.0, 2.0))).unwrap();
    decisions::add(&file, &decision("gone-00000000", DecisionAction::Reject, (1.0, 2.0))).unwrap();
    let other = Decision { speaker: "guest".to_owned(), ..decision(&unit.video, DecisionAction::Accept, (1.0, 2.0)) };
    decisions::add(&file, &other).unwrap();
    decisions::add(&file, &word(&unit.video, (1.0, 2.0), "hello")).unwrap();
    let videos = open().unwrap().videos(&[]).unwrap();
    assert_eq!(videos[0].decisions, [valid]);
    let missing = &videos[0].missing;
    assert_eq!(missing.len(), 3, "{missing:?}");
    for (message, expected) in missing.iter().zip(["gone-00000000", "guest", "transcripts"]) {
        assert!(message.contains("decisions.toml, decision ") && message.contains(expected), "{message}");
    }
    fs::write(decisions::path(&file), "decision = 1").unwrap();
    assert!(format!("{:#}", open().unwrap_err()).contains("decisions.toml"));
}

fn corrected(words: &[&Decision]) -> Vec<String> {
    let transcript = Transcript::parse("0.0\t0.4\ta\n0.5\t0.9\tb\n1.0\t1.5\tc\n", "tsv", ("", "")).unwrap();
    let choice = TranscriptChoice { found: Some(("a.tsv".into(), transcript)), ..TranscriptChoice::default() };
    let words = VideoWords::of(choice, &[], 10.0, 0.0).corrected(words);
    let report = words.report([(0.0, 10.0)]);
    let words = words.within(0.0, 10.0);
    assert!(report.count.is_complete() && report.count.n_words == words.len(), "{report:?}");
    words.iter().map(|word| format!("{} {:.2}-{:.2}", word.word, word.start_secs, word.end_secs)).collect()
}

#[test]
fn words_are_replaced_removed_and_added() {
    let unchanged = ["a 0.00-0.40", "b 0.50-0.90", "c 1.00-1.50"];
    assert_eq!(corrected(&[]), unchanged);
    assert_eq!(corrected(&[&decision("v", DecisionAction::Reject, (0.0, 9.0))]), unchanged);
    let [replaced, wide, removed, both, added, narrow, second] = [
        word("v", (0.5, 0.9), "x"),
        word("v", (0.45, 0.95), "x"),
        word("v", (0.5, 0.9), ""),
        word("v", (0.0, 0.9), "x"),
        word("v", (2.0, 2.5), "x"),
        word("v", (0.5, 0.75), "x"),
        word("v", (0.75, 0.9), "y"),
    ];
    assert_eq!(corrected(&[&replaced]), ["a 0.00-0.40", "x 0.50-0.90", "c 1.00-1.50"]);
    assert_eq!(corrected(&[&wide]), corrected(&[&replaced]), "times are not changed by a wider range");
    assert_eq!(corrected(&[&removed]), ["a 0.00-0.40", "c 1.00-1.50"]);
    assert_eq!(corrected(&[&both]), ["x 0.00-0.90", "c 1.00-1.50"]);
    assert_eq!(corrected(&[&added])[3], "x 2.00-2.50");
    assert_eq!(corrected(&[&narrow, &second]), ["a 0.00-0.40", "x 0.50-0.75", "y 0.75-0.90", "c 1.00-1.50"]);
    assert_eq!(corrected(&[&replaced, &removed]), corrected(&[&removed]), "the last one counts");
}

/// Writes keypoints with hands at their wrists: left at 360 px, right at 280 px; with depth.
fn with_depth(path: &Path) -> orator_base::types::pose2d::Keypoints {
    let mut keypoints = crate::fixtures::footage::good(90).keypoints;
    let depth = ndarray::Array3::from_shape_fn((90, 2, 21), |(t, hand, point)| (t + 100 * hand + point) as f32);
    keypoints.hand_depth = Some(depth);
    npz::write(path, |npz| {
        npz.add_array("body", &keypoints.body)?;
        npz.add_array("left_hand", &keypoints.left_hand)?;
        npz.add_array("right_hand", &keypoints.right_hand)?;
        npz.add_array("hand_depth", keypoints.hand_depth.as_ref().unwrap())?;
        npz.add_array("fps", &ndarray::arr1(&[15.0, 1.0]))?;
        npz.add_array("image_size", &ndarray::arr1(&[640_i64, 480]))
    })
    .unwrap();
    keypoints
}

#[test]
fn hands_are_exchanged_in_the_range_only_and_wrists_follow_them() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("keypoints.npz");
    let before = with_depth(&path);
    assert_eq!(keypoints_npz::read(&path).unwrap(), before);
    let swap = decision("a", DecisionAction::SwapHands, (2.0, 4.0));
    let read = |swaps: &[&Decision]| decisions::read_keypoints(&path, swaps).unwrap();
    let swapped = read(&[&swap]);
    let (inside, outside) = (s![30..60, .., ..], [s![..30, .., ..], s![60.., .., ..]]);
    assert_eq!(swapped.left_hand.slice(inside), before.right_hand.slice(inside));
    assert_eq!(swapped.right_hand.slice(inside), before.left_hand.slice(inside));
    let (depth, depth_before) = (swapped.hand_depth.as_ref().unwrap(), before.hand_depth.as_ref().unwrap());
    assert_eq!(depth.slice(s![30..60, 0, ..]), depth_before.slice(s![30..60, 1, ..]));
    assert_eq!(depth.slice(s![30..60, 1, ..]), depth_before.slice(s![30..60, 0, ..]));
    // The hands were at their wrists, so the wrists were confused, too. Elbows and shoulders were not.
    let wrist = |points: &ndarray::Array3<f32>, joint: usize| points.slice(s![30..60, joint, ..]).to_owned();
    assert_eq!(wrist(&swapped.body, coco::L_WRIST), wrist(&before.body, coco::R_WRIST));
    assert_eq!(wrist(&swapped.body, coco::R_WRIST), wrist(&before.body, coco::L_WRIST));
    assert_eq!(wrist(&swapped.body, coco::L_ELBOW), wrist(&before.body, coco::L_ELBOW));
    for range in outside {
        assert_eq!(swapped.body.slice(range), before.body.slice(range));
        assert_eq!(swapped.left_hand.slice(range), before.left_hand.slice(range));
    }
    assert_eq!(read(&[&swap, &swap]), before, "exchanged twice");
    let part = decision("a", DecisionAction::SwapHands, (3.0, 4.0));
    let half = read(&[&swap, &part]);
    assert_eq!(half.left_hand.slice(s![45.., .., ..]), before.left_hand.slice(s![45.., .., ..]));
    assert_eq!(half.left_hand.slice(s![30..45, .., ..]), before.right_hand.slice(s![30..45, .., ..]));

    // Hands at the wrong arms: after the exchange, each is at its wrist, which stays.
    let mut crossed = before.clone();
    std::mem::swap(&mut crossed.left_hand, &mut crossed.right_hand);
    npz::write(&path, |npz| {
        npz.add_array("body", &crossed.body)?;
        npz.add_array("left_hand", &crossed.left_hand)?;
        npz.add_array("right_hand", &crossed.right_hand)?;
        npz.add_array("fps", &ndarray::arr1(&[15.0, 1.0]))?;
        npz.add_array("image_size", &ndarray::arr1(&[640_i64, 480]))
    })
    .unwrap();
    let corrected = read(&[&decision("a", DecisionAction::SwapHands, (0.0, 100.0))]);
    assert_eq!((&corrected.body, &corrected.left_hand), (&before.body, &before.left_hand));
}

struct Talk {
    dir: tempfile::TempDir,
    unit: Unit,
    settings: Settings,
}

impl Talk {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let unit = video(dir.path(), "talk", 300, 1);
        let rows: String = (0..20).map(|n| format!("{n}.1\t{n}.8\tw{n}\n")).collect();
        fs::write(dir.path().join("talk.tsv"), rows).unwrap();
        let mut settings = settings(dir.path());
        let (name, transcripts) = ("host".to_owned(), vec!["talk.tsv".to_owned()]);
        settings.speaker.push(config::SpeakerConfig { name, transcripts, ..config::SpeakerConfig::default() });
        Self { dir, unit, settings }
    }

    fn stage(&self, decisions: &[Decision]) -> DatasetStage {
        let transcripts = BTreeMap::from([(self.unit.video.clone(), vec![self.dir.path().join("talk.tsv")])]);
        let all = Videos {
            speaker: "host".to_owned(),
            units: vec![self.unit.clone()],
            splits: BTreeMap::from([(self.unit.video.clone(), Split::Train)]),
            transcripts,
            decisions: decisions.to_vec(),
            ..Videos::default()
        };
        let inputs = DatasetInputs { ready: vec![self.unit.clone()], all: vec![all], ..DatasetInputs::default() };
        DatasetStage::new(&self.settings, inputs)
    }

    /// Writes the dataset over an earlier one; returns all files.
    fn write(&self, decisions: &[Decision]) -> BTreeMap<String, Vec<u8>> {
        let speaker = self.speaker();
        let (old, out) = (self.settings.work.dir.join("dataset/host"), self.dir.path().join("out"));
        fs::create_dir_all(&out).unwrap();
        self.stage(decisions).run(&speaker, &out, &Silent).unwrap();
        let _ = fs::remove_dir_all(&old);
        fs::create_dir_all(old.parent().unwrap()).unwrap();
        fs::rename(&out, &old).unwrap();
        files_under(&old).into_iter().map(|(name, path)| (name, fs::read(path).unwrap())).collect()
    }

    fn speaker(&self) -> Unit {
        Unit { speaker: "host".into(), video: String::new(), source: self.dir.path().join("pipeline.toml") }
    }
}

#[test]
fn a_dataset_contains_corrected_words_and_hands_and_its_card_the_decisions() {
    let talk = Talk::new();
    let before = talk.write(&[]);
    let video = talk.unit.video.as_str();
    let decided = [
        word(video, (3.0, 4.0), "hello"),
        word(video, (5.0, 6.0), ""),
        Decision { author: "ben".to_owned(), ..decision(video, DecisionAction::SwapHands, (1.0, 2.0)) },
    ];
    let other = decision("other-00000000", DecisionAction::SwapHands, (0.0, 20.0));
    let settings = |decisions: &[Decision]| talk.stage(decisions).settings(&talk.speaker());
    assert!(settings(&[]).get("decisions").is_none() && settings(&decided) != settings(&[]));
    let renamed = decided.clone().map(|one| Decision { id: "0000000a".into(), time: "x".into(), ..one });
    assert_eq!(settings(&renamed), settings(&decided));

    let after = talk.write(&decided);
    let dataset = Dataset::open(talk.settings.work.dir.join("dataset/host")).unwrap();
    let samples: Vec<_> = dataset.samples(Split::Train).into_iter().map(|s| dataset.read(&s).unwrap()).collect();
    let words: Vec<String> = samples.iter().flat_map(|s| s.words.clone().unwrap()).map(|word| word.word).collect();
    assert_eq!(words[2..6], ["w2", "hello", "w4", "w6"], "{words:?}");
    let hands = crate::fixtures::footage::good(300).keypoints;
    let pose2d = &samples[0].pose2d;
    assert_eq!(pose2d.slice(s![15..30, 17..38, ..]), hands.right_hand.slice(s![15..30, .., ..]));
    assert_eq!(pose2d.slice(s![30..45, 17..38, ..]), hands.left_hand.slice(s![30..45, .., ..]));
    let card = String::from_utf8(after["README.md"].clone()).unwrap();
    assert!(card.contains("Decided by hand: 1 swap-hands (ben), 2 word (ana)."), "{card}");

    // Undone: every file is as before, and a decision on another video changes no sample.
    assert_eq!(talk.write(&[]), before);
    assert!(!String::from_utf8(before["README.md"].clone()).unwrap().contains("by hand"));
    let with_other = talk.write(&[other]);
    let shards = |files: &BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
        files.iter().filter(|(name, _)| name.ends_with(".tar")).map(|(n, bytes)| (n.clone(), bytes.clone())).collect()
    };
    assert_eq!(shards(&with_other), shards(&before));
    assert_ne!(shards(&after), shards(&before));
}
