//! Convolutions with batch norm.

use super::composed::{self, ComposedNorm};
use candle_core::{DType, Result, Tensor};
use orator_nn::cpu::axis::Padding;
use orator_nn::ops::batch_norm::BatchNorm;
use orator_nn::ops::conv_norm::conv_norm;
use orator_nn::ops::conv2d;
use orator_nn::params::Params;
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern};

/// Inputs, kernels and strides like the networks', but small: over time, over time and frequency, even and odd.
const LAYERS: [(&[usize], &[usize], usize); 8] = [
    (&[2, 9, 2], &[3, 2, 3], 1),
    (&[2, 12, 2], &[3, 2, 4], 2),
    (&[2, 13, 2], &[3, 2, 4], 2),
    (&[3, 16, 2], &[3, 2, 4], 1),
    (&[2, 7, 2], &[3, 2, 1], 1),
    (&[2, 6, 5, 2], &[3, 2, 3, 3], 1),
    (&[2, 9, 8, 2], &[3, 2, 4, 4], 2),
    (&[2, 7, 7, 1], &[3, 1, 4, 4], 2),
];

#[test]
fn results_gradients_and_running_statistics_equal_those_of_candle() -> Result<()> {
    for ((shape, kernel, stride), (train, slope)) in
        LAYERS.into_iter().flat_map(|layer| [(true, 0.2), (true, 1.0), (false, 0.2)].map(|settings| (layer, settings)))
    {
        let inputs = [pattern(shape, 0.0)?, pattern(kernel, 7.0)?, pattern(&kernel[..1], 3.0)?];
        let s = conv2d::sizes(&inputs[0], &inputs[1], stride, Padding::Same)?;
        // Weights and running statistics like those of a layer in training.
        let norm = || -> Result<(Params, BatchNorm)> {
            let mut params = Params::with_dtype(0, DType::F64);
            let norm = BatchNorm::new(&mut params, "n", 3, 1e-3, 0.1, slope)?;
            for (i, (name, var)) in params.all().enumerate() {
                let around = if name.ends_with("bias") || name.ends_with("mean") { 0.0 } else { 1.5 };
                var.set(&(pattern(&[3], 5.0 + i as f64)? + around)?)?;
            }
            Ok((params, norm))
        };
        let (params, own) = norm()?;
        let tensors = params.tensors()?;
        let [weight, bias, mean, variance] =
            ["weight", "bias", "running_mean", "running_var"].map(|of| &tensors[&format!("n.{of}")]);
        let statistics = if train { None } else { Some([mean, variance]) };
        let composed_norm = ComposedNorm { weight, bias, statistics, eps: 1e-3, slope };
        let composed = |v: &[Tensor]| composed::conv_norm([&v[0], &v[1], &v[2]], &composed_norm, &s);
        let off = max_difference(&inputs, |v| conv_norm(&v[0], &v[1], &v[2], &own, s, train), |v| Ok(composed(v)?.0))?;
        assert!(off < 1e-11, "{shape:?} {kernel:?} {train} {slope}: {off:e}");
        if !train {
            continue;
        }
        // The running variance is the unbiased one.
        let (y, batch) = composed(&inputs)?;
        let n = (y.elem_count() / 3) as f64;
        let updated = params.tensors()?;
        for (name, before, batch, scale) in
            [("mean", mean, &batch[0], 1.0), ("var", variance, &batch[1], n / (n - 1.0))]
        {
            let expected = ((before * 0.9)? + (batch * (0.1 * scale))?)?;
            let off = (&updated[&format!("n.running_{name}")] - expected)?.abs()?.max_all()?.to_scalar::<f64>()?;
            assert!(off < 1e-12, "{name}: {off:e}");
        }
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    check_thread_independence(&[&[3, 40, 10, 20], &[70, 20, 3, 3], &[70]], 1, |v| {
        let norm = BatchNorm::new(&mut Params::new(0), "n", 70, 1e-3, 0.3, 0.2)?;
        conv_norm(&v[0], &v[1], &v[2], &norm, conv2d::sizes(&v[0], &v[1], 1, Padding::Same)?, true)
    })
}
