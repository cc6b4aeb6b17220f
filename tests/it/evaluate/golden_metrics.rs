//! The metrics on the authors' released clips have the values computed with numpy, to every printed digit.

use ndarray::{Array2, Array3, Axis, concatenate, s};
use orator_base::types::skeleton::{L_SHOULDER, N_JOINTS, R_SHOULDER};
use orator_base::types::time::FrameRate;
use orator_formats::authors_txt;
use orator_gesture::metrics::catalogue::{Catalogue, MotionPair};
use orator_gesture::metrics::position::pck::{CorrectKeypoints, PckAxes};
use orator_gesture::metrics::settings::MetricSettings;
use orator_test_support::skip::real_data;
use std::path::{Path, PathBuf};

const CLIPS: [&str; 4] = ["1845", "3821", "3838", "102571"];
const FPS: FrameRate = FrameRate::new(15, 1);

#[track_caller]
fn folder() -> Option<PathBuf> {
    real_data("data/released_clips")
}

fn read(folder: &Path, kind: &str, clip: &str) -> Array3<f32> {
    authors_txt::read(&folder.join(format!("{kind}_interval_{clip}.txt")), FPS).unwrap().joints
}

/// All metrics of pairs (predicted, ground truth) cut to equal length, by `name part` or `name@alpha part`.
struct Metrics {
    catalogue: Catalogue,
    values: Vec<Vec<f64>>,
}

impl Metrics {
    fn new(pairs: &[(Array3<f32>, Array3<f32>)]) -> Self {
        let catalogue = Catalogue::new(&MetricSettings { with_neck: true, ..MetricSettings::default() }).unwrap();
        let values = |(predicted, real): &(Array3<f32>, Array3<f32>)| {
            let n = predicted.len_of(Axis(0)).min(real.len_of(Axis(0)));
            let (predicted, real) = (predicted.slice(s![..n, .., ..]), real.slice(s![..n, .., ..]));
            let mask = Array2::from_elem((n, N_JOINTS), true);
            catalogue.values(&catalogue.measure(&MotionPair {
                predicted,
                ground_truth: real,
                mask: mask.view(),
                fps: FPS,
                onsets: None,
            }))
        };
        let values = pairs.iter().map(values).collect();
        Self { catalogue, values }
    }

    /// Value of a metric for each pair.
    fn of(&self, label: &str) -> Vec<f64> {
        let i = self.catalogue.definitions().iter().position(|d| d.label() == label).expect(label);
        self.values.iter().map(|values| values[i]).collect()
    }

    /// Asserts that `scale` times the values of a metric are those printed, one word per pair.
    fn assert_values(&self, label: &str, scale: f64, printed: &str) {
        compare(label, &self.of(label).iter().map(|v| scale * v).collect::<Vec<_>>(), printed);
    }
}

/// Asserts that every value rounds to the printed one.
fn compare(label: &str, values: &[f64], printed: &str) {
    let words: Vec<&str> = printed.split_whitespace().collect();
    assert_eq!(values.len(), words.len(), "{label}");
    for (value, word) in values.iter().zip(words) {
        let n_digits = word.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
        let expected: f64 = word.parse().unwrap();
        assert!((value - expected).abs() <= 0.5001 * 10f64.powi(-n_digits), "{label}: {value}, printed {word}");
    }
}

