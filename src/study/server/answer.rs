//! Validation of answers: whether the response fits the design of its trial, whether numbers are in range, and whether
//! an attention check is passed.

use crate::plan::{PlannedTask, TaskDesign, Trial, TrialPhase};
use crate::store::answers::SubmittedAnswer;
use crate::vote::Response;
use orator_web::reply::ApiError;

/// Maximum duration that a page may report, seconds: one day.
const MAX_SECS: f64 = 86_400.0;
/// Maximum number of plays that a page may report.
const MAX_PLAYS: u32 = 1000;

/// Validates an answer to `trial`, which belongs to `task`.
///
/// # Errors
/// The response does not fit the design, or a number is out of range.
pub fn check(answer: &SubmittedAnswer, trial: &Trial, task: &PlannedTask) -> Result<(), ApiError> {
    if !fits(&answer.response, trial, task) {
        return Err(ApiError::bad_request("The response does not match the design of the task."));
    }
    if !(1..=MAX_PLAYS).contains(&answer.plays) {
        return Err(ApiError::bad_request("The films must be played before the answer."));
    }
    let secs = [answer.stalled_secs, answer.unfocused_secs, answer.response_secs];
    if !secs.iter().all(|secs| (0.0..=MAX_SECS).contains(secs)) {
        return Err(ApiError::bad_request("Durations must be between 0 and 86400 seconds."));
    }
    Ok(())
}

fn fits(response: &Response, trial: &Trial, task: &PlannedTask) -> bool {
    match (trial.phase, task.design, response) {
        (TrialPhase::AttentionCheck, _, Response::Number(number)) => (10..=99).contains(number),
        (TrialPhase::AttentionCheck, ..) => false,
        (_, TaskDesign::Turing | TaskDesign::Mismatch, Response::Side(_)) => true,
        (_, TaskDesign::TuringSingle, Response::Real(_)) => true,
        (_, TaskDesign::Preference, Response::Step(step)) => (-2..=2).contains(step),
        (_, TaskDesign::Sliders, Response::Scores(scores)) => {
            scores.len() == trial.films.len() && scores.iter().all(|score| *score <= 100)
        }
        _ => false,
    }
}

/// Whether `response` fails an attention check; false for other trials.
pub fn fails_check(response: &Response, trial: &Trial) -> bool {
    trial.phase == TrialPhase::AttentionCheck && trial.expected.as_ref().is_some_and(|right| right != response)
}

/// Correct response that a practice or training trial shows after its answer.
pub fn feedback(trial: &Trial) -> Option<&Response> {
    let has_feedback = matches!(trial.phase, TrialPhase::Practice | TrialPhase::Training);
    trial.expected.as_ref().filter(|_| has_feedback)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vote::ScreenSide;

    fn task(design: TaskDesign) -> PlannedTask {
        PlannedTask { name: "t".to_owned(), design, replay: false, scale: String::new() }
    }

    fn trial(phase: TrialPhase, n_films: usize) -> Trial {
        Trial { task: 0, phase, films: vec![String::new(); n_films], expected: None }
    }

    #[test]
    fn each_design_accepts_only_its_own_kind_of_response() {
        let (side, real) = (Response::Side(ScreenSide::Left), Response::Real(false));
        let scores = |scores: &[u8]| Response::Scores(scores.to_vec());
        let (step, number) = (Response::Step(-2), Response::Number(42));
        let all = [side, real, step, number, scores(&[0, 100])];
        let fitting = |design, phase| -> Vec<usize> {
            let fits = |one: &Response| fits(one, &trial(phase, 2), &task(design));
            all.iter().enumerate().filter(|(_, one)| fits(one)).map(|(k, _)| k).collect()
        };
        use TaskDesign::{Mismatch, Preference, Sliders, Turing, TuringSingle};
        for (design, form) in [(Turing, 0), (Mismatch, 0), (TuringSingle, 1), (Preference, 2), (Sliders, 4)] {
            for phase in [TrialPhase::Practice, TrialPhase::Training, TrialPhase::Main] {
                assert_eq!(fitting(design, phase), [form], "{design:?}");
            }
            assert_eq!(fitting(design, TrialPhase::AttentionCheck), [3], "{design:?}");
        }
    }

    #[test]
    fn numbers_must_be_in_range() {
        let given = |response, plays, secs| SubmittedAnswer {
            position: 0,
            response,
            plays,
            stalled_secs: secs,
            unfocused_secs: 0.0,
            response_secs: 0.0,
        };
        let accepts = |design, phase, response, plays, secs| {
            check(&given(response, plays, secs), &trial(phase, 1), &task(design)).is_ok()
        };
        use TrialPhase::{AttentionCheck, Main};
        assert!(accepts(TaskDesign::Preference, Main, Response::Step(2), 1, 0.0));
        assert!(!accepts(TaskDesign::Preference, Main, Response::Step(3), 1, 0.0));
        assert!(!accepts(TaskDesign::Sliders, Main, Response::Scores(vec![101]), 1, 0.0));
        assert!(!accepts(TaskDesign::Sliders, Main, Response::Scores(vec![1, 2]), 1, 0.0));
        assert!(!accepts(TaskDesign::Turing, AttentionCheck, Response::Number(9), 1, 0.0));
        for (plays, secs) in [(0, 0.0), (1001, 0.0), (1, -1.0), (1, f64::NAN), (1, f64::INFINITY), (1, 86_401.0)] {
            assert!(!accepts(TaskDesign::TuringSingle, Main, Response::Real(true), plays, secs), "{plays} {secs}");
        }
    }
}
