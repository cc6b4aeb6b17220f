//! Tests of `orator_study::analyse::share`.

use orator_study::analyse::share::mixed_model;
use orator_study::analyse::statistic::{StatisticMethod, StatisticSet};
use orator_study::power::{CrossedDesign, CrossedEffects, crossed_votes};
use orator_study::stats::cluster::votes::ClipVote;

#[test]
fn the_share_of_a_simulated_study_is_found() {
    let design = CrossedDesign { n_participants: 60, n_trials: 10, n_clips: 30 };
    let effects = CrossedEffects { share: 0.65, sd_participants: 0.5, sd_clips: 0.3 };
    let votes = crossed_votes(&design, &effects, 4, 0);
    let mut found = StatisticSet::default();
    let model = mixed_model(&votes, &mut found, 0.95).unwrap();
    let interval = found.interval(StatisticMethod::MixedModel).unwrap();
    assert!(interval.low < 0.65 && 0.65 < interval.high, "{interval:?}");
    assert!((model.share - 0.65).abs() < 0.06 && model.log_odds > 0.3, "{model:?}");
    assert!(found.test(StatisticMethod::MixedModel).unwrap().p < 0.01);
    // Equal votes have no finite log odds.
    let equal: Vec<_> = votes.iter().map(|vote| ClipVote { score: 1.0, ..*vote }).collect();
    let mut found = StatisticSet::default();
    assert_eq!(mixed_model(&equal, &mut found, 0.95), None);
    assert_eq!((found.missing.len(), found.tests.len()), (1, 0));
}
