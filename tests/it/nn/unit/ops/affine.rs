//! Tests of `orator_nn::ops::affine`.

use candle_core::{Result, Tensor};
use orator_nn::ops::affine::affine;
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern, worst};

#[test]
fn layer_equals_the_composed_one_and_gradients_are_correct() -> Result<()> {
    for (shape, relu) in [(&[2, 5, 3][..], false), (&[7, 3], true), (&[1, 3], false)] {
        let inputs = [pattern(shape, 0.0)?, pattern(&[4, 3], 5.0)?, pattern(&[4], 9.0)?];
        let own = |v: &[Tensor]| affine(&v[0], &v[1], &v[2], relu);
        let composed = |v: &[Tensor]| {
            let y = v[0].reshape(((), 3))?.matmul(&v[1].t()?)?.broadcast_add(&v[2])?;
            let y = if relu { y.relu()? } else { y };
            y.reshape([&shape[..shape.len() - 1], &[4]].concat())
        };
        let (off, error) = (max_difference(&inputs, own, composed)?, worst(&inputs, own)?);
        assert!(off < 1e-12 && error < 1e-7, "{shape:?}: {off:e} {error:e}");
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    check_thread_independence(&[&[1500, 26], &[50, 26], &[50]], 1, |v| affine(&v[0], &v[1], &v[2], true))
}

#[test]
fn mismatched_shapes_are_errors() -> Result<()> {
    let (x, weight) = (pattern(&[2, 3], 0.0)?, pattern(&[4, 3], 0.0)?);
    assert!(affine(&x, &weight, &pattern(&[4], 0.0)?, false).is_ok());
    assert!(affine(&x, &weight, &pattern(&[3], 0.0)?, false).is_err());
    assert!(affine(&x.narrow(1, 0, 2)?, &weight, &pattern(&[4], 0.0)?, false).is_err());
    Ok(())
}
