//! Which split a video belongs to. A video is never divided, and its split follows from its content alone, so that
//! adding videos moves none of the others. The one exception keeps small speakers trainable: when no video would
//! train, all of them do.

use serde::{Deserialize, Serialize};

/// A part of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    Train,
    Validation,
    Test,
}

impl Split {
    pub const ALL: [Split; 3] = [Split::Train, Split::Validation, Split::Test];

    /// Its name in file names and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Validation => "validation",
            Split::Test => "test",
        }
    }

    /// The split of a video whose content has this hash: the hash is a place in 0..1, of which the first `test`
    /// share tests, the next `validation` share validates, and the rest trains.
    pub fn of(content_hash: &str, validation: f64, test: f64) -> Split {
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

    /// The splits of a speaker's videos, in their order. When none would train, all do (see the module).
    pub fn of_all(content_hashes: &[&str], validation: f64, test: f64) -> Vec<Split> {
        let splits: Vec<Split> = content_hashes.iter().map(|hash| Split::of(hash, validation, test)).collect();
        if splits.contains(&Split::Train) { splits } else { vec![Split::Train; splits.len()] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_depends_on_the_video_alone_and_keeps_the_shares() {
        let hashes: Vec<String> = (0..4_000).map(|n| format!("video {n}")).collect();
        let all: Vec<&str> = hashes.iter().map(String::as_str).collect();
        let splits = Split::of_all(&all, 0.15, 0.1);
        let share = |split| splits.iter().filter(|&&s| s == split).count() as f64 / splits.len() as f64;
        assert!((share(Split::Validation) - 0.15).abs() < 0.02);
        assert!((share(Split::Test) - 0.1).abs() < 0.02);
        let some: Vec<&str> = all.iter().copied().skip(100).step_by(7).collect();
        let of_some = Split::of_all(&some, 0.15, 0.1);
        let of_all: Vec<Split> = splits.iter().copied().skip(100).step_by(7).collect();
        assert_eq!(of_some, of_all);
    }

    #[test]
    fn a_speaker_always_trains_on_something() {
        for n in 0..200 {
            let hash = format!("only video {n}");
            assert_eq!(Split::of_all(&[&hash], 0.15, 0.15), [Split::Train]);
        }
        assert_eq!(Split::of_all(&["a", "b"], 1.0, 0.0), [Split::Train, Split::Train]);
    }
}
