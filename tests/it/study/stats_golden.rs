//! Compares statistics with scipy, statsmodels and krippendorff (`fixtures/reference/study_stats.py`).

use orator_study::stats::estimate::{StudentEstimate, holm};
use orator_study::stats::proportion::{BinomialCount, Equivalence};
use orator_study::stats::rank::{MeasurementScale, alpha, friedman, median_interval, signed_rank};
use serde::de::DeserializeOwned;
use serde_json::Value;

fn cases(statistic: &str) -> Vec<Value> {
    let golden: Value =
        serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
    golden[statistic].as_array().unwrap().clone()
}

fn of<T: DeserializeOwned>(case: &Value, name: &str) -> T {
    serde_json::from_value(case[name].clone()).unwrap()
}

fn assert_near<const N: usize>(case: &Value, names: [&str; N], found: [f64; N], relative: f64, min_scale: f64) {
    for (found, name) in found.into_iter().zip(names) {
        let expected: f64 = of(case, name);
        assert!((found - expected).abs() <= relative * expected.abs().max(min_scale), "{name} {found}: {case}");
    }
}

fn count(case: &Value) -> BinomialCount {
    BinomialCount::new(of(case, "successes"), of(case, "trials")).unwrap()
}

#[test]
fn proportions_and_their_equivalence() {
    for case in cases("proportion") {
        let (wilson, exact) = (count(&case).wilson(0.95).unwrap(), count(&case).exact(0.95).unwrap());
        let p = count(&case).test(of(&case, "probability")).unwrap();
        let names = ["wilson_low", "wilson_high", "exact_low", "exact_high", "p"];
        assert_near(&case, names, [wilson.low, wilson.high, exact.low, exact.high, p], 1e-9, 1e-6);
    }
    for case in cases("binomial_equivalence") {
        let test = Equivalence::of_count(&count(&case), 0.5, of(&case, "bound")).unwrap();
        assert_near(&case, ["p"], [test.p], 1e-9, 0.0);
    }
}

#[test]
fn means_and_their_equivalence() {
    for case in cases("mean") {
        let mean = StudentEstimate::of_mean(&of::<Vec<f64>>(&case, "values")).unwrap();
        let interval = mean.interval(0.95).unwrap();
        let found = [mean.value, mean.standard_error, mean.p_value(0.5), interval.low, interval.high];
        assert_near(&case, ["mean", "standard_error", "p", "low", "high"], found, 1e-9, 1e-3);
    }
    for case in cases("equivalence") {
        let mean = StudentEstimate::of_mean(&of::<Vec<f64>>(&case, "values")).unwrap();
        assert_near(&case, ["p"], [Equivalence::of_estimate(&mean, 0.5, of(&case, "bound")).unwrap().p], 1e-9, 0.0);
    }
    for case in cases("t_quantile") {
        let [freedom, share, expected]: [f64; 3] = serde_json::from_value(case).unwrap();
        let found = StudentEstimate::new(0.0, 1.0, freedom).unwrap().quantile(share);
        // Above 10,000 degrees of freedom `quantile` uses an expansion.
        let bound = if freedom < 1e4 { 1e-10 } else { 1e-7 };
        assert!((found / expected - 1.0).abs() < bound, "{freedom} {share} {found} {expected}");
    }
}

#[test]
fn adjusted_p_values() {
    for case in cases("holm") {
        let found = holm(&of::<Vec<f64>>(&case, "p")).unwrap();
        assert!(found.iter().zip(of::<Vec<f64>>(&case, "adjusted")).all(|(a, b)| (a - b).abs() < 1e-15), "{case}");
    }
}

#[test]
fn ranks_and_medians() {
    for case in cases("wilcoxon") {
        let test = signed_rank(&of::<Vec<f64>>(&case, "differences")).unwrap();
        assert_near(&case["wilcox"], ["statistic", "p"], [test.statistic, test.p], 1e-9, 0.0);
    }
    for case in cases("friedman") {
        let test = friedman(&of::<Vec<Vec<f64>>>(&case, "blocks")).unwrap();
        assert_near(&case, ["statistic", "p"], [test.statistic, test.p], 1e-9, 0.0);
    }
    for case in cases("median") {
        let interval = median_interval(&of::<Vec<f64>>(&case, "values"), 0.95).unwrap();
        assert_near(&case, ["low", "high"], [interval.low, interval.high], 1e-12, 1.0);
    }
}

#[test]
fn agreement_of_raters() {
    for case in cases("krippendorff") {
        let units: Vec<Vec<Option<f64>>> = of(&case, "units");
        let units: Vec<Vec<f64>> = units.into_iter().map(|unit| unit.into_iter().flatten().collect()).collect();
        let scales = [MeasurementScale::Nominal, MeasurementScale::Ordinal, MeasurementScale::Interval];
        let found = scales.map(|scale| alpha(&units, scale).unwrap());
        assert_near(&case, ["nominal", "ordinal", "interval"], found, 1e-12, 1.0);
    }
}