#[test]
fn released_predictions_have_the_reference_metrics() {
    let Some(folder) = folder() else { return };
    let metrics = Metrics::new(&CLIPS.map(|clip| (read(&folder, "prediction", clip), read(&folder, "gt", clip))));
    // Measured with numpy on the published clips.
    metrics.assert_values("pck_2d@0.2 all", 1.0, ".3690 .2553 .1136 .7294");
    metrics.assert_values("pck_2d@0.1 all", 1.0, ".1792 .1002 .0527 .4310");
    metrics.assert_values("l1 all_and_neck", 1.0, ".1074 .1265 .1516 .0435");
    metrics.assert_values("mpjpe all_and_neck", 0.001, ".2282 .2575 .3172 .0920");
    metrics.assert_values("jerk_of_real all_and_neck", 1.0, "260.6 175.9 182.9 50.9");
    metrics.assert_values("jerk all_and_neck", 1.0, "176.5 156.2 118.7 57.1");
    metrics.assert_values("acceleration_of_real all_and_neck", 1.0, "11.09 7.36 7.37 2.24");
    metrics.assert_values("acceleration all_and_neck", 1.0, "7.48 6.64 5.09 2.60");
    metrics.assert_values("speed_of_real all_and_neck", 1.0, ".622 .481 .422 .157");
    metrics.assert_values("speed all_and_neck", 1.0, ".437 .435 .318 .185");
    metrics.assert_values("hellinger_speed all", 1.0, ".1774 .1683 .1178 .0809");
    metrics.assert_values("l1div_of_real all", 1.0, "19.88 13.99 13.54 7.10");
    metrics.assert_values("l1div all", 1.0, "16.36 11.98 11.71 5.84");
    metrics.assert_values("bone_change_of_real body", 1.0, "5.51 1.68 1.54 1.45");
    metrics.assert_values("bone_change body", 1.0, "3.64 2.89 2.23 1.99");
    metrics.assert_values("bone_change_of_real hands", 1.0, "2.99 2.61 2.15 .56");
    metrics.assert_values("bone_change hands", 1.0, "5.18 4.51 3.70 1.67");
    // Accuracy.
    metrics.assert_values("pck_3d@0.2 all", 100.0, "29.6 19.0 6.7 71.5");
    metrics.assert_values("pck_2d@0.2 all", 100.0, "36.9 25.5 11.4 72.9");
    metrics.assert_values("pck_3d@0.1 all", 100.0, "10.1 6.5 3.2 37.7");
    metrics.assert_values("pck_2d@0.1 all", 100.0, "17.9 10.0 5.3 43.1");
    metrics.assert_values("pck_3d@0.2 body", 100.0, "53.9 65.1 39.8 88.2");
    metrics.assert_values("pck_3d@0.2 hands", 100.0, "25.8 12.0 1.8 68.8");
    metrics.assert_values("pck_3d_neck_in_box@0.2 all", 100.0, "29.8 19.1 6.7 71.5");
    metrics.assert_values("l1 all", 1.0, "0.110 0.129 0.155 0.044");
    metrics.assert_values("mpjpe all", 1.0, "233.0 262.9 323.8 93.9");
    metrics.assert_values("mpjpe body", 1.0, "147.3 128.3 175.9 50.2");
    metrics.assert_values("mpjpe wrists", 1.0, "222.1 232.8 286.7 83.8");
    metrics.assert_values("mpjpe fingers_from_wrist", 1.0, "92.7 102.6 112.5 47.9");
    // Bone lengths.
    metrics.assert_values("bone_deviation_of_real body", 1.0, "13.4 5.4 4.7 5.2");
    metrics.assert_values("bone_deviation body", 1.0, "8.9 6.1 5.2 4.6");
    metrics.assert_values("bone_deviation_of_real hands", 1.0, "15.7 17.1 15.9 6.3");
    metrics.assert_values("bone_deviation hands", 1.0, "26.2 23.1 26.2 14.4");
    metrics.assert_values("bone_change_share_of_real body", 1.0, "2.00 0.74 0.68 0.57");
    metrics.assert_values("bone_change_share body", 1.0, "1.48 1.27 0.95 0.78");
    metrics.assert_values("bone_change_share_of_real hands", 1.0, "7.7 6.2 5.9 1.7");
    metrics.assert_values("bone_change_share hands", 1.0, "14.3 12.7 10.9 5.3");
    // Motion.
    metrics.assert_values("speed_of_real all", 1.0, "0.64 0.49 0.43 0.16");
    metrics.assert_values("speed all", 1.0, "0.45 0.44 0.32 0.19");
    metrics.assert_values("acceleration_of_real all", 1.0, "11.3 7.5 7.5 2.3");
    metrics.assert_values("acceleration all", 1.0, "7.6 6.8 5.2 2.7");
    metrics.assert_values("jerk_of_real all", 1.0, "266 180 187 52");
    metrics.assert_values("jerk all", 1.0, "180 159 121 58");
    metrics.assert_values("speed_of_real wrists", 1.0, "0.43 0.32 0.22 0.12");
    metrics.assert_values("speed wrists", 1.0, "0.28 0.29 0.19 0.15");
    metrics.assert_values("acceleration_of_real wrists", 1.0, "6.2 2.6 2.1 1.4");
    metrics.assert_values("acceleration wrists", 1.0, "3.6 3.0 2.1 1.9");
    metrics.assert_values("jerk_of_real wrists", 1.0, "128 47 42 30");
    metrics.assert_values("jerk wrists", 1.0, "78 61 45 38");
    metrics.assert_values("speed_of_real fingers_from_wrist", 1.0, "0.44 0.39 0.39 0.10");
    metrics.assert_values("speed fingers_from_wrist", 1.0, "0.39 0.36 0.28 0.12");
    metrics.assert_values("jerk_of_real fingers_from_wrist", 1.0, "251 200 210 46");
    metrics.assert_values("jerk fingers_from_wrist", 1.0, "192 172 132 55");
}

