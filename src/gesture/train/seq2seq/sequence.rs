//! Poses, audio features and words of an uninterrupted stretch of motion, in the form in which the networks read them.

use ndarray::{Array2, ArrayView1, ArrayViewMut1};
use orator_formats::transcript::Word;

/// Uninterrupted motion with its audio features and words.
#[derive(Clone, Debug)]
pub struct PoseSequence {
    /// Features of the poses [T, C]; unknown values are interpolated.
    pub poses: Array2<f32>,
    /// Mask [T, C] of the known values, which are trained on.
    pub known: Array2<bool>,
    /// Cepstra with half a context on either side [T + context - 1, 26].
    pub audio: Array2<f32>,
    /// Words with times in seconds from the first pose; empty if there is no transcript.
    pub words: Vec<Word>,
}

/// Training and validation sequences.
pub struct SequenceSplits {
    pub train: Vec<PoseSequence>,
    pub held_out: Vec<PoseSequence>,
    /// Warnings about the data, one sentence each.
    pub notes: Vec<String>,
}

impl PoseSequence {
    /// Sequence whose unknown values are interpolated between the known ones before and after them.
    pub fn new(mut poses: Array2<f32>, known: Array2<bool>, audio: Array2<f32>, words: Vec<Word>) -> Self {
        for (column, known) in poses.columns_mut().into_iter().zip(known.columns()) {
            interpolate(column, known);
        }
        Self { poses, known, audio, words }
    }
}

/// Interpolates linearly between known values and holds the first and the last; all 0 if none is known.
fn interpolate(mut values: ArrayViewMut1<f32>, known: ArrayView1<bool>) {
    let known_frames: Vec<usize> = (0..known.len()).filter(|t| known[*t]).collect();
    let (Some(&first), Some(&last)) = (known_frames.first(), known_frames.last()) else { return values.fill(0.0) };
    for t in 0..first {
        values[t] = values[first];
    }
    for t in last + 1..values.len() {
        values[t] = values[last];
    }
    for pair in known_frames.windows(2) {
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
    fn unknown_values_are_interpolated() {
        let mut values = array![9.0f32, 1.0, 9.0, 9.0, 4.0, f32::NAN];
        interpolate(values.view_mut(), aview1(&[false, true, false, false, true, false]));
        assert_eq!(values, array![1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        interpolate(values.view_mut(), aview1(&[false; 6]));
        assert_eq!(values, ndarray::Array1::<f32>::zeros(6));
    }
}
