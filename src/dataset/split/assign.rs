//! Assignment of videos to splits. Splits that the configuration names come first, then those on record; new videos fill
//! the splits toward their shares, the longest first, so that their order does not matter and adding videos moves no
//! other. Videos that share sound stay together; by time, sound that two splits share is left out of the later video.

use super::blocks::{self, Span};
use super::record::{RecordedSplit, SplitBy};
use crate::config::choices::SplitUnit;
use crate::shared_sound::SharedSound;
use orator_base::types::split::{Split, TimeBlock};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// How videos are divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitPlan {
    /// Whole videos, or blocks of time.
    pub unit: SplitUnit,
    /// Shares of the seconds, 0..1.
    pub validation: f64,
    pub test: f64,
    /// Gap between two splits of a video, seconds.
    pub guard_secs: f64,
    /// Shortest block, seconds.
    pub least_secs: f64,
}

/// Video without a split.
#[derive(Clone, Debug)]
pub struct Unassigned<'a> {
    pub name: &'a str,
    pub content: &'a str,
    pub duration_secs: f64,
    /// Kept stretches in seconds, in order.
    pub kept: Vec<Span>,
    /// Split named in the configuration.
    pub named: Option<Split>,
    /// Split on record; `None`: a new video.
    pub before: Option<&'a RecordedSplit>,
}

/// Assignment of a video.
#[derive(Clone, Debug, PartialEq)]
pub enum Assignment {
    In(Split, SplitBy),
    /// Blocks of time in several splits.
    Blocks(Vec<TimeBlock>),
    /// No split, since it shares sound with these videos of different splits; the longest first.
    Nowhere(Vec<SharedSound>),
}

impl Unassigned<'_> {
    fn secs(&self) -> f64 {
        self.kept.iter().map(|(start, end)| end - start).sum()
    }

    /// The longest first; of equals the one with the smaller hash.
    fn order(&self, other: &Self) -> Ordering {
        other.secs().total_cmp(&self.secs()).then(self.content.cmp(other.content)).then(self.name.cmp(other.name))
    }
}

/// Assignments of the videos, in their order.
pub fn assign(videos: &[Unassigned], shared: &[SharedSound], plan: &SplitPlan) -> Vec<Assignment> {
    let total_secs = videos.iter().map(Unassigned::secs).sum();
    let fill = Fill::new(plan.validation, plan.test, total_secs);
    let mut assigning = Assigning { videos, shared, plan, fill, placed: BTreeMap::new(), answers: BTreeMap::new() };
    let mut new: Vec<usize> = Vec::new();
    for (at, video) in videos.iter().enumerate() {
        match (video.named, video.before) {
            (Some(split), _) => assigning.place(at, Assignment::In(split, SplitBy::Name)),
            (None, Some(RecordedSplit { split: Some(split), by, .. })) => {
                assigning.place(at, Assignment::In(*split, by.clone()));
            }
            (None, Some(RecordedSplit { split: None, blocks, .. })) => {
                assigning.place(at, Assignment::Blocks(blocks.clone()));
            }
            // Nothing to divide.
            (None, None) if video.secs() <= 0.0 => {
                assigning.answers.insert(at, Assignment::In(Split::Train, SplitBy::Share));
            }
            (None, None) => new.push(at),
        }
    }
    new.sort_by(|&a, &b| videos[a].order(&videos[b]));
    match plan.unit {
        SplitUnit::Time => assigning.by_time(&new),
        SplitUnit::Video | SplitUnit::Auto => assigning.by_video(&new),
    }
    let mut answers = assigning.answers;
    (0..videos.len()).map(|at| answers.remove(&at).unwrap_or(Assignment::Nowhere(Vec::new()))).collect()
}

struct Assigning<'a> {
    videos: &'a [Unassigned<'a>],
    shared: &'a [SharedSound],
    plan: &'a SplitPlan,
    fill: Fill,
    /// Blocks of each video that has a place, by name.
    placed: BTreeMap<&'a str, Vec<TimeBlock>>,
    answers: BTreeMap<usize, Assignment>,
}

impl<'a> Assigning<'a> {
    fn place(&mut self, at: usize, answer: Assignment) {
        let video = &self.videos[at];
        let blocks = match &answer {
            Assignment::In(split, _) => vec![TimeBlock::whole(*split)],
            Assignment::Blocks(blocks) => blocks.clone(),
            Assignment::Nowhere(_) => Vec::new(),
        };
        for (block, (start, end)) in blocks.iter().flat_map(|block| video.kept.iter().map(move |kept| (block, kept))) {
            let secs = end.min(block.end_secs) - start.max(block.start_secs);
            block.split.into_iter().for_each(|split| self.fill.add(split, secs.max(0.0)));
        }
        if !blocks.is_empty() {
            self.placed.insert(video.name, blocks);
        }
        self.answers.insert(at, answer);
    }

