//! Votes of a task as numbers: participants and clips numbered, answers turned to scores.

use super::result::ShareMeasure;
use crate::plan::TaskDesign;
use crate::stats::cluster::votes::ClipVote;
use crate::vote::{Response, ScreenSide, StudyVote};
use std::collections::{BTreeMap, BTreeSet};

/// Numbers of participants and clips by their names, the same for all votes of a task.
#[derive(Clone, Debug, Default)]
pub struct Numbering<'v> {
    participants: BTreeMap<&'v str, usize>,
    clips: BTreeMap<(&'v str, &'v str), usize>,
}

impl<'v> Numbering<'v> {
    pub fn new(votes: &[&'v StudyVote]) -> Self {
        let mut numbering = Self::default();
        for vote in votes {
            numbering.participants.insert(&vote.participant, 0);
            numbering.clips.insert((&vote.speaker, &vote.clip), 0);
        }
        numbering.participants.values_mut().enumerate().for_each(|(number, place)| *place = number);
        numbering.clips.values_mut().enumerate().for_each(|(number, place)| *place = number);
        numbering
    }

    /// Vote of this score.
    pub fn vote(&self, vote: &StudyVote, score: f64) -> ClipVote {
        let clip = (vote.speaker.as_str(), vote.clip.as_str());
        ClipVote {
            participant: self.participants.get(vote.participant.as_str()).copied().unwrap_or_default(),
            clip: self.clips.get(&clip).copied().unwrap_or_default(),
            score,
        }
    }
}

/// Numbers of participants and of clips that votes are of.
pub fn distinct<'v>(votes: impl IntoIterator<Item = &'v ClipVote> + Clone) -> [usize; 2] {
    let participants: BTreeSet<usize> = votes.clone().into_iter().map(|vote| vote.participant).collect();
    let clips: BTreeSet<usize> = votes.into_iter().map(|vote| vote.clip).collect();
    [participants.len(), clips.len()]
}

/// Mean score; NaN of no vote.
pub fn mean_score(votes: &[ClipVote]) -> f64 {
    votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64
}

/// All pairs of names, in their order.
pub fn name_pairs<S: AsRef<str>>(names: &[S]) -> impl Iterator<Item = [&str; 2]> {
    names.iter().enumerate().flat_map(|(k, a)| names[k + 1..].iter().map(move |b| [a.as_ref(), b.as_ref()]))
}

/// Vote that is a success or not.
#[derive(Clone, Debug, PartialEq)]
pub struct BinaryVote<'v> {
    /// Score 1 for success, 0 for none.
    pub vote: ClipVote,
    pub speaker: &'v str,
    /// Condition that was judged: the generated one, the one that was matched or not, the one that was seen.
    pub condition: &'v str,
    /// Whether the expected film was on the left, and whether the left one was chosen.
    pub sides: Option<[bool; 2]>,
}

/// Measure of a task against chance.
pub fn measure(design: TaskDesign) -> Option<ShareMeasure> {
    match design {
        TaskDesign::Turing => Some(ShareMeasure::GeneratedChosen),
        TaskDesign::TuringSingle => Some(ShareMeasure::Correct),
        TaskDesign::Mismatch => Some(ShareMeasure::MatchedChosen),
        TaskDesign::Preference | TaskDesign::Sliders => None,
    }
}

/// Votes of a task as successes of `measure`; what does not fit it is left out.
pub fn binary<'v>(votes: &[&'v StudyVote], numbering: &Numbering, measure: ShareMeasure) -> Vec<BinaryVote<'v>> {
    let one = |vote: &&'v StudyVote| {
        let (condition, is_success, sides) = match (&vote.response, vote.expected.as_ref()?) {
            (Response::Side(chosen), Response::Side(expected)) => {
                let is_right = chosen == expected;
                let right = usize::from(*expected == ScreenSide::Right);
                let (shown, is_success) = match measure {
                    ShareMeasure::GeneratedChosen => (1 - right, !is_right),
                    _ => (right, is_right),
                };
                let sides = [expected, chosen].map(|side| *side == ScreenSide::Left);
                (vote.conditions.get(shown)?, is_success, Some(sides))
            }
            (Response::Real(said), Response::Real(is_real)) => {
                let is_success = if measure == ShareMeasure::TakenForReal { *said } else { said == is_real };
                (vote.conditions.first()?, is_success, None)
            }
            _ => return None,
        };
        let score = f64::from(u8::from(is_success));
        Some(BinaryVote { vote: numbering.vote(vote, score), speaker: &vote.speaker, condition, sides })
    };
    votes.iter().filter_map(one).collect()
}

/// Conditions in the order of their names.
pub fn conditions(votes: &[&StudyVote]) -> Vec<String> {
    let names: BTreeSet<&str> = votes.iter().flat_map(|vote| &vote.conditions).map(String::as_str).collect();
    names.into_iter().map(str::to_owned).collect()
}

/// Differences between two conditions where one vote judged both: steps towards `first`, or its score less that of
/// `second`.
pub fn differences(votes: &[&StudyVote], numbering: &Numbering, [first, second]: [&str; 2]) -> Vec<ClipVote> {
    let one = |vote: &&StudyVote| {
        let place = |name: &str| vote.conditions.iter().position(|condition| condition == name);
        let (a, b) = (place(first)?, place(second)?);
        let difference = match &vote.response {
            // Steps go from the left film to the right one.
            Response::Step(step) => f64::from(*step) * if a > b { 1.0 } else { -1.0 },
            Response::Scores(scores) => f64::from(*scores.get(a)?) - f64::from(*scores.get(b)?),
            _ => return None,
        };
        Some(numbering.vote(vote, difference))
    };
    votes.iter().filter_map(one).collect()
}

/// Scores of a condition.
pub fn scores(votes: &[&StudyVote], numbering: &Numbering, condition: &str) -> Vec<ClipVote> {
    let one = |vote: &&StudyVote| {
        let place = vote.conditions.iter().position(|name| name == condition)?;
        let Response::Scores(scores) = &vote.response else { return None };
        Some(numbering.vote(vote, f64::from(*scores.get(place)?)))
    };
    votes.iter().filter_map(one).collect()
}
