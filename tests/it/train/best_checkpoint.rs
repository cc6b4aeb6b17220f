//! The best checkpoint depends on the audio: over logged trainings of the synthetic speaker, whose correlation with the
//! true motion was measured at each validation (`.ci/log-checkpoints`), the score selects one within 5 % of the best.

use orator_gesture::train::gan::score::{ValidationMetrics, score};
use serde::Deserialize;
use std::collections::BTreeMap;

/// A validation, with the correlation that only the rule of the synthetic speaker provides.
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

    fn correlation(&self) -> f64 {
        self.speed_correlation.iter().sum::<f64>() / 2.0
    }
}

#[test]
fn the_score_selects_a_checkpoint_that_depends_on_the_audio() {
    let text = include_str!("../../../fixtures/training/logged_checkpoints.json");
    let trainings: BTreeMap<String, Vec<LoggedCheckpoint>> = serde_json::from_str(text).unwrap();
    assert!(trainings.len() >= 4, "{:?}", trainings.keys());
    for (name, checkpoints) in &trainings {
        let selected = checkpoints.iter().min_by(|a, b| a.score().total_cmp(&b.score())).unwrap();
        let best = checkpoints.iter().max_by(|a, b| a.correlation().total_cmp(&b.correlation())).unwrap();
        assert!(
            selected.correlation() >= 0.95 * best.correlation(),
            "{name}: the correlation of step {} is {:.3}, that of step {} is {:.3}",
            selected.step,
            selected.correlation(),
            best.step,
            best.correlation()
        );
    }
}
