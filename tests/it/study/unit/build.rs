//! Unit tests of `orator_study::build`.

use orator_study::build::{common_bytes, padded};

#[test]
fn films_are_padded_to_equal_size() {
    let lengths = [4_080, 4_085, 12, 4_088];
    let n_bytes = common_bytes(lengths);
    assert_eq!((n_bytes, common_bytes([4_089]), common_bytes([])), (4_096, 8_192, 4_096));
    for length in lengths {
        let film = padded(vec![7; length], n_bytes).unwrap();
        assert_eq!(film.len(), n_bytes);
        let free = &film[length..];
        assert_eq!((&free[..4], &free[4..8]), (&((n_bytes - length) as u32).to_be_bytes()[..], &b"free"[..]));
        assert!(free[8..].iter().all(|byte| *byte == 0));
        assert!(padded(film, n_bytes + 3).is_err());
    }
}
