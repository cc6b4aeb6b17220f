//! TensorFlow.js: every supported kind of node, and the post-processing of MoveNet and NanoDet.

use crate::fixtures::source_models::picture::{Picture, half_pixel, numbers, sigmoid};
use crate::fixtures::source_models::run::assert_close;
use crate::fixtures::source_models::tfjs_models::{BINS, CELLS, SCALE, SIDE, movenet, movenet_with, nanodet};

/// Accessor to a weight of the shape [rows, columns, inputs, outputs].
fn weight(shape: [usize; 4], seed: usize) -> impl Fn(usize, usize, usize, usize) -> f32 {
    let values = numbers(shape.iter().product(), seed);
    move |row, column, input, output| values[((row * shape[1] + column) * shape[2] + input) * shape[3] + output]
}

fn depthwise(seed: usize) -> impl Fn(usize, usize, usize, usize) -> f32 {
    let at = weight([3, 3, 4, 1], seed);
    move |row, column, input, output| if input == output { at(row, column, input, 0) } else { 0.0 }
}

#[test]
fn movenet_heat_maps_are_weighted_by_distance_to_the_person() {
    let image = Picture::new([SIDE, SIDE, 3], |y, x, c| (y * 9 + x * 5 + c * 11) as f32);
    let Some(found) = movenet().run(&image.data) else { return };
    let shifted = image.padded([2, 2, 0, 0], 0.0);
    let (mean, factor, offset) = SCALE;
    let scaled = Picture::new([SIDE, SIDE, 3], |y, x, c| (shifted.at(y, x, c) - mean[c]) * factor[c] - offset);
    let bias = numbers(4, 2);
    // SAME: 8 and 4 cells with stride 2 are padded with zeros below and at the right.
    let conv = scaled.padded([0, 0, 1, 1], 0.0).convolved([3, 2, 4], weight([3, 3, 3, 4], 1), |c| bias[c]);
    let conv = conv.map(|number| number.clamp(0.0, 6.0));
    let deep = conv.padded([1; 4], 0.0).convolved([3, 1, 4], depthwise(3), |c| bias[c]).map(|number| number.max(0.0));
    let deeper = deep.padded([0, 0, 1, 1], 0.0).convolved([3, 2, 4], depthwise(3), |_| 0.0);
    let sum = deeper.resized(4, 4, half_pixel).add(&deep);
    let head = |k: usize, channels: usize| {
        let bias = numbers(channels, 8 + k);
        sum.convolved([1, 2, channels], weight([1, 1, 4, channels], 4 + k), |c| bias[c])
    };
    let (heat, centre, regression) = (head(0, 17), head(1, 1), head(2, 34));
    let cell_weights = [0.5, 1.0, 0.25, 0.75];
    let cell = |k: &usize| (sigmoid(centre.data[*k]) * cell_weights[*k] * 1e6) as i64;
    let best = (0..CELLS * CELLS).max_by_key(cell).unwrap();
    let (row, column) = (best / CELLS, best % CELLS);
    let weighted = Picture::new([CELLS, CELLS, 17], |y, x, c| {
        let down = y as f32 - (row as f32 + regression.at(row, column, 2 * c));
        let along = x as f32 - (column as f32 + regression.at(row, column, 2 * c + 1));
        let quarters = (down * down + along * along) * (4.0 / CELLS as f32).powi(2);
        sigmoid(heat.at(y, x, c)) / (1.0 + quarters * quarters)
    });
    assert!(deep.data.iter().any(|number| *number > 0.0) && weighted.data.iter().any(|number| *number > 0.05));
    assert_close(&found[0], &[1, 17, CELLS as i64, CELLS as i64], &weighted.channels_first());
}

#[test]
fn nanodet_gives_boxes_of_persons() {
    let image = Picture::new([32, 32, 3], |y, x, c| ((y * 9 + x * 5 + c * 11) % 64) as f32 / 64.0 - 0.5);
    let Some(found) = nanodet().run(&image.channels_first()) else { return };
    let bias = numbers(4, 2);
    let conv = image.padded([1; 4], 0.0).convolved([3, 4, 4], weight([3, 3, 3, 4], 1), |c| bias[c]);
    let leaky = conv.map(|number| if number < 0.0 { 0.1 * number } else { number });
    let first = leaky.padded([0, 0, 1, 1], -1e4).max_pooled(3, 2);
    let pooled = first.max_pooled(2, 2);
    let inputs = [first, Picture::joined(&[&pooled, &pooled]), pooled.resized(4, 4, half_pixel)];
    let channels = 80 + 4 * BINS;
    let mut rows = Vec::new();
    for (k, (input, kernel, stride)) in
        inputs.iter().zip([1, 1, 4]).zip([8.0, 16.0, 32.0]).map(|((a, b), c)| (a, b, c)).enumerate()
    {
        let bias = numbers(channels, 8 + k);
        let head =
            input.convolved([kernel, 1, channels], weight([kernel, kernel, input.channels, channels], 4 + k), |c| {
                bias[c]
            });
        for (y, x) in (0..head.height).flat_map(|y| (0..head.width).map(move |x| (y, x))) {
            // Two bins, 0 and one stride: the mean is the stride times the probability of the second.
            let side = |side: usize| {
                let bin = |bin: usize| head.at(y, x, 80 + side * BINS + bin);
                sigmoid(bin(1) - bin(0)) * stride
            };
            let centre = [(x as f32 + 0.5) * stride, (y as f32 + 0.5) * stride];
            let corners = [centre[0] - side(0), centre[1] - side(1), centre[0] + side(2), centre[1] + side(3)];
            rows.extend(corners);
            rows.push(sigmoid(head.at(y, x, 0)));
        }
    }
    assert!(conv.data.iter().any(|number| *number < 0.0) && rows.len() == 21 * 5);
    assert_close(&found[0], &[1, 21, 5], &rows);
}

#[test]
fn errors_name_the_cause() {
    let unknown = movenet_with("Swish").error();
    assert!(unknown.contains("kpt_heatmap_0/conv2d_5/BiasAdd\" (Swish)"), "{unknown}");
    let error_of = |from: &str, to: &str| {
        let mut model = nanodet();
        let text = String::from_utf8(model.files[0].clone()).unwrap();
        assert!(text.contains(from), "{from}");
        model.files[0] = text.replacen(from, to, 1).into_bytes();
        model.error()
    };
    for (from, to, expected) in [
        ("PartitionedCall/Add_37", "elsewhere", "neither"),
        ("\"input\":[\"conv\",\"bias\"]", "\"input\":[\"leaky\",\"bias\"]", "depends on its own result"),
        ("\"input\":[\"conv\",\"bias\"]", "\"input\":[\"conv\",\"lost\"]", "\"lost\""),
        ("\"shape\":[4],\"dtype\":\"int32\"", "\"shape\":[5],\"dtype\":\"int32\"", "ends inside this constant"),
        ("\"dtype\":\"float16\"", "\"dtype\":\"uint8\"", "\"weight\""),
        ("\"size\":\"32\"", "\"size\":\"-1\"", "invalid size -1"),
        ("VkFMSUQ=", "U0FN", "\"SAM\""),
    ] {
        let error = error_of(from, to);
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let mut model = nanodet();
    model.files.reverse();
    assert!(model.error().contains("not JSON"), "{}", model.error());
    model.files.pop();
    assert!(model.error().contains("2 file"), "{}", model.error());
}
