//! Assignment of videos to splits. Splits named in the configuration take precedence over recorded ones; new videos
//! fill the splits towards their shares, the longest first, so the result does not depend on their order and adding
//! videos moves no other. Videos that share sound stay in one split; in a division by time, shared sound that would be
//! in two splits is excluded from the video that is assigned later.

use super::blocks::{self, Span};
use super::record::{RecordedSplit, SplitBy};
use crate::config::choices::SplitUnit;
use crate::shared_sound::SharedSound;
use orator_base::types::split::{Split, TimeBlock};
use std::cmp::Ordering;
use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitPlan {
    /// Unit of the division: whole videos, or time blocks.
    pub unit: SplitUnit,
    /// Shares of the accepted seconds, 0..1; training gets the rest.
    pub validation: f64,
    pub test: f64,
    /// Gap between two splits of a video, seconds.
    pub guard_secs: f64,
    /// Minimum length of a block, accepted seconds.
    pub min_block_secs: f64,
}

/// Video to be assigned to a split.
#[derive(Clone, Debug)]
pub struct Unassigned<'a> {
    pub name: &'a str,
    pub content: &'a str,
    pub duration_secs: f64,
    /// Accepted spans, in order.
    pub accepted: Vec<Span>,
    /// Split named in the configuration.
    pub named: Option<Split>,
    /// Recorded split; `None`: a new video.
    pub recorded: Option<&'a RecordedSplit>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Assignment {
    In(Split, SplitBy),
    /// Time blocks in several splits.
    Blocks(Vec<TimeBlock>),
    /// No split, since the video shares sound with videos in different splits; the longest shared sound first.
    Excluded(Vec<SharedSound>),
}

impl Unassigned<'_> {
    fn secs(&self) -> f64 {
        self.accepted.iter().map(|(start, end)| end - start).sum()
    }

    /// Order of assignment: the longest first, ties by content hash, then by name.
    fn order(&self, other: &Self) -> Ordering {
        other.secs().total_cmp(&self.secs()).then(self.content.cmp(other.content)).then(self.name.cmp(other.name))
    }
}

/// Assigns all videos; the result is in the order of `videos`.
pub fn assign(videos: &[Unassigned], shared: &[SharedSound], plan: &SplitPlan) -> Vec<Assignment> {
    let total_secs = videos.iter().map(Unassigned::secs).sum();
    let fill = SplitFill::new(plan.validation, plan.test, total_secs);
    let mut assigner =
        Assigner { videos, shared, plan, fill, blocks_by_video: BTreeMap::new(), assignments: BTreeMap::new() };
    let mut new: Vec<usize> = Vec::new();
    for (at, video) in videos.iter().enumerate() {
        match (video.named, video.recorded) {
            (Some(split), _) => assigner.record_assignment(at, Assignment::In(split, SplitBy::Name)),
            (None, Some(RecordedSplit { split: Some(split), by, .. })) => {
                assigner.record_assignment(at, Assignment::In(*split, by.clone()));
            }
            (None, Some(RecordedSplit { split: None, blocks, .. })) => {
                assigner.record_assignment(at, Assignment::Blocks(blocks.clone()));
            }
            // A video without accepted seconds; its split does not matter.
            (None, None) if video.secs() <= 0.0 => {
                assigner.assignments.insert(at, Assignment::In(Split::Train, SplitBy::Share));
            }
            (None, None) => new.push(at),
        }
    }
    new.sort_by(|&a, &b| videos[a].order(&videos[b]));
    match plan.unit {
        SplitUnit::Time => assigner.by_time(&new),
        SplitUnit::Video | SplitUnit::Auto => assigner.by_video(&new),
    }
    let mut assignments = assigner.assignments;
    (0..videos.len()).map(|at| assignments.remove(&at).unwrap_or(Assignment::Excluded(Vec::new()))).collect()
}

struct Assigner<'a> {
    videos: &'a [Unassigned<'a>],
    shared: &'a [SharedSound],
    plan: &'a SplitPlan,
    fill: SplitFill,
    /// Blocks of each assigned video, by name.
    blocks_by_video: BTreeMap<&'a str, Vec<TimeBlock>>,
    assignments: BTreeMap<usize, Assignment>,
}

impl<'a> Assigner<'a> {
    fn record_assignment(&mut self, at: usize, assignment: Assignment) {
        let video = &self.videos[at];
        let blocks = match &assignment {
            Assignment::In(split, _) => vec![TimeBlock::entire(*split)],
            Assignment::Blocks(blocks) => blocks.clone(),
            Assignment::Excluded(_) => Vec::new(),
        };
        for (block, (start, end)) in
            blocks.iter().flat_map(|block| video.accepted.iter().map(move |accepted| (block, accepted)))
        {
            let secs = end.min(block.end_secs) - start.max(block.start_secs);
            block.split.into_iter().for_each(|split| self.fill.add(split, secs.max(0.0)));
        }
        if !blocks.is_empty() {
            self.blocks_by_video.insert(video.name, blocks);
        }
        self.assignments.insert(at, assignment);
    }

