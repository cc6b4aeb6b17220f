//! Latin squares balanced for first-order carry-over: every item occurs equally often in every position and after every
//! other item (Williams 1949).

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Rows of a carry-over-balanced Latin square of `n` items: `n` rows, or twice as many for an odd `n`.
pub(super) fn williams(n: usize) -> Vec<Vec<usize>> {
    // First row 0, 1, n - 1, 2, n - 2, ...: the differences of neighbours are all distinct modulo n.
    let first: Vec<usize> =
        (0..n).map(|position| if position % 2 == 1 { position / 2 + 1 } else { (n - position / 2) % n }).collect();
    let mut rows: Vec<Vec<usize>> = (0..n).map(|shift| first.iter().map(|item| (item + shift) % n).collect()).collect();
    if n % 2 == 1 && n > 1 {
        let mirrored: Vec<Vec<usize>> = rows.iter().map(|row| row.iter().rev().copied().collect()).collect();
        rows.extend(mirrored);
    }
    rows
}

/// Rows of a square, one per session in random order; every row is used once before any repeats.
pub struct SquareRows {
    square: Vec<Vec<usize>>,
    order: Vec<usize>,
    n_assigned: usize,
    rng: ChaCha8Rng,
}

impl SquareRows {
    pub fn new(n: usize, rng: ChaCha8Rng) -> Self {
        let square = williams(n);
        Self { order: (0..square.len()).collect(), square, n_assigned: 0, rng }
    }

    pub fn n_rows(&self) -> usize {
        self.square.len()
    }

    /// Index of the next row.
    pub fn next_row(&mut self) -> usize {
        let n_rows = self.square.len().max(1);
        if self.n_assigned.is_multiple_of(n_rows) {
            self.order.shuffle(&mut self.rng);
        }
        self.n_assigned += 1;
        self.order.get((self.n_assigned - 1) % n_rows).copied().unwrap_or(0)
    }

    /// Row with this index, modulo the number of rows.
    pub fn row(&self, number: usize) -> &[usize] {
        self.square.get(number % self.square.len().max(1)).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn positions_and_neighbours_are_balanced() {
        for n in 1..12 {
            let rows = williams(n);
            let (mut positions, mut neighbours) = (BTreeMap::new(), BTreeMap::new());
            for row in &rows {
                row.iter().enumerate().for_each(|at| *positions.entry(at).or_insert(0) += 1);
                row.windows(2).for_each(|pair| *neighbours.entry((pair[0], pair[1])).or_insert(0) += 1);
            }
            assert_eq!((positions.len(), neighbours.len()), (n * n, n * (n - 1)));
            assert!(positions.values().all(|count| count * n == rows.len()), "{n}: {rows:?}");
            assert!(neighbours.values().all(|count| count * n == rows.len()), "{n}: {rows:?}");
        }
        assert_eq!(williams(1), [[0]]);
        assert!(williams(0).is_empty());
    }
}
