//! The synthetic speaker as a video file: what was drawn is what is read back.

use super::support::speaker_clip;
use orator::demo::truth::Truth;
use orator::media::{audio, frames::FrameReader};
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
