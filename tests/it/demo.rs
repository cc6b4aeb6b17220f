//! The synthetic speaker as a video file: what was drawn is what is read back, and what is found in it.

use super::support::speaker_clip;
use orator::demo::measure::measure_keypoints;
use orator::demo::truth::Truth;
use orator::extract::Extract;
use orator::media::{audio, frames::FrameReader};
use orator::onnx;
use orator::pose2d::Pose2dStage;
use orator::stage::Stage;
use orator::stage::fingerprint::HashCache;
use orator::stage::progress::Silent;
use orator::stage::runner::{self, Ended};
use orator::types::time::FrameRate;

#[test]
fn the_clip_has_its_pictures_its_sound_and_its_truth() {
    let dir = tempfile::tempdir().unwrap();
    let video = speaker_clip(dir.path(), 3.0, 5);
    let truth = Truth::read(&dir.path().join("truth/clip-1.npz")).unwrap();
    let n_frames = FrameReader::open(&video, FrameRate::new(15, 1)).unwrap().map(Result::unwrap).count();
    assert_eq!((n_frames, truth.motion.n_frames()), (45, 45));
    let sound = audio::read_mono(&video, 16_000).unwrap().expect("a sound track");
    assert!((sound.secs() - 3.0).abs() < 0.1);
    let loud = sound.samples.iter().filter(|s| s.abs() > 0.05).count();
    assert!(loud > 2_000, "{loud}");
    for name in ["models/marker_person.onnx", "models/marker_hand.onnx", "pipeline.toml", "speech.wav"] {
        assert!(dir.path().join(name).is_file(), "{name}");
    }
    orator::config::load(&dir.path().join("pipeline.toml"), &[]).unwrap();
}

#[test]
fn the_marker_models_find_every_joint_through_the_chain_of_real_models() {
    let dir = tempfile::tempdir().unwrap();
    speaker_clip(dir.path(), 6.0, 5);
    let config = orator::config::load(&dir.path().join("pipeline.toml"), &[]).unwrap();
    let (settings, work) = (&config.settings, &config.settings.work.dir);
    let units = orator::config::videos::of(&config).remove(0).units;
    let hashes = HashCache::open(&work.join("hashes.json"));
    let pose2d = match Pose2dStage::new(settings) {
        Ok(stage) if onnx::find_library(&settings.models.onnxruntime, &settings.models.dir).is_ok() => stage,
        Ok(_) => return eprintln!("SKIPPED: no ONNX Runtime library; `make runtime` gets it"),
        Err(error) => panic!("{error:#}"),
    };
    for stage in [&Extract::new(&settings.extract) as &dyn Stage, &pose2d] {
        let ended = runner::run(stage, &units, work, &hashes, (1, false), &Silent);
        assert!(ended.iter().all(|ended| matches!(ended, Ended::Done(_))), "{ended:?}");
    }
    let measured = measure_keypoints(dir.path()).unwrap();
    let (body, hands) = (measured.body, measured.hands);
    eprintln!("body {body:?}\nhands {hands:?}");
    assert!(body.median < 1.0 && body.p90 < 2.0 && body.found > 0.95, "{body:?}");
    assert!(hands.median < 1.0 && hands.p90 < 12.0 && hands.found > 0.95, "{hands:?}");
}
