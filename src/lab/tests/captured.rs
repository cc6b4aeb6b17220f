//! Captured motion of rendered persons: all four sources are opened, their parts are disjoint, and the rendered body
//! has the bone directions of the capture.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, dot, sub, unit};
use orator_base::stage::progress::Silent;
use orator_base::types::skeleton::{ARM_BONES, L_SHOULDER, R_SHOULDER};
use orator_base::types::time::FrameRate;
use orator_lab::demo::captured_body;
use orator_lab::demo::people::condition::Condition;
use orator_lab::demo::people::folder::{self, ClipSeeds, RenderPlan, SetPart};
use orator_lab::demo::people::scene::PersonScene;
use orator_lab::mocap::captured::source::MotionSource;
use orator_lab::mocap::captured::take::CapturedTake;
use orator_test_support::skip::real_data;
use std::collections::BTreeSet;

/// Angle in degrees between two vectors.
fn degrees(a: Vec3, b: Vec3) -> f64 {
    let [a, b] = [a, b].map(|v| unit(v, 1e-9).unwrap());
    dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Largest angle between the arm bones and the shoulder line of a rendered body and those of the capture, degrees.
fn direction_error(take: &CapturedTake, body: u64) -> f64 {
    let seeds = ClipSeeds { body, clothes: 1, camera: 1, motion: 1, voice: None };
    let secs = take.fps.secs(take.frames.len());
    let scene =
        PersonScene::new(Condition::Front, seeds, secs, FrameRate::new(15, 1), Some(&captured_body::clip(take)));
    let actor = &scene.actors[0];
    let facing = Rotation::about([0.0, 1.0, 0.0], -actor.role.turn);
    let step = take.fps.per_sec() / 15.0;
    let mut largest: f64 = 0.0;
    for (t, pose) in actor.poses.iter().enumerate() {
        let Some(captured) = take.frames.get((t as f64 * step).round() as usize) else { break };
        let positions = actor.rig.skeleton.positions(pose.root, &pose.local);
        for (a, b) in ARM_BONES.into_iter().chain([(R_SHOULDER, L_SHOULDER)]) {
            let [from, to] = [a, b].map(|joint| positions[actor.rig.positions[joint]]);
            largest = largest.max(degrees(facing.turn(sub(to, from)), sub(captured.joints[b], captured.joints[a])));
        }
    }
    largest
}

#[test]
fn all_sources_are_opened_and_their_directions_are_those_of_the_rendered_body() {
    let Some(data) = real_data("data") else { return };
    for source in MotionSource::CAPTURED {
        let mut names = BTreeSet::new();
        for part in SetPart::ALL {
            let takes = source.takes(&data, part).unwrap();
            assert_eq!(takes.is_empty(), part == SetPart::First && source != MotionSource::Cmu, "{source:?} {part:?}");
            assert!(takes.iter().all(|take| names.insert(take.name.clone())), "{source:?}: a take is in two parts");
            let excerpts: Vec<CapturedTake> = takes.iter().flat_map(|take| take.excerpts(8.0)).collect();
            assert_eq!(excerpts.is_empty(), takes.is_empty(), "{source:?} {part:?}");
            let secs: f64 = excerpts.iter().map(|take| take.fps.secs(take.frames.len())).sum();
            eprintln!("{} {part:?}: {} takes, {} excerpts, {secs:.0} s", source.name(), takes.len(), excerpts.len());
            for take in excerpts.iter().step_by(excerpts.len().div_ceil(3).max(1)) {
                let n_missing = take.missing_joints().len();
                let expected = [("cmu", 40), ("bandai", 40), ("beat2", 0), ("ted", 10)];
                assert!(expected.contains(&(source.name(), n_missing)), "{}: {n_missing}", take.name);
                let error = direction_error(take, 7);
                assert!(error < 1.0, "{}: {error} degrees", take.name);
            }
        }
    }
}

#[test]
fn a_set_has_a_clip_of_every_source_for_each_of_its_parts() {
    if real_data("data").is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let motions = vec![MotionSource::Generated, MotionSource::Cmu, MotionSource::Beat];
    let plan = RenderPlan {
        conditions: vec![Condition::Front],
        n_clips: 3,
        secs: 5.0,
        fps: FrameRate::new(15, 1),
        seed: 3,
        motions,
        truth_only: true,
    };
    let clips = folder::draw(dir.path(), &plan, &Silent).unwrap();
    let sources: Vec<&str> = clips.iter().map(|clip| clip.source.as_deref().unwrap_or("generated")).collect();
    assert_eq!(sources, ["generated", "generated", "generated", "cmu", "cmu", "cmu", "beat2", "beat2"]);
    // Only the motion differs between clips of different sources.
    assert!(clips[1].seeds == clips[4].seeds && clips[4].seeds == clips[6].seeds);
    assert_eq!((clips[4].generated_joints.len(), clips[6].generated_joints.len()), (40, 0));
    assert!(clips.iter().all(|clip| dir.path().join(&clip.truth).is_file()));
}
