//! Tests of `orator_gesture::train::seq2seq::step`.

use candle_core::{Device, Tensor};
use orator_gesture::generate::seq2seq::architecture::{PADDING, UNKNOWN};
use orator_gesture::train::seq2seq::step::drop_words;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

#[test]
fn dropped_words_are_unknown_at_all_their_occurrences() {
    let numbers: Vec<u32> = (0..64 * 10 * 4).map(|i| [0, 2, 3, 4 + (i / 40) % 5][i as usize % 4]).collect();
    let words = Tensor::from_vec(numbers, (64, 10, 4), &Device::Cpu).unwrap();
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let same = drop_words(&words, 0.0, rng).unwrap();
    assert_eq!(same.to_vec3::<u32>().unwrap(), words.to_vec3::<u32>().unwrap());
    let dropped = drop_words(&words, 0.3, rng).unwrap().to_vec3::<u32>().unwrap();
    let mut n_unknown = 0;
    for segment in &dropped {
        assert!(segment.iter().all(|row| row[0] == PADDING && *row == segment[0]));
        n_unknown += segment[0].iter().filter(|number| **number == UNKNOWN).count();
    }
    assert!((35..80).contains(&n_unknown), "{n_unknown} of 192");
}