    /// Assigned videos that share sound with the video at `at`, the longest shared sound first; with each, its split,
    /// or `None` if it is in several.
    fn partners(&self, at: usize) -> Vec<(&'a SharedSound, Option<Split>)> {
        let name = self.videos[at].name;
        let split = |blocks: &Vec<TimeBlock>| match blocks.as_slice() {
            [whole] => whole.split,
            _ => None,
        };
        let partner = |shared: &'a SharedSound| Some((shared, split(self.blocks_by_video.get(shared.other(name)?)?)));
        let mut partners: Vec<_> = self.shared.iter().filter_map(partner).collect();
        partners.sort_by(|a, b| b.0.secs.total_cmp(&a.0.secs).then(a.0.cmp_names(b.0)));
        partners
    }

    /// Assigns whole videos; videos that share sound are assigned together.
    fn by_video(&mut self, new: &[usize]) {
        let mut groups = self.groups(new);
        let secs = |group: &Vec<usize>| -> f64 { group.iter().map(|&at| self.videos[at].secs()).sum() };
        groups.sort_by(|a, b| secs(b).total_cmp(&secs(a)).then(self.videos[a[0]].order(&self.videos[b[0]])));
        let n_groups = groups.len();
        for (n, group) in groups.into_iter().enumerate() {
            let mut splits: Vec<Option<Split>> =
                group.iter().flat_map(|&at| self.partners(at)).map(|(_, split)| split).collect();
            splits.sort();
            splits.dedup();
            let split = match splits.as_slice() {
                [] => Some(self.fill.furthest_below_share(n_groups - n)),
                [split] => *split,
                _ => None,
            };
            for at in group {
                let partners = self.partners(at);
                let of = |shared: &SharedSound| shared.other(self.videos[at].name).unwrap_or_default().to_owned();
                let assignment = match (partners.as_slice(), split) {
                    ([], split) => {
                        let split = split.unwrap_or_else(|| self.fill.furthest_below_share(n_groups - n));
                        Assignment::In(split, SplitBy::Share)
                    }
                    ([(first, Some(split)), rest @ ..], _) if rest.iter().all(|(_, other)| *other == Some(*split)) => {
                        Assignment::In(*split, SplitBy::SoundOf(of(first)))
                    }
                    (several, _) => Assignment::Excluded(several.iter().map(|(shared, _)| (*shared).clone()).collect()),
                };
                self.record_assignment(at, assignment);
            }
        }
    }

    /// Groups of new videos that are connected by shared sound, each group sorted by `order`.
    fn groups(&self, new: &[usize]) -> Vec<Vec<usize>> {
        let mut ungrouped = new.to_vec();
        let mut groups = Vec::new();
        while !ungrouped.is_empty() {
            let mut group = vec![ungrouped.remove(0)];
            let mut next = 0;
            while next < group.len() {
                let name = self.videos[group[next]].name;
                let shares = |&mut at: &mut usize| {
                    self.shared.iter().any(|shared| shared.other(name) == Some(self.videos[at].name))
                };
                group.extend(ungrouped.extract_if(.., shares));
                next += 1;
            }
            group.sort_by(|&a, &b| self.videos[a].order(&self.videos[b]));
            groups.push(group);
        }
        groups
    }

    /// Divides each long enough video into time blocks; a shorter one is assigned whole, unless a split would be empty.
    fn by_time(&mut self, new: &[usize]) {
        let SplitPlan { guard_secs, min_block_secs, .. } = *self.plan;
        for (n, &at) in new.iter().enumerate() {
            let video = &self.videos[at];
            let (secs, duration_secs, n_left) = (video.secs(), video.duration_secs, new.len() - n);
            let empty = self.fill.empty();
            let forced = || {
                // This video covers the empty splits that the following videos are too few to fill, those with the
                // largest share first; fewer if the blocks would be too short.
                let n_splits = (empty.len() + 1).saturating_sub(n_left);
                let lengths = (2..=n_splits)
                    .rev()
                    .find_map(|n| blocks::lengths(secs, &empty[..n], guard_secs, min_block_secs, true))?;
                Some(blocks::consecutive(&video.accepted, duration_secs, &lengths, guard_secs))
            };
            let cut = blocks::cut(&video.accepted, duration_secs, &self.fill.shares(), guard_secs, min_block_secs)
                .or_else(forced);
            let partners = self.partners(at);
            let whole = || match partners.first() {
                Some((shared, Some(split))) => {
                    let of = shared.other(video.name).unwrap_or_default().to_owned();
                    Assignment::In(*split, SplitBy::SoundOf(of))
                }
                _ => Assignment::In(self.fill.furthest_below_share(n_left), SplitBy::Share),
            };
            let assignment = cut.map_or_else(whole, Assignment::Blocks);
            let assignment = self.without_shared(at, assignment);
            self.record_assignment(at, assignment);
        }
    }

