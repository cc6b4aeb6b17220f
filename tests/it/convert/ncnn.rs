//! ncnn: each kind of layer against plain arithmetic, and errors for invalid files.

use crate::fixtures::source_models::ncnn_model::{LAYERS, small, with_layers};
use crate::fixtures::source_models::picture::{Picture, align_corners, numbers};
use crate::fixtures::source_models::run::assert_close;

#[test]
fn layers_match_plain_arithmetic() {
    let image = Picture::new([6, 6, 2], |y, x, c| (y * 5 + x * 3 + c * 7) as f32 / 8.0 - 2.0);
    let Some(found) = small().run(&image.channels_first()) else { return };
    let (weight, bias) = (numbers(72, 1), numbers(4, 2));
    let at =
        |row: usize, column: usize, input: usize, output: usize| weight[((output * 2 + input) * 3 + row) * 3 + column];
    let conv = image.padded([1; 4], 0.0).convolved([3, 2, 4], at, |c| bias[c]).map(|number| number.max(0.0));
    let (weight, bias) = (numbers(18, 3), numbers(2, 4));
    let at = |row: usize, column: usize, input: usize, output: usize| {
        if input == output { weight[(output * 3 + row) * 3 + column] } else { 0.0 }
    };
    let deep = conv.part(0..2).padded([1; 4], 0.0).convolved([3, 1, 2], at, |c| bias[c]);
    let (weight, bias) = (numbers(8, 5), numbers(4, 6));
    let point = conv.part(2..4).convolved([1, 1, 4], |_, _, input, output| weight[output * 2 + input], |c| bias[c]);
    let joined = Picture::joined(&[&deep, &point]);
    // Three groups of two channels become two groups of three.
    let mixed = Picture::new([3, 3, 6], |y, x, c| joined.at(y, x, c % 3 * 2 + c / 3));
    let sum = mixed.map(|number| number.max(0.0)).add(&mixed);
    let near = Picture::new([6, 6, 6], |y, x, c| sum.at(y / 2, x / 2, c));
    let both = near.add(&mixed.resized(6, 6, align_corners)).map(|number| number.max(0.0));
    assert!(mixed.data.iter().any(|number| *number < 0.0) && conv.data.iter().any(|number| *number > 0.0));
    assert_close(&found[0], &[1, 6, 6, 6], &both.channels_first());
    assert_close(&found[1], &[1, 6, 3, 3], &sum.map(|number| number.max(0.0)).channels_first());
}

#[test]
fn errors_name_the_cause() {
    let error_of = |from: &str, to: &str| with_layers(&LAYERS.replace(from, to)).error();
    for (from, to, expected) in [
        ("7767517", "7767516", "expected 7767517"),
        ("17 21", "18 21", "17 layers"),
        ("ReLU relu", "Swish relu", "\"relu\" (Swish)"),
        ("6=72", "6=73", "[4, 2, 3, 3]"),
        ("deep 0=2", "deep 0=3", "\"deep\" (ConvolutionDepthWise)"),
        ("0=9 1=2 2=3", "0=9 1=2 2=4", "\"reshape_0\" (Reshape)"),
        ("turned 0=2", "turned 0=3", "\"permute\" (Permute)"),
        ("sum\nInterp", "sum 0=2\nInterp", "\"add\" (BinaryOp)"),
        ("relu mixed_1 sum", "relu nothing sum", "\"nothing\""),
        ("0=2 3=6 4=6 6=1", "0=2 3=6 4=6", "\"even\" (Interp)"),
        ("-23300=2,-233,-233", "-23300=2,5,-233", "\"slice\" (Slice)"),
        ("0=4 1=1", "0=4 1=x", "line 7"),
        ("0=4 1=1", "0=4 8=1 1=1", "parameter 8"),
    ] {
        let error = error_of(from, to);
        assert!(error.contains(expected), "{error}");
    }
    let mut model = small();
    model.files[1].push(0);
    assert!(model.error().contains("1 byte of the .bin"), "{}", model.error());
    model.files[1].truncate(50);
    assert!(model.error().contains("\"conv\""), "{}", model.error());
}
