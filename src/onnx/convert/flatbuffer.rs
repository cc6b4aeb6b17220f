//! Reader for flatbuffer tables; every offset is checked against the end of the file.

use super::layout::int32s;
use anyhow::{Context, Result, ensure};

/// Maximum number of entries in a list of tables.
const MAX_TABLES: usize = 1 << 14;

/// A table: fields are accessed by number; absent ones have their default.
#[derive(Clone, Copy)]
pub(crate) struct FlatTable<'a> {
    file: &'a [u8],
    position: usize,
    /// Offsets of the fields from `position`, two bytes each.
    offsets: &'a [u8],
}

impl<'a> FlatTable<'a> {
    pub(crate) fn root(file: &'a [u8]) -> Result<Self> {
        Self::at(file, target(file, 0)?)
    }

    fn at(file: &'a [u8], position: usize) -> Result<Self> {
        let vtable_offset = i32::from_le_bytes(read(file, position)?);
        let vtable = position
            .checked_add_signed(-(vtable_offset as isize))
            .context("the field list of a table is outside the file")?;
        let n_bytes = usize::from(u16::from_le_bytes(read(file, vtable)?));
        let offsets = file.get(vtable + 4..vtable + n_bytes.max(4));
        Ok(Self { file, position, offsets: offsets.context("the field list of a table is outside the file")? })
    }

    /// Position of a field, if present.
    fn field(&self, field: usize) -> Option<usize> {
        let offset = self.offsets.get(2 * field..2 * field + 2)?;
        let offset = usize::from(offset[0]) | usize::from(offset[1]) << 8;
        (offset != 0).then_some(self.position + offset)
    }

    /// Reads an 8-bit number; 0 if absent.
    pub(crate) fn byte(&self, field: usize) -> Result<i8> {
        self.field(field).map_or(Ok(0), |at| Ok(i8::from_le_bytes(read(self.file, at)?)))
    }

    /// Reads a 32-bit number; `absent` if absent.
    pub(crate) fn int(&self, field: usize, absent: i32) -> Result<i32> {
        self.field(field).map_or(Ok(absent), |at| Ok(i32::from_le_bytes(read(self.file, at)?)))
    }

    pub(crate) fn table(&self, field: usize) -> Result<Option<Self>> {
        let Some(at) = self.field(field) else { return Ok(None) };
        Self::at(self.file, target(self.file, at)?).map(Some)
    }

    pub(crate) fn tables(&self, field: usize) -> Result<Vec<Self>> {
        let (n_tables, start, _) = self.list(field, 4)?;
        ensure!(n_tables <= MAX_TABLES, "a list has {n_tables} tables, expected at most {MAX_TABLES}");
        (0..n_tables).map(|k| Self::at(self.file, target(self.file, start + 4 * k)?)).collect()
    }

    /// Reads a list of at most `max` 32-bit numbers.
    pub(crate) fn ints(&self, field: usize, max: usize) -> Result<Vec<i32>> {
        let (n_ints, _, bytes) = self.list(field, 4)?;
        ensure!(n_ints <= max, "a list has {n_ints} numbers, expected at most {max}");
        Ok(int32s(bytes).collect())
    }

    /// Reads a list of bytes.
    pub(crate) fn bytes(&self, field: usize) -> Result<&'a [u8]> {
        Ok(self.list(field, 1)?.2)
    }

    /// The number of entries of a list, the position of the first one, and their bytes.
    fn list(&self, field: usize, n_bytes: usize) -> Result<(usize, usize, &'a [u8])> {
        let Some(at) = self.field(field) else { return Ok((0, 0, &[])) };
        let list = target(self.file, at)?;
        let (n_entries, start) = (u32::from_le_bytes(read(self.file, list)?) as usize, list + 4);
        let bytes = self.file.get(start..start.saturating_add(n_entries.saturating_mul(n_bytes)));
        Ok((
            n_entries,
            start,
            bytes.with_context(|| format!("a list of {n_entries} entries at byte {list} is truncated"))?,
        ))
    }
}

fn read<const N: usize>(file: &[u8], at: usize) -> Result<[u8; N]> {
    let bytes = at.checked_add(N).and_then(|end| file.get(at..end));
    let bytes = bytes.and_then(|bytes| bytes.try_into().ok());
    bytes.with_context(|| format!("the file ends before byte {}", at.saturating_add(N)))
}

/// Position to which the offset at `at` points.
fn target(file: &[u8], at: usize) -> Result<usize> {
    Ok(at + u32::from_le_bytes(read(file, at)?) as usize)
}