    /// Placed videos that share sound with a video, with the split each is in as a whole; the longest first.
    fn partners(&self, at: usize) -> Vec<(&'a SharedSound, Option<Split>)> {
        let name = self.videos[at].name;
        let split = |blocks: &Vec<TimeBlock>| match blocks.as_slice() {
            [whole] => whole.split,
            _ => None,
        };
        let partner = |shared: &'a SharedSound| Some((shared, split(self.placed.get(shared.other(name)?)?)));
        let mut partners: Vec<_> = self.shared.iter().filter_map(partner).collect();
        partners.sort_by(|a, b| b.0.secs.total_cmp(&a.0.secs).then(a.0.cmp_names(b.0)));
        partners
    }

    /// Whole videos: those that share sound are placed together.
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
                [] => Some(self.fill.lacking_most(n_groups - n)),
                [split] => *split,
                _ => None,
            };
            for at in group {
                let partners = self.partners(at);
                let of = |shared: &SharedSound| shared.other(self.videos[at].name).unwrap_or_default().to_owned();
                let answer = match (partners.as_slice(), split) {
                    ([], split) => {
                        let split = split.unwrap_or_else(|| self.fill.lacking_most(n_groups - n));
                        Assignment::In(split, SplitBy::Share)
                    }
                    ([(first, Some(split)), rest @ ..], _) if rest.iter().all(|(_, other)| *other == Some(*split)) => {
                        Assignment::In(*split, SplitBy::SoundOf(of(first)))
                    }
                    (several, _) => Assignment::Nowhere(several.iter().map(|(shared, _)| (*shared).clone()).collect()),
                };
                self.place(at, answer);
            }
        }
    }

    /// New videos joined by shared sound, each group in the order of `new`.
    fn groups(&self, new: &[usize]) -> Vec<Vec<usize>> {
        let mut waiting = new.to_vec();
        let mut groups = Vec::new();
        while !waiting.is_empty() {
            let mut group = vec![waiting.remove(0)];
            let mut next = 0;
            while next < group.len() {
                let name = self.videos[group[next]].name;
                let shares = |&mut at: &mut usize| {
                    self.shared.iter().any(|shared| shared.other(name) == Some(self.videos[at].name))
                };
                group.extend(waiting.extract_if(.., shares));
                next += 1;
            }
            group.sort_by(|&a, &b| self.videos[a].order(&self.videos[b]));
            groups.push(group);
        }
        groups
    }

    /// Blocks of time in each video that is long enough; a shorter one fills a split as a whole, unless that left a split
    /// empty.
    fn by_time(&mut self, new: &[usize]) {
        let SplitPlan { guard_secs, least_secs, .. } = *self.plan;
        for (n, &at) in new.iter().enumerate() {
            let video = &self.videos[at];
            let (secs, duration_secs, n_left) = (video.secs(), video.duration_secs, new.len() - n);
            let empty = self.fill.empty();
            let forced = || {
                // As many splits as the videos after it cannot fill, the largest first; fewer where they do not fit.
                let n_splits = (empty.len() + 1).saturating_sub(n_left);
                let lengths = (2..=n_splits)
                    .rev()
                    .find_map(|n| blocks::lengths(secs, &empty[..n], guard_secs, least_secs, true))?;
                Some(blocks::in_turn(&video.kept, duration_secs, &lengths, guard_secs))
            };
            let cut =
                blocks::cut(&video.kept, duration_secs, &self.fill.shares(), guard_secs, least_secs).or_else(forced);
            let partners = self.partners(at);
            let whole = || match partners.first() {
                Some((shared, Some(split))) => {
                    let of = shared.other(video.name).unwrap_or_default().to_owned();
                    Assignment::In(*split, SplitBy::SoundOf(of))
                }
                _ => Assignment::In(self.fill.lacking_most(n_left), SplitBy::Share),
            };
            let answer = cut.map_or_else(whole, Assignment::Blocks);
            let answer = self.without_shared(at, answer);
            self.place(at, answer);
        }
    }

    /// Assignment without the sound that placed videos have in other splits.
    fn without_shared(&self, at: usize, answer: Assignment) -> Assignment {
        let video = &self.videos[at];
        let own = match &answer {
            Assignment::In(split, _) => {
                vec![TimeBlock { end_secs: video.duration_secs, ..TimeBlock::whole(*split) }]
            }
            Assignment::Blocks(blocks) => blocks.clone(),
            Assignment::Nowhere(_) => return answer,
        };
        let mut holes: Vec<Span> = Vec::new();
        for (shared, _) in self.partners(at) {
            let (own_secs, other_secs) =
                if shared.a == video.name { (shared.a_secs, shared.b_secs) } else { (shared.b_secs, shared.a_secs) };
            let other = shared.other(video.name).and_then(|other| self.placed.get(other));
            let span = (own_secs, own_secs + shared.secs);
            let found = other.map(|other| blocks::conflicts(&own, span, other, other_secs - own_secs));
            holes.extend(found.into_iter().flatten().map(|(span, ..)| span));
        }
        if holes.is_empty() { answer } else { Assignment::Blocks(blocks::without(&own, &holes)) }
    }
}

