//! The synthetic speaker: drawn files are read back unchanged, and a run locates the speaker correctly.

use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
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

/// A dataset of additional speech of the same figure is written beside the videos, once; another seed gives another
/// speaker.
#[test]
fn more_speech_of_the_figure_is_a_dataset() {
    let project = Project::with_clips("speech", 0, 1.0);
    let folder = project.dir().to_string_lossy().into_owned();
    let draw = |extra: &[&str]| {
        let plan = ["demo", "draw", &folder, "--rendered", "--videos", "1", "--secs", "1", "--speech", "1"];
        lab(&project, &[&plan, extra].concat())
    };
    let drawn = draw(&[]);
    assert_eq!(drawn.code, 0, "{}", drawn.errors);
    let dataset = Dataset::open(project.dir().join("speech")).unwrap();
    let secs =
        |split| -> f64 { dataset.samples(split).iter().map(|sample| dataset.info().fps.secs(sample.n_frames)).sum() };
    assert_eq!((secs(Split::Train), secs(Split::Validation), secs(Split::Test)), (60.0, 240.0, 0.0));
    let hash = dataset.hash().unwrap();
    drop(dataset);
    let hash_again = || Dataset::open(project.dir().join("speech")).unwrap().hash().unwrap();
    let again = draw(&[]);
    assert_eq!(again.code, 0, "{}", again.errors);
    assert_eq!(hash_again(), hash);
    let other = draw(&["--seed", "2"]);
    assert!(other.code != 0 && other.errors.contains("other speech"), "{}", other.errors);
}
