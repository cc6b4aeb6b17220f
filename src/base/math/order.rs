//! Order statistics: median, quantile and the trimmed ends of a set of numbers. Non-finite numbers are ignored
//! everywhere. `median` and `quantile` may interpolate; the `lower_` and `upper_` variants return a number of the set.

use std::ops::{Add, Div};

/// A sortable floating-point number: f32 or f64.
pub trait Sortable: Copy + From<u8> + Into<f64> + Add<Output = Self> + Div<Output = Self> {}

impl<F: Copy + From<u8> + Into<f64> + Add<Output = F> + Div<Output = F>> Sortable for F {}

/// Finite numbers in ascending order. Every method returns `None` for an empty set.
#[derive(Clone, Debug)]
pub struct Ordered<F>(Vec<F>);

impl<F: Sortable> Ordered<F> {
    /// Sorts the finite numbers of `values`.
    pub fn new(values: impl IntoIterator<Item = F>) -> Self {
        let mut values: Vec<F> = values.into_iter().filter(|&value| value.into().is_finite()).collect();
        values.sort_unstable_by(|&a, &b| a.into().total_cmp(&b.into()));
        Self(values)
    }

    /// Number at `rank`, counted from 0 for the smallest.
    fn at(&self, rank: usize) -> Option<F> {
        self.0.get(rank).copied()
    }

    /// Middle number, or the mean of the two middle numbers.
    pub fn median(&self) -> Option<F> {
        Some((self.lower_quantile(0.5)? + self.upper_median()?) / F::from(2))
    }

    /// Middle number, or the larger of the two middle numbers.
    pub fn upper_median(&self) -> Option<F> {
        self.at(self.0.len() / 2)
    }

    /// Number at rank `share * (n - 1)`, rounded down; `share` is 0..=1.
    pub fn lower_quantile(&self, share: f64) -> Option<F> {
        self.at((share * self.0.len().checked_sub(1)? as f64).floor() as usize)
    }

    /// Smallest number after the smallest `n / part` numbers, rounded down, are trimmed.
    pub fn low_end(&self, part: usize) -> Option<F> {
        self.at(self.0.len() / part)
    }

    /// Largest number after the largest `n / part` numbers, rounded down, are trimmed.
    pub fn high_end(&self, part: usize) -> Option<F> {
        self.at(self.0.len().checked_sub(1 + self.0.len() / part)?)
    }
}

impl Ordered<f64> {
    /// Value at rank `share * (n - 1)`, interpolated between its neighbours (numpy's `quantile`); `share` is 0..=1.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let rank = share * self.0.len().checked_sub(1)? as f64;
        let (below, above) = (self.at(rank.floor() as usize)?, self.at(rank.ceil() as usize)?);
        Some(below + (above - below) * rank.fract())
    }
}

/// Middle number, or the mean of the two middle numbers.
pub fn median<F: Sortable>(values: impl IntoIterator<Item = F>) -> Option<F> {
    Ordered::new(values).median()
}

/// Middle number, or the smaller of the two middle numbers.
pub fn lower_median<F: Sortable>(values: impl IntoIterator<Item = F>) -> Option<F> {
    lower_quantile(values, 0.5)
}

/// Middle number, or the larger of the two middle numbers.
pub fn upper_median<F: Sortable>(values: impl IntoIterator<Item = F>) -> Option<F> {
    Ordered::new(values).upper_median()
}

/// Number at rank `share * (n - 1)`, rounded down; `share` is 0..=1.
pub fn lower_quantile<F: Sortable>(values: impl IntoIterator<Item = F>, share: f64) -> Option<F> {
    Ordered::new(values).lower_quantile(share)
}

/// Smallest number at which the cumulative weight reaches half of the total weight. Numbers must be finite.
pub fn weighted_median(mut values: Vec<(f64, u64)>) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: u64 = values.iter().map(|(_, weight)| weight).sum();
    let mut reached = 0;
    let half = values.into_iter().find(|(_, weight)| {
        reached += weight;
        2 * reached >= total
    });
    half.map(|(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
