//! A video in blocks of time, each of one split. Between blocks of different splits lies a guard gap, which is cut off
//! both of them when samples are cut, so that a longer gap moves no block.

use orator_base::types::interval::Interval;
use orator_base::types::split::{Split, TimeBlock};
use orator_base::types::time::FrameRate;

/// Kept seconds after which a long video has another block of every split.
const CYCLE_SECS: f64 = 600.0;
/// Uncertainty of where shared sound begins and ends, seconds.
const SHARED_EDGE_SECS: f64 = 1.0;

/// Stretch of seconds.
pub type Span = (f64, f64);

/// Lengths of blocks of `splits` (with shares) that share `secs` with a gap between each two; a block is raised to
/// `least_secs` at the cost of the longest. `None`: that does not fit.
pub fn lengths(
    secs: f64,
    splits: &[(Split, f64)],
    guard_secs: f64,
    least_secs: f64,
    may_raise: bool,
) -> Option<Vec<(Split, f64)>> {
    let left = secs - guard_secs * splits.len().saturating_sub(1) as f64;
    let all: f64 = splits.iter().map(|(_, share)| share).sum();
    let wanted: Vec<(Split, f64)> = splits.iter().map(|(split, share)| (*split, left * share / all)).collect();
    let is_short = |(_, secs): &(Split, f64)| *secs < least_secs;
    if wanted.iter().any(is_short) && !may_raise {
        return None;
    }
    let missing: f64 = wanted.iter().map(|(_, secs)| (least_secs - secs).max(0.0)).sum();
    let longest = wanted.iter().map(|(_, secs)| *secs).fold(f64::MIN, f64::max);
    let longest = wanted.iter().position(|(_, secs)| *secs == longest)?;
    let mut raised: Vec<(Split, f64)> = wanted.iter().map(|(split, secs)| (*split, secs.max(least_secs))).collect();
    raised[longest].1 -= missing;
    (!raised.iter().any(is_short)).then_some(raised)
}

/// Cuts a video of which `kept` is kept into blocks of all `splits` in turn, each split once in about ten minutes.
/// `None`: it is too short for blocks of `least_secs`.
pub fn cut(
    kept: &[Span],
    duration_secs: f64,
    splits: &[(Split, f64)],
    guard_secs: f64,
    least_secs: f64,
) -> Option<Vec<TimeBlock>> {
    let secs: f64 = kept.iter().map(|(start, end)| end - start).sum();
    let n_cycles = ((secs / CYCLE_SECS) as usize).max(1);
    // The gap between the last block of a cycle and the first of the next is one more.
    let of_cycle = (secs + guard_secs) / n_cycles as f64 - guard_secs;
    let lengths = lengths(of_cycle, splits, guard_secs, least_secs, false)?;
    Some(in_turn(kept, duration_secs, &lengths.repeat(n_cycles), guard_secs))
}

/// Blocks of these lengths of kept seconds, one after the other with half a gap on either side of each boundary.
pub fn in_turn(kept: &[Span], duration_secs: f64, lengths: &[(Split, f64)], guard_secs: f64) -> Vec<TimeBlock> {
    let mut blocks: Vec<TimeBlock> = Vec::new();
    let mut until = 0.0;
    for (n, (split, secs)) in lengths.iter().enumerate() {
        until += secs + if n == 0 { guard_secs / 2.0 } else { guard_secs };
        let start_secs = blocks.last().map_or(0.0, |block| block.end_secs);
        let end_secs = if n + 1 == lengths.len() { duration_secs } else { at_kept(kept, until) };
        blocks.push(TimeBlock { split: Some(*split), start_secs, end_secs });
    }
    blocks
}

/// Time at which `secs` of `kept` are over.
fn at_kept(kept: &[Span], secs: f64) -> f64 {
    let mut left = secs;
    for (start, end) in kept {
        if left <= end - start {
            return start + left;
        }
        left -= end - start;
    }
    kept.last().map_or(0.0, |(_, end)| *end)
}

/// Split at a time; `None` in what is left out.
fn split_at(blocks: &[TimeBlock], secs: f64) -> Option<Split> {
    blocks.iter().find(|block| (block.start_secs..block.end_secs).contains(&secs)).and_then(|block| block.split)
}

/// Smallest distance of kept stretches of different splits; `None`: there is only one split.
pub fn least_gap(blocks: &[TimeBlock], kept: &[Span]) -> Option<f64> {
    let placed = |(start, end): &Span| Some((*start, *end, split_at(blocks, f64::midpoint(*start, *end))?));
    let placed: Vec<(f64, f64, Split)> = kept.iter().filter_map(placed).collect();
    let apart = placed.windows(2).filter(|pair| pair[0].2 != pair[1].2).map(|pair| pair[1].0 - pair[0].1);
    apart.min_by(f64::total_cmp)
}

