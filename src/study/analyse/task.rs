//! Analysis of one task: the cells of its design, its families of tests, inter-rater agreement.

use super::conclusions::conclusions;
use super::outcome::{
    BinaryVote, Numbering, binary, clip_shares, conditions, differences, measure, name_pairs, scores,
};
use super::pair::{overall, pairs, score_table, single_pairs, strengths};
use super::result::{ShareAnalysis, ShareMeasure, StatisticSettings, TaskAnalysis};
use super::share::{ShareCell, conclude, share};
use super::statistic::{StatisticMethod, adjust};
use crate::plan::TaskDesign;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::estimate::StatisticsError;
use crate::stats::rank::{MeasurementScale, alpha};
use crate::vote::StudyVote;
use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};

/// Analyses the votes of a task, which must all have the same design.
///
/// # Errors
/// There are no votes, or votes of two designs.
pub fn task(name: &str, votes: &[&StudyVote], settings: &StatisticSettings) -> Result<TaskAnalysis> {
    let design = votes.first().with_context(|| format!("the task {name} has no votes"))?.design;
    if let Some(other) = votes.iter().find(|vote| vote.design != design) {
        bail!(
            "the task {name} has votes of two designs ({design:?}, {:?}): give each design a task name of its own",
            other.design
        )
    }
    let numbering = Numbering::new(votes);
    let speakers: BTreeSet<&str> = votes.iter().map(|vote| vote.speaker.as_str()).collect();
    let clips: BTreeSet<[&str; 2]> = votes.iter().map(|vote| [vote.speaker.as_str(), vote.clip.as_str()]).collect();
    let mut analysis = TaskAnalysis {
        task: name.to_owned(),
        design,
        n_votes: votes.len(),
        n_participants: votes.iter().map(|vote| &vote.participant).collect::<BTreeSet<_>>().len(),
        n_clips: clips.len(),
        conditions: conditions(votes),
        speakers: speakers.into_iter().filter(|name| !name.is_empty()).map(str::to_owned).collect(),
        conclusions: Vec::new(),
        shares: Vec::new(),
        clips: Vec::new(),
        scores: Vec::new(),
        pairs: Vec::new(),
        overall: None,
        strengths: Vec::new(),
        agreement: None,
        missing: Vec::new(),
    };
    match measure(design) {
        Some(measure) => binary_task(&mut analysis, votes, &numbering, measure, settings),
        None => compared_task(&mut analysis, votes, &numbering, settings),
    }
    match agreement(votes, &numbering, &analysis) {
        Ok(alpha) => analysis.agreement = Some(alpha),
        Err(error) => analysis.missing.push(format!("Krippendorff's alpha: {error}")),
    }
    analysis.conclusions = conclusions(&analysis, settings);
    Ok(analysis)
}

/// Analyses proportions of all votes, by speaker and by condition.
fn binary_task(
    analysis: &mut TaskAnalysis,
    votes: &[&StudyVote],
    numbering: &Numbering,
    measure: ShareMeasure,
    settings: &StatisticSettings,
) {
    let all = binary(votes, numbering, measure);
    analysis.clips = clip_shares(&all, numbering);
    let cell = |measure, speaker: Option<&str>, condition: Option<&str>, votes: Vec<BinaryVote>| {
        let [speaker, condition] = [speaker, condition].map(|name| name.map(str::to_owned));
        share(&ShareCell { measure, speaker, condition, votes }, settings)
    };
    analysis.shares.push(cell(measure, None, None, all.clone()));
    if analysis.speakers.len() > 1 {
        let of_speaker = |name: &String| cell(measure, Some(name), None, pick(&all, |vote| vote.speaker == name));
        family(analysis, settings.level(), |analysis| analysis.speakers.iter().map(of_speaker).collect());
    }
    let is_single = analysis.design == TaskDesign::TuringSingle;
    let (measure, all) = match is_single {
        true => (ShareMeasure::JudgedReal, binary(votes, numbering, ShareMeasure::JudgedReal)),
        false => (measure, all),
    };
    let shown: BTreeSet<&str> = all.iter().map(|vote| vote.condition).collect();
    if shown.len() > 1 {
        let of_condition = |name: &&str| cell(measure, None, Some(name), pick(&all, |vote| vote.condition == *name));
        family(analysis, settings.level(), |_| shown.iter().map(of_condition).collect());
    }
    if is_single {
        analysis.pairs = single_pairs(&all, &shown.into_iter().collect::<Vec<_>>(), settings);
    }
}

