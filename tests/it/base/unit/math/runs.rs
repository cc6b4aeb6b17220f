//! Tests of `orator_base::math::runs`.

use orator_base::math::runs::true_ranges;

#[test]
fn ranges_are_maximal_and_cover_what_is_true() {
    for bits in 0u32..1 << 9 {
        let values: Vec<bool> = (0..9).map(|i| bits >> i & 1 == 1).collect();
        let ranges: Vec<_> = true_ranges(&values).collect();
        let covered: Vec<usize> = ranges.iter().cloned().flatten().collect();
        assert!(covered.into_iter().eq((0..9).filter(|i| values[*i])));
        assert!(ranges.windows(2).all(|pair| pair[0].end < pair[1].start), "{ranges:?}");
    }
    assert_eq!(true_ranges(&[]).count(), 0);
}
