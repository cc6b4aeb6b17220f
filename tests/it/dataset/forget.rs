//! `orator forget` removes all data derived from a video, leaves other data unchanged byte for byte, and completes an
//! interrupted removal.

use crate::fixtures::media::recogniser::project_with_words;
use orator_base::stage::progress::Silent;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_dataset::forget::removal::PENDING;
use orator_dataset::verify::verify::verify;
use orator_test_support::project::{Project, files_under};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Every file under a folder, and its bytes.
fn bytes_under(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files_under(folder).into_iter().map(|(name, path)| (name, fs::read(path).unwrap())).collect()
}

fn problems(project: &Project) -> usize {
    verify(&project.work().join("dataset/host"), true, &Silent).unwrap().problems.len()
}

#[test]
fn forgetting_removes_all_data_of_a_video_and_no_other_data() {
    let project = project_with_words("forget", 2, 6.0);
    assert_eq!(project.run(&[]).code, 0);
    let clips = project.clips();
    let (forgotten, other) = (&clips[0], &clips[1]);
    let name = forgotten.file_name().unwrap().to_str().unwrap();
    let stem = other.file_stem().unwrap().to_str().unwrap().replace('_', "-");
    let before = bytes_under(&project.work());
    for kind in ["gan/host", "seq2seq/host", "seq2seq/other"] {
        fs::create_dir_all(project.work().join(kind)).unwrap();
        fs::write(project.work().join(kind).join("step-0000001.safetensors"), "weights").unwrap();
    }

    let report = project.work().join("report.html");
    fs::write(&report, format!("<p>{name}</p>")).unwrap();
    let plan = project.answer(&["forget", "--video", name, "--dry-run"]);
    assert_eq!(plan.code, 0, "{}", plan.errors);
    assert!(plan.json["would_remove"].as_array().unwrap().len() > 8, "{}", plan.json);
    assert!(before.iter().all(|(name, bytes)| fs::read(project.work().join(name)).unwrap() == *bytes));
    for (video, expected) in [("gone.mp4", "expected one of"), ("", "expected one of")] {
        let answer = project.answer(&["forget", "--video", video]);
        assert!(
            answer.code == 1 && answer.errors.contains(expected) && answer.errors.contains(name),
            "{}",
            answer.errors
        );
    }

    let stem_of_forgotten = forgotten.file_stem().unwrap().to_str().unwrap().replace('_', "-");
    let folder = project.written("extract", &stem_of_forgotten, "audio.wav");
    let decision = Decision {
        speaker: "host".to_owned(),
        video: folder.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned(),
        action: DecisionAction::Reject,
        end_secs: 1.0,
        author: "ana".to_owned(),
        id: String::new(),
        time: String::new(),
        start_secs: 0.0,
        x: None,
        y: None,
        text: None,
    };
    decisions::add(&project.dir().join("pipeline.toml"), &decision).unwrap();

    let answer = project.answer(&["forget", "--video", name]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(answer.json["removed"].to_string().contains("1 decision of "), "{}", answer.json);
    assert!(!project.dir().join("decisions.toml").exists());
    assert!(answer.json["found"].as_array().unwrap().is_empty());
    assert!(answer.json["searched"]["files"].as_u64().unwrap() > 20, "{}", answer.json);
    let advice = answer.json["advice"].to_string();
    assert!(advice.contains("exclude = ["), "{advice}");
    for kind in ["gan/host", "seq2seq/host"] {
        assert!(!project.work().join(kind).exists(), "models trained on it are removed");
    }
    fs::remove_dir_all(project.work().join("seq2seq/other")).unwrap();
    assert!(!report.exists(), "a report that shows it is removed");
    assert_eq!(problems(&project), 0);
    // No file names the video, and the files of the other video are unchanged.
    let after = bytes_under(&project.work());
    let own = |(file, _): &(&String, &Vec<u8>)| file.contains(&stem) && !file.contains("dataset/host/videos");
    let unchanged: Vec<_> = before.iter().filter(own).collect();
    assert!(unchanged.len() > 10, "{unchanged:?}");
    for (file, bytes) in unchanged {
        assert!(after.get(file) == Some(bytes), "{file}");
    }
    let names_it = |bytes: &[u8]| bytes.windows(name.len()).any(|window| window == name.as_bytes());
    assert!(!after.iter().any(|(file, bytes)| file.contains(name) || names_it(bytes)));

    let again = project.answer(&["forget", "--video", name]);
    assert_eq!((again.code, again.json["removed"].as_array().unwrap().len()), (0, 0), "{}", again.json);
    assert!(
        again.json["searched"]["marks"].as_u64().unwrap() >= 6,
        "the search still knows its content: {}",
        again.json
    );

    // The printed line excludes the video from the next run.
    let config = project.dir().join("pipeline.toml");
    let line = advice.split("exclude = ").nth(1).unwrap().split(']').next().unwrap().replace("\\\"", "\"");
    let text = fs::read_to_string(&config).unwrap();
    let text = text.replace("[[speaker]]", &format!("[[speaker]]\nexclude = {line}]"));
    fs::write(&config, text).unwrap();
    let run = project.run(&[]);
    assert_eq!(run.code, 0, "{} {}", run.json, run.errors);
    assert_eq!(run.json["stages"]["dataset"]["done"].as_u64(), Some(1));
    assert!(!bytes_under(&project.work()).iter().any(|(file, _)| file.contains(name.trim_end_matches(".mp4"))));
    let shards = |all: &BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
        all.iter().filter(|(file, _)| file.ends_with(".tar")).map(|(f, b)| (f.clone(), b.clone())).collect()
    };
    assert_eq!(shards(&bytes_under(&project.work())), shards(&after));
    assert_eq!(problems(&project), 0);

    let all = project.answer(&["forget", "--speaker", "host"]);
    assert_eq!(all.code, 0, "{} {}", all.json, all.errors);
    let remaining: Vec<String> = files_under(&project.work()).into_iter().map(|(file, _)| file).collect();
    assert_eq!(remaining, [".lock", "hashes.json"]);
}

