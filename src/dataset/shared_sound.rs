//! Detection of sound shared between videos (re-uploads, shortened versions, intros). Equal fingerprint codes
//! (`audio::fingerprint`) in two videos vote for a time offset; at offsets with enough votes, the codes are compared
//! bit by bit.
//!
//! Memory: a quarter of the codes of every video, 12 bytes each (0.3 MB per hour), and all codes of two videos.

use anyhow::Result;
use orator_base::audio::fingerprint::PER_SEC;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Largest share of different bits in shared sound; unrelated ones differ in about half of them, with little variation.
const MAX_BIT_ERROR_RATE: f64 = 0.33;
/// Window over which the share of different bits is computed, seconds.
const WINDOW_SECS: f64 = 3.0;
/// Number of codes in the shorter window that locates the ends of shared sound.
const EDGE_CODES: usize = 16;
/// Minimum number of votes for an offset to be examined.
const MIN_VOTES: usize = 2;
/// Number of occurrences above which a code is ignored as unspecific (a hum, a beep).
const MAX_OCCURRENCES: usize = 64;

/// Sound shared by two videos.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SharedSound {
    /// Names of the videos, in alphabetical order.
    pub a: String,
    pub b: String,
    /// Start in `a`, seconds.
    pub a_secs: f64,
    /// Start in `b`, seconds.
    pub b_secs: f64,
    /// Duration, seconds.
    pub secs: f64,
}

impl SharedSound {
    /// Name of the other video of the pair, if `name` is one of them.
    pub fn other(&self, name: &str) -> Option<&str> {
        if self.a == name {
            Some(&self.b)
        } else if self.b == name {
            Some(&self.a)
        } else {
            None
        }
    }

    /// Compares by the names of the videos.
    pub fn cmp_names(&self, other: &Self) -> Ordering {
        (&self.a, &self.b).cmp(&(&other.a, &other.b))
    }
}

/// Code, index of its video, and position in the codes of the video.
type Landmark = (u32, u32, u32);

/// Finds shared sound of at least `min_secs`: the longest of each pair of videos, sorted by name. `names` must be
/// sorted; `codes` reads the codes of the n-th video.
pub fn find(names: &[String], codes: impl Fn(usize) -> Result<Vec<u32>>, min_secs: f64) -> Result<Vec<SharedSound>> {
    let mut landmarks: Vec<Landmark> = Vec::new();
    for video in 0..names.len() {
        let chosen = |code: u32| code != 0 && code.wrapping_mul(0x9E37_79B1) >> 30 == 0;
        let positions = codes(video)?.into_iter().zip(0u32..).filter(|(code, _)| chosen(*code));
        landmarks.extend(positions.map(|(code, position)| (code, video as u32, position)));
    }
    landmarks.sort_unstable();
    let mut found = Vec::new();
    let mut last_codes: Option<(usize, Vec<u32>)> = None;
    for ((a, b), offsets) in votes(&landmarks) {
        let (a, b) = (a as usize, b as usize);
        let first = match last_codes.take() {
            Some((video, codes)) if video == a => codes,
            _ => codes(a)?,
        };
        let second = codes(b)?;
        let matches = offsets.into_iter().filter_map(|offset| longest_near(&first, &second, offset));
        if let Some((start, offset, n)) = matches.max_by_key(|(_, _, n)| *n) {
            let secs = n as f64 / PER_SEC;
            if secs >= min_secs {
                let at = |position: i64| position as f64 / PER_SEC;
                let (a_secs, b_secs) = (at(start), at(start + offset));
                found.push(SharedSound { a: names[a].clone(), b: names[b].clone(), a_secs, b_secs, secs });
            }
        }
        last_codes = Some((a, first));
    }
    Ok(found)
}

/// For pairs of videos with equal codes, the offsets (position in the second less the first) with at least `MIN_VOTES`.
fn votes(landmarks: &[Landmark]) -> Vec<((u32, u32), Vec<i64>)> {
    let mut votes: Vec<((u32, u32), i64)> = Vec::new();
    for group in landmarks.chunk_by(|x, y| x.0 == y.0).filter(|group| group.len() <= MAX_OCCURRENCES) {
        for (n, x) in group.iter().enumerate() {
            let others = group[n + 1..].iter().filter(|y| y.1 != x.1);
            votes.extend(others.map(|y| ((x.1, y.1), i64::from(y.2) - i64::from(x.2))));
        }
    }
    votes.sort_unstable();
    let mut pairs = Vec::new();
    for of_pair in votes.chunk_by(|x, y| x.0 == y.0) {
        let mut offsets: Vec<i64> = Vec::new();
        for (n, (_, offset)) in of_pair.iter().enumerate() {
            let near = of_pair[n..].iter().take_while(|(_, other)| other - offset <= 2).count();
            if near >= MIN_VOTES && offsets.last().is_none_or(|last| offset - last > 1) {
                offsets.push(*offset);
            }
        }
        if !offsets.is_empty() {
            pairs.push((of_pair[0].0, offsets));
        }
    }
    pairs
}

/// Longest shared sound near an offset: its start in `a`, the exact offset and its length, in codes.
fn longest_near(a: &[u32], b: &[u32], offset: i64) -> Option<(i64, i64, usize)> {
    (offset - 1..=offset + 2).filter_map(|offset| longest_at(a, b, offset)).max_by_key(|(_, _, n)| *n)
}

/// Longest shared sound at exactly this offset, as `longest_near`.
pub fn longest_at(a: &[u32], b: &[u32], offset: i64) -> Option<(i64, i64, usize)> {
    let window = (WINDOW_SECS * PER_SEC) as usize;
    let (a_start, b_start) = ((-offset).max(0) as usize, offset.max(0) as usize);
    let pairs: Vec<(u32, u32)> =
        a.iter().skip(a_start).zip(b.iter().skip(b_start)).map(|(x, y)| bit_errors(*x, *y)).collect();
    let (mut bits, mut n_errors, mut run, mut best) = (0, 0, 0, None);
    for end in 0..pairs.len() {
        bits += pairs[end].0;
        n_errors += pairs[end].1;
        if end >= window {
            bits -= pairs[end - window].0;
            n_errors -= pairs[end - window].1;
        }
        let is_match = end + 1 >= window
            && bits as usize >= 16 * window
            && f64::from(n_errors) <= MAX_BIT_ERROR_RATE * f64::from(bits);
        run = if is_match { run + 1 } else { 0 };
        let n = run + window - 1;
        if is_match && best.is_none_or(|(_, _, longest)| n > longest) {
            best = Some(((a_start + end + 1 - n) as i64, offset, n));
        }
    }
    best.map(|(start, offset, n)| {
        // A window may extend past the ends of shared sound, so shorter windows locate the ends.
        let position = (start as usize).saturating_sub(a_start);
        let differs = |piece: &[(u32, u32)]| {
            let (bits, n_errors) = piece.iter().fold((0, 0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
            (bits as usize) < 16 * EDGE_CODES || f64::from(n_errors) > MAX_BIT_ERROR_RATE * f64::from(bits)
        };
        let matched = &pairs[position..position + n];
        let skip = matched.windows(EDGE_CODES).take_while(|piece| differs(piece)).count();
        let cut = matched[skip.min(n)..].windows(EDGE_CODES).rev().take_while(|piece| differs(piece)).count();
        (start + skip as i64, offset, n.saturating_sub(skip + cut))
    })
}

/// Number of compared bits and of different ones; silence (code 0) is not compared.
fn bit_errors(x: u32, y: u32) -> (u32, u32) {
    if x == 0 || y == 0 { (0, 0) } else { (32, (x ^ y).count_ones()) }
}
