//! The GRU layer against one of plain operators, and its gradients.

use candle_core::{Result, Tensor};
use orator_nn::cpu::vectorised::DropMask;
use orator_nn::ops::recurrent::cell::GruSizes;
use orator_nn::ops::recurrent::gru::{GruOptions, gru};
use orator_test_support::gradcheck::{check_thread_independence, max_difference, pattern, worst};

/// A unidirectional GRU composed of candle's operators.
fn composed(x: &Tensor, first: &Tensor, weights: &Tensor, reverse: bool) -> Result<Tensor> {
    let ((_, n_steps, input), hidden) = (x.dims3()?, first.dim(1)?);
    let part = |start: usize, rows: usize, columns: usize| {
        weights.narrow(0, start, rows * columns)?.reshape((rows, columns))?.t()?.contiguous()
    };
    let of_input = part(0, 3 * hidden, input)?;
    let of_state = part(3 * hidden * input, 3 * hidden, hidden)?;
    let start = 3 * hidden * (input + hidden);
    let input_bias = weights.narrow(0, start, 3 * hidden)?;
    let state_bias = weights.narrow(0, start + 3 * hidden, 3 * hidden)?;
    let sigmoid = |x: Tensor| -> Result<Tensor> { (x.neg()?.exp()? + 1.0)?.recip() };
    let (mut state, mut states) = (first.clone(), Vec::new());
    for k in 0..n_steps {
        let x = x.narrow(1, if reverse { n_steps - 1 - k } else { k }, 1)?.squeeze(1)?.contiguous()?;
        let a = x.matmul(&of_input)?.broadcast_add(&input_bias)?;
        let b = state.matmul(&of_state)?.broadcast_add(&state_bias)?;
        let gate = |of: &Tensor, i: usize| of.narrow(1, i * hidden, hidden);
        let r = sigmoid((gate(&a, 0)? + gate(&b, 0)?)?)?;
        let z = sigmoid((gate(&a, 1)? + gate(&b, 1)?)?)?;
        let n = ((sigmoid(((gate(&a, 2)? + (r * gate(&b, 2)?)?)? * 2.0)?)? * 2.0)? - 1.0)?;
        state = (&n + (z * (&state - &n)?)?)?;
        states.push(state.clone());
    }
    if reverse {
        states.reverse();
    }
    Tensor::stack(&states, 1)
}

fn inputs(n_directions: usize, batch: usize) -> Result<[Tensor; 3]> {
    let sizes = GruSizes { input: 3, hidden: 4 };
    Ok([
        pattern(&[batch, 5, 3], 0.0)?,
        pattern(&[n_directions, batch, 4], 7.0)?,
        (pattern(&[n_directions * sizes.n_weights()], 3.0)? * 0.7)?,
    ])
}

#[test]
fn layer_equals_the_composed_one_and_gradients_are_correct() -> Result<()> {
    for (n_directions, last, batch) in [(1, false, 2), (1, true, 3), (2, false, 10), (2, true, 2)] {
        let inputs = inputs(n_directions, batch)?;
        let own = |v: &[Tensor]| gru(&v[0], &v[1], &v[2], GruOptions { n_directions, last, mask: None });
        let by_parts = |v: &[Tensor]| {
            let n = v[2].dim(0)? / n_directions;
            let way = |d: usize| composed(&v[0], &v[1].get(d)?, &v[2].narrow(0, d * n, n)?, d == 1);
            let y = Tensor::cat(&(0..n_directions).map(way).collect::<Result<Vec<_>>>()?, 2)?;
            if last { y.narrow(1, 4, 1)?.squeeze(1) } else { Ok(y) }
        };
        let (off, error) = (max_difference(&inputs, own, by_parts)?, worst(&inputs, own)?);
        assert!(off < 1e-12 && error < 1e-7, "{n_directions} {last}: {off:e} {error:e}");
    }
    Ok(())
}

#[test]
fn dropped_values_have_no_gradient() -> Result<()> {
    let mask = Some(DropMask::new(5, 0.4));
    let dropped = |v: &[Tensor]| gru(&v[0], &v[1], &v[2], GruOptions { n_directions: 2, last: false, mask });
    let inputs = inputs(2, 3)?;
    assert!(worst(&inputs, dropped)? < 1e-7);
    let y = dropped(&inputs)?.flatten_all()?.to_vec1::<f64>()?;
    assert!(y.contains(&0.0) && y.iter().any(|v| *v != 0.0));
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
    let weights = 2 * GruSizes { input: 26, hidden: 50 }.n_weights();
    let options = GruOptions { n_directions: 2, last: false, mask: Some(DropMask::new(1, 0.2)) };
    check_thread_independence(&[&[150, 7, 26], &[2, 150, 50], &[weights]], 2, |v| {
        gru(&v[0], &v[1], &(&v[2] * 0.2)?, options)
    })
}

#[test]
fn mismatched_shapes_are_errors() -> Result<()> {
    let [x, first, weights] = inputs(1, 2)?;
    let options = GruOptions { n_directions: 1, last: false, mask: None };
    assert!(gru(&x, &first, &weights, options).is_ok());
    assert!(gru(&x, &first, &weights.narrow(0, 1, 10)?, options).is_err());
    assert!(gru(&x, &first, &weights, GruOptions { n_directions: 2, ..options }).is_err());
    Ok(())
}
