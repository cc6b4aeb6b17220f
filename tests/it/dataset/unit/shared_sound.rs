//! Tests of `orator_dataset::shared_sound`.

use orator_dataset::shared_sound::longest_at;

#[test]
fn silence_is_not_shared() {
    assert_eq!(longest_at(&[5; 300], &[5; 300], 0), Some((0, 0, 300)));
    assert_eq!(longest_at(&[0; 300], &[0; 300], 0), None);
}
