//! Tests of `orator_gesture::metrics::space::embedding`.

use crate::evaluate::unit::fixed_rate::moving;
use ndarray::{Array2, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_gesture::metrics::space::embedding::{N, parse, windows};
use orator_gesture::metrics::space::fixed_rate::FPS;

const FILE: &[u8] = include_bytes!("../../../../../models/motion_embedding.safetensors");

#[test]
fn rows_depend_on_their_window_only_and_not_on_size() {
    let joints = moving(1100);
    let mut mask = Array2::from_elem((1100, N_JOINTS), true);
    let rows = windows(joints.view(), mask.view(), FPS);
    assert_eq!(rows.dim(), ((1100 - 34) / 4 + 1, N));
    for n in [0, 3, 255, 256, 266] {
        let at = 4 * n..4 * n + 34;
        let own = windows(joints.slice(s![at.clone(), .., ..]), mask.slice(s![at, ..]), FPS);
        assert!(own.row(0).iter().zip(rows.row(n)).all(|(a, b)| (a - b).abs() < 1e-4), "{n}");
    }
    let larger = windows((&joints * 1.3).view(), mask.view(), FPS);
    assert!(larger.iter().zip(&rows).all(|(a, b)| (a - b).abs() < 1e-3));
    mask[[50, 12]] = false;
    assert_eq!(windows(joints.view(), mask.view(), FPS).nrows(), (50 - 34) / 4 + 1 + (1049 - 34) / 4 + 1);
    assert_eq!(windows(joints.slice(s![..33, .., ..]), mask.slice(s![..33, ..]), FPS).dim(), (0, N));
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let joints = moving(700);
    let mask = Array2::from_elem((700, N_JOINTS), true);
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| {
            (
                windows(joints.view(), mask.view(), FPS),
                orator_gesture::metrics::space::basis::windows(joints.view(), mask.view(), FPS),
            )
        })
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn the_built_in_weights_are_valid() {
    parse(FILE).unwrap();
    assert!(FILE.len() < 1_000_000);
    let error = |bytes: &[u8]| format!("{:#}", parse(bytes).err().unwrap());
    assert!(error(include_bytes!("../../../../../models/hand_lifter.safetensors")).contains("motion-embedding"));
    error(&FILE[..1000]);
}
