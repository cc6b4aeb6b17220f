//! Unit tests of `orator_study::stats::proportion`.

use orator_study::stats::estimate::StudentEstimate;
use orator_study::stats::proportion::{BinomialCount, Equivalence, votes_needed};

/// Counts of Rebol, Guetl and Pietroszek 2021, section 4.5, with votes treated as independent.
#[test]
fn p_values_of_the_papers_votes_match() {
    let p = |successes, trials| BinomialCount::new(successes, trials).unwrap().test(0.5).unwrap();
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 5e-4, "{found} {expected}");
    near(p(1050, 2000), 0.027);
    near(p(538, 1000), 0.018);
    near(p(512, 1000), 0.467);
    // 71.2 % and 58.8 % of 500 chose the matching sound.
    assert!(p(356, 500) < 1e-20 && p(294, 500) < 1e-4);
}

#[test]
fn extreme_counts_and_invalid_arguments() {
    let none = BinomialCount::new(0, 20).unwrap();
    let all = BinomialCount::new(20, 20).unwrap();
    assert_eq!((none.exact(0.95).unwrap().low, all.exact(0.95).unwrap().high), (0.0, 1.0));
    assert_eq!((none.wilson(0.95).unwrap().low, all.wilson(0.95).unwrap().high), (0.0, 1.0));
    assert_eq!((none.test(0.0).unwrap(), all.test(1.0).unwrap(), all.test(0.0).unwrap()), (1.0, 1.0, 0.0));
    assert!((all.test(0.5).unwrap() - 2.0 * 0.5f64.powi(20)).abs() < 1e-18);
    assert!(BinomialCount::new(0, 0).is_err() && BinomialCount::new(3, 2).is_err());
    assert!(none.test(f64::NAN).is_err() && none.test(1.5).is_err() && none.wilson(0.0).is_err());
}

/// 1,050 of 2,000 votes, the pooled counts of Rebol, Guetl and Pietroszek 2021, section 4.5.
#[test]
fn pooled_votes_of_the_paper_are_equivalent_to_chance() {
    let count = BinomialCount::new(1050, 2000).unwrap();
    let exact = |bound| Equivalence::of_count(&count, 0.5, bound).unwrap();
    assert!((exact(0.10).p / 6.51e-12 - 1.0).abs() < 0.01 && exact(0.10).passes(), "{}", exact(0.10).p);
    assert!((exact(0.05).p - 0.0131).abs() < 5e-5 && exact(0.05).passes(), "{}", exact(0.05).p);
    assert!(!exact(0.03).passes());
    let estimate = StudentEstimate::new(0.525, (0.525f64 * 0.475 / 2000.0).sqrt(), f64::INFINITY).unwrap();
    let asymptotic = Equivalence::of_estimate(&estimate, 0.5, 0.05).unwrap();
    assert!((asymptotic.p - 0.0126).abs() < 5e-5, "{}", asymptotic.p);
}

#[test]
fn votes_for_equivalence_follow_the_formula() {
    assert_eq!([0.05, 0.10].map(|bound| votes_needed(bound, 0.9).unwrap()), [1083, 271]);
    assert!(votes_needed(0.0, 0.9).is_err() && votes_needed(0.05, 1.0).is_err());
}

/// The interval is inside the bounds exactly where the test passes.
#[test]
fn interval_and_p_value_agree() {
    for value in [0.47, 0.5, 0.52, 0.529, 0.531, 0.56] {
        let estimate = StudentEstimate::new(value, 0.012, 39.0).unwrap();
        let test = Equivalence::of_estimate(&estimate, 0.5, 0.05).unwrap();
        let inside = test.interval.low > 0.45 && test.interval.high < 0.55;
        assert_eq!(inside, test.passes(), "{value}");
    }
    let estimate = StudentEstimate::new(0.5, 0.01, 9.0).unwrap();
    assert!(Equivalence::of_estimate(&estimate, 0.5, f64::NAN).is_err());
    assert!(Equivalence::of_count(&BinomialCount::new(1, 2).unwrap(), 0.95, 0.1).is_err());
}
