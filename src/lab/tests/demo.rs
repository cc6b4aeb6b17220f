//! The synthetic speaker: drawn files are read back unchanged, and a run locates the speaker correctly.

use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::audio;
use orator_media::ffmpeg::frames::FrameReader;
use orator_test_support::drawn::truth::DrawnTruth;
use orator_test_support::project::{ProgramAnswer, Project, speaker_clip};

fn lab(project: &Project, args: &[&str]) -> ProgramAnswer {
    project.answer_of(env!("CARGO_BIN_EXE_orator-lab"), args)
}

#[test]
fn a_clip_has_frames_audio_and_ground_truth() {
    let dir = tempfile::tempdir().unwrap();
    let video = speaker_clip(dir.path(), 3.0, 5);
    let truth = DrawnTruth::read(&dir.path().join("truth/clip-1.npz")).unwrap();
    let n_frames = FrameReader::open(&video, FrameRate::new(15, 1)).unwrap().map(Result::unwrap).count();
    assert_eq!((n_frames, truth.motion.n_frames()), (45, 45));
    let sound = audio::read_mono(&video, 16_000).unwrap().expect("a sound track");
    assert!((sound.secs() - 3.0).abs() < 0.1);
    let loud = sound.samples.iter().filter(|s| s.abs() > 0.05).count();
    assert!(loud > 2_000, "{loud}");
}

/// The target of the 3D error is checked by `make demo`, on longer clips.
#[test]
fn a_run_finds_every_joint_through_the_chain_of_real_models() {
    let project = Project::with_clips("pipeline", 1, 5.0);
    let ran = project.run(&[]);
    assert_eq!(ran.code, 0, "{}", ran.errors);
    let folder = project.dir().to_string_lossy().into_owned();
    let measured = lab(&project, &["demo", "measure", &folder]).json;
    eprintln!("{measured}");
    let number = |path: &str| measured.pointer(path).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN);
    for part in ["body_px", "hands_px"] {
        let of = |name: &str| number(&format!("/{part}/{name}"));
        assert!(of("median") < 1.0 && of("p90") < 8.0 && of("found") > 0.95, "{part}: {measured}");
    }
    assert_eq!((number("/n_frames"), number("/n_drawn")), (75.0, 75.0));
    assert!(number("/mm/fingers") < number("/mean_pose_mm/fingers"), "{measured}");

    let sheet = project.dir().join("sheet.png").to_string_lossy().into_owned();
    assert_eq!(lab(&project, &["demo", "sheet", &folder, "--out", &sheet]).code, 0);
    let picture = orator_media::opencv::png::read(std::path::Path::new(&sheet)).unwrap();
    assert!(picture.data.iter().any(|&value| value < 100));
}

/// Uninitialised memory differs between runs; no encoder may write it to a video.
#[test]
fn a_video_does_not_depend_on_what_memory_held_before() {
    let dir = tempfile::tempdir().unwrap();
    let video = |fill: &str| {
        let folder = dir.path().join(fill);
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orator-lab"));
        command.args(["demo", "draw", "--videos", "1", "--secs", "2"]).arg(&folder).env("MALLOC_PERTURB_", fill);
        assert!(command.output().unwrap().status.success());
        let videos = std::fs::read_dir(folder.join("videos/host")).unwrap();
        videos.map(|video| std::fs::read(video.unwrap().path()).unwrap()).collect::<Vec<_>>()
    };
    let first = video("1");
    assert!(!first.is_empty() && ["2", "85"].iter().all(|fill| video(fill) == first));
}

/// Without a terminal, drawing reports each finished video on standard error.
#[test]
fn drawing_reports_its_progress_in_a_pipe() {
    let project = Project::with_clips("progress", 0, 1.0);
    let folder = project.dir().to_string_lossy().into_owned();
    let drawn = lab(&project, &["demo", "draw", &folder, "--rendered", "--videos", "2", "--secs", "1", "--fps", "15"]);
    assert_eq!(drawn.code, 0, "{}", drawn.errors);
    for line in ["rendered clip-1.mp4, 1 of 2", "rendered clip-2.mp4, 2 of 2"] {
        assert!(drawn.errors.lines().any(|of| of == line), "{}", drawn.errors);
    }
    assert!(project.dir().join("truth/clip-2.json").is_file());
}
