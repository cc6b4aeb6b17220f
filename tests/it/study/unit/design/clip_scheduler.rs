//! Tests of `orator_study::design::clip_scheduler`.

use orator_study::design::clip_scheduler::{AssignedClip, ClipScheduler, williams};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::{BTreeMap, BTreeSet};

proptest::proptest! {
    #[test]
    fn counts_are_balanced_at_any_time(
        n_clips in 1usize..13, n_comparisons in 1usize..6, n_arrangements in 1usize..5,
        offset in 0usize..4, session_sizes in proptest::collection::vec(1usize..13, 1..40), seed in 0u64..100,
    ) {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let mut scheduler = ClipScheduler::new(n_clips, [n_comparisons, n_arrangements], offset, rng);
        let mut counts = [(); 3].map(|()| BTreeMap::<AssignedClip, usize>::new());
        for clip in 0..n_clips {
            for comparison in 0..n_comparisons {
                for arrangement in 0..n_arrangements {
                    let cell = |comparison, arrangement| AssignedClip { clip, comparison, arrangement };
                    counts[0].insert(cell(0, 0), 0);
                    counts[1].insert(cell(comparison, 0), 0);
                    counts[2].insert(cell(comparison, arrangement), 0);
                }
            }
        }
        for n in session_sizes {
            let chosen = scheduler.assign(n.min(n_clips));
            let clips: BTreeSet<usize> = chosen.iter().map(|assigned| assigned.clip).collect();
            assert_eq!(clips.len(), n.min(n_clips), "a clip occurs twice");
            for assigned in chosen {
                *counts[0].get_mut(&AssignedClip { comparison: 0, arrangement: 0, ..assigned }).unwrap() += 1;
                *counts[1].get_mut(&AssignedClip { arrangement: 0, ..assigned }).unwrap() += 1;
                *counts[2].get_mut(&assigned).unwrap() += 1;
            }
            for counts in &counts {
                assert!(counts.values().max().unwrap() - counts.values().min().unwrap() <= 1, "{counts:?}");
            }
        }
    }
}

#[test]
fn positions_and_neighbours_are_balanced() {
    for n in 1..12 {
        let rows = williams(n);
        let (mut positions, mut neighbours) = (BTreeMap::new(), BTreeMap::new());
        for row in &rows {
            row.iter().enumerate().for_each(|at| *positions.entry(at).or_insert(0) += 1);
            row.windows(2).for_each(|pair| *neighbours.entry((pair[0], pair[1])).or_insert(0) += 1);
        }
        assert_eq!((positions.len(), neighbours.len()), (n * n, n * (n - 1)));
        assert!(positions.values().all(|count| count * n == rows.len()), "{n}: {rows:?}");
        assert!(neighbours.values().all(|count| count * n == rows.len()), "{n}: {rows:?}");
    }
    assert_eq!(williams(1), [[0]]);
    assert!(williams(0).is_empty());
}
