//! Unit tests of `orator_study::analyse::statistic`.

use orator_study::analyse::statistic::{StatisticMethod, StatisticSet, TestResult, adjust};

#[test]
fn tests_of_one_method_are_a_family() {
    let set = |p: &[(StatisticMethod, f64)]| StatisticSet {
        tests: p.iter().map(|(method, p)| TestResult::new(*method, *p)).collect(),
        ..StatisticSet::default()
    };
    let (crossed, wilson) = (StatisticMethod::Crossed, StatisticMethod::Binomial);
    let mut sets = [set(&[(crossed, 0.01), (wilson, 0.03)]), set(&[(crossed, 0.04)]), set(&[(wilson, 0.02)])];
    let [a, b, c] = &mut sets;
    adjust(&mut [a, b, c]);
    let adjusted = |set: &StatisticSet| set.tests.iter().filter_map(|test| test.adjusted_p).collect::<Vec<_>>();
    assert_eq!([&sets[0], &sets[1], &sets[2]].map(adjusted), [vec![0.02, 0.04], vec![0.04], vec![0.04]]);
    adjust(&mut [&mut sets[1]]);
    assert_eq!(adjusted(&sets[1]), [0.04]);
}
