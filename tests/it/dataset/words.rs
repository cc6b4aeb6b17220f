//! Words of transcripts in datasets: assigned to a sample or counted, verified, imported, forgotten; transcript errors
//! are reported and exclude no video.

use crate::fixtures::media::lifted_videos::{settings, shard_with_words, video};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{StageName, dir};
use orator_base::stage::ledger::{TranscriptReport, WordCount};
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;
use orator_dataset::config::DatasetConfig;
use orator_dataset::forget::dataset::without;
use orator_dataset::import::import;
use orator_dataset::import::take::TakeLimits;
use orator_dataset::import::write::ImportPlan;
use orator_dataset::info::About;
use orator_dataset::verify::verify::{read_ledgers, verify};
use orator_dataset::{Dataset, Split};
use orator_formats::media_json::MediaInfo;
use orator_formats::transcript::Word;
use orator_test_support::project::files_under;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Subtitles with one cue of one word per second.
fn srt(n_words: usize, word: &str) -> String {
    let time = |secs: usize| format!("{:02}:{:02}:{:02},000", secs / 3600, secs / 60 % 60, secs % 60);
    (0..n_words).map(|n| format!("{}\n{} --> {}\n{word}{n}\n\n", n + 1, time(n), time(n + 1))).collect()
}

/// Two videos of 20 s.
struct TwoTalks {
    dir: tempfile::TempDir,
    videos: [Unit; 2],
}

impl TwoTalks {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let videos = [("first", 1), ("second", 2)].map(|(name, seed)| video(dir.path(), name, 300, seed));
        Self { dir, videos }
    }

    /// Writes a dataset with the transcripts (name, content) of the videos; returns its report line and folder.
    fn dataset(&self, transcripts: [Option<(&str, &[u8])>; 2], out: &str) -> (String, PathBuf) {
        let written = self.videos.iter().zip(transcripts).filter_map(|(unit, transcript)| {
            let (name, bytes) = transcript?;
            let path = self.dir.path().join(name);
            fs::write(&path, bytes).unwrap();
            Some((unit, path))
        });
        let written: Vec<_> = written.collect();
        let named: Vec<_> = self.videos.iter().map(|unit| (unit, Split::Train)).collect();
        let settings = settings(self.dir.path());
        let (report, out) = shard_with_words(&settings, &self.videos, &named, &written, out);
        assert_eq!(verify(&out, true, &Silent).unwrap().problems, []);
        (report.unwrap().line, out)
    }
}

/// The words of all samples, by key.
fn words(dir: &Path) -> BTreeMap<String, Option<Vec<Word>>> {
    let dataset = Dataset::open(dir).unwrap();
    let samples = Split::ALL.iter().flat_map(|split| dataset.samples(*split)).collect::<Vec<_>>();
    samples.into_iter().map(|sample| (sample.key.to_string(), dataset.read(&sample).unwrap().words)).collect()
}

fn transcript_report(dir: &Path, name: &str) -> TranscriptReport {
    let lines = read_ledgers(dir).unwrap().into_iter();
    lines.filter(|line| line.file.starts_with(name)).find_map(|line| line.ledger.words).unwrap()
}

