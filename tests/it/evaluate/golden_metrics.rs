//! The metrics on the authors' released clips give the numbers measured there with numpy, to every
//! digit that is printed.

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

/// All values of `made` beside `real`, cut to the shorter, by `name part` or `name@alpha part`.
struct Figures {
    catalogue: Catalogue,
    values: Vec<Vec<f64>>,
}

impl Figures {
    fn new(pairs: &[(Array3<f32>, Array3<f32>)]) -> Self {
        let catalogue = Catalogue::new(&MetricSettings { with_neck: true, ..MetricSettings::default() }).unwrap();
        let values = |(made, real): &(Array3<f32>, Array3<f32>)| {
            let n = made.len_of(Axis(0)).min(real.len_of(Axis(0)));
            let (made, real) = (made.slice(s![..n, .., ..]), real.slice(s![..n, .., ..]));
            let mask = Array2::from_elem((n, N_JOINTS), true);
            catalogue.values(&catalogue.measure(&MotionPair {
                predicted: made,
                ground_truth: real,
                mask: mask.view(),
                fps: FPS,
                onsets: None,
            }))
        };
        let values = pairs.iter().map(values).collect();
        Self { catalogue, values }
    }

    /// Of each pair.
    fn of(&self, label: &str) -> Vec<f64> {
        let i = self.catalogue.definitions().iter().position(|d| d.label() == label).expect(label);
        self.values.iter().map(|values| values[i]).collect()
    }

    /// Compares `scale` times the values with those printed, a word a pair.
    fn are(&self, label: &str, scale: f64, printed: &str) {
        compare(label, &self.of(label).iter().map(|v| scale * v).collect::<Vec<_>>(), printed);
    }
}

/// Every value rounds to what is printed.
fn compare(label: &str, values: &[f64], printed: &str) {
    let words: Vec<&str> = printed.split_whitespace().collect();
    assert_eq!(values.len(), words.len(), "{label}");
    for (value, word) in values.iter().zip(words) {
        let n_digits = word.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
        let known: f64 = word.parse().unwrap();
        assert!((value - known).abs() <= 0.5001 * 10f64.powi(-n_digits), "{label}: {value}, printed {word}");
    }
}

