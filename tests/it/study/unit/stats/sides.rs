//! Tests of `orator_study::stats::cluster::sides`.

use orator_study::stats::cluster::sides::{SideBlock, side_p};

fn block(trials: &[(bool, bool)]) -> SideBlock {
    let mut block = SideBlock::default();
    trials.iter().for_each(|(real, chosen)| block.push(*real, *chosen));
    block
}

/// Two blocks of three trials with one and two real films on the left: compared with all nine assignments.
#[test]
fn p_is_the_share_of_all_assignments() {
    let (first, second) = ([true, false, false], [true, true, false]);
    for chosen in 0..64u32 {
        let chosen: Vec<bool> = (0..6).map(|k| chosen >> k & 1 == 1).collect();
        let right = |real: [bool; 3], chosen: &[bool]| (0..3).filter(|k| real[*k] == chosen[*k]).count() as f64;
        let mut draws = Vec::new();
        for a in 0..3 {
            for b in 0..3 {
                let (mut x, mut y) = (first, second);
                x.rotate_right(a);
                y.rotate_right(b);
                draws.push(right(x, &chosen[..3]) + right(y, &chosen[3..]));
            }
        }
        let mean = draws.iter().sum::<f64>() / 9.0;
        let far = |correct: f64| (correct - mean).abs();
        let p = draws.iter().filter(|draw| far(**draw) >= far(draws[0]) - 1e-9).count() as f64 / 9.0;
        let blocks = [(first, &chosen[..3]), (second, &chosen[3..])]
            .map(|(real, chosen)| block(&real.into_iter().zip(chosen.iter().copied()).collect::<Vec<_>>()));
        let found = side_p(&blocks).unwrap();
        assert!((found - p).abs() < 1e-12, "{found} {p}");
    }
}

#[test]
fn always_choosing_left_is_no_evidence() {
    let left = block(&[(true, true), (false, true), (true, true), (false, true)]);
    assert_eq!(side_p(&[left, SideBlock::default()]), Ok(1.0));
    assert!(side_p(&[]).is_err() && side_p(&[SideBlock::default()]).is_err());
}
