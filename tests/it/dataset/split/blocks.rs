//! Blocks of time: cut by the shares of the splits, and without audio that another split shares.

use orator_base::types::split::{Split, TimeBlock};
use orator_base::types::time::FrameRate;
use orator_dataset::split::blocks::{Span, conflicts, cut, lengths, usable, without};

const SHARES: [(Split, f64); 3] = [(Split::Train, 0.7), (Split::Validation, 0.15), (Split::Test, 0.15)];

#[test]
fn a_long_video_is_cut_in_turn_and_a_short_one_is_not() {
    let accepted = [(10.0, 310.0), (400.0, 700.0)];
    let blocks = cut(&accepted, 720.0, &SHARES, 8.0, 8.0).unwrap();
    let splits: Vec<_> = blocks.iter().filter_map(|block| block.split).collect();
    assert_eq!(splits, [Split::Train, Split::Validation, Split::Test]);
    let fps = FrameRate::new(10, 1);
    let secs: Vec<f64> = usable(&blocks, fps, 7_200, 80)
        .into_iter()
        .map(|(_, part)| {
            let overlap = |(start, end): &Span| end.min(fps.secs(part.end)) - start.max(fps.secs(part.start));
            accepted.iter().map(|span| overlap(span).max(0.0)).sum()
        })
        .collect();
    for (secs, (_, share)) in secs.iter().zip(SHARES) {
        assert!((secs / 584.0 - share).abs() < 0.01, "{secs} of {share}");
    }
    assert_eq!(cut(&[(0.0, 60.0)], 60.0, &SHARES, 8.0, 8.0), None);
    assert_eq!(cut(&[(0.0, 3_000.0)], 3_000.0, &SHARES, 8.0, 8.0).unwrap().len(), 15);
    // Short blocks are raised to the minimum at the expense of the longest.
    let raised = lengths(60.0, &SHARES, 8.0, 8.0, true).unwrap();
    assert!((raised[0].1 - 28.0).abs() < 1e-9 && raised[1].1 == 8.0 && raised[2].1 == 8.0, "{raised:?}");
    assert_eq!(lengths(30.0, &SHARES, 8.0, 8.0, true), None);
}

#[test]
fn shared_audio_is_excluded_where_the_splits_differ() {
    let block = |split, start_secs, end_secs| TimeBlock { split: Some(split), start_secs, end_secs };
    let own = [block(Split::Train, 0.0, 60.0), block(Split::Test, 60.0, 100.0)];
    let other = [block(Split::Train, 0.0, 40.0), block(Split::Validation, 40.0, 90.0)];
    // 10 s in the own video correspond to 20 s in the other.
    let found = conflicts(&own, (10.0, 70.0), &other, 10.0);
    let expected = [((30.0, 60.0), Split::Train, Split::Validation), ((60.0, 70.0), Split::Test, Split::Validation)];
    assert_eq!(found, expected);
    let holes: Vec<Span> = found.into_iter().map(|(span, ..)| span).collect();
    let left = without(&own, &holes);
    assert!(conflicts(&left, (10.0, 70.0), &other, 10.0).is_empty(), "{left:?}");
    assert_eq!(left.first().unwrap().end_secs, 29.0);
}