    /// Removes from the assignment the sound that assigned videos have in other splits.
    fn without_shared(&self, at: usize, assignment: Assignment) -> Assignment {
        let video = &self.videos[at];
        let own = match &assignment {
            Assignment::In(split, _) => {
                vec![TimeBlock { end_secs: video.duration_secs, ..TimeBlock::entire(*split) }]
            }
            Assignment::Blocks(blocks) => blocks.clone(),
            Assignment::Excluded(_) => return assignment,
        };
        let mut holes: Vec<Span> = Vec::new();
        for (shared, _) in self.partners(at) {
            let (own_secs, other_secs) =
                if shared.a == video.name { (shared.a_secs, shared.b_secs) } else { (shared.b_secs, shared.a_secs) };
            let other = shared.other(video.name).and_then(|other| self.blocks_by_video.get(other));
            let span = (own_secs, own_secs + shared.secs);
            let found = other.map(|other| blocks::conflicts(&own, span, other, other_secs - own_secs));
            holes.extend(found.into_iter().flatten().map(|(span, ..)| span));
        }
        if holes.is_empty() { assignment } else { Assignment::Blocks(blocks::without(&own, &holes)) }
    }
}

/// Seconds in each split, compared with its share of the total.
#[derive(Clone, Debug, PartialEq)]
struct SplitFill {
    /// Split, its share 0..1, and its seconds; splits with a share of 0 are omitted.
    splits: Vec<(Split, f64, f64)>,
    total_secs: f64,
}

impl SplitFill {
    /// Empty splits for `total_secs` in total, with the given shares of validation and test.
    pub(crate) fn new(validation: f64, test: f64, total_secs: f64) -> Self {
        let shares = [(Split::Train, 1.0 - validation - test), (Split::Validation, validation), (Split::Test, test)];
        let splits = shares.into_iter().filter(|(_, share)| *share > 0.0).map(|(split, share)| (split, share, 0.0));
        Self { splits: splits.collect(), total_secs }
    }

    pub(crate) fn add(&mut self, split: Split, secs: f64) {
        self.splits.iter_mut().filter(|(other, ..)| *other == split).for_each(|(_, _, filled)| *filled += secs);
    }

    pub(crate) fn shares(&self) -> Vec<(Split, f64)> {
        self.splits.iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Splits with 0 seconds and their shares, the largest share first.
    pub(crate) fn empty(&self) -> Vec<(Split, f64)> {
        let mut empty: Vec<_> = self.splits.iter().filter(|(.., filled)| *filled <= 0.0).collect();
        empty.sort_by(|a, b| b.1.total_cmp(&a.1));
        empty.into_iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Split that is the most seconds below its share. If `n_left`, the number of videos still to be assigned, is not
    /// larger than the number of empty splits, an empty one.
    pub(crate) fn furthest_below_share(&self, n_left: usize) -> Split {
        let empty = self.empty();
        let is_allowed = |split: Split| n_left > empty.len() || empty.iter().any(|(other, _)| *other == split);
        let missing_secs = |(_, share, filled): &(Split, f64, f64)| share * self.total_secs - filled;
        // Ties go to the first split.
        let larger = |a: Option<(Split, f64)>, b: (Split, f64)| Some(a.filter(|a| a.1 >= b.1).unwrap_or(b));
        let candidates =
            self.splits.iter().filter(|(split, ..)| is_allowed(*split)).map(|entry| (entry.0, missing_secs(entry)));
        candidates.fold(None, larger).map_or(Split::Train, |(split, _)| split)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_videos_leave_no_split_empty() {
        let filled = |n: usize| -> Vec<Split> {
            let mut fill = SplitFill::new(0.15, 0.15, n as f64);
            let next = |k: usize| {
                let split = fill.furthest_below_share(n - k);
                fill.add(split, 1.0);
                split
            };
            (0..n).map(next).collect()
        };
        assert_eq!(filled(1), [Split::Train]);
        assert_eq!(filled(2), [Split::Train, Split::Validation]);
        assert_eq!(filled(3), [Split::Train, Split::Validation, Split::Test]);
        assert_eq!(filled(4), [Split::Train, Split::Train, Split::Validation, Split::Test]);
    }
}
