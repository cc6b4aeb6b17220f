//! TFLite: each operator against plain arithmetic, and errors for invalid files.

use crate::fixtures::source_models::picture::{Picture, half_pixel, numbers, sigmoid};
use crate::fixtures::source_models::run::assert_close;
use crate::fixtures::source_models::tflite_model::{ending_with, small};

#[test]
fn operators_match_plain_arithmetic() {
    let image = Picture::new([4, 4, 2], |y, x, c| (y * 5 + x * 3 + c * 7) as f32 / 8.0 - 1.0);
    let Some(found) = small().run(&image.data) else { return };
    let (weight, bias) = (numbers(54, 1), numbers(3, 2));
    // SAME over 6 x 5 with stride 2: a row below, a column on each side.
    let padded = image.padded([1, 0, 1, 1], 0.0).padded([0, 1, 1, 1], 0.0);
    let at =
        |row: usize, column: usize, input: usize, output: usize| weight[((output * 3 + row) * 3 + column) * 2 + input];
    let conv = padded.convolved([3, 2, 3], at, |c| bias[c]).map(|number| number.clamp(0.0, 6.0));
    let deep = numbers(12, 3);
    let at = |row: usize, column: usize, input: usize, output: usize| {
        if input == output { deep[(row * 2 + column) * 3 + input] } else { 0.0 }
    };
    let deep = conv.convolved([2, 1, 3], at, |c| bias[c]);
    let slope = numbers(3, 4);
    let sloped =
        Picture::new([2, 2, 3], |y, x, c| deep.at(y, x, c) * if deep.at(y, x, c) < 0.0 { slope[c] } else { 1.0 });
    let pooled = sloped.resized(4, 4, half_pixel).max_pooled(2, 2);
    let joined = Picture::joined(&[&sloped.add(&pooled).map(|number| number.max(0.0)), &pooled]);
    let weight = numbers(12, 5);
    let mean = |c: usize| joined.data.iter().skip(c).step_by(6).sum::<f32>() / 4.0;
    let product: Vec<f32> = (0..2).map(|row| (0..6).map(|c| weight[row * 6 + c] * mean(c)).sum()).collect();
    assert!(deep.data.iter().any(|number| *number < 0.0) && conv.data.iter().any(|number| *number > 0.0));
    assert_eq!(found.len(), 3);
    assert_close(&found[0], &[1, 2, 2, 6], &joined.map(sigmoid).data);
    assert_close(&found[1], &[1, 2], &product);
    assert_close(&found[2], &[1, 24], &joined.data);
}

#[test]
fn errors_name_the_cause() {
    let unknown = ending_with(99).error();
    assert!(unknown.contains("operator 14 (builtin operator 99)"), "{unknown}");
    let mut model = small();
    model.options.outputs.pop();
    assert!(model.error().contains("4 outputs"), "{}", model.error());
    let mut model = small();
    model.options.input.shape[1] = 5;
    assert!(model.error().contains("[1, 4, 4, 2]"), "{}", model.error());
    let mut model = small();
    model.files[0].truncate(100);
    assert!(model.error().contains("TFLite"), "{}", model.error());
    model.files.push(Vec::new());
    assert!(model.error().contains("1 file"), "{}", model.error());
}
