//! The best checkpoint is one that hears: over logged trainings of the synthetic speaker, whose hidden truth was measured at
//! each validation (`.ci/log-checkpoints`), the score chooses one within 5 % of the best.

use orator_gesture::train::gan::score::{ValidationMetrics, score};
use serde::Deserialize;
use std::collections::BTreeMap;

/// A validation with what only the rule knows.
#[derive(Deserialize)]
struct LoggedCheckpoint {
    step: usize,
    generator: ValidationMetrics,
    mean_pose: ValidationMetrics,
    other_sound: f64,
    /// Correlation of either wrist's speed with that of the rule.
    speed_correlation: [f64; 2],
}

impl LoggedCheckpoint {
    fn score(&self) -> f64 {
        score(&self.generator, &self.mean_pose, self.other_sound)
    }

    fn hidden(&self) -> f64 {
        self.speed_correlation.iter().sum::<f64>() / 2.0
    }
}

#[test]
fn the_score_chooses_a_checkpoint_that_hears() {
    let text = include_str!("../../../fixtures/training/logged_checkpoints.json");
    let trainings: BTreeMap<String, Vec<LoggedCheckpoint>> = serde_json::from_str(text).unwrap();
    assert!(trainings.len() >= 4, "{:?}", trainings.keys());
    for (name, checkpoints) in &trainings {
        let chosen = checkpoints.iter().min_by(|a, b| a.score().total_cmp(&b.score())).unwrap();
        let best = checkpoints.iter().max_by(|a, b| a.hidden().total_cmp(&b.hidden())).unwrap();
        assert!(
            chosen.hidden() >= 0.95 * best.hidden(),
            "{name}: step {} hears with {:.3}, step {} with {:.3}",
            chosen.step,
            chosen.hidden(),
            best.step,
            best.hidden()
        );
    }
}
