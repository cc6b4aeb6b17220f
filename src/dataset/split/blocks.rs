//! Time blocks of a video, each in one split. The guard gap between blocks of different splits is taken from both of
//! them only when samples are cut, so the block boundaries do not depend on its length.

use orator_base::types::interval::Interval;
use orator_base::types::split::{Split, TimeBlock};
use orator_base::types::time::FrameRate;

/// Accepted seconds per cycle; in each cycle of a long video every split gets a block.
const CYCLE_SECS: f64 = 600.0;
/// Uncertainty of the ends of shared sound, seconds.
const SHARED_EDGE_SECS: f64 = 1.0;

/// Start and end, seconds.
pub type Span = (f64, f64);

/// Lengths of one block for each of `splits` (with their shares), in seconds: `secs` minus the gaps between the blocks
/// is divided by share. With `may_raise`, shorter blocks are raised to `min_secs` at the expense of the longest.
/// `None`: a block would be shorter than `min_secs`.
pub fn lengths(
    secs: f64,
    splits: &[(Split, f64)],
    guard_secs: f64,
    min_secs: f64,
    may_raise: bool,
) -> Option<Vec<(Split, f64)>> {
    let available_secs = secs - guard_secs * splits.len().saturating_sub(1) as f64;
    let total_share: f64 = splits.iter().map(|(_, share)| share).sum();
    let by_share: Vec<(Split, f64)> =
        splits.iter().map(|(split, share)| (*split, available_secs * share / total_share)).collect();
    let is_short = |(_, secs): &(Split, f64)| *secs < min_secs;
    if by_share.iter().any(is_short) && !may_raise {
        return None;
    }
    let missing_secs: f64 = by_share.iter().map(|(_, secs)| (min_secs - secs).max(0.0)).sum();
    let longest = by_share.iter().map(|(_, secs)| *secs).fold(f64::MIN, f64::max);
    let longest = by_share.iter().position(|(_, secs)| *secs == longest)?;
    let mut raised: Vec<(Split, f64)> = by_share.iter().map(|(split, secs)| (*split, secs.max(min_secs))).collect();
    raised[longest].1 -= missing_secs;
    (!raised.iter().any(is_short)).then_some(raised)
}

/// Divides a video with the accepted spans `accepted` into blocks of all `splits` in turn, each split about once per
/// `CYCLE_SECS`. `None`: the video is too short for blocks of `min_secs`.
pub fn cut(
    accepted: &[Span],
    duration_secs: f64,
    splits: &[(Split, f64)],
    guard_secs: f64,
    min_secs: f64,
) -> Option<Vec<TimeBlock>> {
    let secs: f64 = accepted.iter().map(|(start, end)| end - start).sum();
    let n_cycles = ((secs / CYCLE_SECS) as usize).max(1);
    // Each cycle except the last also contains the gap before the next one.
    let cycle_secs = (secs + guard_secs) / n_cycles as f64 - guard_secs;
    let lengths = lengths(cycle_secs, splits, guard_secs, min_secs, false)?;
    Some(consecutive(accepted, duration_secs, &lengths.repeat(n_cycles), guard_secs))
}

/// Consecutive blocks with the given lengths in accepted seconds, plus half a gap on either side of each boundary.
pub fn consecutive(accepted: &[Span], duration_secs: f64, lengths: &[(Split, f64)], guard_secs: f64) -> Vec<TimeBlock> {
    let mut blocks: Vec<TimeBlock> = Vec::new();
    let mut until = 0.0;
    for (n, (split, secs)) in lengths.iter().enumerate() {
        until += secs + if n == 0 { guard_secs / 2.0 } else { guard_secs };
        let start_secs = blocks.last().map_or(0.0, |block| block.end_secs);
        let end_secs = if n + 1 == lengths.len() { duration_secs } else { time_at_kept(accepted, until) };
        blocks.push(TimeBlock { split: Some(*split), start_secs, end_secs });
    }
    blocks
}

/// Time at which `secs` accepted seconds have passed.
fn time_at_kept(accepted: &[Span], secs: f64) -> f64 {
    let mut left = secs;
    for (start, end) in accepted {
        if left <= end - start {
            return start + left;
        }
        left -= end - start;
    }
    accepted.last().map_or(0.0, |(_, end)| *end)
}

