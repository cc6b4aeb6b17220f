//! Memory that lies in a temporary file: the system writes it out where memory is short, and it does not count as a
//! program's own. The file has no name and is gone with the program.

use anyhow::{Context, Result, ensure};
use memmap2::Mmap;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most bytes of a file. It has holes: what was not written takes no place.
const CAPACITY: u64 = 64 << 30;
/// What is kept begins at multiples of this, so that it can be seen as numbers.
const ALIGNMENT: u64 = 16;

/// A temporary file to which bytes are added.
pub struct FileMemory {
    folder: PathBuf,
    file: File,
    map: Arc<Mmap>,
    end: u64,
}

/// Bytes in a temporary file.
#[derive(Clone, Debug)]
pub struct FileBytes {
    map: Arc<Mmap>,
    range: Range<usize>,
}

impl FileMemory {
    /// An empty file in `folder`. Errors: no file can be made there.
    pub fn new(folder: &Path) -> Result<Self> {
        let made = || -> Result<Self> {
            let file = tempfile::tempfile_in(folder)?;
            file.set_len(CAPACITY)?;
            // SAFETY: the file has no name, so that nobody else can write or shorten it; this type writes only behind
            // its end, and gives out bytes before it.
            let map = unsafe { Mmap::map(&file) }?;
            Ok(Self { folder: folder.to_owned(), file, map: Arc::new(map), end: 0 })
        };
        made().with_context(|| format!("{}: no temporary file can be made in this folder", folder.display()))
    }

    /// Adds bytes. Errors: the disk is full.
    pub fn keep(&mut self, bytes: &[u8]) -> Result<FileBytes> {
        let (start, end) = (self.end, self.end.saturating_add(bytes.len() as u64));
        ensure!(end <= CAPACITY, "more than {} GiB of temporary data", CAPACITY >> 30);
        let written = self.file.write_all_at(bytes, start);
        written.with_context(|| format!("{}: temporary data cannot be written here", self.folder.display()))?;
        self.end = end.next_multiple_of(ALIGNMENT);
        Ok(FileBytes { map: self.map.clone(), range: usize::try_from(start)?..usize::try_from(end)? })
    }
}

impl FileBytes {
    /// The bytes.
    pub fn as_slice(&self) -> &[u8] {
        &self.map[self.range.clone()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_there_while_more_is_added() {
        let mut memory = FileMemory::new(&std::env::temp_dir()).unwrap();
        let kept: Vec<FileBytes> =
            (0..50u8).map(|n| memory.keep(&vec![n; 1000 * usize::from(n) + 1]).unwrap()).collect();
        drop(memory);
        for (n, bytes) in kept.iter().enumerate() {
            let bytes = bytes.as_slice();
            assert!(bytes.len() == 1000 * n + 1 && bytes.iter().all(|byte| usize::from(*byte) == n));
            assert_eq!(bytes.as_ptr() as usize % 16, 0);
        }
    }
}
