//! Rendered persons: files are read back unchanged, occluders are identified, and the bytes depend only on the seed.

use ndarray::Array2;
use orator_base::stage::progress::Silent;
use orator_base::types::pose2d::coco;
use orator_base::types::time::FrameRate;
use orator_lab::demo::people::condition::Condition;
use orator_lab::demo::people::folder::{self, ClipSeeds, RenderPlan, SetPart};
use orator_lab::demo::people::scene::PersonScene;
use orator_lab::mocap::captured::source::MotionSource;
use orator_lab::rendered_truth::{RenderedTruth, Visibility};
use orator_media::ffmpeg::frames::FrameReader;
use orator_test_support::project::Project;
use orator_test_support::skip::fetched_models;
use std::path::Path;

const FPS: FrameRate = FrameRate::new(3, 1);
/// Seeds of clips that begin with the hands under the desk.
const SEEDS: [u64; 3] = [2, 20, 28];

fn plan(conditions: &[Condition]) -> RenderPlan {
    let (conditions, motions) = (conditions.to_vec(), vec![MotionSource::Generated]);
    RenderPlan { conditions, n_clips: 3, secs: 1.0, fps: FPS, seed: 4, motions, truth_only: false }
}

fn bytes(dir: &Path, file: &Path) -> Vec<u8> {
    std::fs::read(dir.join(file)).unwrap()
}

#[test]
fn clips_have_their_truth_and_the_same_bytes_on_one_thread() {
    let dirs = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [first, second] = dirs.each_ref().map(tempfile::TempDir::path);
    let plan = plan(&[Condition::Outside, Condition::Holding]);
    let clips = folder::draw(first, &plan, &Silent).unwrap();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one_thread.install(|| folder::draw(second, &plan, &Silent)).unwrap(), clips);
    assert_eq!(folder::read(first).unwrap(), clips);
    assert_eq!(clips.iter().map(|clip| clip.part).collect::<Vec<_>>(), [SetPart::ALL, SetPart::ALL].concat());
    let mut outside = 0;
    for clip in &clips {
        for file in [&clip.video, &clip.truth] {
            assert_eq!(bytes(first, file), bytes(second, file), "{}", file.display());
        }
        let truth = RenderedTruth::read(&first.join(&clip.truth)).unwrap();
        let frames = FrameReader::open(&first.join(&clip.video), FPS).unwrap().map(Result::unwrap);
        assert_eq!((frames.count(), truth.n_frames()), (3, 3));
        let [width, height] = clip.size.map(|n| n as f32);
        for ((t, point), &seen) in truth.body_visibility.indexed_iter() {
            let [x, y] = [0, 1].map(|k| truth.body[[t, point, k]]);
            let inside = (-0.5..width - 0.5).contains(&x) && (-0.5..height - 0.5).contains(&y);
            assert_eq!(seen != Visibility::Outside, inside, "{x} {y}");
            // The pixel is the projection of the 3D point.
            let position = [0, 1, 2].map(|k| truth.body_joints[[t, point, k]] + truth.neck[[t, k]]);
            let px = (width - 1.0) / 2.0 + truth.focal_px * position[0] / position[2];
            assert!((px - x).abs() < 0.05, "{px} {x}");
        }
        assert!(truth.body_visibility.row(0)[coco::NOSE] == Visibility::Visible);
        outside += usize::from(clip.condition == "outside" && truth.body_visibility[[0, 11]] == Visibility::Outside);
    }
    assert_eq!(outside, 3, "hips are below a picture of head and shoulders");
}

#[test]
fn hands_under_a_desk_are_behind_an_object() {
    let share = |visibility: &Array2<Visibility>, value: Visibility| {
        visibility.iter().filter(|&&v| v == value).count() as f64 / visibility.len() as f64
    };
    let dir = tempfile::tempdir().unwrap();
    let hidden = SEEDS.into_iter().any(|seed| {
        let seeds = ClipSeeds { body: seed, clothes: 1, camera: seed, motion: seed, voice: None };
        let scene = PersonScene::new(Condition::SeatedDesk, seeds, 1.0, FrameRate::new(2, 1), None);
        let truth = scene.film(&dir.path().join("a.mp4"), &Silent).unwrap();
        let hands = [&truth.left_hand_visibility, &truth.right_hand_visibility];
        hands.iter().all(|seen| share(seen, Visibility::BehindObject) > 0.4)
    });
    assert!(hidden, "no clip has both hands under the desk");
}

#[test]
fn the_error_of_an_unknown_condition_lists_the_conditions() {
    let project = Project::with_clips("people", 0, 1.0);
    let rejected = project.answer_of(
        env!("CARGO_BIN_EXE_orator-lab"),
        &["demo", "draw", "people", "--people", "3", "--conditions", "front,rear"],
    );
    assert_ne!(rejected.code, 0);
    assert!(rejected.errors.contains("`rear`") && rejected.errors.contains("hands-folded"), "{}", rejected.errors);
    assert!(!project.dir().join("people").exists());
}

#[test]
fn the_page_of_errors_is_written_where_it_is_asked_for() {
    let Some(models) = fetched_models() else { return };
    let project = Project::with_clips("people-page", 0, 1.0);
    let page = tempfile::tempdir().unwrap();
    folder::draw(&project.dir().join("people"), &plan(&[Condition::Front]), &Silent).unwrap();
    let models = format!("models.dir={}", models.display());
    let ran = project.run(&["-c", "people/pipeline.toml", "--to", "lift", "--set", &models]);
    assert_eq!(ran.code, 0, "{}", ran.errors);
    let (file, text) = (page.path().join("people.html"), page.path().join("people.html").display().to_string());
    let report =
        project.answer_of(env!("CARGO_BIN_EXE_orator-lab"), &["evaluate", "people", "people", "--report", &text]);
    assert_eq!(report.code, 0, "{}", report.errors);
    let html = std::fs::read_to_string(&file).unwrap();
    assert!(html.contains("Errors on rendered persons") && !html.contains("Keypoints without ground truth"), "{html}");
    let both = ["evaluate", "people", "people", "--real", "people/pipeline.toml", "--report", &text];
    let report = project.answer_of(env!("CARGO_BIN_EXE_orator-lab"), &both);
    assert_eq!(report.code, 0, "{}", report.errors);
    assert!(std::fs::read_to_string(&file).unwrap().contains("Keypoints without ground truth"));
}

#[test]
fn truth_only_equals_the_truth_except_for_occlusion() {
    let dir = tempfile::tempdir().unwrap();
    let [rendered, truth_only] = ["rendered", "truth-only"].map(|name| dir.path().join(name));
    let conditions = [Condition::Front];
    folder::draw(&rendered, &plan(&conditions), &Silent).unwrap();
    folder::draw(&truth_only, &RenderPlan { truth_only: true, ..plan(&conditions) }, &Silent).unwrap();
    let truth = |folder: &Path| RenderedTruth::read(&folder.join("truth/front/front-1.npz")).unwrap();
    let (full, truth) = (truth(&rendered), truth(&truth_only));
    assert!(!truth_only.join("videos").exists());
    assert_eq!((&truth.joints, &truth.body, &truth.right_hand), (&full.joints, &full.body, &full.right_hand));
    let takes = orator_lab::mocap::upper_body::read_all(&[truth_only.join("truth")]).unwrap();
    assert_eq!(takes.len(), 3);
}
