//! Medians, quantiles and orders of values.

use orator_base::math::order::{Ordered, lower_median, median, upper_median, weighted_median};

/// Ten numbers of known ranks, with ignored non-finite ones between them.
const TEN: [f64; 13] = [7.0, f64::NAN, -1.0, 3.0, 3.0, f64::INFINITY, 20.0, 0.5, 8.0, -4.0, 11.0, 5.0, f64::NAN];

#[test]
fn every_variant_returns_the_known_number() {
    // -4 -1 0.5 3 3 | 5 7 8 11 20
    let ten = Ordered::new(TEN);
    assert_eq!((median(TEN), lower_median(TEN), upper_median(TEN)), (Some(4.0), Some(3.0), Some(5.0)));
    let nine = TEN.map(|v| if v == 20.0 { f64::NAN } else { v });
    assert_eq!((median(nine), lower_median(nine), upper_median(nine)), (Some(3.0), Some(3.0), Some(3.0)));
    // numpy.quantile: 0 -> -4, 0.1 -> -1.3, 0.5 -> 4, 0.9 -> 11.9, 1 -> 20
    for (share, expected) in [(0.0, -4.0), (0.1, -1.3), (0.5, 4.0), (0.9, 11.9), (1.0, 20.0)] {
        assert!((ten.quantile(share).unwrap() - expected).abs() < 1e-12, "{share}");
    }
    assert_eq!([0.0, 0.3, 0.7, 0.99, 1.0].map(|q| ten.lower_quantile(q).unwrap()), [-4.0, 0.5, 7.0, 11.0, 20.0]);
    assert_eq!([10, 5, 3].map(|part| ten.low_end(part).unwrap()), [-1.0, 0.5, 3.0]);
    assert_eq!([10, 5, 3, 50].map(|part| ten.high_end(part).unwrap()), [11.0, 8.0, 7.0, 20.0]);
    assert_eq!(median([1.0f32, 2.0]), Some(1.5));
}

#[test]
fn an_empty_set_has_no_median() {
    let none = Ordered::new([f64::NAN]);
    assert_eq!((none.median(), none.upper_median(), none.quantile(0.5)), (None, None, None));
    assert_eq!((none.low_end(10), none.high_end(10), none.lower_quantile(0.7)), (None, None, None));
    assert_eq!((weighted_median(Vec::new()), Ordered::new([2.0f32]).high_end(10)), (None, Some(2.0)));
}

#[test]
fn weighted_median_reaches_half_of_the_weight() {
    assert_eq!(weighted_median(vec![(0.9, 50), (0.2, 40), (0.3, 100)]), Some(0.3));
    assert_eq!(weighted_median(vec![(2.0, 1), (1.0, 1)]), Some(1.0));
}
