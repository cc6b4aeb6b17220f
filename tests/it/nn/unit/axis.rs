//! Unit tests of `orator_nn::cpu::axis`.

use orator_nn::cpu::axis::ConvAxis;

#[test]
fn same_padding_is_tensorflows() {
    let same = |n_in, kernel, stride| ConvAxis::same(n_in, kernel, stride);
    let first = [(209, 4, 2), (63, 4, 2), (64, 4, 2), (16, 4, 1)].map(|(n, kernel, stride)| same(n, kernel, stride));
    assert_eq!(first.map(|axis| axis.pad), [1, 1, 1, 1]);
    assert_eq!(first.map(|axis| axis.n_out), [105, 32, 32, 16]);
    assert_eq!([(64, 3, 1), (64, 4, 2), (9, 4, 2)].map(|(n, k, s)| ConvAxis::causal(n, k, s).pad), [2, 2, 2]);
    assert_eq!([(64, 3, 1), (64, 4, 2), (9, 4, 2)].map(|(n, k, s)| ConvAxis::causal(n, k, s).n_out), [64, 32, 5]);
    assert_eq!([9, 11, 2].map(|n| ConvAxis::valid(n, 3, 3).n_out), [3, 3, 0]);
}
