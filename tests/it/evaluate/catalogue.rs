//! All metrics of every convention, measured through the catalogue: golden values, blocks, hidden and invalid joints.

use ndarray::{Array2, Array3, ArrayView2, ArrayView3, array, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_gesture::metrics::catalogue::{Better, Catalogue, Convention, Definition, MetricSums, MotionPair};
use orator_gesture::metrics::settings::MetricSettings;

const CONVENTIONS: [Convention; 6] = {
    use Convention::{Aist, Emage, Genea, Orator, Speech2gesture, Trimodal};
    [Orator, Speech2gesture, Genea, Emage, Trimodal, Aist]
};

/// Two pseudo-random motions, [T, 49, 3].
fn motions(n_frames: usize) -> (Array3<f32>, Array3<f32>) {
    let ground_truth = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, joint, k)| {
        ((t * 7919 + joint * 104_729 + k * 611_953) % 1009) as f32 / 1009.0 - 0.5
    });
    let predicted = ground_truth.mapv(|v| v * v - 0.1);
    (predicted, ground_truth)
}

/// Interval of [predicted, ground truth] at 15 fps.
fn interval<'a>(
    [predicted, ground_truth]: [ArrayView3<'a, f32>; 2],
    mask: ArrayView2<'a, bool>,
    onsets: Option<&'a [f64]>,
) -> MotionPair<'a> {
    MotionPair { predicted, ground_truth, mask, fps: FrameRate::new(15, 1), onsets }
}

fn measured(catalogue: &Catalogue, frames: std::ops::Range<usize>) -> MetricSums {
    let (predicted, ground_truth) = motions(120);
    let mask = Array2::from_elem((120, N_JOINTS), true);
    let joints = [predicted.slice(s![frames.clone(), .., ..]), ground_truth.slice(s![frames.clone(), .., ..])];
    catalogue.measure(&interval(joints, mask.slice(s![frames, ..]), Some(&[0.3, 1.7, 2.5])))
}

/// Motion of the reference script.
fn moving(predicted: bool) -> Array3<f32> {
    let kind = f64::from(u8::from(predicted));
    Array3::from_shape_fn((90, N_JOINTS, 3), |(t, joint, k)| {
        if joint == 0 {
            return 0.0;
        }
        let hash = ((joint * 7919 + k * 104_729) % 1009) as f64 / 1009.0;
        let (t, phase) = (t as f64, (joint + k) as f64);
        let position = hash - 0.5
            + 0.08 * (t * (0.07 + 0.05 * hash + 0.01 * kind) + 6.0 * hash).sin()
            + 0.02 * (0.9 * t + joint as f64).sin();
        (if predicted { 1.1 * position + 0.03 * (0.4 * t + phase).cos() } else { position }) as f32
    })
}

#[test]
fn values_match_the_reference_script() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../fixtures/reference/metrics_golden.json")).unwrap();
    let onsets: Vec<f64> = serde_json::from_value(golden["motion"]["onsets"].clone()).unwrap();
    let (predicted, ground_truth) = (moving(true), moving(false));
    let mask = Array2::from_elem((90, N_JOINTS), true);
    for convention in CONVENTIONS {
        let known = &golden["motion"]["known"];
        let name = serde_json::to_value(convention).unwrap();
        let known = if convention == Convention::Orator { known } else { &known[name.as_str().unwrap()] };
        let catalogue = Catalogue::new(&MetricSettings { convention, ..MetricSettings::default() }).unwrap();
        let interval = interval([predicted.view(), ground_truth.view()], mask.view(), Some(&onsets));
        let measured = catalogue.measure_blocks(&interval, 20);
        let mut added = MetricSums::default();
        measured.blocks.iter().for_each(|block| added += block);
        let values = catalogue.values(&measured.total);
        for (label, known) in known.as_object().into_iter().flatten().filter(|(_, v)| v.is_number()) {
            let label_of = |d: &Definition| format!("{} {}", d.name, d.part);
            let i = catalogue.definitions().iter().position(|d| label_of(d) == *label).expect(label);
            let (found, known) = (values[i], known.as_f64().unwrap());
            assert!((found - known).abs() < 1e-5 * known, "{convention:?} {label}: {found}, known {known}");
        }
        for ((whole, added), definition) in values.iter().zip(catalogue.values(&added)).zip(catalogue.definitions()) {
            let same = (whole - added).abs() <= 1e-3 * whole.abs() || (whole.is_nan() && added.is_nan());
            assert!(same, "{}: {whole} {added}", definition.label());
        }
    }
}

/// Whether two values agree: equal up to rounding, or both NaN.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(1e-6) || (a.is_nan() && b.is_nan())
}

