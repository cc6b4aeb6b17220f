//! Assignment of videos to splits. A video is never divided, and its split follows from its content hash or from a name
//! in the configuration, so that adding videos moves no other. Videos that share sound stay together: the later one
//! follows the earlier one.

use super::shared_sound::SharedSound;
use serde::{Deserialize, Serialize};

pub use crate::types::split::Split;
use std::collections::BTreeMap;

/// Split by content hash: the hash as a number in 0..1, of which the first `test` share tests, the next `validation`
/// share validates, and the rest trains.
pub fn of_content(content_hash: &str, validation: f64, test: f64) -> Split {
    let digest = blake3::hash(format!("split {content_hash}").as_bytes());
    let place = digest.as_bytes().iter().take(8).rev().fold(0.0, |sum, &byte| (sum + f64::from(byte)) / 256.0);
    if place < test {
        Split::Test
    } else if place < test + validation {
        Split::Validation
    } else {
        Split::Train
    }
}

/// Video without a split.
#[derive(Clone, Debug)]
pub struct Unassigned<'a> {
    pub name: &'a str,
    pub content: &'a str,
    /// Split named in the configuration.
    pub named: Option<Split>,
    /// Reason of its split in the previous dataset; `None`: a new video.
    pub before: Option<&'a SplitBy>,
}

/// Assignment of a video.
#[derive(Clone, Debug, PartialEq)]
pub enum Assignment {
    In(Split, SplitBy),
    /// No split, since it shares sound with these videos of different splits; the longest first.
    Nowhere(Vec<SharedSound>),
}

/// Assignments of the videos, in their order. Named ones come first, then those of the previous dataset, then new ones
/// in the order of their content hash, so that the order of `videos` does not matter.
pub fn assign(videos: &[Unassigned], shared: &[SharedSound], validation: f64, test: f64) -> Vec<Assignment> {
    let rank = |video: &Unassigned| match (video.named, video.before) {
        (Some(_), _) => 0,
        (None, Some(SplitBy::Content)) => 1,
        (None, Some(SplitBy::SoundOf(_))) => 2,
        (None, Some(SplitBy::Name) | None) => 3,
    };
    let mut order: Vec<usize> = (0..videos.len()).collect();
    order.sort_by_key(|&at| (rank(&videos[at]), videos[at].content));
    let mut splits: BTreeMap<&str, Split> = BTreeMap::new();
    let mut placed: Vec<Option<Assignment>> = vec![None; videos.len()];
    for at in order {
        let video = &videos[at];
        let partners = || -> Vec<(&SharedSound, Split)> {
            let mut partners: Vec<_> =
                shared.iter().filter_map(|s| Some((s, *splits.get(s.other(video.name)?)?))).collect();
            partners.sort_by(|a, b| b.0.secs.total_cmp(&a.0.secs).then(a.0.cmp_names(b.0)));
            partners
        };
        let by_content = || Assignment::In(of_content(video.content, validation, test), SplitBy::Content);
        let answer = match (rank(video), video.named) {
            (_, Some(split)) => Assignment::In(split, SplitBy::Name),
            (1, _) => by_content(),
            _ => match partners().as_slice() {
                [] => by_content(),
                [(first, split), rest @ ..] if rest.iter().all(|(_, other)| other == split) => {
                    Assignment::In(*split, SplitBy::SoundOf(first.other(video.name).unwrap_or_default().to_owned()))
                }
                several => Assignment::Nowhere(several.iter().map(|(shared, _)| (*shared).clone()).collect()),
            },
        };
        if let Assignment::In(split, _) = &answer {
            splits.insert(video.name, *split);
        }
        placed[at] = Some(answer);
    }
    placed.into_iter().map(|answer| answer.unwrap_or(Assignment::Nowhere(Vec::new()))).collect()
}

/// Reason of a video's split.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// Content hash.
    #[default]
    Content,
    /// Configuration or source dataset.
    Name,
    /// Shared sound with the video of this name, whose split it follows.
    SoundOf(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_depends_on_the_video_alone_and_keeps_the_shares() {
        let hashes: Vec<String> = (0..4_000).map(|n| format!("video {n}")).collect();
        let splits: Vec<Split> = hashes.iter().map(|hash| of_content(hash, 0.15, 0.1)).collect();
        let share = |split| splits.iter().filter(|&&s| s == split).count() as f64 / splits.len() as f64;
        assert!((share(Split::Validation) - 0.15).abs() < 0.02);
        assert!((share(Split::Test) - 0.1).abs() < 0.02);
    }

    fn new(name: &str) -> Unassigned<'_> {
        Unassigned { name, content: name, named: None, before: None }
    }

    fn shared(a: &str, b: &str, secs: f64) -> SharedSound {
        SharedSound { a: a.into(), b: b.into(), a_secs: 0.0, b_secs: 0.0, secs }
    }

    /// Names whose content gives these splits, sorted by content.
    fn named(n: usize, split: Split) -> Vec<String> {
        (0..500).map(|k| format!("v{k:03}")).filter(|name| of_content(name, 0.3, 0.3) == split).take(n).collect()
    }

    #[test]
    fn shared_sound_keeps_videos_together_and_moves_none_that_was_there() {
        let (test, train) = (named(3, Split::Test), named(3, Split::Train));
        let content = SplitBy::Content;
        // the new video would train by itself; it goes to the one that was there
        let old = Unassigned { before: Some(&content), ..new(&test[1]) };
        let both = [new(&train[0]), old.clone(), new(&train[1])];
        let pairs = [shared(&train[0], &test[1], 9.0)];
        let answer = assign(&both, &pairs, 0.3, 0.3);
        assert_eq!(answer[0], Assignment::In(Split::Test, SplitBy::SoundOf(test[1].clone())));
        assert_eq!(
            answer[1..],
            [Assignment::In(Split::Test, content.clone()), Assignment::In(Split::Train, content.clone())]
        );
        // from then on it stays there
        let follows = SplitBy::SoundOf(test[1].clone());
        let again = [Unassigned { before: Some(&follows), ..new(&train[0]) }, old.clone()];
        assert_eq!(assign(&again, &pairs, 0.3, 0.3)[0], answer[0]);
        // one that shares sound with two splits would leak in any of them
        let old_train = Unassigned { before: Some(&content), ..new(&train[2]) };
        let bridge = [old, old_train, new(&train[1])];
        let pairs = [shared(&train[1], &test[1], 6.0), shared(&train[2], &train[1], 20.0)];
        let answer = assign(&bridge, &pairs, 0.3, 0.3);
        assert_eq!(answer[2], Assignment::Nowhere(vec![pairs[1].clone(), pairs[0].clone()]));
        assert_eq!(answer[1], Assignment::In(Split::Train, content));
    }

    #[test]
    fn a_name_in_the_configuration_wins_and_the_order_has_no_say() {
        let (test, train) = (named(2, Split::Test), named(2, Split::Train));
        let pairs = [shared(&train[0], &test[0], 9.0), shared(&train[0], &train[1], 7.0)];
        let mut videos =
            vec![new(&train[0]), new(&train[1]), Unassigned { named: Some(Split::Train), ..new(&test[0]) }];
        let first = assign(&videos, &pairs, 0.3, 0.3);
        assert_eq!(first[2], Assignment::In(Split::Train, SplitBy::Name));
        assert!(first.iter().all(|answer| matches!(answer, Assignment::In(Split::Train, _))));
        videos.reverse();
        let mut second = assign(&videos, &pairs, 0.3, 0.3);
        second.reverse();
        assert_eq!(first, second);
    }
}