#[test]
fn every_word_is_in_one_sample_or_counted() {
    let talks = TwoTalks::new();
    let (first, second) = (srt(20, "alpha"), srt(18, "omega"));
    let (line, out) = talks.dataset([Some(("a.srt", first.as_bytes())), Some(("b.vtt", second.as_bytes()))], "out");
    assert!(line.contains("38 of 38 words"), "{line}");
    let by_sample = words(&out);
    assert_eq!(by_sample.len(), 4, "two intervals of each video");
    let all: Vec<&Word> = by_sample.values().flatten().flatten().collect();
    let names: BTreeSet<&str> = all.iter().map(|word| word.word.as_str()).collect();
    assert_eq!((all.len(), names.len()), (38, 38));
    assert!(all.iter().all(|word| word.start_secs >= 0.0 && word.end_secs <= 10.0 + 1e-6));
    let expected = WordCount { n_words: 20, n_accepted: 20, n_rejected: 0, n_outside: 0 };
    assert_eq!(transcript_report(&out, "first").count, expected);
    let info = Dataset::open(&out).unwrap();
    assert!(info.info().members.contains_key("words.json"));
    assert_eq!(info.stats().footage.words.unwrap().n_accepted, 38);
    drop(info);

    // Importing only the shards gives the same words.
    let tars: Vec<PathBuf> = files_under(&out).into_iter().map(|(_, path)| path).collect();
    let tars = tars.into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "tar")).collect();
    let fps = FrameRate::new(15, 1);
    let plan = ImportPlan {
        sources: tars,
        kind: None,
        speaker_id: None,
        about: About::new("host", fps),
        limits: TakeLimits { fps, min_frames: 64, max_difference_secs: 0.5, no_sound: false, units: None },
        dataset: DatasetConfig { validation: 0.0, test: 0.0, ..DatasetConfig::default() },
    };
    let imported = talks.dir.path().join("imported");
    fs::create_dir(&imported).unwrap();
    import(&plan, &imported, &Silent).unwrap();
    assert_eq!(verify(&imported, true, &Silent).unwrap().problems, []);
    assert_eq!(words(&imported), by_sample);

    // Forgetting a video removes its words.
    let forgotten =
        by_sample.keys().find(|key| key.starts_with("first")).unwrap().rsplit_once('-').unwrap().0.to_owned();
    without(&out, &BTreeSet::from([forgotten])).unwrap();
    assert_eq!(verify(&out, true, &Silent).unwrap().problems, []);
    let is_stored = |word: &str| {
        files_under(&out).into_iter().any(|(_, path)| String::from_utf8_lossy(&fs::read(path).unwrap()).contains(word))
    };
    assert!(!is_stored("alpha") && !is_stored("a.srt") && is_stored("omega"));
}

#[test]
fn words_are_moved_by_the_delay_of_the_first_picture() {
    let talks = TwoTalks::new();
    let path = dir(&talks.dir.path().join("work"), StageName::Extract, &talks.videos[0]).join("media.json");
    MediaInfo { first_image_secs: 1.5, ..MediaInfo::read(&path).unwrap() }.write(&path).unwrap();
    // The sound ends at 21.5 s of the file.
    let (_, out) = talks.dataset([Some(("a.srt", srt(21, "so").as_bytes())), None], "out");
    let expected = WordCount { n_words: 21, n_accepted: 20, n_rejected: 1, n_outside: 0 };
    assert_eq!(transcript_report(&out, "first").count, expected);
    let by_sample = words(&out);
    let first = by_sample.values().flatten().flatten().find(|word| word.word == "so1").unwrap();
    assert_eq!((first.start_secs, first.end_secs), (0.0, 0.5));
    let second = by_sample.values().flatten().flatten().find(|word| word.word == "so2").unwrap();
    assert_eq!((second.start_secs, second.end_secs), (0.5, 1.5));
}

#[test]
fn a_dataset_without_transcripts_does_not_mention_words() {
    let talks = TwoTalks::new();
    let (_, out) = talks.dataset([None, None], "out");
    assert!(words(&out).values().all(Option::is_none));
    for file in ["info.json", "stats.json", "index.jsonl", "ledger.jsonl", "README.md"] {
        assert!(!fs::read_to_string(out.join(file)).unwrap().contains("words"), "{file}");
    }
}