#[test]
fn drawing_blocks_equals_adding_them() {
    let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
    let blocks = [measured(&catalogue, 0..60), measured(&catalogue, 60..120)];
    let mut sums = blocks[0].clone();
    sums += &blocks[1];
    sums += &blocks[0];
    let counts = array![[1.0, 0.0], [2.0, 1.0]];
    let (cheap, costly) = (catalogue.draw_cheap(&blocks, counts.view()), catalogue.draw_costly(&blocks, counts.view()));
    assert_eq!(cheap.dim(), (2, catalogue.definitions().len()));
    for (i, value) in catalogue.values(&sums).into_iter().enumerate() {
        let drawn = if catalogue.is_costly(i) { &costly } else { &cheap }[[1, i]];
        assert!(same(drawn, value), "{}: {drawn} {value}", catalogue.definitions()[i].label());
    }
    let alone = catalogue.values(&blocks[0]);
    assert!((0..alone.len()).filter(|i| !catalogue.is_costly(*i)).all(|i| same(alone[i], cheap[[0, i]])));
}

#[test]
fn hashes_are_unique_and_invalid_settings_are_rejected() {
    let catalogue = Catalogue::new(&MetricSettings { with_neck: true, ..MetricSettings::default() }).unwrap();
    let hashes: std::collections::BTreeSet<_> = catalogue.definitions().iter().map(Definition::hash).collect();
    assert_eq!(hashes.len(), catalogue.definitions().len());
    assert!(Catalogue::new(&MetricSettings { alphas: vec![0.0], ..MetricSettings::default() }).is_err());
    for i in 0..catalogue.definitions().len() {
        let needs = catalogue.definitions()[i].better == Better::NearerTruth;
        assert_eq!(catalogue.truth_of(i).is_some(), needs, "{}", catalogue.definitions()[i].label());
    }
}

#[test]
fn a_predicted_joint_that_is_not_finite_is_reported() {
    let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
    let (mut predicted, ground_truth) = motions(30);
    predicted[[3, 20, 1]] = f32::NAN;
    let mask = Array2::from_elem((30, N_JOINTS), true);
    let interval = interval([predicted.view(), ground_truth.view()], mask.view(), None);
    let sums = catalogue.measure(&interval);
    let of = |name, part| catalogue.definitions().iter().position(|d| (d.name, d.part) == (name, part)).unwrap();
    let values = catalogue.values(&sums);
    assert!(values[of("pck_3d", "all")].is_finite());
    assert!(values[of("mpjpe", "body")].is_finite());
    assert!(values[of("mpjpe", "hands")].is_nan());
    assert!(catalogue.reason(&sums, of("mpjpe", "hands")).contains("1 predicted joints"));
    let nothing = catalogue.measure(&MotionPair { mask: mask.slice(s![..0, ..]), ..interval });
    assert!(catalogue.values(&nothing).iter().all(|value| value.is_nan()));
    assert!(catalogue.reason(&nothing, 0).contains("no joint"));
    let other = catalogue.measure(&MotionPair { fps: FrameRate::new(30, 1), ..interval });
    assert!(catalogue.values(&other).iter().all(|value| value.is_nan()));
}

#[test]
fn hidden_joints_do_not_affect_values() {
    // The left hand is hidden for a second, and the right wrist in some frames.
    let mask = Array2::from_shape_fn((90, N_JOINTS), |(t, joint)| {
        !((20..35).contains(&t) && (7..28).contains(&joint) || t % 40 == 13 && joint == 3)
    });
    for convention in CONVENTIONS {
        let catalogue = Catalogue::new(&MetricSettings { convention, ..MetricSettings::default() }).unwrap();
        assert!(catalogue.definitions().iter().all(|of| !of.formula.is_empty() && !of.undefined.is_empty()));
        let [first, second] = [f32::NAN, 7.0].map(|hidden| {
            let [predicted, ground_truth] = [true, false].map(|predicted| {
                let mut joints = moving(predicted);
                joints
                    .indexed_iter_mut()
                    .filter(|((t, joint, _), _)| !mask[[*t, *joint]])
                    .for_each(|(_, v)| *v = hidden);
                joints
            });
            let onsets: &[f64] = &[0.35, 1.4, 2.2, 3.3, 4.4];
            let joints = [predicted.view(), ground_truth.view()];
            catalogue.values(&catalogue.measure(&interval(joints, mask.view(), Some(onsets))))
        });
        for ((a, b), definition) in first.iter().zip(&second).zip(catalogue.definitions()) {
            assert!(same(*a, *b), "{convention:?} {}: {a} {b}", definition.label());
            // These metrics have too few frames, or too few consecutive ones.
            let few =
                definition.name == "frechet_embedding" || definition.name == "cca" && convention == Convention::Genea;
            assert!(a.is_finite() || few, "{convention:?} {}: {a}", definition.label());
        }
    }
}
