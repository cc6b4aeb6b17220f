//! Tests of `orator_media::file_memory`.

use orator_media::file_memory::{FileBytes, FileMemory};

#[test]
fn stored_bytes_remain_valid_while_more_are_appended() {
    let mut memory = FileMemory::new(&std::env::temp_dir()).unwrap();
    let stored: Vec<FileBytes> =
        (0..50u8).map(|n| memory.append(&vec![n; 1000 * usize::from(n) + 1]).unwrap()).collect();
    drop(memory);
    for (n, bytes) in stored.iter().enumerate() {
        let bytes = bytes.as_slice();
        assert!(bytes.len() == 1000 * n + 1 && bytes.iter().all(|byte| usize::from(*byte) == n));
        assert_eq!(bytes.as_ptr() as usize % 16, 0);
    }
}
