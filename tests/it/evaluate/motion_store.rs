//! Motion of clips read once.

use ndarray::{Array3, s};
use orator_gesture::evaluate::clips::motion_store::{MotionStore, StoredMotion};

#[test]
fn motions_round_trip_through_memory_and_file() {
    let motion = |n: usize| Array3::from_shape_fn((n, 49, 3), |(t, j, k)| (1000 * n + 100 * t + 3 * j + k) as f32);
    let store = MotionStore::in_folder(&std::env::temp_dir(), 3 * 49 * 3 * 4);
    let accepted: Vec<StoredMotion> = (0..6).map(|n| store.keep(motion(n)).unwrap()).collect();
    let in_file = accepted.iter().filter(|motion| matches!(motion, StoredMotion::InFile(..))).count();
    assert_eq!(in_file, 3);
    drop(store);
    for (n, accepted) in accepted.iter().enumerate() {
        assert_eq!((accepted.view(), accepted.n_frames()), (motion(n).view(), n));
    }
    assert_eq!(accepted[5][[4, 48, 2]], motion(5)[[4, 48, 2]]);
    // Slices of longer motions, and arrays that are not in standard layout.
    let store = MotionStore::in_folder(&std::env::temp_dir(), 0);
    for part in [
        motion(5).slice_move(s![1..3, ..;2, ..]),
        motion(5).slice_move(s![2..4, .., ..]),
        motion(5).slice_move(s![..1, .., ..]),
        motion(5).slice_move(s![4..4, .., ..]),
        motion(5).permuted_axes([1, 0, 2]),
    ] {
        let accepted = store.keep(part.clone()).unwrap();
        assert_eq!((accepted.view(), StoredMotion::Held(part.clone()).view()), (part.view(), part.view()));
        assert!(part.indexed_iter().all(|((t, row, axis), v)| accepted[[t, row, axis]] == *v));
    }
}
