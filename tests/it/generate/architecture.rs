//! Architectures of sequence-to-sequence networks.

use candle_core::Result;
use orator_base::types::time::FrameRate;
use orator_dataset::config::SequenceNetwork as Architecture;
use orator_formats::transcript::{Word, WordSource};
use orator_gesture::generate::seq2seq::architecture::{
    AROUND_SEGMENT_SECS, NumberedWord, UNKNOWN, Vocabulary, network_config, words, words_tensor,
};
use orator_nn::seq2seq::config::Config;

#[test]
fn sizes_at_20_fps_are_the_published_ones() {
    let config = network_config(FrameRate::new(20, 1), 45, 2, [150, 100]);
    assert_eq!(config, Config::default());
    let config = network_config(FrameRate::new(15, 1), 144, 2, [150, 100]);
    assert_eq!((config.predicted, config.previous, config.context), (15, 8, 47));
}

#[test]
fn words_around_a_pose_and_around_a_segment() -> Result<()> {
    let word = |number, start_secs: f64| NumberedWord { number, start_secs, end_secs: start_secs + 0.5 };
    let spoken_words = [word(2, 0.0), word(3, 2.0), word(4, 4.0), word(5, 7.0)];
    let fps = FrameRate::new(20, 1);
    // The segment is at 3 s to 4 s, its word context at 1 s to 6 s.
    let of_words = words(Architecture::Words, &spoken_words, [60, 20], fps, AROUND_SEGMENT_SECS);
    assert_eq!(of_words, [[3, 4]]);
    // No complete word lies between 2.6 s and 4.4 s, two lie between 1.9 s and 5.1 s.
    assert_eq!(words(Architecture::Words, &spoken_words, [60, 20], fps, 0.4), [Vec::<u32>::new()]);
    assert_eq!(words(Architecture::Words, &spoken_words, [60, 20], fps, 1.1), [[3, 4]]);
    // The word context of the pose at 3 s is 1.5 s to 4.5 s, that of the pose at 3.55 s starts at 2.05 s.
    let around = words(Architecture::Contextual, &spoken_words, [60, 20], fps, AROUND_SEGMENT_SECS);
    assert_eq!((around.len(), &around[0][..], &around[11][..]), (20, &[3, 4][..], &[4][..]));
    let tensor = words_tensor(Architecture::Words, &[of_words, vec![Vec::new()]])?;
    assert_eq!(tensor.map(|t| t.to_vec2::<u32>()).transpose()?, Some(vec![vec![3, 4], vec![0, 0]]));
    let silent = words_tensor(Architecture::Contextual, &[vec![Vec::new(); 20]])?;
    assert_eq!(silent.map(|t| t.dims().to_vec()), Some(vec![1, 20, 1]));
    assert!(words_tensor(Architecture::Adversarial, &[Vec::new()])?.is_none());
    Ok(())
}

#[test]
fn word_indices_ignore_case_and_full_stops() {
    let word = |text: &str| Word {
        word: text.into(),
        start_secs: 0.5,
        end_secs: 1.0,
        source: WordSource::Given,
        confidence: None,
    };
    let words = [word("The"), word("dog."), word("the"), word(" ")];
    let vocabulary = Vocabulary::of(&words);
    assert_eq!((vocabulary.words().len(), vocabulary.n_indices(), vocabulary.is_sorted()), (2, 4, true));
    assert_eq!(["dog", "DOG.", "the,", "cat", ""].map(|word| vocabulary.number(word)), [2, 2, 3, UNKNOWN, UNKNOWN]);
    let numbered = vocabulary.numbered(&words[1..2]);
    assert_eq!(numbered, [NumberedWord { number: 2, start_secs: 0.5, end_secs: 1.0 }]);
    let numbered = vocabulary.numbered_with(&[word("Cat"), word("dog")], |word| 10 + word.word.len() as u32);
    assert_eq!(numbered.iter().map(|word| word.number).collect::<Vec<_>>(), [13, 2]);
}
