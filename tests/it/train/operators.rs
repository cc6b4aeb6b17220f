//! Gradients of all operators used in training agree with finite differences, and the source does not use stock
//! operators with wrong or missing gradients.

use candle_core::{DType, Device, Result, Tensor};
use orator_test_support::gradcheck::{pattern, worst};
use std::fs;
use std::path::{Path, PathBuf};

/// Calls of stock operators that are broken (found by finite differences, batch 2) or slow, each with the reason.
const BROKEN: [(&str, &str); 16] = [
    (".conv2d(", "its gradient allows no slack, and is slow on a GPU; use nn::conv2d"),
    (".conv1d(", "its weight gradient is wrong for every batch larger than one; use nn::conv1d"),
    ("candle_nn::conv1d", "the same; use nn::conv1d"),
    ("Conv1dConfig", "the same; use nn::conv1d"),
    ("conv_transpose1d", "no backward; use nn::resize::twice and nn::conv1d"),
    ("upsample_nearest", "overwrites the gradient if its input is used again; use nn::resize::twice"),
    ("upsample_bilinear", "no backward"),
    ("interpolate1d", "no backward except for integer factors; use nn::resize::linear"),
    ("max_pool", "wrong gradient"),
    ("avg_pool", "wrong gradient at odd sizes"),
    ("layer_norm", "no gradient on the fast path"),
    ("LayerNorm", "no gradient on the fast path"),
    ("RmsNorm", "no gradient on the fast path"),
    ("softmax_last_dim", "no gradient; use softmax"),
    (".scatter", "wrong gradient; use index_add"),
    ("rope(", "no gradient; use rope_slow"),
];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

