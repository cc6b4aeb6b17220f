//! Numbered frames as a sequence; missing frames count as frames without persons, and are noted.

use super::found::FoundPerson;
use anyhow::{Result, bail};
use orator_base::text::counted;
use std::collections::BTreeMap;

/// Maximum ratio of the length of the sequence to the number of frames present; sequences of up to `SHORT_SEQUENCE`
/// frames may have larger gaps.
const MAX_LENGTH_RATIO: u64 = 20;
const SHORT_SEQUENCE: u64 = 10_000;

/// The persons in each frame, starting at frame number 0 or 1, and notes on gaps.
///
/// # Errors
///
/// No frame; numbers too far apart to be those of one video.
pub fn in_order(numbered: BTreeMap<u64, Vec<FoundPerson>>) -> Result<(Vec<Vec<FoundPerson>>, Vec<String>)> {
    let (Some(&first), Some(&last)) = (numbered.keys().next(), numbered.keys().next_back()) else {
        bail!("no frames");
    };
    let base = first.min(1);
    let (n_present, n_frames) = (numbered.len() as u64, (last - base).saturating_add(1));
    if n_frames > SHORT_SEQUENCE && n_frames / MAX_LENGTH_RATIO > n_present {
        bail!("{n_present} frames numbered from {first} to {last}: expected consecutive frames of one video");
    }
    let mut notes = Vec::new();
    if first > base {
        let before = counted((first - base) as usize, "frame");
        notes.push(format!("the first frame has number {first}: {before} before it marked as not detected"));
    }
    let n_gaps = n_frames - n_present - (first - base);
    if n_gaps > 0 {
        let missing = (first..last).find(|number| !numbered.contains_key(number)).unwrap_or(first);
        notes.push(format!(
            "{} (the first is number {missing}): marked as not detected",
            counted(n_gaps as usize, "missing frame")
        ));
    }
    let mut frames = vec![Vec::new(); n_frames as usize];
    for (number, persons) in numbered {
        frames[(number - base) as usize] = persons;
    }
    Ok((frames, notes))
}

/// Frame number: the last run of digits in a file name without its extension, at most 18 digits.
pub fn number_of(name: &str) -> Option<u64> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let stem = ["_keypoints", "_predictions"].iter().fold(stem, |stem, end| stem.strip_suffix(end).unwrap_or(stem));
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let digits = &stem[..end];
    let start = digits.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let start = start + digits[start..].len().saturating_sub(18);
    digits.get(start..)?.parse().ok()
}