/// Split at the time `secs`; `None` outside all blocks or in an excluded one.
fn split_at(blocks: &[TimeBlock], secs: f64) -> Option<Split> {
    blocks.iter().find(|block| (block.start_secs..block.end_secs).contains(&secs)).and_then(|block| block.split)
}

/// Smallest gap between consecutive accepted spans in different splits, seconds; `None`: there is no such pair.
pub fn min_gap(blocks: &[TimeBlock], accepted: &[Span]) -> Option<f64> {
    let placed = |(start, end): &Span| Some((*start, *end, split_at(blocks, f64::midpoint(*start, *end))?));
    let placed: Vec<(f64, f64, Split)> = accepted.iter().filter_map(placed).collect();
    let apart = placed.windows(2).filter(|pair| pair[0].2 != pair[1].2).map(|pair| pair[1].0 - pair[0].1);
    apart.min_by(f64::total_cmp)
}

/// Parts of the shared sound `shared` that are in different splits in the two videos, each with its span and both
/// splits (own, other). Times are those of the own video; the other video's times are larger by `to_other`, seconds.
pub fn conflicts(own: &[TimeBlock], shared: Span, other: &[TimeBlock], to_other: f64) -> Vec<(Span, Split, Split)> {
    let inside = |secs: &f64| shared.0 < *secs && *secs < shared.1;
    let own_edges = own.iter().flat_map(|block| [block.start_secs, block.end_secs]);
    let other_edges = other.iter().flat_map(|block| [block.start_secs - to_other, block.end_secs - to_other]);
    let mut edges: Vec<f64> = own_edges.chain(other_edges).filter(inside).chain([shared.0, shared.1]).collect();
    edges.sort_by(f64::total_cmp);
    let conflict = |pair: &[f64]| {
        let middle = f64::midpoint(pair[0], pair[1]);
        let (a, b) = (split_at(own, middle)?, split_at(other, middle + to_other)?);
        (a != b && pair[0] < pair[1]).then_some(((pair[0], pair[1]), a, b))
    };
    edges.windows(2).filter_map(conflict).collect()
}

/// Blocks with the spans `holes`, extended by `SHARED_EDGE_SECS` on either side, excluded from every split.
pub fn without(blocks: &[TimeBlock], holes: &[Span]) -> Vec<TimeBlock> {
    let mut blocks = blocks.to_vec();
    for (start, end) in holes {
        let (start, end) = (start - SHARED_EDGE_SECS, end + SHARED_EDGE_SECS);
        let parts = |block: &TimeBlock| {
            let (from, to) =
                (start.clamp(block.start_secs, block.end_secs), end.clamp(block.start_secs, block.end_secs));
            let part = |split, start_secs, end_secs| TimeBlock { split, start_secs, end_secs };
            let parts = [
                part(block.split, block.start_secs, from),
                part(None, from, to),
                part(block.split, to, block.end_secs),
            ];
            parts.into_iter().filter(|part| part.secs() > 0.0).collect::<Vec<_>>()
        };
        blocks = blocks.iter().flat_map(parts).collect();
    }
    blocks
}

/// Frame intervals of each split that samples may be cut from. Neighbouring intervals of different splits are at least
/// `guard_frames` apart; about half of a missing gap is taken from each.
pub fn usable(blocks: &[TimeBlock], fps: FrameRate, n_frames: usize, guard_frames: usize) -> Vec<(Split, Interval)> {
    let frame = |secs: f64| ((secs * fps.per_sec()).round() as usize).min(n_frames);
    let mut usable: Vec<(Split, Interval)> = Vec::new();
    for block in blocks {
        let Some(split) = block.split else { continue };
        let mut interval = Interval { start: frame(block.start_secs), end: frame(block.end_secs) };
        if let Some((other, before)) = usable.last_mut()
            && *other != split
        {
            let missing = (before.end + guard_frames).saturating_sub(interval.start);
            before.end = before.end.saturating_sub(missing / 2).max(before.start);
            interval.start = (before.end + guard_frames).min(interval.end);
        }
        usable.push((split, interval));
    }
    usable.retain(|(_, interval)| interval.n_frames() > 0);
    usable
}
