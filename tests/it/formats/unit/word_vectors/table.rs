//! Tests of `orator_formats::word_vectors::table`.

use anyhow::Result;
use orator_formats::word_vectors::glove;
use orator_formats::word_vectors::table::{PADDING, WordVectors};
use std::path::Path;

/// Table converted from GloVe text.
fn table(dir: &Path, text: &str) -> Result<WordVectors> {
    let path = dir.join("w.safetensors");
    glove::convert(text.as_bytes(), &path)?;
    WordVectors::open(&path)
}

#[test]
fn words_are_looked_up_as_in_the_paper() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), "the 0.5 -1\nso 1e-3 2\n. 3 4\nu.s. 5 6\nthe 9 9\n").unwrap();
    assert_eq!((table.dim(), table.n_words()), (2, 4));
    let vector = |word: &str| table.vector(table.index(word)).unwrap();
    assert_eq!(
        (vector("The"), vector("so."), vector("."), vector("So,")),
        (vec![0.5, -1.0], vec![0.001, 2.0], vec![3.0, 4.0], vec![0.001, 2.0])
    );
    assert_eq!((vector("Straße"), table.vector(PADDING).unwrap()), (vec![1.0, 1.0], vec![0.0, 0.0]));
    assert!(table.vector(6).is_err());
    assert_eq!(table.n_known(["the", "der", "so"]), 2);
}

#[test]
fn truncated_files_are_errors_and_damage_does_not_panic() {
    let dir = tempfile::tempdir().unwrap();
    drop(table(dir.path(), "the 0.5 -1\nso 1 2\n").unwrap());
    let path = dir.path().join("w.safetensors");
    let file_bytes = std::fs::read(&path).unwrap();
    for end in 0..file_bytes.len() {
        std::fs::write(&path, &file_bytes[..end]).unwrap();
        assert!(WordVectors::open(&path).is_err(), "{end}");
    }
    for at in (0..512).step_by(3) {
        let mut bytes = file_bytes.clone();
        bytes[at] ^= 0x15;
        std::fs::write(&path, &bytes).unwrap();
        let _ = WordVectors::open(&path).map(|table| table.vector(2));
    }
}
