//! Rendered persons with exactly synchronised lips and voices, processed with the models for real people: the speaking
//! one of two is tracked, own voices are distinguished from others, audio shifts are estimated. `ORATOR_PEOPLE` (`make
//! prove-people`) names the work folder of a run with the face model on rendered persons; all its clips are measured.

use crate::fixtures::clips::ffmpeg;
use crate::fixtures::media::voices::{TalkingClip, WINDOW_SECS, area, rejected};
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz;
use orator_lab::demo::people::condition::Condition;
use orator_lab::demo::people::scene::{ClipSeeds, PersonScene};
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::{fetched_model, fetched_models};
use std::path::Path;

const FPS: FrameRate = FrameRate::new(15, 1);
const SECS: f64 = 7.0;

/// Prints and returns the area under the ROC curve of own voices against other voices and the share of shifts that are
/// estimated within one frame, then the shares of own and of other voices that the default of `min_own_voice` rejects.
fn measure(clips: &[TalkingClip]) -> ([f64; 2], [f64; 2]) {
    let (mut own, mut other, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let mut of_frames = [Vec::new(), Vec::new()];
    for (index, clip) in clips.iter().enumerate() {
        own.extend(clip.windows(&clip.voice, 0.0));
        of_frames[0].extend(clip.own_voice(&clip.voice, 0.0));
        let others = (1..clips.len().min(5)).map(|step| &clips[(index + step * 7) % clips.len()]);
        let other_clips = others.filter(|other_clip| other_clip.name != clip.name);
        other_clips.for_each(|other_clip| {
            other.extend(clip.windows(&other_clip.voice, 0.0));
            of_frames[1].extend(clip.own_voice(&other_clip.voice, 0.0));
        });
        errors.extend(clip.shift_errors(8.0, 6.0).into_iter().map(|error| error * clip.source_fps));
    }
    let n_within = errors.iter().filter(|frames| **frames <= 1.0 + 1e-9).count();
    let share = n_within as f64 / errors.len().max(1) as f64;
    let area = area(&own, &other);
    eprintln!(
        "{} clips: area under the curve at {WINDOW_SECS} s {area:.3} ({} own, {} other windows); {n_within} of {} \
         shifts of -400 to 400 ms within a frame",
        clips.len(),
        own.len(),
        other.len(),
        errors.len()
    );
    ([area, share], rejected("rendered persons", &of_frames[0], &of_frames[1]))
}

#[test]
fn the_speaking_person_is_tracked_and_voices_are_distinguished() {
    let (Some(models), Some(_)) = (fetched_models(), fetched_model("face_landmark_192.onnx")) else { return };
    let project = Project::with_clips("two", 0, 0.0);
    for seed in [3, 8] {
        let seeds = ClipSeeds { body: seed, clothes: seed, camera: seed, motion: seed, voice: None };
        let scene = PersonScene::new(Condition::Front, seeds, SECS, FPS, None);
        scene.film(&project.dir().join(format!("{seed}.mp4")), &Silent).unwrap();
    }
    // Side by side, one at two thirds of the size of the other; the audio is that of one of them.
    let sizes = "[0:v]scale=-2:480[a];[1:v]scale=-2:320,pad=iw:480:0:160[b];[a][b]hstack[v]";
    for (voice, name) in [(0, "large"), (1, "small")] {
        let args = format!("-i 3.mp4 -i 8.mp4 -filter_complex {sizes} -map [v] -map {voice}:a videos/host/{name}.mp4");
        if !ffmpeg(project.dir(), &args) {
            return;
        }
    }
    let text = format!(
        "[models]\ndir = {models:?}\n[pose2d]\nfollow = \"speaking\"\n[[speaker]]\nname = \"host\"\nvideos = \
         [\"videos/host/*.mp4\"]\n"
    );
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    let answer = project.run(&["--to", "pose2d"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let clips = ["large", "small"].map(|name| {
        let file = project.written("pose2d", name, "keypoints.npz");
        let extras = keypoints_npz::read_extras(&file).unwrap();
        assert!(extras.n_persons.iter().filter(|n| **n == 2).count() > 60, "{name}: {:?}", extras.n_persons);
        assert!(extras.identity.iter().all(|identity| *identity == 0), "{name}: {:?}", extras.identity);
        let middle = extras.person.column(0).mean().unwrap() + extras.person.column(2).mean().unwrap() / 2.0;
        let clip = TalkingClip::read(&file, &project.written("extract", name, "audio.wav"), FPS.per_sec()).unwrap();
        (middle, clip)
    });
    assert!(clips[0].0 + 150.0 < clips[1].0, "tracked at {} and {} px", clips[0].0, clips[1].0);
    let ([area, found], _) = measure(&clips.map(|(_, clip)| clip));
    assert!(area > 0.9 && found == 1.0, "{area} {found}");
}

#[test]
fn voices_of_a_rendered_set_are_distinguished() {
    let Some(work) = std::env::var_os("ORATOR_PEOPLE") else { return };
    let is_keypoints = |(name, _): &(String, _)| name.starts_with("pose2d/") && name.ends_with("keypoints.npz");
    let files = files_under(Path::new(&work)).into_iter().filter(is_keypoints);
    let clips: Vec<TalkingClip> = files
        .filter_map(|(name, path)| {
            let clip = Path::new(&name).parent()?.strip_prefix("pose2d").ok()?;
            let audio = Path::new(&work).join("extract").join(clip).join("audio.wav");
            TalkingClip::read(&path, &audio, FPS.per_sec())
        })
        .collect();
    let (_, [own, others]) = measure(&clips);
    assert!(own <= 0.1 && others >= 0.5, "{own} {others}");
}
