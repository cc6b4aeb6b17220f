//! Conclusions from a table: whether the prediction is better than a constant pose, and whether it depends on the
//! audio. Several metrics vote, since a single one can mislead (a constant pose has many correct keypoints). Their
//! paired differences are tested together by sign flips of blocks.

use super::labels;
use crate::evaluate::baseline::baselines::PredictorKind;
use crate::evaluate::table::sign_flips::{MIN_BLOCKS, TestedDifference};
use crate::evaluate::table::table::{PredictorRow, Table};
use crate::metrics::catalogue::Better;
use orator_base::math::estimate::Estimate;
use orator_base::text::{counted, length};
use serde::Serialize;

/// Aspect of motion that a metric describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aspect {
    /// Position of the joints at each moment.
    Position,
    Poses,
    Movement,
    /// Alignment of movement with the beat of the sound.
    Beat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    Yes,
    No,
    Inconclusive,
}

#[derive(Clone, Debug, Serialize)]
pub struct Vote {
    pub metric: String,
    pub aspect: Aspect,
    pub against: PredictorKind,
    pub answer: Answer,
    /// Gain in the unit of the metric with its simultaneous interval over all votes; below 0: worse.
    pub gain: Estimate,
    /// p value, adjusted for all votes of the conclusion.
    pub p: f64,
}

/// Answer to a question with the votes behind it.
#[derive(Clone, Debug, Serialize)]
pub struct Conclusion {
    /// One of `yes`, `no`, `in part`, `undecided`.
    pub word: &'static str,
    /// Full sentence without the votes.
    pub sentence: String,
    pub votes: Vec<Vote>,
}

pub fn better_than_constant_pose(table: &Table, own: &PredictorRow) -> Conclusion {
    let question = "Is the prediction better than a constant pose?";
    let aspects = [Aspect::Position, Aspect::Poses, Aspect::Movement];
    let votes = votes(table, own, &aspects, |index| better_constant_pose(table, index));
    if let Some(reason) = inconclusive_because(table, &votes) {
        return undecided(question, &reason);
    }
    let of = |aspect: Aspect| votes.iter().filter(move |vote| vote.aspect == aspect);
    let others = || votes.iter().filter(|vote| vote.aspect != Aspect::Position);
    let rest = match combined(others()) {
        // A constant pose may fit better in its poses, but it has no movement.
        Answer::Yes if of(Aspect::Movement).next().is_some() && combined(of(Aspect::Movement)) != Answer::Yes => {
            Answer::Inconclusive
        }
        rest => rest,
    };
    // `None`: the convention has no metric of this aspect.
    let position = of(Aspect::Position).next().map(|_| combined(of(Aspect::Position)));
    let rest = others().next().map(|_| rest);
    let position_text = match position {
        Some(Answer::Yes) => "its joint positions are closer to the truth than a constant pose",
        Some(Answer::No) => "the joint positions of a constant pose are closer to the truth",
        Some(Answer::Inconclusive) => {
            "its joint positions are not shown to be closer to the truth than a constant pose"
        }
        None => "no metric of this convention compares joint positions with a constant pose",
    };
    let motion_text = match rest {
        Some(Answer::Yes) => "its poses and movements are more like the speaker's",
        Some(Answer::No) => "its poses or movements are less like the speaker's",
        Some(Answer::Inconclusive) => "its poses and movements are not shown to be more like the speaker's",
        None => "no metric of this convention compares poses and movements",
    };
    let answers = [position, rest];
    let word = match answers.iter().filter(|answer| **answer == Some(Answer::Yes)).count() {
        2 => "yes",
        1 => "in part",
        _ if answers.contains(&Some(Answer::No)) => "no",
        _ => "undecided",
    };
    let oracle = table.row(PredictorKind::MeanPose).is_some_and(|row| row.description.contains("oracle"));
    let oracle = if oracle { " (The constant pose is computed from the truth itself, which favours it.)" } else { "" };
    Conclusion {
        word,
        sentence: format!("{question} {}: {position_text}; {motion_text}.{oracle}", capitalised(word)),
        votes,
    }
}