/// Seconds in each split beside those it should have.
#[derive(Clone, Debug, PartialEq)]
struct Fill {
    /// Split, its share 0..1, and its seconds; splits without a share are left out.
    splits: Vec<(Split, f64, f64)>,
    total_secs: f64,
}

impl Fill {
    /// Empty splits for `total_secs` in all, with these shares for validation and test.
    pub(crate) fn new(validation: f64, test: f64, total_secs: f64) -> Self {
        let shares = [(Split::Train, 1.0 - validation - test), (Split::Validation, validation), (Split::Test, test)];
        let splits = shares.into_iter().filter(|(_, share)| *share > 0.0).map(|(split, share)| (split, share, 0.0));
        Self { splits: splits.collect(), total_secs }
    }

    /// Adds seconds to a split.
    pub(crate) fn add(&mut self, split: Split, secs: f64) {
        self.splits.iter_mut().filter(|(other, ..)| *other == split).for_each(|(_, _, filled)| *filled += secs);
    }

    /// Splits with their shares.
    pub(crate) fn shares(&self) -> Vec<(Split, f64)> {
        self.splits.iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Splits without a second, with their shares, the largest share first.
    pub(crate) fn empty(&self) -> Vec<(Split, f64)> {
        let mut empty: Vec<_> = self.splits.iter().filter(|(.., filled)| *filled <= 0.0).collect();
        empty.sort_by(|a, b| b.1.total_cmp(&a.1));
        empty.into_iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Split that lacks most seconds. When only `n_left` videos are left for as many empty splits or more, an empty one.
    pub(crate) fn lacking_most(&self, n_left: usize) -> Split {
        let empty = self.empty();
        let may = |split: Split| n_left > empty.len() || empty.iter().any(|(other, _)| *other == split);
        let lacking = |(_, share, filled): &(Split, f64, f64)| share * self.total_secs - filled;
        // Of equals the first.
        let better = |a: Option<(Split, f64)>, b: (Split, f64)| Some(a.filter(|a| a.1 >= b.1).unwrap_or(b));
        let lacks = self.splits.iter().filter(|(split, ..)| may(*split)).map(|entry| (entry.0, lacking(entry)));
        lacks.fold(None, better).map_or(Split::Train, |(split, _)| split)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(secs: &[f64]) -> [f64; 3] {
        let mut fill = Fill::new(0.15, 0.15, secs.iter().sum());
        for (n, one) in secs.iter().enumerate() {
            let split = fill.lacking_most(secs.len() - n);
            fill.add(split, *one);
        }
        Split::ALL.map(|split| fill.splits.iter().find(|entry| entry.0 == split).unwrap().2)
    }

    #[test]
    fn the_emptiest_split_comes_next_and_none_stays_empty() {
        assert_eq!(filled(&[10.0; 10]), [70.0, 20.0, 10.0]);
        let few = |n: usize| {
            let mut fill = Fill::new(0.15, 0.15, n as f64);
            (0..n)
                .map(|k| {
                    let split = fill.lacking_most(n - k);
                    fill.add(split, 1.0);
                    split
                })
                .collect::<Vec<_>>()
        };
        assert_eq!(few(1), [Split::Train]);
        assert_eq!(few(2), [Split::Train, Split::Validation]);
        assert_eq!(few(3), [Split::Train, Split::Validation, Split::Test]);
        assert_eq!(few(4), [Split::Train, Split::Train, Split::Validation, Split::Test]);
        let mut fill = Fill::new(0.2, 0.0, 10.0);
        assert_eq!(fill.lacking_most(2), Split::Train);
        fill.add(Split::Train, 5.0);
        assert_eq!(fill.lacking_most(1), Split::Validation);
    }
}