fn pick<'v>(votes: &[BinaryVote<'v>], is_included: impl Fn(&BinaryVote) -> bool) -> Vec<BinaryVote<'v>> {
    votes.iter().filter(|vote| is_included(vote)).cloned().collect()
}

/// Adds cells whose tests are adjusted as one family.
fn family(analysis: &mut TaskAnalysis, level: f64, cells: impl FnOnce(&TaskAnalysis) -> Vec<ShareAnalysis>) {
    let mut cells = cells(analysis);
    adjust(&mut cells.iter_mut().map(|cell| &mut cell.statistics).collect::<Vec<_>>());
    cells.iter_mut().for_each(|cell| conclude(cell, level));
    analysis.shares.extend(cells);
}

/// Analyses preferences and sliders: pairs, scores, strengths.
fn compared_task(
    analysis: &mut TaskAnalysis,
    votes: &[&StudyVote],
    numbering: &Numbering,
    settings: &StatisticSettings,
) {
    if analysis.design == TaskDesign::Sliders {
        analysis.scores = score_table(votes, numbering, &analysis.conditions, settings);
        analysis.conditions = analysis.scores.iter().map(|row| row.condition.clone()).collect();
        match overall(votes, numbering, &analysis.conditions) {
            Ok(test) => analysis.overall = Some(test),
            Err(error) => analysis.missing.push(format!("{}: {error}", StatisticMethod::Friedman.name())),
        }
    }
    analysis.pairs = pairs(votes, numbering, &analysis.conditions, analysis.design, settings);
    match strengths(votes, numbering, &analysis.conditions, settings) {
        Ok(found) => analysis.strengths = found,
        Err(error) => analysis.missing.push(format!("{}: {error}", StatisticMethod::BradleyTerry.name())),
    }
}

/// Krippendorff's alpha: participants are raters, and each combination of a clip with a condition or a pair is a unit.
fn agreement(votes: &[&StudyVote], numbering: &Numbering, analysis: &TaskAnalysis) -> Result<f64, StatisticsError> {
    let names = &analysis.conditions;
    let (scale, groups): (_, Vec<Vec<ClipVote>>) = match analysis.design {
        TaskDesign::Sliders => {
            (MeasurementScale::Interval, names.iter().map(|name| scores(votes, numbering, name)).collect())
        }
        TaskDesign::Preference => {
            let of_pair = |names| differences(votes, numbering, names);
            (MeasurementScale::Ordinal, name_pairs(names).map(of_pair).collect())
        }
        design => {
            // For single films, agreement is measured on the responses, not on their correctness.
            let measure = measure(design).filter(|measure| *measure != ShareMeasure::Correct);
            let measure = measure.unwrap_or(ShareMeasure::JudgedReal);
            let mut groups: BTreeMap<&str, Vec<ClipVote>> = BTreeMap::new();
            let all = binary(votes, numbering, measure);
            all.iter().for_each(|vote| groups.entry(vote.condition).or_default().push(vote.vote));
            (MeasurementScale::Nominal, groups.into_values().collect())
        }
    };
    let mut units: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for (group, votes) in groups.iter().enumerate() {
        votes.iter().for_each(|vote| units.entry((group, vote.clip)).or_default().push(vote.score));
    }
    alpha(&units.into_values().collect::<Vec<_>>(), scale)
}
