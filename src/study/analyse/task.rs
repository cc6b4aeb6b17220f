//! Analysis of one task: the cells of its design, its families of tests, the agreement of its participants.

use super::figure::FigureMethod;
use super::figures::{FigureSet, adjust};
use super::outcome::{BinaryVote, Numbering, binary, conditions, differences, measure, scores};
use super::pair::{overall, pairs, score_table};
use super::result::{Conclusion, FigureSettings, PairAnalysis, ShareAnalysis, ShareMeasure, TaskAnalysis};
use super::share::{ShareCell, conclude, share};
use super::strength::strengths;
use super::verdict::verdicts;
use crate::plan::TaskDesign;
use crate::stats::cluster::crossed::crossed_difference;
use crate::stats::cluster::participants::participant_differences;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::krippendorff::{MeasurementScale, alpha};
use crate::stats::rank::{ZeroDifferences, signed_rank};
use crate::vote::StudyVote;
use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};

/// Analysis of the votes of a task, which must have one design.
pub fn task(name: &str, votes: &[&StudyVote], settings: &FigureSettings) -> Result<TaskAnalysis> {
    let design = votes.first().with_context(|| format!("the task {name} has no vote"))?.design;
    if let Some(other) = votes.iter().find(|vote| vote.design != design) {
        bail!("the task {name} has votes of two designs ({design:?}, {:?}); name them as two tasks", other.design)
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
        verdicts: Vec::new(),
        shares: Vec::new(),
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
    analysis.verdicts = verdicts(&analysis, settings);
    Ok(analysis)
}

/// Shares of all votes, by speaker and by condition.
fn binary_task(
    analysis: &mut TaskAnalysis,
    votes: &[&StudyVote],
    numbering: &Numbering,
    measure: ShareMeasure,
    settings: &FigureSettings,
) {
    let all = binary(votes, numbering, measure);
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
        true => (ShareMeasure::TakenForReal, binary(votes, numbering, ShareMeasure::TakenForReal)),
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

fn pick<'v>(votes: &[BinaryVote<'v>], is_kept: impl Fn(&BinaryVote) -> bool) -> Vec<BinaryVote<'v>> {
    votes.iter().filter(|vote| is_kept(vote)).cloned().collect()
}

/// Adds cells whose tests are adjusted as one family.
fn family(analysis: &mut TaskAnalysis, level: f64, cells: impl FnOnce(&TaskAnalysis) -> Vec<ShareAnalysis>) {
    let mut cells = cells(analysis);
    adjust(&mut cells.iter_mut().map(|cell| &mut cell.figures).collect::<Vec<_>>());
    cells.iter_mut().for_each(|cell| conclude(cell, level));
    analysis.shares.extend(cells);
}

/// Differences between conditions in how often single films were taken for real.
fn single_pairs(votes: &[BinaryVote], conditions: &[&str], settings: &FigureSettings) -> Vec<PairAnalysis> {
    let of = |name: &str| -> Vec<ClipVote> {
        votes.iter().filter(|vote| vote.condition == name).map(|vote| vote.vote).collect()
    };
    let names = conditions.iter().enumerate().flat_map(|(k, a)| conditions[k + 1..].iter().map(move |b| [*a, *b]));
    let pair = |[first, second]: [&str; 2]| {
        let [a, b] = [first, second].map(of);
        let mut found = FigureSet::default();
        if let Some(estimate) = found.known(FigureMethod::Crossed, crossed_difference(&a, &b)) {
            found.add_estimate(FigureMethod::Crossed, &estimate, 0.0, settings.confidence);
        }
        let ranked = participant_differences(&a, &b).and_then(|means| signed_rank(&means, ZeroDifferences::Wilcox));
        found.add_test(FigureMethod::Wilcoxon, ranked.map(|test| test.p));
        let mean = |votes: &[ClipVote]| votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len().max(1) as f64;
        let numbers = |of: fn(&ClipVote) -> usize| a.iter().chain(&b).map(of).collect::<BTreeSet<_>>().len();
        PairAnalysis {
            first: first.to_owned(),
            second: second.to_owned(),
            n_votes: a.len() + b.len(),
            n_participants: numbers(|vote| vote.participant),
            n_clips: numbers(|vote| vote.clip),
            orders: None,
            steps: None,
            difference: mean(&a) - mean(&b),
            figures: found,
            conclusion: Conclusion::Untested,
        }
    };
    let mut found: Vec<PairAnalysis> = names.map(pair).collect();
    adjust(&mut found.iter_mut().map(|pair| &mut pair.figures).collect::<Vec<_>>());
    found.iter_mut().for_each(|pair| super::pair::conclude(pair, settings.level()));
    found
}

/// Preferences and sliders: pairs, scores, strengths.
fn compared_task(analysis: &mut TaskAnalysis, votes: &[&StudyVote], numbering: &Numbering, settings: &FigureSettings) {
    if analysis.design == TaskDesign::Sliders {
        analysis.scores = score_table(votes, numbering, &analysis.conditions, settings);
        analysis.conditions = analysis.scores.iter().map(|row| row.condition.clone()).collect();
        match overall(votes, numbering, &analysis.conditions) {
            Ok(test) => analysis.overall = Some(test),
            Err(error) => analysis.missing.push(format!("{}: {error}", FigureMethod::Friedman.name())),
        }
    }
    analysis.pairs = pairs(votes, numbering, &analysis.conditions, analysis.design, settings);
    match strengths(votes, numbering, &analysis.conditions, settings) {
        Ok(found) => analysis.strengths = found,
        Err(error) => analysis.missing.push(format!("{}: {error}", FigureMethod::BradleyTerry.name())),
    }
}

/// Krippendorff's alpha: participants rate clips, each condition or pair of them by itself.
fn agreement(
    votes: &[&StudyVote],
    numbering: &Numbering,
    analysis: &TaskAnalysis,
) -> Result<f64, crate::stats::error::StatisticsError> {
    let names = &analysis.conditions;
    let (scale, groups): (_, Vec<Vec<ClipVote>>) = match analysis.design {
        TaskDesign::Sliders => {
            (MeasurementScale::Interval, names.iter().map(|name| scores(votes, numbering, name)).collect())
        }
        TaskDesign::Preference => {
            let pairs = names.iter().enumerate().flat_map(|(k, a)| names[k + 1..].iter().map(move |b| (a, b)));
            (MeasurementScale::Ordinal, pairs.map(|(a, b)| differences(votes, numbering, a, b)).collect())
        }
        design => {
            // Of single films, answers are compared, not whether they were right.
            let measure = match design {
                TaskDesign::TuringSingle => ShareMeasure::TakenForReal,
                TaskDesign::Mismatch => ShareMeasure::MatchedChosen,
                _ => ShareMeasure::GeneratedChosen,
            };
            let mut groups: BTreeMap<&str, Vec<ClipVote>> = BTreeMap::new();
            let all = binary(votes, numbering, measure);
            all.iter().for_each(|vote| groups.entry(vote.condition).or_default().push(vote.vote));
            (MeasurementScale::Nominal, groups.into_values().collect())
        }
    };
    let mut units: BTreeMap<(usize, usize), Vec<Option<f64>>> = BTreeMap::new();
    for (group, votes) in groups.iter().enumerate() {
        votes.iter().for_each(|vote| units.entry((group, vote.clip)).or_default().push(Some(vote.score)));
    }
    alpha(&units.into_values().collect::<Vec<_>>(), scale)
}
