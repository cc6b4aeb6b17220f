//! Convolutions in two dimensions.

use super::composed;
use candle_core::{Result, Tensor};
use orator_nn::cpu::axis::{ConvAxis, Padding};
use orator_nn::cpu::direct_conv::ConvSizes;
use orator_nn::ops::conv2d::{conv, sizes};
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern, worst};

/// Input, weight and bias of a batch of two.
fn inputs(s: &ConvSizes) -> Result<[Tensor; 3]> {
    let [rows, columns] = s.axes;
    Ok([
        pattern(&[2, rows.n_in, columns.n_in, s.n_in], 0.0)?,
        pattern(&[s.n_out, s.n_in, rows.kernel, columns.kernel], 7.0)?,
        pattern(&[s.n_out], 3.0)?,
    ])
}

#[test]
fn results_equal_those_of_candle_and_gradients_are_correct() -> Result<()> {
    let same = ConvAxis::same;
    let alone = ConvAxis::valid(1, 1, 1);
    for (n_in, n_out, axes) in [
        (3, 5, [same(9, 3, 1), alone]),
        (2, 3, [same(9, 1, 1), alone]),
        (2, 3, [same(1, 4, 2), alone]),
        (8, 9, [same(13, 4, 2), alone]),
        (2, 3, [same(8, 4, 1), alone]),
        (1, 9, [same(5, 3, 1), same(6, 3, 1)]),
        (3, 2, [same(7, 4, 2), same(6, 4, 2)]),
        (2, 3, [same(6, 4, 2), same(9, 4, 2)]),
        (2, 3, [ConvAxis::causal(9, 3, 1), alone]),
        (2, 3, [ConvAxis::causal(8, 4, 2), alone]),
        (8, 9, [ConvAxis::causal(13, 4, 2), alone]),
        (7, 1, [ConvAxis::valid(5, 3, 1), ConvAxis::valid(4, 4, 1)]),
    ] {
        let s = ConvSizes { batch: 2, n_in, n_out, axes };
        let own = |v: &[Tensor]| conv(&v[0], &v[1], &v[2], s);
        let (off, error) = (max_difference(&inputs(&s)?, own, |v| by_candle(v, &s))?, worst(&inputs(&s)?, own)?);
        assert!(off < 1e-12 && error < 1e-7, "{s:?}: {off:e} {error:e}");
    }
    Ok(())
}

fn by_candle(v: &[Tensor], s: &ConvSizes) -> Result<Tensor> {
    composed::conv(&v[0], &v[1], &v[2], s)
}

#[test]
fn panels_of_every_width_are_correct() -> Result<()> {
    for (n_in, n_out) in [(70, 96), (5, 113)] {
        let s = ConvSizes { batch: 2, n_in, n_out, axes: [ConvAxis::same(6, 4, 2), ConvAxis::same(3, 3, 2)] };
        let off = max_difference(&inputs(&s)?, |v| conv(&v[0], &v[1], &v[2], s), |v| by_candle(v, &s))?;
        assert!(off < 1e-9, "{n_in} to {n_out}: {off:e}");
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    check_thread_independence(&[&[3, 21, 10, 20], &[70, 20, 4, 4], &[70]], 1, |v| {
        conv(&v[0], &v[1], &v[2], sizes(&v[0], &v[1], 2, Padding::Same)?)
    })
}

#[test]
fn mismatched_shapes_are_errors() -> Result<()> {
    let x = pattern(&[2, 3, 4], 0.0)?;
    let same = |weight: &[usize]| sizes(&x, &pattern(weight, 0.0)?, 1, Padding::Same);
    assert!(same(&[5, 4, 3]).is_ok());
    assert!(same(&[5, 3, 3]).is_err());
    assert!(same(&[5, 4, 3, 3]).is_err());
    assert!(sizes(&x, &pattern(&[5, 4, 4], 0.0)?, 1, Padding::None).is_err());
    Ok(())
}
