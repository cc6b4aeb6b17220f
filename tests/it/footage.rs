//! Footage made up for tests of segment and shard: keypoint tracks of a speaker who sits well visible in the picture,
//! to be spoiled as a test likes, and the files that the stages before would have written of them.

use ndarray::{Array1, Array2, Array3, s};
use ndarray_npy::NpzWriter;
use orator::motion::keypoints_npz::{self, Extras};
use orator::stage::Unit;
use orator::stage::runner::place;
use orator::types::pose2d::{Keypoints, coco};
use orator::types::time::FrameRate;
use std::fs::{self, File};
use std::path::Path;

pub const FPS: FrameRate = FrameRate::new(15, 1);

/// A video as far as segment sees it.
#[derive(Clone)]
pub struct Footage {
    pub duration_secs: f64,
    pub keypoints: Keypoints,
    pub shot: Vec<i64>,
    /// 16-bit samples at 16 kHz; `None`: no audio track.
    pub sound: Option<Vec<i16>>,
}

/// A good video of `n_frames`: everything is visible, the speaker sways, the sound hums to the end.
pub fn good(n_frames: usize) -> Footage {
    let mut body = Array3::zeros((n_frames, 17, 3));
    let places = [
        (coco::NOSE, 320.0, 100.0),
        (coco::L_EYE, 335.0, 90.0),
        (coco::R_EYE, 305.0, 90.0),
        (coco::L_EAR, 350.0, 95.0),
        (coco::R_EAR, 290.0, 95.0),
        (coco::L_SHOULDER, 380.0, 200.0),
        (coco::R_SHOULDER, 260.0, 200.0),
        (coco::L_ELBOW, 400.0, 300.0),
        (coco::R_ELBOW, 240.0, 300.0),
        (coco::L_WRIST, 360.0, 340.0),
        (coco::R_WRIST, 280.0, 340.0),
    ];
    let sway = |frame: usize| 4.0 * (frame as f32 / 9.0).sin();
    for frame in 0..n_frames {
        for (joint, x, y) in places {
            body.slice_mut(s![frame, joint, ..]).assign(&ndarray::arr1(&[x + sway(frame), y, 0.9]));
        }
    }
    let hand = |x: f32| {
        Array3::from_shape_fn((n_frames, 21, 3), |(frame, point, k)| match k {
            0 => x + sway(frame) + point as f32,
            1 => 340.0 + point as f32,
            _ => 0.95,
        })
    };
    let keypoints =
        Keypoints { fps: FPS, image_size: [640, 480], body, left_hand: hand(360.0), right_hand: hand(280.0) };
    let duration_secs = FPS.secs(n_frames);
    let n_samples = (duration_secs * 16_000.0) as usize;
    let sound = (0..n_samples).map(|n| ((n as f64 * 0.07).sin() * 8_000.0) as i16).collect();
    Footage { duration_secs, keypoints, shot: vec![0; n_frames], sound: Some(sound) }
}

/// Writes what extract and pose2d would have written of `unit`, and a source file of `content`.
pub fn write(work: &Path, unit: &Unit, footage: &Footage, content: &str) {
    let extract = place(work, "extract", unit);
    let pose2d = place(work, "pose2d", unit);
    fs::create_dir_all(&extract).unwrap();
    fs::create_dir_all(&pose2d).unwrap();
    fs::create_dir_all(unit.source.parent().unwrap()).unwrap();
    fs::write(&unit.source, content).unwrap();
    let n_frames = footage.shot.len();
    let media = serde_json::json!({
        "duration_secs": footage.duration_secs, "n_frames": n_frames, "fps": footage.keypoints.fps,
        "image_size": footage.keypoints.image_size, "has_audio": footage.sound.is_some(),
    });
    fs::write(extract.join("media.json"), media.to_string()).unwrap();
    let mut timeline = NpzWriter::new(File::create(extract.join("timeline.npz")).unwrap());
    let begins = |t: usize| f64::from(u8::from(t > 0 && footage.shot[t] != footage.shot[t - 1]));
    timeline.add_array("shot_score", &Array1::from_shape_fn(n_frames, begins)).unwrap();
    timeline.add_array("repeated", &Array1::from_elem(n_frames, false)).unwrap();
    timeline.add_array("restart", &Array1::from_shape_fn(n_frames, |t| begins(t) > 0.0)).unwrap();
    timeline.add_array("still", &Array1::<f32>::from_elem(n_frames, 2.0)).unwrap();
    timeline.finish().unwrap();
    let _ = fs::remove_file(extract.join("audio.wav"));
    if let Some(sound) = &footage.sound {
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: 16_000,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let mut wav = hound::WavWriter::create(extract.join("audio.wav"), spec).unwrap();
        sound.iter().for_each(|&sample| wav.write_sample(sample).unwrap());
        wav.finalize().unwrap();
    }
    let extras = Extras {
        time_secs: Array1::zeros(n_frames),
        person: Array2::zeros((n_frames, 5)),
        n_people: Array1::from_elem(n_frames, 1),
        identity: Array1::zeros(n_frames),
    };
    keypoints_npz::write(&pose2d.join("keypoints.npz"), &footage.keypoints, &extras).unwrap();
}
