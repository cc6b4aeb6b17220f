//! Tests of `orator_gesture::metrics::distribution::moments`.

use ndarray::{array, s};
use orator_gesture::metrics::distribution::moments::{add, packed_len, read};

#[test]
fn moments_of_parts_add_up() {
    let rows = array![[1.0, 2.0], [3.0, 5.0], [4.0, -1.0], [0.0, 2.0]];
    let mut packed = vec![0.0; packed_len(2)];
    add(rows.slice(s![..1, ..]), &mut packed);
    assert!(read(&packed, 2).is_none());
    add(rows.slice(s![1.., ..]), &mut packed);
    let (n, mean, covariance) = read(&packed, 2).unwrap();
    assert_eq!((n, mean), (4.0, array![2.0, 2.0]));
    let known = array![[10.0 / 3.0, -1.0], [-1.0, 6.0]];
    assert!((&covariance - &known).iter().all(|v| v.abs() < 1e-12));
}
