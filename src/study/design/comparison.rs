//! Which conditions the trials of a task set beside each other, and which response is right.

use crate::file::{StudyCondition, StudyFile, StudyTask};
use crate::plan::TaskDesign;
use crate::response::{Response, ScreenSide};

/// Conditions of one trial.
pub type ComparedConditions<'a> = Vec<&'a StudyCondition>;

/// Comparisons of a task, each of which takes an equal share of its trials. Where films are judged singly, the real
/// condition is as frequent as all others together, so that chance is one half.
pub fn comparisons<'a>(file: &'a StudyFile, task: &StudyTask) -> Vec<ComparedConditions<'a>> {
    let all: ComparedConditions = task.conditions.iter().filter_map(|name| file.find_condition(name)).collect();
    let real = all.iter().copied().find(|condition| condition.real);
    let others = || all.iter().copied().filter(|condition| !condition.real);
    match task.design {
        TaskDesign::Turing => others().filter_map(|other| Some(vec![real?, other])).collect(),
        TaskDesign::TuringSingle => others().filter_map(|other| Some([vec![real?], vec![other]])).flatten().collect(),
        TaskDesign::Preference => {
            let pairs = all.iter().enumerate().flat_map(|(at, a)| all[at + 1..].iter().map(move |b| vec![*a, *b]));
            pairs.collect()
        }
        TaskDesign::Sliders => vec![all],
        TaskDesign::Mismatch => {
            let matched = |condition: &StudyCondition| file.find_condition(condition.source.mismatch_of()?);
            all.iter().filter_map(|condition| Some(vec![matched(condition)?, *condition])).collect()
        }
    }
}

/// Right response to conditions from left to right, where there is one.
pub fn right_response(design: TaskDesign, shown: &[&StudyCondition]) -> Option<Response> {
    let side = |is_right: fn(&StudyCondition) -> bool| {
        let left = is_right(shown.first()?);
        Some(Response::Side(if left { ScreenSide::Left } else { ScreenSide::Right }))
    };
    match design {
        TaskDesign::Turing => side(|condition| condition.real),
        TaskDesign::TuringSingle => Some(Response::Real(shown.first()?.real)),
        TaskDesign::Mismatch => side(|condition| condition.source.mismatch_of().is_none()),
        TaskDesign::Preference | TaskDesign::Sliders => None,
    }
}
