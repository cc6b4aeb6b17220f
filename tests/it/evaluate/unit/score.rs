//! Unit tests of `orator_gesture::train::gan::score`.

use orator_gesture::train::gan::score::{ValidationMetrics, alarm, below_mean_pose, score};

#[test]
fn each_term_of_the_score_counts() {
    let mean_pose =
        ValidationMetrics { l1: 0.8, pck: 0.3, pck_body: 0.3, pck_hands: 0.3, frechet: Some(200.0), energy: 0.0 };
    let good = ValidationMetrics { l1: 0.4, frechet: Some(50.0), energy: 1.0, ..mean_pose };
    assert!((score(&good, &mean_pose, 0.8) - 1.25).abs() < 1e-12);
    assert!(score(&good, &mean_pose, 0.5) > score(&good, &mean_pose, 0.8), "another sound does as well");
    for worse in [
        ValidationMetrics { l1: 0.5, ..good },
        ValidationMetrics { frechet: Some(90.0), ..good },
        ValidationMetrics { energy: 0.5, ..good },
        ValidationMetrics { energy: 2.0, ..good },
        ValidationMetrics { frechet: None, ..good },
        mean_pose,
    ] {
        assert!(score(&worse, &mean_pose, 0.8) > score(&good, &mean_pose, 0.8), "{worse:?}");
    }
}

#[test]
fn a_model_below_the_mean_pose_is_reported() {
    assert_eq!(below_mean_pose([0.4, 0.5], Some([0.6, 0.3])), None);
    assert_eq!(below_mean_pose([0.4, 0.5], None), None);
    assert_eq!(below_mean_pose([f64::NAN, 0.5], Some([f64::NAN, 0.3])), None);
    let message = below_mean_pose([0.8, 0.5], Some([0.25, 0.3])).unwrap();
    assert!(message.ends_with("(L1 0.800 against 0.500, PCK 25.0 % against 30.0 %)."), "{message}");
    assert!(below_mean_pose([0.4, 0.5], Some([0.2, 0.3])).is_some_and(|message| !message.contains("L1")));
    assert!(below_mean_pose([0.6, 0.5], None).is_some_and(|message| !message.contains("PCK")));
}

#[test]
fn collapses_are_reported() {
    assert!(alarm(0.29, 1.0).is_some_and(|text| text.contains("29 %")));
    assert!(alarm(1.0, 0.05).is_some_and(|text| text.contains("hardly depends on the audio")));
    assert_eq!(alarm(0.7, 0.5), None);
}