fn better_constant_pose(table: &Table, index: usize) -> Option<&PredictorRow> {
    let better = |a: &PredictorRow, b: &PredictorRow| table.gain(a, b, index) >= 0.0;
    let constant_poses =
        [PredictorKind::MeanPose, PredictorKind::MedianPose].into_iter().filter_map(|kind| table.row(kind));
    constant_poses.reduce(|a, b| if better(a, b) { a } else { b })
}

/// Comparison of the prediction with the better of the constant poses in a single metric of any aspect; `None` without
/// a finite difference or with too few blocks.
pub fn against_constant_pose(table: &Table, own: &PredictorRow, index: usize) -> Option<Answer> {
    let tested = table.tested_gains(own, &[(index, better_constant_pose(table, index)?)]).into_iter().next()?;
    (tested.mean.value.is_finite() && table.n_blocks >= MIN_BLOCKS).then(|| answer(&tested))
}

/// Differences below this are rounding errors of f32 positions, in any unit of a metric (mm, %, shares).
const NEGLIGIBLE: f64 = 1e-4;

fn answer(tested: &TestedDifference) -> Answer {
    if tested.mean.value.abs() < NEGLIGIBLE {
        return Answer::Inconclusive;
    }
    match (tested.mean.interval.excludes_zero(), tested.mean.value > 0.0) {
        (true, true) => Answer::Yes,
        (true, false) => Answer::No,
        (false, _) => Answer::Inconclusive,
    }
}

/// Compares the prediction with a mismatched one: its own shifted prediction if there is one, since the motion of
/// another clip also differs in posture.
pub fn depends_on_audio(table: &Table, own: &PredictorRow) -> Conclusion {
    let question = "Does the prediction depend on the audio?";
    let of_own =
        |kind: PredictorKind| table.rows.iter().find(|row| row.kind == kind && row.checkpoint == own.checkpoint);
    let other = of_own(PredictorKind::LatePrediction).or_else(|| of_own(PredictorKind::MismatchedPrediction));
    let Some(other) = other else { return undecided(question, "there is no mismatched prediction to compare with") };
    let votes = votes(table, own, &[Aspect::Position, Aspect::Beat], |_| Some(other));
    if let Some(reason) = inconclusive_because(table, &votes) {
        return undecided(question, &reason);
    }
    let (word, description) = match combined(votes.iter()) {
        Answer::Yes => {
            ("yes", "its motion matches its own audio better than motion generated for other audio or another time")
        }
        Answer::No => ("no", "motion generated for other audio or another time matches its audio better"),
        Answer::Inconclusive if votes.iter().any(|vote| vote.answer == Answer::Yes) => {
            ("in part", "its motion matches its own audio better in some metrics and worse in others")
        }
        Answer::Inconclusive => (
            "undecided",
            "its motion is not shown to match its own audio better than motion generated for other audio or another time",
        ),
    };
    Conclusion { word, sentence: format!("{question} {}: {description}.", capitalised(word)), votes }
}

fn undecided(question: &str, reason: &str) -> Conclusion {
    Conclusion { word: "undecided", sentence: format!("{question} Undecided: {reason}."), votes: Vec::new() }
}

/// Reason why no conclusion can be drawn from these votes, if any.
fn inconclusive_because(table: &Table, votes: &[Vote]) -> Option<String> {
    if table.trained_on {
        return Some("the model was trained on these clips; evaluate another split".to_owned());
    }
    if votes.is_empty() {
        return Some("no metric of this convention measures it".to_owned());
    }
    let (n_blocks, secs) = (table.n_blocks, table.block_length.secs);
    let (blocks, are) = (counted(n_blocks, "block"), if n_blocks == 1 { "is" } else { "are" });
    (n_blocks < MIN_BLOCKS).then(|| {
        let missing_secs = (MIN_BLOCKS as f64 * secs - table.secs).max(secs);
        format!(
            "{blocks} of about {secs:.1} s {are} too few for a conclusion (at least {MIN_BLOCKS} are needed); hold out \
             about {} more motion",
            length(missing_secs)
        )
    })
}

