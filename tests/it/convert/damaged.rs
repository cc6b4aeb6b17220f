//! Damaged model files give an error or a model of bounded size, never a panic.

use crate::fixtures::source_models::run::SourceModel;
use crate::fixtures::source_models::{ncnn_model, tfjs_models, tflite_model};

/// Pseudo-random numbers by xorshift.
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// Makes one to four changes: a flipped bit, another byte, an extreme word, a part removed or duplicated.
fn damage(file: &mut Vec<u8>, rng: &mut Xorshift) {
    for _ in 0..=rng.below(4) {
        let at = rng.below(file.len());
        let Some(byte) = file.get_mut(at) else { return };
        match rng.below(6) {
            0 => *byte ^= 1 << rng.below(8),
            1 => *byte = rng.below(256) as u8,
            2 => *byte = b"0123456789-,.=e \""[rng.below(17)],
            3 => {
                let word = [0, -1, i32::MAX, i32::MIN, 1 << 24, 64][rng.below(6)].to_le_bytes();
                file.iter_mut().skip(at / 4 * 4).zip(word).for_each(|(byte, new)| *byte = new);
            }
            4 => drop(file.drain(at..(at + 1 + rng.below(40)).min(file.len()))),
            _ => {
                let part = file[at..(at + 1 + rng.below(40)).min(file.len())].to_vec();
                file.splice(at..at, part);
            }
        }
    }
}

fn models() -> [SourceModel; 4] {
    [tflite_model::small(), ncnn_model::small(), tfjs_models::movenet(), tfjs_models::nanodet()]
}

#[test]
fn damage_causes_neither_panics_nor_oversized_models() {
    let mut rng = Xorshift(0x9e37_79b9_7f4a_7c15);
    for valid in models() {
        let mut n_errors = 0;
        for _ in 0..3000 {
            let mut model = valid.clone();
            let index = rng.below(model.files.len());
            damage(&mut model.files[index], &mut rng);
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
fn a_truncated_file_is_an_error() {
    for valid in models() {
        for index in 0..valid.files.len() {
            for n in 0..60 {
                let mut model = valid.clone();
                let n_bytes = model.files[index].len();
                model.files[index].truncate(n_bytes * n / 60);
                assert!(model.convert().is_err(), "{:?} file {index} {n}/60", model.format);
            }
        }
    }
}
