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
