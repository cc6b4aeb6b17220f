//! Tests of `orator_gesture::evaluate::table::blocks`.

use orator_gesture::evaluate::table::blocks::{BlockLength, integrated_time, windowed};

#[test]
fn slowly_varying_errors_give_long_blocks() {
    let series = |period: usize, n: usize| vec![(0..n).map(|t| f64::from((t / period % 2) as u32)).collect()];
    let fast = BlockLength::new(20.0, 15.0, &[series(1, 300)]);
    assert_eq!((fast.secs, fast.frames(15.0)), (2.0, 30));
    assert_eq!(BlockLength::new(60.0, 15.0, &[series(1, 900)]).secs, 3.75);
    assert_eq!(BlockLength::new(7200.0, 15.0, &[]).secs, 8.0);
    let slow = BlockLength::new(20.0, 15.0, &[series(1, 300), series(150, 300)]);
    assert!(slow.secs > 4.0 && slow.secs == 1.5 * slow.decorrelation_secs, "{slow:?}");
}

#[test]
fn long_blocks_are_almost_independent() {
    let length = BlockLength { secs: 2.0, decorrelation_secs: 1.0 };
    // Means of two neighbouring blocks of an autoregressive process, from its autocorrelations.
    let (frames, decay): (i32, f64) = (2000, (-4.0 * 2.0 / 2000.0_f64).exp());
    let correlation = |gap: i32| {
        let pairs = (-frames..frames).map(|lag| f64::from(frames - lag.abs()) * decay.powi((lag + gap).abs()));
        pairs.sum::<f64>()
    };
    let expected = 1.0 + 2.0 * correlation(frames) / correlation(0);
    assert!((length.variance_inflation(4.0) - expected).abs() < 1e-3, "{expected}");
    assert!(length.variance_inflation(400.0) < 1.01 && length.variance_inflation(1e-9) == 3.0);
    assert!((length.variance_inflation(1e-2) - 3.0).abs() < 0.1);
}

#[test]
fn times_match_emcee() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/verdict_golden.json")).unwrap();
    for case in golden["integrated_time"].as_array().unwrap() {
        let series: Vec<f64> = serde_json::from_value(case["series"].clone()).unwrap();
        let expected = case["time"].as_f64().unwrap();
        let (time, _, n) = windowed(std::slice::from_ref(&series));
        assert!((time / expected - 1.0).abs() < 1e-9 && n == series.len(), "{time} {expected}");
        assert!(integrated_time(&[series]) > time.max(1.0));
    }
}

#[test]
fn pieces_of_different_level_have_a_long_time_and_constants_do_not() {
    let wave = |level: f64| (0..75).map(|t| level + f64::from(t * 7919 % 101) / 101.0).collect::<Vec<f64>>();
    let alike = integrated_time(&[wave(0.0), wave(0.0), wave(0.0)]);
    let apart = integrated_time(&[wave(0.0), wave(5.0), wave(-3.0)]);
    assert!(alike < 4.0 && apart > 40.0, "{alike} {apart}");
    for pieces in [vec![], vec![vec![]], vec![vec![f64::NAN; 9]], vec![vec![2.0; 50]], vec![vec![1.0]]] {
        assert_eq!(integrated_time(&pieces), 1.0);
    }
}