/// PCK at 0.2 of each pair, percent, as computed during training.
fn pck(axes: PckAxes, pairs: &[(Array3<f32>, Array3<f32>)]) -> Vec<f64> {
    let share = |(predicted, real): &(Array3<f32>, Array3<f32>)| {
        let mask = Array2::from_elem((real.len_of(Axis(0)), N_JOINTS), true);
        let mut correct = CorrectKeypoints::default();
        correct.count(axes, predicted.view(), real.view(), mask.view());
        100.0 * correct.share()
    };
    pairs.iter().map(share).collect()
}

/// Joints turned about the vertical so that the shoulder line of each frame is in the image plane.
fn without_yaw(mut joints: Array3<f32>) -> Array3<f32> {
    for mut pose in joints.outer_iter_mut() {
        let line = |k: usize| pose[[L_SHOULDER, k]] - pose[[R_SHOULDER, k]];
        let (sin, cos) = line(2).atan2(line(0)).sin_cos();
        for mut joint in pose.outer_iter_mut() {
            let (x, z) = (joint[0], joint[2]);
            joint[0] = cos * x + sin * z;
            joint[2] = -sin * x + cos * z;
        }
    }
    joints
}

/// The pose in every one of `n` frames.
fn repeated(pose: Array2<f32>, n: usize) -> Array3<f32> {
    Array3::from_shape_fn((n, N_JOINTS, 3), |(_, joint, k)| pose[[joint, k]])
}

fn mean(joints: &Array3<f32>) -> Array2<f32> {
    joints.mapv(f64::from).mean_axis(Axis(0)).unwrap().mapv(|v| v as f32)
}

fn median(joints: &Array3<f32>) -> Array2<f32> {
    Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| {
        let mut values = joints.slice(s![.., joint, k]).to_vec();
        values.sort_by(f32::total_cmp);
        let n = values.len();
        (values[(n - 1) / 2] + values[n / 2]) / 2.0
    })
}

#[test]
fn baselines_on_released_clips_have_the_reference_metrics() {
    let Some(folder) = folder() else { return };
    let real = CLIPS.map(|clip| read(&folder, "gt", clip));
    let predicted = CLIPS.map(|clip| read(&folder, "prediction", clip));
    let n = |i: usize| real[i].len_of(Axis(0));
    let paired =
        |predicted: &dyn Fn(usize) -> Array3<f32>| (0..4).map(|i| (predicted(i), real[i].clone())).collect::<Vec<_>>();
    let yaw: Vec<_> = (0..4).map(|i| (without_yaw(predicted[i].clone()), without_yaw(real[i].clone()))).collect();
    compare("without yaw", &pck(PckAxes::Xyz, &yaw), "30.5 21.6 9.3 72.5");
    let own_mean = paired(&|i| repeated(mean(&real[i]), n(i)));
    compare("own mean", &pck(PckAxes::Xyz, &own_mean), "6.8 44.3 29.8 59.8");
    let own_median = paired(&|i| repeated(median(&real[i]), n(i)));
    compare("own median", &pck(PckAxes::Xyz, &own_median), "8.7 47.5 36.5 60.7");
    compare("own median xy", &pck(PckAxes::Xy, &own_median), "15.43 52.01 49.98 62.49");
    // The prediction rolled by every full second from 3 s to 3 s before the end.
    let late: [Vec<f64>; 4] = std::array::from_fn(|i| {
        let rolled = |by: usize| {
            let (end, start) =
                (predicted[i].slice(s![n(i) - by.., .., ..]), predicted[i].slice(s![..n(i) - by, .., ..]));
            (concatenate(Axis(0), &[end, start]).unwrap(), real[i].clone())
        };
        pck(PckAxes::Xyz, &(45..n(i) - 44).step_by(15).map(rolled).collect::<Vec<_>>())
    });
    let of_late = |statistic: &dyn Fn(&Vec<f64>) -> f64| late.iter().map(statistic).collect::<Vec<f64>>();
    compare("late, mean", &of_late(&|v| v.iter().sum::<f64>() / v.len() as f64), "7.3 12.7 6.4 43.1");
    compare("late, minimum", &of_late(&|v| v.iter().copied().fold(100.0, f64::min)), "4.3 9.4 3.7 33.0");
    compare("late, maximum", &of_late(&|v| v.iter().copied().fold(0.0, f64::max)), "13.1 15.7 10.2 52.0");
}

