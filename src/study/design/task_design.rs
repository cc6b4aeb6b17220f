//! One task over all sessions: its decks of clips and the order of its trials.

use super::clip_deck::{ClipDeck, DealtClip, stream};
use super::clip_needs::SharedClips;
use super::comparison::{ComparedConditions, comparisons};
use super::latin_square::SquareRows;
use crate::file::{StudyFile, StudyTask};
use std::collections::{BTreeMap, VecDeque};

/// Clip of a speaker with what it is shown in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct DealtTrial {
    pub speaker: usize,
    pub dealt: DealtClip,
}

/// State of a task between sessions.
pub struct TaskDesigner<'a> {
    pub task: &'a StudyTask,
    pub comparisons: Vec<ComparedConditions<'a>>,
    /// Screen places of a comparison's conditions.
    pub arrangements: SquareRows,
    number: usize,
    practice: Vec<ClipDeck>,
    training: Vec<ClipDeck>,
    main: Vec<ClipDeck>,
    group_rows: SquareRows,
    clip_rows: SquareRows,
}

impl<'a> TaskDesigner<'a> {
    pub fn new(file: &'a StudyFile, number: usize, clips: &[SharedClips]) -> Self {
        let task = &file.task[number];
        let comparisons = comparisons(file, task);
        let rng = |what: &str, speaker: usize| stream(file.seed, &format!("{} {what} {speaker}", task.name));
        let n_films = comparisons.first().map_or(0, Vec::len);
        let arrangements = SquareRows::new(n_films, rng("arrangements", 0));
        let decks = |what: &str, n_clips: &dyn Fn(&SharedClips) -> usize| -> Vec<ClipDeck> {
            let deck = |(speaker, shared): (usize, &SharedClips)| {
                ClipDeck::new(n_clips(shared), [comparisons.len(), arrangements.n_rows()], speaker, rng(what, speaker))
            };
            clips.iter().enumerate().map(deck).collect()
        };
        let n_main = clips.iter().map(|shared| shared.main[number].len()).max().unwrap_or(0);
        Self {
            practice: decks("practice", &|shared| shared.practice.len()),
            training: decks("training", &|shared| shared.training[number].len()),
            main: decks("main", &|shared| shared.main[number].len()),
            group_rows: SquareRows::new(clips.len() * comparisons.len(), rng("groups", 0)),
            clip_rows: SquareRows::new(n_main, rng("clips", 0)),
            task,
            comparisons,
            arrangements,
            number,
        }
    }

    /// Practice trial of a session.
    pub fn practice(&mut self, session: usize) -> Vec<DealtTrial> {
        deal(&mut self.practice, 1, session)
    }

    /// Training trials of a session.
    pub fn training(&mut self, session: usize) -> Vec<DealtTrial> {
        deal(&mut self.training, self.task.training, session + self.number)
    }

    /// Main trials of a session in their order: speakers and comparisons take turns by one square, clips among those of
    /// the same speaker and comparison come by another.
    pub fn main(&mut self, session: usize) -> Vec<DealtTrial> {
        let dealt = deal(&mut self.main, self.task.trials, session + self.number);
        let mut groups: BTreeMap<usize, VecDeque<DealtTrial>> = BTreeMap::new();
        let clip_row = self.clip_rows.deal();
        let clip_row = self.clip_rows.row(clip_row);
        for clip in clip_row {
            for trial in dealt.iter().filter(|trial| trial.dealt.clip == *clip) {
                let group = trial.speaker * self.comparisons.len() + trial.dealt.comparison;
                groups.entry(group).or_default().push_back(*trial);
            }
        }
        let first = self.group_rows.deal();
        let turns = (0..dealt.len()).flat_map(|turn| self.group_rows.row(first + turn));
        turns.filter_map(|group| groups.get_mut(group)?.pop_front()).collect()
    }
}

/// `n` clips of all speakers, as many of each; those too many go to other speakers in every session.
pub fn deal(decks: &mut [ClipDeck], n: usize, session: usize) -> Vec<DealtTrial> {
    let n_speakers = decks.len().max(1);
    let (each, more) = (n / n_speakers, n % n_speakers);
    let n_of = |speaker: usize| each + usize::from((speaker + session * (n_speakers - more)) % n_speakers < more);
    let hands = decks.iter_mut().enumerate().map(|(speaker, deck)| {
        let hand = deck.deal(n_of(speaker));
        hand.into_iter().map(move |dealt| DealtTrial { speaker, dealt })
    });
    hands.flatten().collect()
}
