//! Tests of `orator_study::power`.

use orator_study::analyse::statistic::StatisticMethod;
use orator_study::power::{CrossedDesign, CrossedEffects, LEVEL, PowerQuestion, crossed_votes, plan, power, text};

fn question() -> PowerQuestion {
    PowerQuestion {
        n_trials: 20,
        n_clips: 40,
        sd_participants: 0.3,
        sd_clips: 0.3,
        power: 0.9,
        effect: 0.58,
        bound: 0.1,
        n_simulations: 200,
        seed: 1,
    }
}

#[test]
fn a_sufficient_number_is_found_and_the_formula_is_too_optimistic() {
    let plan = plan(&question(), &|_| {}).unwrap();
    let needed = plan.difference.n_participants.unwrap();
    assert!((15..120).contains(&needed), "{needed}");
    assert!(plan.difference.at_naive.power < 0.9 && plan.difference.naive_votes > 300, "{:?}", plan.difference);
    assert_eq!(plan.equivalence.naive_votes, 271);
    assert!(plan.difference.rows.is_sorted_by_key(|row| row.n_participants));
    assert!(text(&plan).contains("<- sufficient"), "{}", text(&plan));
}

#[test]
fn few_clips_limit_the_power() {
    let few = PowerQuestion { n_trials: 4, n_clips: 4, sd_clips: 1.0, n_simulations: 100, ..question() };
    let curve = power(&few, 320, 0.58, &|analysis| {
        analysis.statistics.test(StatisticMethod::Crossed).is_some_and(|test| test.p < LEVEL)
    });
    assert!(curve.power < 0.5, "{curve:?}");
    assert!(plan(&PowerQuestion { n_trials: 9, ..few.clone() }, &|_| {}).is_err());
    assert!(plan(&PowerQuestion { effect: 0.5, ..few }, &|_| {}).is_err());
}

#[test]
fn simulated_shares_and_balance_match_the_design() {
    let effects = CrossedEffects { share: 0.6, sd_participants: 0.5, sd_clips: 0.5 };
    assert!(effects.log_odds() > (0.6f64 / 0.4).ln());
    assert!(CrossedEffects { share: 0.5, ..effects }.log_odds().abs() < 1e-9);
    let design = CrossedDesign { n_participants: 2000, n_trials: 10, n_clips: 2000 };
    let votes = crossed_votes(&design, &effects, 1, 0);
    let share = votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64;
    assert!((share - 0.6).abs() < 0.015, "{share}");
    let of_clip = |clip: usize| votes.iter().filter(|vote| vote.clip == clip).count();
    assert!((0..2000).all(|clip| of_clip(clip) == 10));
    assert_eq!(votes, crossed_votes(&design, &effects, 1, 0));
    assert_ne!(votes, crossed_votes(&design, &effects, 1, 1));
}
