//! Tests of `orator_gesture::generate::word_input`.

use anyhow::Result;
use orator_base::types::time::FrameRate;
use orator_gesture::generate::seq2seq::architecture::NumberedWord;
use orator_gesture::generate::word_input::WordFrameList;

#[test]
fn every_frame_has_the_word_that_is_spoken_there() -> Result<()> {
    let word = |number, start_secs: f64, end_secs| NumberedWord { number, start_secs, end_secs };
    // The third word is shorter than a frame; the last two overlap.
    let spoken = [word(2, 0.0, 0.2), word(3, 0.2, 0.31), word(4, 0.52, 0.53), word(5, 0.7, 1.2), word(6, 0.9, 1.0)];
    let fps = FrameRate::new(10, 1);
    let mut builder = WordFrameList::default();
    builder.push(&spoken, fps, (0..12).map(|t| fps.secs(t)));
    builder.push(&[], fps, (0..12).map(|t| fps.secs(t)));
    let frames = builder.frames(None)?;
    assert_eq!(frames.numbers.to_vec2::<u32>()?, [[2, 2, 3, 3, 0, 4, 0, 5, 5, 6, 6, 0], [0; 12]]);
    let times = frames.times.to_vec3::<f32>()?;
    let expected = [[0.0, 0.2], [0.1, 0.1], [0.0, 0.11], [0.1, 0.01], [0.0, 0.0], [0.0, 0.03]];
    for (times, expected) in times[0].iter().zip(expected) {
        assert!(times.iter().zip(expected).all(|(secs, expected)| (secs - expected).abs() < 1e-6), "{times:?}");
    }
    Ok(())
}