#[test]
fn transcript_errors_are_reported_and_exclude_no_video() {
    let talks = TwoTalks::new();
    let good = srt(20, "so");
    let many: String =
        (0..100_000).map(|n| format!("{}\t{}\tso\n", f64::from(n) / 5000.0, f64::from(n) / 5000.0)).collect();
    for (name, bytes, expected) in [
        ("other.srt", srt(40, "so").into_bytes(), "20 of 40 words lie after the end of the sound (20.00 s"),
        ("late.srt", srt(21, "so").into_bytes(), "1 of 21 words lie after the end of the sound and were left out"),
        ("empty.srt", Vec::new(), "the transcript holds no word"),
        ("plain.txt", b"so well".to_vec(), "the transcript has no times"),
        ("latin.srt", b"1\n00:00:01,000 --> 00:00:02,000\nsch\xf6n\n".to_vec(), "line 3: byte 0xf6 is not valid UTF-8"),
        ("times.tsv", b"0\t1\tso\n2\t1\twell\n".to_vec(), "line 2: invalid times 2.00 to 1.00 s of `well`"),
        ("over.tsv", b"0\t5\tso\n1\t2\twell\n".to_vec(), "1 of 2 words begin before the one before ends"),
        ("cut.json", b"{\"segments\": [".to_vec(), "not valid JSON"),
        ("many.tsv", many.into_bytes(), "100020 of 100020 words"),
    ] {
        let (line, out) =
            talks.dataset([Some(("good.srt", good.as_bytes())), Some((name, &bytes))], &format!("out-{name}"));
        assert!(line.contains(expected), "{name}: {line}");
        let of_second = transcript_report(&out, "second");
        assert_eq!((of_second.file.as_deref(), of_second.count.is_complete()), (Some(name), true));
        assert_eq!(transcript_report(&out, "first").count.n_accepted, 20);
        assert!(words(&out).values().all(Option::is_some), "{name}: samples have word lists");
        assert!(!of_second.notes.iter().any(|note| note.contains(talks.dir.path().to_str().unwrap())));
    }
    let (line, _) = talks.dataset([Some(("good.srt", good.as_bytes())), None], "one");
    assert!(line.contains("second.mp4: no transcript has the name of the video"), "{line}");
}

#[test]
fn the_next_transcript_of_a_video_is_read() {
    let talks = TwoTalks::new();
    let [tracker, subtitles, cut] = [
        ("b.json", r#"{"names": ["jawOpen"], "frames": [{"weights": [0.5], "time": 0.1}]}"#.to_owned()),
        ("b.srt", srt(20, "so")),
        ("a.json", "{".to_owned()),
    ]
    .map(|(name, text)| {
        let path = talks.dir.path().join(name);
        fs::write(&path, text).unwrap();
        path
    });
    let [first, second] = &talks.videos;
    let transcripts = [(first, cut), (second, tracker), (second, subtitles)];
    let named: Vec<_> = talks.videos.iter().map(|unit| (unit, Split::Train)).collect();
    let (report, out) = shard_with_words(&settings(talks.dir.path()), &talks.videos, &named, &transcripts, "out");
    let line = report.unwrap().line;
    assert!(line.contains("b.json is not a valid transcript") && line.contains("b.srt was read instead"), "{line}");
    assert!(line.contains("a.json is not a valid transcript"), "{line}");
    let of_second = transcript_report(&out, "second");
    assert_eq!((of_second.file.as_deref(), of_second.count.n_accepted), (Some("b.srt"), 20));
    assert_eq!(verify(&out, true, &Silent).unwrap().problems, []);
}

#[test]
fn an_invalid_word_count_is_detected() {
    let talks = TwoTalks::new();
    let (_, out) = talks.dataset([Some(("a.srt", srt(20, "so").as_bytes())), None], "out");
    let entry =
        files_under(&out).into_iter().find(|(name, _)| name.starts_with("videos/first") && name.ends_with(".json"));
    let (name, path) = entry.unwrap();
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"n_kept\": 20", "\"n_kept\": 19")).unwrap();
    let found = verify(&out, true, &Silent).unwrap().problems;
    let has = |message: &str| found.iter().any(|problem| problem.file == name && problem.message.contains(message));
    assert!(has("account for every word") && has("counts 19 words in samples, the samples contain 20"), "{found:?}");
}
