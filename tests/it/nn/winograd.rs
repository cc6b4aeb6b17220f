//! Winograd's filtering against the definition of a convolution and of its gradients, in f64.

use orator_nn::cpu::axis::ConvAxis;
use orator_nn::cpu::direct_conv::{ConvSizes, forward, gradient_of_input, n_chunks};
use orator_nn::cpu::weight_gradient::gradient_of_weight;
use orator_nn::cpu::winograd::FilterTaps;
use std::sync::Mutex;

/// Calls `f` with the indices of every product: input, weight, output.
fn products(s: &ConvSizes, mut f: impl FnMut(usize, usize, usize)) {
    let [rows, columns] = s.axes;
    let outputs =
        (0..s.batch).flat_map(|b| (0..rows.n_out).flat_map(move |r| (0..columns.n_out).map(move |c| (b, r, c))));
    for (b, row, column) in outputs {
        for (down, across) in (0..rows.kernel).flat_map(|i| (0..columns.kernel).map(move |j| (i, j))) {
            let (r, c) = (row * rows.stride + down, column * columns.stride + across);
            let (Some(r), Some(c)) = (r.checked_sub(rows.pad), c.checked_sub(columns.pad)) else { continue };
            if r >= rows.n_in || c >= columns.n_in {
                continue;
            }
            for (o, i) in (0..s.n_out).flat_map(|o| (0..s.n_in).map(move |i| (o, i))) {
                f(
                    ((b * rows.n_in + r) * columns.n_in + c) * s.n_in + i,
                    ((o * s.n_in + i) * rows.kernel + down) * columns.kernel + across,
                    ((b * rows.n_out + row) * columns.n_out + column) * s.n_out + o,
                );
            }
        }
    }
}

fn numbers(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.37 + seed).sin()).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn forward_and_gradients_are_those_of_the_definition() {
    let alone = ConvAxis::valid(1, 1, 1);
    let same = |n| ConvAxis::same(n, 3, 1);
    let half = |n| ConvAxis::same(n, 4, 2);
    for (batch, n_in, n_out, axes) in [
        (13, 32, 40, [same(16), alone]),
        (3, 33, 32, [same(77), alone]),
        (13, 32, 32, [ConvAxis::valid(19, 3, 1), alone]),
        (9, 32, 35, [same(22), same(5)]),
        (13, 32, 40, [half(61), alone]),
        (5, 33, 32, [half(77), alone]),
        (17, 32, 35, [half(23), half(7)]),
    ] {
        let s = ConvSizes { batch, n_in, n_out, axes };
        assert!(FilterTaps::of(&s).is_some());
        let (x, weight, bias) = (numbers(s.len_in(), 0.0), numbers(s.len_weight(), 1.0), numbers(n_out, 2.0));
        let grad = numbers(s.len_out(), 3.0);
        let mut expected: Vec<f64> = bias.iter().copied().cycle().take(s.len_out()).collect();
        let (mut of_x, mut of_weight) = (vec![0.0; x.len()], vec![0.0; weight.len()]);
        products(&s, |i, w, o| {
            expected[o] += x[i] * weight[w];
            of_x[i] += grad[o] * weight[w];
            of_weight[w] += grad[o] * x[i];
        });
        let chunks = Mutex::new(Vec::new());
        let y = forward(&s, &x, &weight, &bias, |chunk, rows| chunks.lock().unwrap().push((chunk, rows.to_vec())));
        assert!(largest_difference(&y, &expected) < 1e-11);
        let mut chunks = chunks.into_inner().unwrap();
        chunks.sort_by_key(|(chunk, _)| *chunk);
        assert_eq!(chunks.len(), n_chunks(&s));
        assert_eq!(chunks.into_iter().flat_map(|(_, rows)| rows).collect::<Vec<f64>>(), y);
        assert!(largest_difference(&gradient_of_input(&s, &weight, &grad), &of_x) < 1e-11);
        assert!(largest_difference(&gradient_of_weight(&s, &x, &grad), &of_weight) < 1e-11);
    }
}
