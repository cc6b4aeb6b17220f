//! Damaged model files: an error or a model of no more than twice their size, never a panic.

use crate::fixtures::source_models::run::SourceModel;
use crate::fixtures::source_models::{ncnn_model, tfjs_models, tflite_model};

/// Numbers that look random: xorshift.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// One to four changes: a bit, a byte, a word of a size that breaks things, a piece cut out or doubled.
fn damage(file: &mut Vec<u8>, dice: &mut Dice) {
    for _ in 0..=dice.below(4) {
        let at = dice.below(file.len());
        let Some(byte) = file.get_mut(at) else { return };
        match dice.below(6) {
            0 => *byte ^= 1 << dice.below(8),
            1 => *byte = dice.below(256) as u8,
            2 => *byte = b"0123456789-,.=e \""[dice.below(17)],
            3 => {
                let word = [0, -1, i32::MAX, i32::MIN, 1 << 24, 64][dice.below(6)].to_le_bytes();
                file.iter_mut().skip(at / 4 * 4).zip(word).for_each(|(byte, new)| *byte = new);
            }
            4 => drop(file.drain(at..(at + 1 + dice.below(40)).min(file.len()))),
            _ => {
                let piece = file[at..(at + 1 + dice.below(40)).min(file.len())].to_vec();
                file.splice(at..at, piece);
            }
        }
    }
}

fn all() -> [SourceModel; 4] {
    [tflite_model::small(), ncnn_model::small(), tfjs_models::movenet(), tfjs_models::nanodet()]
}

#[test]
fn no_damage_makes_the_conversion_panic_or_swell() {
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    for sound in all() {
        let mut n_errors = 0;
        for _ in 0..3000 {
            let mut model = sound.clone();
            let which = dice.below(model.files.len());
            damage(&mut model.files[which], &mut dice);
            let n_bytes: usize = model.files.iter().map(Vec::len).sum();
            match model.convert() {
                Ok(onnx) => assert!(onnx.len() < 4 * n_bytes + (1 << 20), "{} bytes", onnx.len()),
                Err(error) => {
                    n_errors += 1;
                    assert!(error.to_string().contains("cannot convert"), "{error:#}");
                }
            }
        }
        assert!(n_errors > 300, "{n_errors}");
    }
}

#[test]
fn a_file_that_ends_early_is_an_error() {
    for sound in all() {
        for which in 0..sound.files.len() {
            for n in 0..60 {
                let mut model = sound.clone();
                let n_bytes = model.files[which].len();
                model.files[which].truncate(n_bytes * n / 60);
                assert!(model.convert().is_err(), "{:?} file {which} {n}/60", model.format);
            }
        }
    }
}