/// Votes of the metrics of these aspects; `against` gives the row that each metric is compared with.
fn votes<'a>(
    table: &'a Table,
    own: &PredictorRow,
    aspects: &[Aspect],
    against: impl Fn(usize) -> Option<&'a PredictorRow>,
) -> Vec<Vote> {
    let considered = |index: usize| {
        let aspect = aspect(table, index).filter(|aspect| aspects.contains(aspect))?;
        let other = against(index)?;
        table.gain(own, other, index).is_finite().then_some((aspect, (index, other)))
    };
    let (aspects, compared): (Vec<_>, Vec<_>) = (0..table.definitions.len()).filter_map(considered).unzip();
    let tested = table.tested_gains(own, &compared);
    let vote = |((aspect, (index, other)), tested): ((Aspect, (usize, &PredictorRow)), TestedDifference)| Vote {
        metric: labels::name(&table.definitions[index]),
        aspect,
        against: other.kind,
        answer: answer(&tested),
        gain: Estimate { value: table.gain(own, other, index), ..tested.mean },
        p: tested.p,
    };
    aspects.into_iter().zip(compared).zip(tested).map(vote).collect()
}

/// Aspect of a metric; `None` for metrics that are redundant or do not vote.
fn aspect(table: &Table, index: usize) -> Option<Aspect> {
    let definition = &table.definitions[index];
    let is_first = |start: &str| table.definitions.iter().position(|d| d.name.starts_with(start)) == Some(index);
    let starts = |start: &str| definition.name.starts_with(start);
    // The metric for the whole body, or else for the first part that has a value.
    let has_name = |i: &usize| table.definitions[*i].name == definition.name && table.is_shown(*i);
    let is_main_part = (0..table.definitions.len()).find(has_name) == Some(index);
    match definition.better {
        Better::Neither => None,
        // Only the first of several thresholds, planes and parts.
        _ if starts("pck") => is_first("pck").then_some(Aspect::Position),
        _ if starts("maje") => Some(Aspect::Position),
        _ if starts("mpjpe") => is_first("mpjpe").then_some(Aspect::Position),
        _ if starts("frechet") => is_main_part.then_some(Aspect::Poses),
        _ if starts("hellinger") => is_first("hellinger").then_some(Aspect::Movement),
        _ if starts("jerk") => is_first("jerk").then_some(Aspect::Movement),
        _ if starts("beat") => is_main_part.then_some(Aspect::Beat),
        _ => None,
    }
}

/// Combined answer: yes or no if some votes agree and none contradicts.
fn combined<'a>(votes: impl Iterator<Item = &'a Vote>) -> Answer {
    let (mut yes, mut no) = (false, false);
    for vote in votes {
        yes |= vote.answer == Answer::Yes;
        no |= vote.answer == Answer::No;
    }
    match (yes, no) {
        (true, false) => Answer::Yes,
        (false, true) => Answer::No,
        _ => Answer::Inconclusive,
    }
}

impl Conclusion {
    /// Sentence, followed by a line for each kind of vote, such as `better: a; b`.
    pub fn text(&self) -> String {
        let of = |answer: Answer| {
            let names: Vec<&str> =
                self.votes.iter().filter(|v| v.answer == answer).map(|v| v.metric.as_str()).collect();
            names.join("; ")
        };
        let parts =
            [(Answer::Yes, "better"), (Answer::No, "worse"), (Answer::Inconclusive, "no significant difference")];
        let parts = parts.into_iter().map(|(answer, word)| (word, of(answer))).filter(|(_, names)| !names.is_empty());
        parts.fold(self.sentence.clone(), |text, (word, names)| format!("{text}\n  {word}: {names}"))
    }
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
