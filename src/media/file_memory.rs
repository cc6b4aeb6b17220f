//! Memory backed by a temporary file: the system can write it out when memory is short, and it does not count as
//! private memory of the process. The file has no name and disappears with the process.

use anyhow::{Context, Result, ensure};
use memmap2::Mmap;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum size of a file, bytes. The file is sparse: unwritten parts take no disk space.
const CAPACITY: u64 = 64 << 30;
/// Alignment of each stored block, bytes, so that it can be reinterpreted as numbers.
const ALIGNMENT: u64 = 16;

/// A temporary file to which bytes are appended.
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
    /// Creates an empty file in `folder`.
    pub fn new(folder: &Path) -> Result<Self> {
        let create = || -> Result<Self> {
            let file = tempfile::tempfile_in(folder)?;
            file.set_len(CAPACITY)?;
            // SAFETY: the file has no name, so that no other process can write or truncate it; this type writes only
            // after `end` and hands out only bytes before it.
            let map = unsafe { Mmap::map(&file) }?;
            Ok(Self { folder: folder.to_owned(), file, map: Arc::new(map), end: 0 })
        };
        create().with_context(|| format!("cannot create a temporary file in {}", folder.display()))
    }

    /// Appends bytes.
    pub fn append(&mut self, bytes: &[u8]) -> Result<FileBytes> {
        let (start, end) = (self.end, self.end.saturating_add(bytes.len() as u64));
        ensure!(end <= CAPACITY, "temporary data exceeds {} GiB", CAPACITY >> 30);
        let written = self.file.write_all_at(bytes, start);
        written.with_context(|| format!("cannot write temporary data in {}", self.folder.display()))?;
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
