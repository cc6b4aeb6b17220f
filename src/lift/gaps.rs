//! Gaps in what was seen: short ones are filled over time, long ones stay open.

/// For each frame whether it lies in a gap of `seen` of more than `longest` frames; gaps at the ends count as well.
pub fn long_gaps(seen: &[bool], longest: usize) -> Vec<bool> {
    let mut open = vec![false; seen.len()];
    let mut start = 0;
    for gap in seen.chunk_by(|a, b| a == b) {
        let end = start + gap.len();
        if !gap[0] && gap.len() > longest {
            open[start..end].fill(true);
        }
        start = end;
    }
    open
}

/// The nearest frames with a value before (or at) and after (or at) each frame.
pub fn neighbours<T>(track: &[Option<T>]) -> Vec<(Option<usize>, Option<usize>)> {
    let mut found = vec![(None, None); track.len()];
    let mut last = None;
    for t in 0..track.len() {
        if track[t].is_some() {
            last = Some(t);
        }
        found[t].0 = last;
    }
    last = None;
    for t in (0..track.len()).rev() {
        if track[t].is_some() {
            last = Some(t);
        }
        found[t].1 = last;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_gaps_stay_open() {
        let seen = [false, true, false, false, true, false, false, false];
        assert_eq!(long_gaps(&seen, 2), [false, false, false, false, false, true, true, true]);
        assert_eq!(long_gaps(&seen, 0), seen.map(|s| !s));
        assert!(long_gaps(&[], 3).is_empty());
    }

    #[test]
    fn every_frame_knows_its_neighbours() {
        let track = [None, Some(1), None, Some(3), None];
        let expected = [(None, Some(1)), (Some(1), Some(1)), (Some(1), Some(3)), (Some(3), Some(3)), (Some(3), None)];
        assert_eq!(neighbours(&track), expected);
    }
}
