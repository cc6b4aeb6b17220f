//! Films of all kinds of conditions differ only in motion.

use crate::fixtures::models::untrained::{write_untrained_sequence, write_untrained_speaker};
use crate::fixtures::study::films::{SIZE, speaker};
use crate::fixtures::study::mp4;
use orator_base::stage::progress::Silent;
use orator_base::types::split::Split;
use orator_base::types::time::FrameRate;
use orator_formats::word_vectors::glove;
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::probe::probe;
use orator_study::build::{common_bytes, padded};
use orator_study::file::StudyFile;
use orator_study::plan::{FilmContent, FilmSound};
use orator_study::stimuli::condition_motion::{ConditionModels, motions};
use orator_study::stimuli::cut::{StudyClip, cut};
use orator_study::stimuli::filmed_speaker::{CutSpeaker, normalise_loudness};
use orator_study::stimuli::speaker_source::SpeakerSource;
use orator_test_support::rule::dataset::{RULE, RULE_OF_WORDS, SpokenClip, write};
use std::collections::BTreeSet;

const STUDY: &str = r#"
title = "Kinds of motion"
participants = 4
attention_checks = 0
practice = false
[clips]
seconds = 2.0
[[speaker]]
name = "host"
dataset = "data"
[[condition]]
name = "real"
kind = "natural"
[[condition]]
name = "model"
kind = "checkpoint"
checkpoint = "models/{speaker}"
[[condition]]
name = "mismatched"
kind = "mismatched"
of = "real"
[[condition]]
name = "still"
kind = "mean-pose"
[[condition]]
name = "theirs"
kind = "files"
files = "theirs/{clip}.npy"
[[task]]
name = "liking"
design = "sliders"
scale = "human-likeness"
conditions = ["real", "model", "mismatched", "still", "theirs"]
trials = 1
"#;

#[test]
fn a_drawn_mismatched_film_shows_the_motion_of_the_clip_that_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    speaker(dir);
    let (conditions, _) = STUDY.split_once("[[condition]]\nname = \"still\"").unwrap();
    let study = conditions.replace("seconds = 2.0", "seconds = 2.0\nmismatched = \"per-participant\"")
        + "[[task]]\nname = \"fits\"\ndesign = \"mismatch\"\nconditions = [\"real\", \"mismatched\"]\ntrials = 2\n";
    std::fs::write(dir.join("study.toml"), study).unwrap();
    let file = StudyFile::read(&dir.join("study.toml")).unwrap();
    let host = CutSpeaker::new(&file, &file.speaker[0], 4, |name| name.len() as u64).unwrap();
    let clips = host.cut.clips.clone();
    let host = host.filmed(&file, SIZE, &Silent).unwrap();
    let name = |clip: usize| clips.get(clip).map_or("host/none".to_owned(), |clip| format!("host/{}", clip.name));
    let film = |condition: &str, clip: usize, of: usize| {
        let (condition, speaker) = (condition.to_owned(), "host".to_owned());
        let (clip, motion_of, sound) = (name(clip), name(of), FilmSound::Speech);
        let content = FilmContent { clip, speaker, condition, motion_of, number: None, sound, right: None };
        host.performances(&content).map(|mut performances| performances.remove(0))
    };
    for (clip, of) in [(0, 1), (0, 2), (0, 3), (3, 0)] {
        let [mismatched, own] = [film("mismatched", clip, of), film("real", of, of)].map(|film| film.unwrap().clip);
        assert!(mismatched == own, "{clip} {of}");
        assert!(mismatched != film("real", clip, clip).unwrap().clip, "{clip} {of}");
    }
    let error = film("mismatched", 0, 9).unwrap_err().to_string();
    assert!(error.contains("no motion of the clip host/none"), "{error}");
}