#[test]
fn an_interrupted_removal_is_detected_and_completed() {
    let project = Project::with_clips("forget-kill", 2, 6.0);
    assert_eq!(project.run(&[]).code, 0);
    let dataset = project.work().join("dataset/host");
    let clip = project.clips()[1].clone();
    let stem = clip.file_stem().unwrap().to_str().unwrap().to_owned();
    // The stage files of one video are removed, the dataset still contains it.
    fs::write(dataset.join(PENDING), "half").unwrap();
    fs::remove_dir_all(project.work().join("extract/host")).unwrap();
    fs::remove_file(project.work().join("dataset/host.record.json")).unwrap();
    assert!(problems(&project) > 0, "an unfinished removal is a problem");
    let answer = project.answer(&["forget", "--video", &stem]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(!dataset.join(PENDING).exists() && problems(&project) == 0);
    assert!(files_under(&project.work()).iter().all(|(file, _)| !file.contains(&stem.replace('_', "-"))));

    // Interrupted between the two renames of the new dataset: the old dataset is restored.
    let stem = project.clips()[0].file_stem().unwrap().to_str().unwrap().to_owned();
    fs::rename(&dataset, project.work().join("dataset/.host.old")).unwrap();
    let answer = project.answer(&["forget", "--video", &stem, "--keep-models"]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(!dataset.exists() && !project.work().join("dataset/.host.old").exists(), "it was the last video");
}

#[test]
fn a_dataset_alone_forgets_videos_and_copies_are_reported() {
    let project = Project::with_clips("forget-dataset", 2, 6.0);
    assert_eq!(project.run(&[]).code, 0);
    let name = project.clips()[0].file_name().unwrap().to_str().unwrap().to_owned();
    // A file of the user names the video.
    fs::write(project.work().join("notes.txt"), format!("see {name}")).unwrap();
    let answer = project.answer(&["forget", "--video", &name, "--keep-models"]);
    assert_eq!(answer.code, 1, "{} {}", answer.json, answer.errors);
    let found = answer.json["found"].as_array().unwrap();
    assert!(found.len() == 1 && found[0]["file"].as_str().unwrap().ends_with("notes.txt"), "{found:?}");

    let other = project.clips()[1].file_name().unwrap().to_str().unwrap().to_owned();
    assert_eq!(project.run(&[]).code, 0, "a run adds the forgotten video again");
    let parts = files_under(&project.work().join("dataset/host/videos"));
    let (_, part) = parts.iter().find(|(_, path)| fs::read_to_string(path).is_ok_and(|t| t.contains(&other))).unwrap();
    let original = fs::read_to_string(part).unwrap();
    fs::write(part, original.replacen("0.", "1.", 1)).unwrap();
    let answer = project.answer(&["forget", "--video", &name, "--keep-models"]);
    assert!(answer.code == 1 && answer.errors.contains("nothing was removed"), "{}", answer.errors);
    fs::write(part, original).unwrap();
    fs::write(project.work().join("notes.txt"), "").unwrap();
    assert_eq!(project.answer(&["forget", "--video", &name, "--keep-models"]).code, 0);
    fs::write(project.dir().join("pipeline.toml"), "").unwrap();
    let dataset = project.work().join("dataset/host");
    let folder = dataset.to_str().unwrap();
    let answer = project.answer(&["forget", "--dataset", folder, "--video", "none.mp4"]);
    assert!(answer.code == 1 && answer.errors.contains(&other), "{}", answer.errors);
    let answer = project.answer(&["forget", "--dataset", folder, "--video", &other]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(!dataset.exists(), "it was the last video");
}

#[test]
fn a_page_with_an_escaped_video_name_is_removed() {
    let project = Project::with_clips("forget-quote", 0, 1.0);
    let name = "a \"talk\" & <more>\nof it.mp4";
    fs::write(project.video(name), "no video").unwrap();
    project.name_videos(&["videos/host"]);
    assert_eq!(project.run(&["--to", "extract"]).code, 2, "it is not a video");
    assert_eq!(project.answer(&["report"]).code, 0);
    let page = project.work().join("report.html");
    assert!(fs::read_to_string(&page).unwrap().contains("&quot;talk&quot;"), "the page shows it");
    let answer = project.answer(&["forget", "--video", name]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(!page.exists(), "{}", answer.json);
}