#[test]
fn mismatched_released_clips_have_the_reference_metrics() {
    let Some(folder) = folder() else { return };
    let [real, predicted] = ["gt", "prediction"].map(|kind| [0, 1, 2].map(|i| read(&folder, kind, CLIPS[i])));
    let others = |i: usize| [0, 1, 2].into_iter().filter(move |other| *other != i).collect::<Vec<_>>();
    let mean_of_others: Vec<_> = (0..3)
        .map(|i| {
            let both: Vec<_> = others(i).into_iter().map(|other| real[other].view()).collect();
            (repeated(mean(&concatenate(Axis(0), &both).unwrap()), real[i].len_of(Axis(0))), real[i].clone())
        })
        .collect();
    let metrics = Metrics::new(&mean_of_others);
    metrics.assert_values("pck_3d@0.2 all", 100.0, "8.1 9.4 24.0");
    metrics.assert_values("pck_2d@0.2 all", 100.0, "17.2 14.6 34.0");
    metrics.assert_values("mpjpe all", 1.0, "323.7 303.5 211.2");
    metrics.assert_values("l1 all", 1.0, ".146 .151 .105");
    let mismatched = |from: &[Array3<f32>; 3], expected: &[(&str, f64, &str)]| {
        let each = [0, 1].map(|index| {
            let pairs: Vec<_> = (0..3).map(|i| (from[others(i)[index]].clone(), real[i].clone())).collect();
            Metrics::new(&pairs)
        });
        for (label, scale, printed) in expected {
            let [a, b] = [0, 1].map(|index: usize| each[index].of(label));
            let means: Vec<f64> = a.iter().zip(&b).map(|(a, b)| scale * (a + b) / 2.0).collect();
            compare(label, &means, printed);
        }
    };
    mismatched(&real, &[("pck_3d@0.2 all", 100.0, "4.2 7.2 4.7"), ("mpjpe all", 1.0, "426.7 379.3 394.9")]);
    mismatched(
        &predicted,
        &[
            ("pck_3d@0.2 all", 100.0, "8.3 18.1 10.2"),
            ("pck_2d@0.2 all", 100.0, "14.7 26.1 19.9"),
            ("mpjpe all", 1.0, "406.0 284.1 318.0"),
        ],
    );
}

#[test]
fn released_audio_has_the_reference_onsets() {
    let Some(folder) = folder() else { return };
    for (clip, n) in [("1845", 92), ("3821", 98), ("3838", 120)] {
        let sound =
            orator_media::ffmpeg::audio::read_mono(&folder.join(format!("{clip}.wav")), 44_100).unwrap().unwrap();
        let mut at_16_khz = Vec::new();
        let mut resampler = crate::fixtures::media::librosa_resampler::Resampler::new(44_100, 16_000);
        resampler.push(&sound.samples, &mut at_16_khz);
        resampler.finish(&mut at_16_khz);
        let onsets = orator_base::audio::onset::onsets(&at_16_khz);
        assert_eq!(onsets.len(), n, "{clip}");
    }
}