#[test]
fn films_of_all_conditions_differ_only_in_motion() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    speaker(dir);
    std::fs::write(dir.join("study.toml"), STUDY).unwrap();
    let file = StudyFile::read(&dir.join("study.toml")).unwrap();
    let cut = || CutSpeaker::new(&file, &file.speaker[0], 4, |name| name.len() as u64).unwrap();
    let mut host = cut();
    assert!(host.cut.clips.len() == 4 && host.cut.rejected.is_empty());
    for clip in &host.cut.clips {
        assert!(clip.cut_db < -15.0 && clip.hidden_share == 0.0 && clip.frames.len() == 30, "{clip:?}");
    }
    let missing = format!("{:#}", cut().filmed(&file, SIZE, &Silent).map(drop).unwrap_err());
    assert!(missing.contains("theirs") && missing.contains(".npy"), "{missing}");

    // Motion of another system, at its own frame rate.
    let clips = host.cut.clips.clone();
    for (number, clip) in clips.iter().enumerate() {
        let motion = SpokenClip { rule: RULE, seed: 6, split: Split::Test, number, n_frames: 30, habits: 0 }.motion();
        std::fs::create_dir_all(dir.join("theirs")).unwrap();
        orator_avatar::animate::export::file::ExportFormat::Npy
            .write_joints(&dir.join(format!("theirs/{}.npy", clip.name)), &motion)
            .unwrap();
    }
    let lufs = normalise_loudness(host.sounds.iter_mut());
    assert!((-40.0..=-23.0).contains(&lufs), "{lufs}");
    let host = host.filmed(&file, SIZE, &Silent).unwrap();

    let name = |clip: usize| format!("host/{}", clips[clip].name);
    let content = |condition: &str, number| FilmContent {
        clip: name(1),
        speaker: "host".into(),
        condition: condition.into(),
        motion_of: name(1),
        number,
        sound: FilmSound::Speech,
        right: None,
    };
    let (mut films, mut skeletons) = (Vec::new(), Vec::new());
    for (condition, number) in
        [("real", None), ("model", None), ("mismatched", None), ("still", None), ("theirs", None), ("real", Some(47))]
    {
        let content = content(condition, number);
        let performances = host.performances(&content).unwrap();
        let scene = host.scene(&content, &performances);
        assert_eq!((performances.len(), performances[0].clip.n_frames()), (1, 60));
        skeletons.push(performances[0].rig.skeleton.clone());
        let path = dir.join(format!("{condition}{}.mp4", number.unwrap_or(0)));
        scene.write(&path).unwrap();
        films.push(path);
    }
    assert_eq!(host.motion_of(&content("real", None)).unwrap(), name(1));
    assert_ne!(host.motion_of(&content("mismatched", None)).unwrap(), name(1));

    assert!(skeletons.windows(2).all(|pair| pair[0] == pair[1]), "all films show one body");
    let bytes = common_bytes(films.iter().map(|film| std::fs::metadata(film).unwrap().len() as usize));
    films.iter().for_each(|film| std::fs::write(film, padded(std::fs::read(film).unwrap(), bytes).unwrap()).unwrap());
    let mut headers = Vec::new();
    for film in &films {
        let data = std::fs::read(film).unwrap();
        assert_eq!(data.len(), bytes);
        let order: Vec<String> = mp4::boxes(&data).into_iter().map(|found| found.kind).collect();
        let at = |kind: &str| order.iter().position(|other| other == kind).unwrap();
        assert!(at("moov") < at("mdat") && order.last().unwrap() == "free", "{order:?}");
        // The headers have no title, no program name and no time.
        let metadata = mp4::find(&data, "moov/udta").concat();
        assert!(metadata.ends_with(b"\0\0\0\x08ilst") && mp4::find(&data, "moov/meta").is_empty());
        assert!(mp4::find(&data, "moov/mvhd")[0][4..12].iter().all(|byte| *byte == 0));
        // The first frame is a key frame.
        let keys = &mp4::find(&data, "moov/trak/mdia/minf/stbl/stss")[0];
        assert!(mp4::number(&keys[4..]) >= 1 && mp4::number(&keys[8..]) == 1);
        let [movie, times, edits] =
            ["moov/mvhd", "moov/trak/mdia/minf/stbl/stts", "moov/trak/edts/elst"].map(|path| mp4::find(&data, path));
        headers.push((movie, times, edits));
        let media = probe(film).unwrap();
        let video = media.video.unwrap();
        assert_eq!((video.codec.as_str(), video.image_size, video.fps), ("h264", SIZE, Some(FrameRate::new(30, 1))));
        assert_eq!(media.audio.unwrap().codec, "aac");
        assert_eq!(FrameReader::open(film, FrameRate::new(30, 1)).unwrap().count(), 60);
    }
    assert!(headers.windows(2).all(|pair| pair[0] == pair[1]), "the headers of the films differ");
    let sounds: Vec<_> = films.iter().map(|film| orator::read_sound(film).unwrap()).collect();
    assert!(sounds.windows(2).all(|pair| pair[0] == pair[1]), "the audio of the films differs");
}

