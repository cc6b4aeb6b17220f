//! Exclusion of votes by predefined rules, with the number that each rule alone excludes.

use super::votes::read::VotesRead;
use crate::file::ExclusionRules;
use crate::plan::TrialPhase;
use crate::vote::StudyVote;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Summary of the exclusions. Counts refer to votes of the main phase.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExclusionSummary {
    /// Whether the rules were registered before data collection.
    pub registered: bool,
    pub n_participants: usize,
    pub n_votes: usize,
    pub n_participants_analysed: usize,
    pub n_votes_analysed: usize,
    pub rules: Vec<ExclusionCount>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExclusionCount {
    pub rule: String,
    /// Participants excluded entirely.
    pub n_participants: usize,
    /// Votes excluded, including those of excluded participants.
    pub n_votes: usize,
    /// Reason why the rule cannot be applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unknown: Option<String>,
}

struct ExclusionTest<'r> {
    description: String,
    field: &'static str,
    predicate: Excluded<'r>,
}

enum Excluded<'r> {
    Participants(BTreeSet<&'r str>),
    Votes(Box<dyn Fn(&StudyVote) -> bool>),
}

/// Votes of the main phase that no rule excludes, and a summary of the exclusions.
pub fn exclude<'v>(read: &'v VotesRead, rules: Option<&ExclusionRules>) -> (Vec<&'v StudyVote>, ExclusionSummary) {
    let main: Vec<&StudyVote> = read.votes.iter().filter(|vote| vote.phase == TrialPhase::Main).collect();
    let applied = rules.map(|rules| tests_of_rules(rules, &read.votes)).unwrap_or_default();
    let is_excluded = |rule: &ExclusionTest, vote: &StudyVote| match &rule.predicate {
        Excluded::Participants(names) => names.contains(vote.participant.as_str()),
        Excluded::Votes(predicate) => predicate(vote),
    };
    let count = |rule: &ExclusionTest| {
        let excluded: Vec<_> = main.iter().filter(|vote| is_excluded(rule, vote)).collect();
        let n_participants = match &rule.predicate {
            Excluded::Participants(_) => excluded.iter().map(|vote| &vote.participant).collect::<BTreeSet<_>>().len(),
            Excluded::Votes(_) => 0,
        };
        let unknown = read.absent.contains(&rule.field).then(|| format!("the votes have no column {}", rule.field));
        ExclusionCount { rule: rule.description.clone(), n_participants, n_votes: excluded.len(), unknown }
    };
    let n_participants =
        |votes: &[&StudyVote]| votes.iter().map(|vote| &vote.participant).collect::<BTreeSet<_>>().len();
    let counts = applied.iter().map(count).collect();
    let included: Vec<&StudyVote> =
        main.iter().copied().filter(|vote| !applied.iter().any(|rule| is_excluded(rule, vote))).collect();
    let summary = ExclusionSummary {
        registered: rules.is_some(),
        n_participants: n_participants(&main),
        n_votes: main.len(),
        n_participants_analysed: n_participants(&included),
        n_votes_analysed: included.len(),
        rules: counts,
    };
    (included, summary)
}

fn tests_of_rules<'v>(rules: &ExclusionRules, votes: &'v [StudyVote]) -> Vec<ExclusionTest<'v>> {
    let mut applied = Vec::new();
    let mut add = |description: String, field, predicate| applied.push(ExclusionTest { description, field, predicate });
    if let Some(n) = rules.failed_checks {
        let mut n_failed: BTreeMap<&str, u32> = BTreeMap::new();
        let is_failed = |vote: &&StudyVote| {
            vote.phase == TrialPhase::AttentionCheck && vote.expected.as_ref() != Some(&vote.response)
        };
        votes.iter().filter(is_failed).for_each(|vote| *n_failed.entry(&vote.participant).or_default() += 1);
        let names = n_failed.into_iter().filter(|(_, n_failed)| *n_failed >= n.max(1)).map(|(name, _)| name).collect();
        add(format!("failed {n} or more attention checks"), "phase", Excluded::Participants(names));
    }
    if rules.incomplete {
        let names = votes.iter().filter(|vote| !vote.completed).map(|vote| vote.participant.as_str()).collect();
        add("did not complete the session".to_owned(), "completed", Excluded::Participants(names));
    }
    if let Some(max_secs) = rules.stalled_secs {
        let predicate = Excluded::Votes(Box::new(move |vote| vote.stalled_secs > max_secs));
        add(format!("trial: playback stalled for more than {max_secs} s"), "stalled_secs", predicate);
    }
    if let Some(max_secs) = rules.unfocused_secs {
        let predicate = Excluded::Votes(Box::new(move |vote| vote.unfocused_secs > max_secs));
        add(format!("trial: page in background for more than {max_secs} s"), "unfocused_secs", predicate);
    }
    if rules.reloaded {
        let predicate = Excluded::Votes(Box::new(|vote| vote.reloads > 0));
        add("trial: page reloaded after a film began".to_owned(), "reloads", predicate);
    }
    applied
}

impl ExclusionSummary {
    pub fn any_excluded(&self) -> bool {
        self.n_votes_analysed < self.n_votes
    }
}