#[test]
fn released_predictions_have_the_measured_figures() {
    let Some(folder) = folder() else { return };
    let figures = Figures::new(&CLIPS.map(|clip| (read(&folder, "prediction", clip), read(&folder, "gt", clip))));
    // Measured with numpy on the published clips.
    figures.are("pck_2d@0.2 all", 1.0, ".3690 .2553 .1136 .7294");
    figures.are("pck_2d@0.1 all", 1.0, ".1792 .1002 .0527 .4310");
    figures.are("l1 all_and_neck", 1.0, ".1074 .1265 .1516 .0435");
    figures.are("mpjpe all_and_neck", 0.001, ".2282 .2575 .3172 .0920");
    figures.are("jerk_of_real all_and_neck", 1.0, "260.6 175.9 182.9 50.9");
    figures.are("jerk all_and_neck", 1.0, "176.5 156.2 118.7 57.1");
    figures.are("acceleration_of_real all_and_neck", 1.0, "11.09 7.36 7.37 2.24");
    figures.are("acceleration all_and_neck", 1.0, "7.48 6.64 5.09 2.60");
    figures.are("speed_of_real all_and_neck", 1.0, ".622 .481 .422 .157");
    figures.are("speed all_and_neck", 1.0, ".437 .435 .318 .185");
    figures.are("hellinger_speed all", 1.0, ".1774 .1683 .1178 .0809");
    figures.are("l1div_of_real all", 1.0, "19.88 13.99 13.54 7.10");
    figures.are("l1div all", 1.0, "16.36 11.98 11.71 5.84");
    figures.are("bone_change_of_real body", 1.0, "5.51 1.68 1.54 1.45");
    figures.are("bone_change body", 1.0, "3.64 2.89 2.23 1.99");
    figures.are("bone_change_of_real hands", 1.0, "2.99 2.61 2.15 .56");
    figures.are("bone_change hands", 1.0, "5.18 4.51 3.70 1.67");
    // Accuracy
    figures.are("pck_3d@0.2 all", 100.0, "29.6 19.0 6.7 71.5");
    figures.are("pck_2d@0.2 all", 100.0, "36.9 25.5 11.4 72.9");
    figures.are("pck_3d@0.1 all", 100.0, "10.1 6.5 3.2 37.7");
    figures.are("pck_2d@0.1 all", 100.0, "17.9 10.0 5.3 43.1");
    figures.are("pck_3d@0.2 body", 100.0, "53.9 65.1 39.8 88.2");
    figures.are("pck_3d@0.2 hands", 100.0, "25.8 12.0 1.8 68.8");
    figures.are("pck_3d_neck_in_box@0.2 all", 100.0, "29.8 19.1 6.7 71.5");
    figures.are("l1 all", 1.0, "0.110 0.129 0.155 0.044");
    figures.are("mpjpe all", 1.0, "233.0 262.9 323.8 93.9");
    figures.are("mpjpe body", 1.0, "147.3 128.3 175.9 50.2");
    figures.are("mpjpe wrists", 1.0, "222.1 232.8 286.7 83.8");
    figures.are("mpjpe fingers_from_wrist", 1.0, "92.7 102.6 112.5 47.9");
    // Bone lengths
    figures.are("bone_deviation_of_real body", 1.0, "13.4 5.4 4.7 5.2");
    figures.are("bone_deviation body", 1.0, "8.9 6.1 5.2 4.6");
    figures.are("bone_deviation_of_real hands", 1.0, "15.7 17.1 15.9 6.3");
    figures.are("bone_deviation hands", 1.0, "26.2 23.1 26.2 14.4");
    figures.are("bone_change_share_of_real body", 1.0, "2.00 0.74 0.68 0.57");
    figures.are("bone_change_share body", 1.0, "1.48 1.27 0.95 0.78");
    figures.are("bone_change_share_of_real hands", 1.0, "7.7 6.2 5.9 1.7");
    figures.are("bone_change_share hands", 1.0, "14.3 12.7 10.9 5.3");
    // Motion
    figures.are("speed_of_real all", 1.0, "0.64 0.49 0.43 0.16");
    figures.are("speed all", 1.0, "0.45 0.44 0.32 0.19");
    figures.are("acceleration_of_real all", 1.0, "11.3 7.5 7.5 2.3");
    figures.are("acceleration all", 1.0, "7.6 6.8 5.2 2.7");
    figures.are("jerk_of_real all", 1.0, "266 180 187 52");
    figures.are("jerk all", 1.0, "180 159 121 58");
    figures.are("speed_of_real wrists", 1.0, "0.43 0.32 0.22 0.12");
    figures.are("speed wrists", 1.0, "0.28 0.29 0.19 0.15");
    figures.are("acceleration_of_real wrists", 1.0, "6.2 2.6 2.1 1.4");
    figures.are("acceleration wrists", 1.0, "3.6 3.0 2.1 1.9");
    figures.are("jerk_of_real wrists", 1.0, "128 47 42 30");
    figures.are("jerk wrists", 1.0, "78 61 45 38");
    figures.are("speed_of_real fingers_from_wrist", 1.0, "0.44 0.39 0.39 0.10");
    figures.are("speed fingers_from_wrist", 1.0, "0.39 0.36 0.28 0.12");
    figures.are("jerk_of_real fingers_from_wrist", 1.0, "251 200 210 46");
    figures.are("jerk fingers_from_wrist", 1.0, "192 172 132 55");
}

/// PCK at 0.2 of each pair, percent, as training counts it.
fn pck(axes: PckAxes, pairs: &[(Array3<f32>, Array3<f32>)]) -> Vec<f64> {
    let share = |(made, real): &(Array3<f32>, Array3<f32>)| {
        let mask = Array2::from_elem((real.len_of(Axis(0)), N_JOINTS), true);
        let mut correct = CorrectKeypoints::default();
        correct.count(axes, made.view(), real.view(), mask.view());
        100.0 * correct.share()
    };
    pairs.iter().map(share).collect()
}

