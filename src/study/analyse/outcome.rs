//! Converts the votes of a task to numbers: indices of participants and clips, and scores.

use super::result::{ClipShare, ShareMeasure};
use crate::plan::TaskDesign;
use crate::stats::cluster::votes::ClipVote;
use crate::vote::{Response, ScreenSide, StudyVote};
use std::collections::{BTreeMap, BTreeSet};

/// Indices of participants and clips by name, common to all votes of a task.
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
        numbering.participants.values_mut().enumerate().for_each(|(number, index)| *index = number);
        numbering.clips.values_mut().enumerate().for_each(|(number, index)| *index = number);
        numbering
    }

    pub fn vote(&self, vote: &StudyVote, score: f64) -> ClipVote {
        let clip = (vote.speaker.as_str(), vote.clip.as_str());
        ClipVote {
            participant: self.participants.get(vote.participant.as_str()).copied().unwrap_or_default(),
            clip: self.clips.get(&clip).copied().unwrap_or_default(),
            score,
        }
    }
}

/// Number of distinct participants and of distinct clips.
pub fn distinct<'v>(votes: impl IntoIterator<Item = &'v ClipVote> + Clone) -> [usize; 2] {
    let participants: BTreeSet<usize> = votes.clone().into_iter().map(|vote| vote.participant).collect();
    let clips: BTreeSet<usize> = votes.into_iter().map(|vote| vote.clip).collect();
    [participants.len(), clips.len()]
}

/// Mean score; NaN without votes.
pub fn mean_score(votes: &[ClipVote]) -> f64 {
    votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64
}

/// All unordered pairs of names, in the order of the names.
pub fn name_pairs<S: AsRef<str>>(names: &[S]) -> impl Iterator<Item = [&str; 2]> {
    names.iter().enumerate().flat_map(|(k, a)| names[k + 1..].iter().map(move |b| [a.as_ref(), b.as_ref()]))
}

#[derive(Clone, Debug, PartialEq)]
pub struct BinaryVote<'v> {
    /// Score 1 for success, otherwise 0.
    pub vote: ClipVote,
    pub speaker: &'v str,
    /// Condition judged: generated one of a Turing test, that of the expected film of a mismatch task, or that shown.
    pub condition: &'v str,
    /// Whether the expected film was on the left, and whether the left film was chosen; `None` for single films.
    pub sides: Option<[bool; 2]>,
}

/// Measure that a design compares with chance; `None` if it has no chance level.
pub fn measure(design: TaskDesign) -> Option<ShareMeasure> {
    match design {
        TaskDesign::Turing => Some(ShareMeasure::GeneratedChosen),
        TaskDesign::TuringSingle => Some(ShareMeasure::Correct),
        TaskDesign::Mismatch => Some(ShareMeasure::MatchedChosen),
        TaskDesign::Preference | TaskDesign::Sliders => None,
    }
}

/// Binary outcomes of `measure`; votes that do not fit it are dropped.
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
            (Response::Real(answered_real), Response::Real(is_real)) => {
                let is_success =
                    if measure == ShareMeasure::JudgedReal { *answered_real } else { answered_real == is_real };
                (vote.conditions.first()?, is_success, None)
            }
            _ => return None,
        };
        let score = f64::from(u8::from(is_success));
        Some(BinaryVote { vote: numbering.vote(vote, score), speaker: &vote.speaker, condition, sides })
    };
    votes.iter().filter_map(one).collect()
}

/// Proportion of successes by clip, in alphabetical order of speakers and clips.
pub fn clip_shares(votes: &[BinaryVote], numbering: &Numbering) -> Vec<ClipShare> {
    let mut counts = vec![(0, 0); numbering.clips.len()];
    for BinaryVote { vote, .. } in votes {
        if let Some((n_votes, n_successes)) = counts.get_mut(vote.clip) {
            *n_votes += 1;
            *n_successes += u64::from(vote.score == 1.0);
        }
    }
    let share = |((speaker, clip), index): (&(&str, &str), &usize)| {
        let (n_votes, n_successes) = counts.get(*index).copied().filter(|(n_votes, _)| *n_votes > 0)?;
        let [speaker, clip] = [speaker, clip].map(|name| (*name).to_owned());
        Some(ClipShare { speaker, clip, n_votes, n_successes, share: n_successes as f64 / n_votes as f64 })
    };
    numbering.clips.iter().filter_map(share).collect()
}

pub fn conditions(votes: &[&StudyVote]) -> Vec<String> {
    let names: BTreeSet<&str> = votes.iter().flat_map(|vote| &vote.conditions).map(String::as_str).collect();
    names.into_iter().map(str::to_owned).collect()
}

/// Differences of two conditions from votes on both: preference steps towards `first`, or its score less `second`'s.
pub fn differences(votes: &[&StudyVote], numbering: &Numbering, [first, second]: [&str; 2]) -> Vec<ClipVote> {
    let one = |vote: &&StudyVote| {
        let index = |name: &str| vote.conditions.iter().position(|condition| condition == name);
        let (a, b) = (index(first)?, index(second)?);
        let difference = match &vote.response {
            // Steps are negative for the left film, positive for the right film.
            Response::Step(step) => f64::from(*step) * if a > b { 1.0 } else { -1.0 },
            Response::Scores(scores) => f64::from(*scores.get(a)?) - f64::from(*scores.get(b)?),
            _ => return None,
        };
        Some(numbering.vote(vote, difference))
    };
    votes.iter().filter_map(one).collect()
}

pub fn scores(votes: &[&StudyVote], numbering: &Numbering, condition: &str) -> Vec<ClipVote> {
    let one = |vote: &&StudyVote| {
        let index = vote.conditions.iter().position(|name| name == condition)?;
        let Response::Scores(scores) = &vote.response else { return None };
        Some(numbering.vote(vote, f64::from(*scores.get(index)?)))
    };
    votes.iter().filter_map(one).collect()
}
