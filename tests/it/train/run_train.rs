//! One command from videos to a model: `orator init DIR VIDEO...`, `orator run --train`, and the models in
//! `orator status`.

use super::interrupted::signalled;
use orator_test_support::drawn::folder::DemoPlan;
use orator_test_support::project::Project;
use rustix::process::Signal;
use std::fs;
use std::process::Stdio;

#[test]
fn init_lists_the_videos() {
    let project = Project::with_clips("init", 1, 1.0);
    let clip = project.video("clip-1.mp4");
    let answer = project.answer(&["init", "mine", "videos/host/clip-1.mp4"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    assert_eq!(answer.json["next"], "orator run -c mine/pipeline.toml --train");
    let status = project.answer(&["status", "-c", "mine/pipeline.toml"]);
    let unit = status.json["units"][0]["unit"].as_str().unwrap_or_default().to_owned();
    assert!(status.code == 0 && unit.starts_with("host/clip-1-"), "{}", status.errors);
    let text = fs::read_to_string(project.dir().join("mine/pipeline.toml")).unwrap();
    assert!(text.contains(&format!("videos = [\"{}\"]", clip.display())), "{text:.1000}");
    let wrong = project.answer(&["init", "other", "pipeline.toml"]);
    assert!(wrong.code == 1 && wrong.errors.contains("pipeline.toml is not a video"), "{}", wrong.errors);
    let missing = project.answer(&["init", "other", "gone.mp4"]);
    assert!(missing.code == 1 && missing.errors.contains("gone.mp4 does not exist"), "{}", missing.errors);
    let twice = project.answer(&["init", "other", "videos/host/clip-1.mp4", "videos/../videos/host/clip-1.mp4"]);
    assert!(twice.code == 1 && twice.errors.contains("are the same file"), "{}", twice.errors);
    assert!(!project.dir().join("other").exists());
}

#[test]
fn a_run_trains_evaluates_and_trains_anew_when_the_dataset_changes() {
    let plan = DemoPlan { n_videos: 3, secs: 6.0, size: [640, 480], ..DemoPlan::default() };
    let project = Project::drawn("run-train", &plan);
    let short = ["--set", "gan.steps=4", "--set", "gan.epoch_steps=2", "--set", "gan.batch=2"];
    let args = [&["--train"], &short[..]].concat();
    let answer = project.run(&args);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    assert!(answer.errors.contains("the result will be the mean pose"), "{}", answer.errors);
    let model = &answer.json["models"][0];
    let page = project.work().join("gan/host/result.html");
    assert_eq!((&model["speaker"], &model["split"]), (&"host".into(), &"test".into()), "{model}");
    assert_eq!(answer.json["next"], format!("xdg-open {}", page.display()));
    assert_eq!(model["conclusions"].as_array().unwrap().len(), 2);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("<video controls src=\"data:video/mp4;base64,") && html.contains("id=\"conclusions\""));
    assert!(project.work().join("gan/host/film.mp4").is_file());

    let models = |set: &[&str]| {
        let status = project.answer(&[&["status"], set].concat()).json;
        (status["models"].clone(), status["next"].as_str().unwrap_or_default().to_owned())
    };
    let (fresh, next) = models(&[]);
    assert_eq!(
        (&fresh[0]["name"], &fresh[0]["state"], &fresh[0]["step"]),
        (&"gan/host".into(), &"fresh".into(), &4.into())
    );
    assert!(next.starts_with("orator generate --checkpoint "), "{next}");
    // Other joints: the dataset changes, and the model is stale until it is trained anew.
    let changed = ["--set", "lift.smooth_arms=2"];
    assert_eq!(project.run(&changed).code, 0);
    let (stale, next) = models(&changed);
    assert_eq!((&stale[0]["state"], next.as_str()), (&"stale".into(), "orator run --train --set lift.smooth_arms=2"));
    let best = project.work().join("gan/host/best.safetensors");
    let before = fs::read(&best).unwrap();
    assert_eq!(project.run(&[&args[..], &changed].concat()).code, 0);
    assert!(fs::read(&best).unwrap() != before);
    assert_eq!(fs::read(project.work().join("gan/host-old/best.safetensors")).unwrap(), before);
    let (fresh, _) = models(&changed);
    assert_eq!((fresh.as_array().unwrap().len(), &fresh[0]["state"]), (1, &"fresh".into()));
    // A stale model of another network, which `run --train` does not train.
    let other = project.work().join("seq2seq/host");
    fs::create_dir_all(&other).unwrap();
    fs::copy(project.work().join("gan/host-old/best.safetensors"), other.join("best.safetensors")).unwrap();
    let (_, next) = models(&changed);
    assert!(next.starts_with("orator train seq2seq --speaker host --out "), "{next}");
}

#[test]
fn a_signal_during_the_training_saves_a_checkpoint_from_which_it_resumes() {
    let plan = DemoPlan { n_videos: 3, secs: 6.0, size: [640, 480], ..DemoPlan::default() };
    let project = Project::drawn("run-train-stopped", &plan);
    let short = ["--set", "gan.steps=20", "--set", "gan.epoch_steps=20", "--set", "gan.batch=2"];
    let mut command = project.command(&[&["run", "--train"], &short[..]].concat());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let (code, answer, errors) = signalled(command, "step 1 of 20: ", Signal::INT);
    assert_eq!((code, &answer["stopped"]), (Some(130), &true.into()), "{answer} {errors}");
    let step = answer["step"].as_u64().unwrap();
    assert!((1..20).contains(&step), "{answer}");
    let resumed = project.run(&[&["--train"], &short[..]].concat());
    assert!(resumed.code == 0 && resumed.errors.contains("resuming from"), "{}", resumed.errors);
    assert!(!project.work().join("gan/host-old").exists());
}

#[test]
fn a_speaker_without_a_model_is_listed() {
    let project = Project::with_clips("untrained", 1, 4.6);
    assert_eq!(project.run(&[]).code, 0);
    let status = project.answer(&["status"]).json;
    assert_eq!((&status["models"][0]["state"], &status["next"]), (&"-".into(), &"orator train gan".into()), "{status}");
}