/// Stretches of `shared` (in `own` time; the other video's time is `to_other` later) that two videos have in different
/// splits, with both splits: own, other.
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

/// Blocks without the stretches `holes`, which belong to no split any more; a second on either side goes with them.
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

/// Frames of each split that samples may be cut from: blocks of different splits are at least `guard_frames` apart,
/// half of what is missing is cut off each.
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

#[cfg(test)]
mod tests {
    use super::*;

    const SHARES: [(Split, f64); 3] = [(Split::Train, 0.7), (Split::Validation, 0.15), (Split::Test, 0.15)];

    #[test]
    fn a_long_video_is_cut_in_turn_and_a_short_one_is_not() {
        let kept = [(10.0, 310.0), (400.0, 700.0)];
        let blocks = cut(&kept, 720.0, &SHARES, 8.0, 8.0).unwrap();
        let splits: Vec<_> = blocks.iter().filter_map(|block| block.split).collect();
        assert_eq!(splits, [Split::Train, Split::Validation, Split::Test]);
        let fps = FrameRate::new(10, 1);
        let secs: Vec<f64> = usable(&blocks, fps, 7_200, 80)
            .into_iter()
            .map(|(_, part)| {
                let overlap = |(start, end): &Span| end.min(fps.secs(part.end)) - start.max(fps.secs(part.start));
                kept.iter().map(|span| overlap(span).max(0.0)).sum()
            })
            .collect();
        for (secs, (_, share)) in secs.iter().zip(SHARES) {
            assert!((secs / 584.0 - share).abs() < 0.01, "{secs} of {share}");
        }
        assert_eq!(cut(&[(0.0, 60.0)], 60.0, &SHARES, 8.0, 8.0), None);
        assert_eq!(cut(&[(0.0, 3_000.0)], 3_000.0, &SHARES, 8.0, 8.0).unwrap().len(), 15);
        // raised to the least at the cost of the longest
        let raised = lengths(60.0, &SHARES, 8.0, 8.0, true).unwrap();
        assert!((raised[0].1 - 28.0).abs() < 1e-9 && raised[1].1 == 8.0 && raised[2].1 == 8.0, "{raised:?}");
        assert_eq!(lengths(30.0, &SHARES, 8.0, 8.0, true), None);
    }

    #[test]
    fn neighbours_of_different_splits_are_a_gap_apart() {
        let block = |split, start_secs, end_secs| TimeBlock { split: Some(split), start_secs, end_secs };
        let blocks = [
            block(Split::Train, 0.0, 10.0),
            block(Split::Test, 10.0, 11.0),
            block(Split::Train, 11.0, 30.0),
            TimeBlock { split: None, start_secs: 30.0, end_secs: 31.0 },
            block(Split::Train, 31.0, 32.0),
            TimeBlock { split: None, start_secs: 32.0, end_secs: 35.0 },
            block(Split::Validation, 35.0, 50.0),
        ];
        let fps = FrameRate::new(10, 1);
        let usable = usable(&blocks, fps, 480, 45);
        for (n, (split, part)) in usable.iter().enumerate() {
            for (other, later) in &usable[n + 1..] {
                assert!(later.start >= part.end + if split == other { 0 } else { 45 }, "{usable:?}");
            }
        }
        assert_eq!(usable.last().unwrap().1.end, 480);
        assert!(usable.iter().filter(|(split, _)| *split == Split::Train).count() >= 2, "{usable:?}");
    }

    #[test]
    fn sound_that_two_videos_share_is_left_out_where_their_splits_differ() {
        let block = |split, start_secs, end_secs| TimeBlock { split: Some(split), start_secs, end_secs };
        let own = [block(Split::Train, 0.0, 60.0), block(Split::Test, 60.0, 100.0)];
        let other = [block(Split::Train, 0.0, 40.0), block(Split::Validation, 40.0, 90.0)];
        // 10 s of own time are 20 s of the other's
        let found = conflicts(&own, (10.0, 70.0), &other, 10.0);
        let expected =
            [((30.0, 60.0), Split::Train, Split::Validation), ((60.0, 70.0), Split::Test, Split::Validation)];
        assert_eq!(found, expected);
        let holes: Vec<Span> = found.into_iter().map(|(span, ..)| span).collect();
        let left = without(&own, &holes);
        assert!(conflicts(&left, (10.0, 70.0), &other, 10.0).is_empty(), "{left:?}");
        assert_eq!(left.iter().map(TimeBlock::secs).sum::<f64>(), 100.0);
        assert_eq!(left.first().unwrap().end_secs, 29.0);
    }
}
