//! Convolutions with batch norm.

use candle_core::{DType, Result};
use orator_nn::ops::batch_norm::BatchNorm;
use orator_nn::ops::conv_norm::{conv_norm, fallback_conv_norm};
use orator_nn::ops::conv2d;
use orator_nn::ops::gradcheck::{check_thread_independence, max_difference, pattern};
use orator_nn::params::Params;

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
        let s = conv2d::same(&inputs[0], &inputs[1], stride)?;
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
        let ((_, own), (_, other)) = (norm()?, norm()?);
        let off = max_difference(
            &inputs,
            |v| conv_norm(&v[0], &v[1], &v[2], &own, s, train),
            |v| fallback_conv_norm(&v[0], &v[1], &v[2], &other, &s, train),
        )?;
        assert!(off < 1e-11, "{shape:?} {kernel:?} {train} {slope}: {off:e}");
        let (own, other) = (own.running()?, other.running()?);
        let pairs = own.mean.iter().chain(&own.variance).zip(other.mean.iter().chain(&other.variance));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12), "{own:?} {other:?}");
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    check_thread_independence(&[&[3, 40, 10, 20], &[70, 20, 3, 3], &[70]], 1, |v| {
        let norm = BatchNorm::new(&mut Params::new(0), "n", 70, 1e-3, 0.3, 0.2)?;
        conv_norm(&v[0], &v[1], &v[2], &norm, conv2d::same(&v[0], &v[1], 1)?, true)
    })
}