/// The shoulder line turned into the picture plane, frame by frame, about the vertical.
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
fn still(pose: Array2<f32>, n: usize) -> Array3<f32> {
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
fn baselines_on_the_released_clips_have_the_measured_figures() {
    let Some(folder) = folder() else { return };
    let real = CLIPS.map(|clip| read(&folder, "gt", clip));
    let made = CLIPS.map(|clip| read(&folder, "prediction", clip));
    let n = |i: usize| real[i].len_of(Axis(0));
    let beside = |made: &dyn Fn(usize) -> Array3<f32>| (0..4).map(|i| (made(i), real[i].clone())).collect::<Vec<_>>();
    let yaw: Vec<_> = (0..4).map(|i| (without_yaw(made[i].clone()), without_yaw(real[i].clone()))).collect();
    compare("without yaw", &pck(PckAxes::Xyz, &yaw), "30.5 21.6 9.3 72.5");
    let own_mean = beside(&|i| still(mean(&real[i]), n(i)));
    compare("own mean", &pck(PckAxes::Xyz, &own_mean), "6.8 44.3 29.8 59.8");
    let own_median = beside(&|i| still(median(&real[i]), n(i)));
    compare("own median", &pck(PckAxes::Xyz, &own_median), "8.7 47.5 36.5 60.7");
    compare("own median xy", &pck(PckAxes::Xy, &own_median), "15.43 52.01 49.98 62.49");
    // the prediction some seconds late, what is past the end at the start: every second from 3 s to 3 s before the end
    let late: [Vec<f64>; 4] = std::array::from_fn(|i| {
        let rolled = |by: usize| {
            let (end, start) = (made[i].slice(s![n(i) - by.., .., ..]), made[i].slice(s![..n(i) - by, .., ..]));
            (concatenate(Axis(0), &[end, start]).unwrap(), real[i].clone())
        };
        pck(PckAxes::Xyz, &(45..n(i) - 44).step_by(15).map(rolled).collect::<Vec<_>>())
    });
    let of_late = |figure: &dyn Fn(&Vec<f64>) -> f64| late.iter().map(figure).collect::<Vec<f64>>();
    compare("late, mean", &of_late(&|v| v.iter().sum::<f64>() / v.len() as f64), "7.3 12.7 6.4 43.1");
    compare("late, least", &of_late(&|v| v.iter().copied().fold(100.0, f64::min)), "4.3 9.4 3.7 33.0");
    compare("late, most", &of_late(&|v| v.iter().copied().fold(0.0, f64::max)), "13.1 15.7 10.2 52.0");
}

#[test]
fn what_the_released_clips_say_of_each_other_has_the_measured_figures() {
    let Some(folder) = folder() else { return };
    let [real, made] = ["gt", "prediction"].map(|kind| [0, 1, 2].map(|i| read(&folder, kind, CLIPS[i])));
    let others = |i: usize| [0, 1, 2].into_iter().filter(move |other| *other != i).collect::<Vec<_>>();
    let mean_of_others: Vec<_> = (0..3)
        .map(|i| {
            let both: Vec<_> = others(i).into_iter().map(|other| real[other].view()).collect();
            (still(mean(&concatenate(Axis(0), &both).unwrap()), real[i].len_of(Axis(0))), real[i].clone())
        })
        .collect();
    let figures = Figures::new(&mean_of_others);
    figures.are("pck_3d@0.2 all", 100.0, "8.1 9.4 24.0");
    figures.are("pck_2d@0.2 all", 100.0, "17.2 14.6 34.0");
    figures.are("mpjpe all", 1.0, "323.7 303.5 211.2");
    figures.are("l1 all", 1.0, ".146 .151 .105");
    let mismatched = |from: &[Array3<f32>; 3], known: &[(&str, f64, &str)]| {
        let each = [0, 1].map(|which| {
            let pairs: Vec<_> = (0..3).map(|i| (from[others(i)[which]].clone(), real[i].clone())).collect();
            Figures::new(&pairs)
        });
        for (label, scale, printed) in known {
            let [a, b] = [0, 1].map(|which: usize| each[which].of(label));
            let means: Vec<f64> = a.iter().zip(&b).map(|(a, b)| scale * (a + b) / 2.0).collect();
            compare(label, &means, printed);
        }
    };
    mismatched(&real, &[("pck_3d@0.2 all", 100.0, "4.2 7.2 4.7"), ("mpjpe all", 1.0, "426.7 379.3 394.9")]);
    mismatched(
        &made,
        &[
            ("pck_3d@0.2 all", 100.0, "8.3 18.1 10.2"),
            ("pck_2d@0.2 all", 100.0, "14.7 26.1 19.9"),
            ("mpjpe all", 1.0, "406.0 284.1 318.0"),
        ],
    );
}

#[test]
fn the_released_sounds_have_the_measured_onsets() {
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
