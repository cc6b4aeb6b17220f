//! Poses, sound and words of an uninterrupted piece of motion, as the networks read them.

use ndarray::{Array2, ArrayView1, ArrayViewMut1};
use orator_formats::transcript::Word;

/// Uninterrupted motion with its sound and words.
#[derive(Clone, Debug)]
pub struct PoseSequence {
    /// Numbers of the poses [T, C]; what is not known is filled.
    pub poses: Array2<f32>,
    /// Numbers to learn from [T, C].
    pub known: Array2<bool>,
    /// Cepstra with half a context on either side [T + context - 1, 26].
    pub audio: Array2<f32>,
    /// Words with times in seconds from the first pose; none where nothing is transcribed.
    pub words: Vec<Word>,
}

/// Sequences to train and to validate on.
pub struct SequenceSplits {
    pub train: Vec<PoseSequence>,
    pub held_out: Vec<PoseSequence>,
    /// What is doubtful about the data, a sentence each.
    pub notes: Vec<String>,
}

impl PoseSequence {
    /// A sequence whose unknown numbers are filled by the known ones before and behind them in time.
    pub fn new(mut poses: Array2<f32>, known: Array2<bool>, audio: Array2<f32>, words: Vec<Word>) -> Self {
        for (column, known) in poses.columns_mut().into_iter().zip(known.columns()) {
            fill(column, known);
        }
        Self { poses, known, audio, words }
    }
}

/// Straight lines between known values, the first and the last held; 0 where none is known.
fn fill(mut values: ArrayViewMut1<f32>, known: ArrayView1<bool>) {
    let at: Vec<usize> = (0..known.len()).filter(|t| known[*t]).collect();
    let (Some(&first), Some(&last)) = (at.first(), at.last()) else { return values.fill(0.0) };
    for t in 0..first {
        values[t] = values[first];
    }
    for t in last + 1..values.len() {
        values[t] = values[last];
    }
    for pair in at.windows(2) {
        for t in pair[0] + 1..pair[1] {
            let share = (t - pair[0]) as f32 / (pair[1] - pair[0]) as f32;
            values[t] = values[pair[0]] * (1.0 - share) + values[pair[1]] * share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{array, aview1};

    #[test]
    fn what_is_not_known_is_filled_in_time() {
        let mut values = array![9.0f32, 1.0, 9.0, 9.0, 4.0, f32::NAN];
        fill(values.view_mut(), aview1(&[false, true, false, false, true, false]));
        assert_eq!(values, array![1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        fill(values.view_mut(), aview1(&[false; 6]));
        assert_eq!(values, ndarray::Array1::<f32>::zeros(6));
    }
}
