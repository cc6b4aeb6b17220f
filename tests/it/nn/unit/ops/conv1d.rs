//! Tests of `orator_nn::ops::conv1d`.

use candle_core::{Result, Tensor};
use orator_nn::cpu::axis::ConvAxis;
use orator_nn::cpu::direct_conv::ConvSizes;
use orator_nn::ops::conv1d::conv1d;
use orator_nn::ops::conv2d;
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern, worst};

#[test]
fn results_equal_those_of_conv2d_and_gradients_are_correct() -> Result<()> {
    for (batch, axis) in [
        (2, ConvAxis::valid(9, 1, 1)),
        (3, ConvAxis::same(11, 3, 1)),
        (2, ConvAxis::same(13, 4, 2)),
        (2, ConvAxis::same(12, 4, 2)),
        (3, ConvAxis::valid(12, 3, 2)),
        (2, ConvAxis::same(8, 4, 1)),
        (2, ConvAxis::valid(9, 3, 3)),
        (3, ConvAxis::valid(11, 3, 3)),
        (2, ConvAxis::same(1, 4, 2)),
        (2, ConvAxis::valid(7, 1, 2)),
    ] {
        let x = pattern(&[batch, 3, axis.n_in], 0.0)?;
        let inputs = [x, pattern(&[4, 3, axis.kernel], 7.0)?, pattern(&[4], 3.0)?];
        let own = |v: &[Tensor]| conv1d(&v[0], &v[1], &v[2], axis);
        let channels_last = |v: &[Tensor]| {
            let axes = [axis, ConvAxis::valid(1, 1, 1)];
            conv2d::conv(&v[0].t()?, &v[1], &v[2], ConvSizes { batch, n_in: 3, n_out: 4, axes })?.t()
        };
        let (off, error) = (max_difference(&inputs, own, channels_last)?, worst(&inputs, own)?);
        assert!(off < 1e-12 && error < 1e-7, "{axis:?}: {off:e} {error:e}");
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    let axis = ConvAxis::same(61, 3, 1);
    check_thread_independence(&[&[5, 40, 61], &[70, 40, 3], &[70]], 1, |v| conv1d(&v[0], &v[1], &v[2], axis))
}

#[test]
fn mismatched_shapes_are_errors() -> Result<()> {
    let (x, bias) = (pattern(&[2, 3, 2], 0.0)?, pattern(&[4], 0.0)?);
    let fits = |weight: &[usize], bias: &Tensor| -> Result<bool> {
        Ok(conv1d(&x, &pattern(weight, 0.0)?, bias, ConvAxis::valid(2, weight[2], 1)).is_ok())
    };
    assert!(fits(&[4, 3, 1], &bias)? && !fits(&[4, 3, 3], &bias)? && !fits(&[4, 2, 1], &bias)?);
    assert!(!fits(&[4, 3, 1], &bias.narrow(0, 0, 1)?)?);
    Ok(())
}
