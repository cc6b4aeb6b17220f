//! Tests of `orator_gesture::train::epochs`.

use orator_gesture::train::epochs::EpochSchedule;
use std::ops::Range;

/// Runs the schedule on a score per epoch of 10 steps; returns the decay and the last step.
fn schedule(schedule: EpochSchedule, scores: &[f32]) -> (Option<Range<usize>>, usize) {
    let (mut best, mut decay, mut done) = (None::<(usize, f32)>, None, 0);
    for score in scores {
        if done >= schedule.end(done, best, decay.as_ref()) {
            break;
        }
        done += 10;
        if best.is_none_or(|(_, lowest)| *score < lowest) {
            best = Some((done, *score));
        }
        decay = decay.or_else(|| schedule.decay(done, best));
    }
    (decay, done)
}

#[test]
fn the_decay_begins_when_the_score_stops_improving() {
    let base = EpochSchedule { steps: 120, epoch_steps: 10, checkpoint_every: 10, patience: 2, decay_share: 0.25 };
    let falling: Vec<f32> = (0..20).map(|epoch| -epoch as f32).collect();
    let rising = [3.0, 2.0, 1.0, 1.5, 1.2, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2];
    // The fifth score is the second without an improvement: a quarter of 50 steps, in epochs, follows.
    assert_eq!(schedule(base, &rising), (Some(50..70), 70));
    assert_eq!(schedule(EpochSchedule { steps: 65, ..base }, &rising), (Some(50..65), 70));
    assert_eq!(schedule(EpochSchedule { steps: 60, ..base }, &rising), (None, 60));
    assert_eq!(schedule(EpochSchedule { patience: 3, ..base }, &rising), (None, 120));
    assert_eq!(schedule(base, &falling), (None, 120));
    assert_eq!(schedule(EpochSchedule { decay_share: 0.0, ..base }, &rising), (None, 50));
    assert_eq!(schedule(EpochSchedule { decay_share: 0.0, patience: 0, ..base }, &rising), (None, 120));
}