const MODEL_STUDY: &str = r#"
title = "Settings of a model"
participants = 4
attention_checks = 0
[clips]
seconds = 2.0
[[speaker]]
name = "host"
dataset = "data"
[[task]]
name = "liking"
design = "preference"
trials = 1
[[condition]]
name = "real"
kind = "natural"
[[condition]]
name = "model"
kind = "checkpoint"
checkpoint = "words.safetensors"
"#;

#[test]
fn a_model_condition_may_carry_its_state_and_read_word_vectors() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let clip = |split, number| SpokenClip { rule: RULE_OF_WORDS, seed: 5, split, number, n_frames: 90, habits: 0 };
    let clips = [clip(Split::Train, 0), clip(Split::Test, 0), clip(Split::Test, 1)];
    std::fs::create_dir_all(dir.join("data")).unwrap();
    write(&dir.join("data"), &clips, &Silent).unwrap();
    write_untrained_speaker(&dir.join("gan.safetensors"));
    write_untrained_sequence(&dir.join("words.safetensors"), Architecture::Words, false, &["hello"]);
    let spoken: BTreeSet<String> = clips.iter().flat_map(SpokenClip::words).map(|word| word.word).collect();
    let rows = spoken.iter().enumerate().map(|(n, word)| format!("{word} {n} 1 -1 0.5\n"));
    glove::convert(rows.collect::<String>().as_bytes(), &dir.join("host.safetensors")).unwrap();
    let joints = |checkpoint: &str, key: &str| {
        let study = MODEL_STUDY.replace("words.safetensors", checkpoint);
        std::fs::write(dir.join("study.toml"), format!("{study}{key}\n")).unwrap();
        let file = StudyFile::read(&dir.join("study.toml"))?;
        let models = ConditionModels::open(&file.condition, "host")?;
        let source = SpeakerSource::of_dataset("host", &dir.join("data"), Split::Test)?;
        let cut = cut(&source, 30, (2, 1), |_| 0)?;
        let shown = motions(&source, &cut.clips, &file.condition, &models, &|| ())?;
        anyhow::Ok(shown["model"].iter().map(|shown| shown.motion.joints.clone()).collect::<Vec<_>>())
    };
    let of = |key: &str| joints("words.safetensors", key).unwrap();
    let plain = of("");
    assert_eq!((plain.len(), &of("carry_state = false")), (2, &plain));
    assert_ne!(of("carry_state = true"), plain);
    assert_ne!(of("words = \"{speaker}.safetensors\""), plain);
    for (key, error) in [
        ("carry_state = true", "the model of host has no decoder state: remove the key carry_state"),
        ("words = \"host.safetensors\"", "the model of host does not read words: remove the key words"),
    ] {
        let text = format!("{:#}", joints("gan.safetensors", key).unwrap_err());
        assert!(text.contains(&format!("condition model of the speaker host: {error}")), "{text}");
    }
}

#[test]
fn clips_are_stratified_by_stroke_rate() {
    let folder = tempfile::tempdir().unwrap();
    let clip = |split, number| SpokenClip { rule: RULE_OF_WORDS, seed: 5, split, number, n_frames: 300, habits: 0 };
    let clips = [clip(Split::Train, 0), clip(Split::Test, 0), clip(Split::Test, 1), clip(Split::Test, 2)];
    write(folder.path(), &clips, &Silent).unwrap();
    let source = SpeakerSource::of_dataset("host", folder.path(), Split::Test).unwrap();
    let of = |n_groups: usize| cut(&source, 60, (100, n_groups), |_| 0).unwrap();
    let (plain, grouped) = (of(1), of(2));
    assert!(plain.clips.iter().all(|clip| clip.strokes_per_minute.is_none()));
    let names = |clips: &[StudyClip]| clips.iter().map(|clip| clip.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&grouped.clips), names(&plain.clips));
    let rate = |name: &String| {
        grouped.clips.iter().find(|clip| clip.name == *name).and_then(|clip| clip.strokes_per_minute).unwrap()
    };
    let rates: BTreeSet<u64> = grouped.best_first.iter().map(|name| rate(name).round() as u64).collect();
    assert!(rates.len() > 1, "{rates:?}");
    // Clips of low and of high rate alternate among the best.
    assert!(grouped.best_first.chunks_exact(2).take(2).all(|pair| rate(&pair[0]) <= rate(&pair[1])));
}