#[test]
fn broken_stock_operators_are_not_used() {
    let mut found = Vec::new();
    for path in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        let text = fs::read_to_string(&path).unwrap();
        if !text.contains("candle") {
            continue;
        }
        for (n, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")) {
            for (name, reason) in BROKEN.iter().filter(|(name, _)| line.contains(name)) {
                found.push(format!("{}:{}: {name}: {reason}", path.display(), n + 1));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A case: its name, the shapes of its inputs, and the operator.
type Case = (&'static str, &'static [&'static [usize]], fn(&[Tensor]) -> Result<Tensor>);

fn indices(values: &[u32]) -> Result<Tensor> {
    Tensor::new(values, &Device::Cpu)
}

/// The stock operators in use; the project's own (convolution, batch norm, resizing, losses, complete networks) are tested
/// in their modules. Inputs lie in -1..1.
const CASES: &[Case] = &[
    ("add", &[&[2, 3, 4], &[2, 3, 4]], |v| &v[0] + &v[1]),
    ("add, input used twice", &[&[2, 3, 4]], |v| &v[0].sqr()? + v[0].sin()?),
    ("subtract", &[&[2, 3], &[2, 3]], |v| &v[0] - &v[1]),
    ("multiply", &[&[2, 3], &[2, 3]], |v| &v[0] * &v[1]),
    ("divide", &[&[2, 3], &[2, 3]], |v| &v[0] / (v[1].sqr()? + 0.5)?),
    ("add and multiply a number", &[&[2, 3]], |v| (&v[0] * 3.0)? - 1.0),
    ("broadcast add", &[&[2, 3, 4], &[1, 3, 1]], |v| v[0].broadcast_add(&v[1])),
    ("broadcast multiply", &[&[2, 3, 4], &[1, 3, 1]], |v| v[0].broadcast_mul(&v[1])),
    ("broadcast subtract", &[&[2, 3, 4], &[1, 3, 1]], |v| v[0].broadcast_sub(&v[1])),
    ("broadcast divide", &[&[2, 3, 4], &[1, 3, 1]], |v| v[0].broadcast_div(&(v[1].sqr()? + 0.5)?)),
    ("square", &[&[2, 3]], |v| v[0].sqr()),
    ("square root", &[&[2, 3]], |v| (v[0].sqr()? + 0.1)?.sqrt()),
    ("absolute value", &[&[2, 3]], |v| v[0].abs()),
    ("sine", &[&[2, 3]], |v| v[0].sin()),
    ("exponential", &[&[2, 3]], |v| v[0].exp()),
    ("logarithm", &[&[2, 3]], |v| (v[0].sqr()? + 0.5)?.log()),
    ("negation", &[&[2, 3]], |v| v[0].neg()?.exp()),
    ("maximum with a number", &[&[2, 9]], |v| v[0].maximum(0.1)),
    ("clamp", &[&[2, 9]], |v| v[0].clamp(-0.5, 0.5)),
    ("leaky ReLU", &[&[2, 9]], |v| candle_nn::ops::leaky_relu(&v[0], 0.2)),
    ("ReLU", &[&[2, 9]], |v| v[0].relu()),
    ("hyperbolic tangent", &[&[2, 9]], |v| v[0].tanh()),
    ("index select, rows, repeated", &[&[5, 3]], |v| v[0].index_select(&indices(&[4, 0, 0, 2, 0])?, 0)),
    ("sum and mean", &[&[2, 3, 4]], |v| v[0].sum_all()? * v[0].mean_all()?),
    ("sum over a middle axis", &[&[2, 3, 4, 5]], |v| v[0].sum(2)),
    ("sum over an axis, keepdim", &[&[2, 3, 4]], |v| v[0].sqr()?.sum_keepdim(2)),
    ("mean over the last axis", &[&[2, 3, 4]], |v| v[0].sqr()?.mean(candle_core::D::Minus1)),
    ("mean over an axis, keepdim", &[&[2, 3, 4]], |v| v[0].mean_keepdim(2)),
    ("matrix product, right side transposed", &[&[3, 4], &[5, 4]], |v| v[0].matmul(&v[1].t()?)),
    ("concatenate", &[&[2, 3, 4], &[2, 2, 4]], |v| Tensor::cat(&[&v[0], &v[1], &v[0]], 1)),
    ("stack", &[&[2, 3], &[2, 3]], |v| Tensor::stack(&[&v[0], &v[1]], 1)),
    ("concatenate vectors, one used again", &[&[3], &[2]], |v| Tensor::cat(&[&v[0], &v[1], &v[0].sqr()?], 0)),
    ("narrow", &[&[2, 3, 7]], |v| v[0].narrow(2, 1, 5)?.sqr()? + v[0].narrow(2, 2, 5)?),
    ("reshape, transpose, squeeze", &[&[2, 3, 4]], |v| v[0].t()?.unsqueeze(1)?.contiguous()?.reshape((2, 12))),
    ("channels first, channels last", &[&[2, 3, 4, 2]], |v| v[0].permute((0, 3, 1, 2))?.contiguous()?.sqr()),
    ("strided view to matrix", &[&[2, 3, 6]], |v| v[0].reshape((2, 3, 2, 3))?.narrow(3, 1, 1)?.squeeze(3)),
    ("index select, axis 1, repeated", &[&[2, 3, 4]], |v| v[0].index_select(&indices(&[2, 0, 2, 1])?, 1)),
    ("index select, last axis, repeated", &[&[2, 3, 4]], |v| v[0].index_select(&indices(&[0, 0, 3, 1, 1])?, 2)),
    ("pad with zeros", &[&[2, 3, 4, 5]], |v| v[0].pad_with_zeros(2, 1, 2)?.pad_with_zeros(3, 0, 1)),
    ("broadcast as", &[&[2, 3, 1]], |v| v[0].broadcast_as((2, 3, 4))),
    // Used only by the reference of tests (`nn::composed`); no slack.
    ("conv2d, kernel 3", &[&[2, 2, 6, 5], &[3, 2, 3, 3]], |v| v[0].conv2d(&v[1], 0, 1, 1, 1)),
    ("conv2d, kernel 4, stride 2, no slack", &[&[2, 2, 8, 6], &[3, 2, 4, 4]], |v| v[0].conv2d(&v[1], 0, 2, 1, 1)),
    ("conv2d, kernel 3 x 4", &[&[2, 2, 6, 4], &[3, 2, 3, 4]], |v| v[0].conv2d(&v[1], 0, 1, 1, 1)),
    ("conv2d, one row high", &[&[2, 2, 1, 11], &[3, 2, 1, 3]], |v| v[0].conv2d(&v[1], 0, 2, 1, 1)),
    ("conv2d, one column wide", &[&[2, 2, 8, 1], &[3, 2, 4, 1]], |v| v[0].conv2d(&v[1], 0, 2, 1, 1)),
    ("conv2d, dilated", &[&[2, 2, 1, 13], &[3, 2, 1, 3]], |v| v[0].conv2d(&v[1], 0, 1, 3, 1)),
];

#[test]
fn gradients_of_the_stock_operators_in_use_are_correct() -> Result<()> {
    for (name, shapes, operator) in CASES {
        let inputs = shapes.iter().enumerate().map(|(i, shape)| pattern(shape, 1.0 + 31.0 * i as f64));
        let error = worst(&inputs.collect::<Result<Vec<_>>>()?, operator)?;
        assert!(error < 1e-7, "{name}: {error}");
    }
    Ok(())
}

#[test]
fn the_check_detects_an_incorrect_gradient() -> Result<()> {
    let detached = |v: &[Tensor]| v[0].sqr()? + v[0].detach().sin()?;
    assert!(worst(&[pattern(&[3, 3], 0.0)?], detached)? > 1e-2);
    let stock = |v: &[Tensor]| v[0].conv1d(&v[1], 0, 1, 1, 1);
    assert!(worst(&[pattern(&[2, 2, 7], 0.0)?, pattern(&[3, 2, 3], 1.0)?], stock)? > 1e-2, "fixed upstream");
    assert_eq!(pattern(&[2], 0.0)?.dtype(), DType::F64);
    Ok(())
}
