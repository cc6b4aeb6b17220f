//! The Frechet distances in both fixed spaces grow with the strength of a disturbance.

use crate::fixtures::disturbed::{Disturbance, table, unseen};

#[test]
fn distances_in_both_fixed_spaces_grow_with_the_disturbance() {
    let rows = table(&unseen(6).unwrap());
    let of = |disturbance: Disturbance, space: usize| {
        rows.iter().find(|row| row.disturbance == disturbance).unwrap().distances[space]
    };
    use Disturbance::{MeanPose, NoiseMm, Scrambled, Smoothed, StiffHands};
    for space in [1, 2] {
        let baseline = of(Disturbance::None, space);
        for levels in [
            [NoiseMm(5.0), NoiseMm(10.0), NoiseMm(20.0), NoiseMm(50.0)],
            [Scrambled(3), Scrambled(8), Scrambled(30), Scrambled(30)],
            [Smoothed(5), Smoothed(15), Smoothed(45), MeanPose],
        ] {
            let distances = levels.map(|disturbance| of(disturbance, space));
            assert!(distances.is_sorted(), "space {space}, {levels:?}: {distances:?}");
            assert!(distances[3] > 1.5 * baseline, "space {space}, {levels:?}: {distances:?}, floor {baseline}");
        }
        assert!(of(StiffHands, space) > 1.5 * baseline, "space {space}");
    }
    let order = of(Scrambled(30), 0) / of(Disturbance::None, 0);
    assert!((order - 1.0).abs() < 1e-6, "poses have no order: {order}");
}
