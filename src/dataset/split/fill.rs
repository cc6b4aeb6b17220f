//! Filling of splits toward their shares by seconds.

use orator_base::types::split::Split;

/// Seconds in each split beside those it should have.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// Split, its share 0..1, and its seconds; splits without a share are left out.
    splits: Vec<(Split, f64, f64)>,
    total_secs: f64,
}

impl Fill {
    /// Empty splits for `total_secs` in all, with these shares for validation and test.
    pub fn new(validation: f64, test: f64, total_secs: f64) -> Self {
        let shares = [(Split::Train, 1.0 - validation - test), (Split::Validation, validation), (Split::Test, test)];
        let splits = shares.into_iter().filter(|(_, share)| *share > 0.0).map(|(split, share)| (split, share, 0.0));
        Self { splits: splits.collect(), total_secs }
    }

    /// Adds seconds to a split.
    pub fn add(&mut self, split: Split, secs: f64) {
        self.splits.iter_mut().filter(|(other, ..)| *other == split).for_each(|(_, _, filled)| *filled += secs);
    }

    /// Splits with their shares.
    pub fn shares(&self) -> Vec<(Split, f64)> {
        self.splits.iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Splits without a second, with their shares, the largest share first.
    pub fn empty(&self) -> Vec<(Split, f64)> {
        let mut empty: Vec<_> = self.splits.iter().filter(|(.., filled)| *filled <= 0.0).collect();
        empty.sort_by(|a, b| b.1.total_cmp(&a.1));
        empty.into_iter().map(|(split, share, _)| (*split, *share)).collect()
    }

    /// Split that lacks most seconds. When only `n_left` videos are left for as many empty splits or more, an empty one.
    pub fn lacking_most(&self, n_left: usize) -> Split {
        let empty = self.empty();
        let may = |split: Split| n_left > empty.len() || empty.iter().any(|(other, _)| *other == split);
        let lacking = |(_, share, filled): &(Split, f64, f64)| share * self.total_secs - filled;
        // Of equals the first.
        let better = |a: Option<(Split, f64)>, b: (Split, f64)| Some(a.filter(|a| a.1 >= b.1).unwrap_or(b));
        let lacks = self.splits.iter().filter(|(split, ..)| may(*split)).map(|entry| (entry.0, lacking(entry)));
        lacks.fold(None, better).map_or(Split::Train, |(split, _)| split)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(secs: &[f64]) -> [f64; 3] {
        let mut fill = Fill::new(0.15, 0.15, secs.iter().sum());
        for (n, one) in secs.iter().enumerate() {
            let split = fill.lacking_most(secs.len() - n);
            fill.add(split, *one);
        }
        Split::ALL.map(|split| fill.splits.iter().find(|entry| entry.0 == split).unwrap().2)
    }

    #[test]
    fn the_emptiest_split_comes_next_and_none_stays_empty() {
        assert_eq!(filled(&[10.0; 10]), [70.0, 20.0, 10.0]);
        let few = |n: usize| {
            let mut fill = Fill::new(0.15, 0.15, n as f64);
            (0..n)
                .map(|k| {
                    let split = fill.lacking_most(n - k);
                    fill.add(split, 1.0);
                    split
                })
                .collect::<Vec<_>>()
        };
        assert_eq!(few(1), [Split::Train]);
        assert_eq!(few(2), [Split::Train, Split::Validation]);
        assert_eq!(few(3), [Split::Train, Split::Validation, Split::Test]);
        assert_eq!(few(4), [Split::Train, Split::Train, Split::Validation, Split::Test]);
        let mut fill = Fill::new(0.2, 0.0, 10.0);
        assert_eq!(fill.lacking_most(2), Split::Train);
        fill.add(Split::Train, 5.0);
        assert_eq!(fill.lacking_most(1), Split::Validation);
    }
}
