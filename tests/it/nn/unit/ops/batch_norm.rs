//! Tests of `orator_nn::ops::batch_norm`.

use candle_core::{DType, Device, Result, Tensor};
use orator_nn::cpu::vectorised::DropMask;
use orator_nn::ops::batch_norm::{BatchNorm, BatchNormOp, Statistics};
use orator_nn::ops::operator::CustomOperator;
use orator_nn::params::Params;
use orator_test_support::gradcheck::{max_difference, pattern, worst};
use std::sync::{Arc, OnceLock};

#[test]
fn results_equal_those_of_candle_and_gradients_are_correct() -> Result<()> {
    let fixed = Statistics { mean: vec![0.2, -0.3, 0.1], variance: vec![0.5, 1.5, 2.0] };
    for (shape, train, slope) in [
        (&[4, 3, 5][..], true, 1.0),
        (&[4, 3, 5], true, 0.2),
        (&[4, 3, 5], true, 0.0),
        (&[4, 3, 5], false, 0.2),
        (&[2, 3, 4, 5], true, 0.2),
        (&[5, 3], true, 0.0),
    ] {
        let inputs = [pattern(shape, 0.0)?, (pattern(&[3], 5.0)? + 1.5)?, pattern(&[3], 9.0)?];
        let own = |v: &[Tensor]| {
            let statistics = Arc::new(OnceLock::new());
            if !train {
                let _ = statistics.set(fixed.clone());
            }
            let op = BatchNormOp { statistics, eps: 1e-3, slope, train, dropout: None };
            v[0].apply_op3(&v[1], &v[2], CustomOperator(op))
        };
        let composed = |v: &[Tensor]| {
            let moved = v[0].transpose(0, 1)?;
            let rows = moved.flatten_from(1)?;
            let own = rows.mean_keepdim(1)?;
            let of_fixed = |values: &[f64]| Tensor::new(values, &Device::Cpu)?.unsqueeze(1);
            let (mean, variance) = match train {
                true => (own.clone(), rows.broadcast_sub(&own)?.sqr()?.mean_keepdim(1)?),
                false => (of_fixed(&fixed.mean)?, of_fixed(&fixed.variance)?),
            };
            let y = rows.broadcast_sub(&mean)?.broadcast_div(&(variance + 1e-3)?.sqrt()?)?;
            let y = y.broadcast_mul(&v[1].unsqueeze(1)?)?.broadcast_add(&v[2].unsqueeze(1)?)?;
            (y.relu()? - (y.neg()?.relu()? * slope)?)?.reshape(moved.shape())?.transpose(0, 1)?.contiguous()
        };
        let (off, error) = (max_difference(&inputs, own, composed)?, worst(&inputs, own)?);
        assert!(off < 1e-11 && error < 1e-7, "{shape:?}, train {train}, slope {slope}: {off:e} {error:e}");
    }
    Ok(())
}

#[test]
fn dropped_values_after_a_relu_have_no_gradient() -> Result<()> {
    let inputs = [pattern(&[6, 3, 5], 0.0)?, (pattern(&[3], 5.0)? + 1.5)?, pattern(&[3], 9.0)?];
    let dropped = |v: &[Tensor]| {
        let dropout = Some(DropMask::new(4, 0.3));
        let op = BatchNormOp { statistics: Arc::default(), eps: 1e-3, slope: 0.0, train: true, dropout };
        v[0].apply_op3(&v[1], &v[2], CustomOperator(op))
    };
    let error = worst(&inputs, dropped)?;
    assert!(error < 1e-7, "{error:e}");
    Ok(())
}

#[test]
fn training_normalises_and_evaluation_uses_the_running_statistics() -> anyhow::Result<()> {
    let mut params = Params::with_dtype(0, DType::F64);
    let norm = BatchNorm::new(&mut params, "n", 3, 0.0, 0.5, 1.0)?;
    let x = (pattern(&[8, 3, 7], 0.0)? * 3.0)?.affine(1.0, 2.0)?;
    let y = norm.forward(&x, true)?;
    let of_channel = |y: &Tensor| -> Result<Vec<f64>> { y.narrow(1, 1, 1)?.flatten_all()?.to_vec1() };
    let y = of_channel(&y)?;
    assert!(y.iter().sum::<f64>().abs() < 1e-9);
    assert!((y.iter().map(|v| v * v).sum::<f64>() / 56.0 - 1.0).abs() < 1e-9);
    for _ in 0..40 {
        norm.forward(&x, true)?;
    }
    let evaluated = of_channel(&norm.forward(&x, false)?)?;
    // The running variance is the unbiased one.
    let shrink = (55.0f64 / 56.0).sqrt();
    assert!(evaluated.iter().zip(&y).all(|(e, y)| (e - y * shrink).abs() < 1e-6));
    assert!(norm.forward(&x.narrow(1, 0, 2)?, true).is_err());
    Ok(())
}
