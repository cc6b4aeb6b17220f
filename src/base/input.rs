//! Opens and reads files that other programs wrote or other users sent: only regular files, of bounded size. Opening a
//! named pipe would wait for a writer, and a device may have no end.

use rustix::fs::OFlags;
use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Maximum size in bytes of a text file: configuration, JSON records, tables.
pub const MAX_TEXT: u64 = 256 << 20;
/// Maximum size in bytes of a file of motion, keypoints or weights.
pub const MAX_DATA: u64 = 4 << 30;

/// Opens a regular file for reading.
///
/// # Errors
/// Those of `File::open`; `path` is not a regular file. The message continues the file's name in the caller's context.
pub fn open(path: impl AsRef<Path>) -> Result<File> {
    let path = path.as_ref();
    // Without O_NONBLOCK, opening a named pipe waits for its writer. It changes nothing for regular files.
    let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32;
    let opened = OpenOptions::new().read(true).custom_flags(flags).open(path);
    // Sockets and some devices cannot be opened, and that error would not name the file type.
    let meta = opened.as_ref().map_or_else(|_| path.metadata(), File::metadata);
    match meta {
        Ok(meta) if !meta.is_file() => {
            let kind = kind_of(meta.file_type());
            Err(Error::new(ErrorKind::InvalidInput, format!("it is a {kind}, expected a regular file")))
        }
        _ => opened,
    }
}

/// Reads a regular file completely.
///
/// # Errors
/// Those of [`open`]; the file is larger than `max_bytes`.
pub fn read(path: impl AsRef<Path>, max_bytes: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let n_bytes = file.metadata()?.len();
    let mut bytes = Vec::new();
    if n_bytes <= max_bytes {
        bytes.try_reserve_exact(n_bytes as usize)?;
        // Limited again, because the file may grow while it is read.
        file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    }
    if n_bytes.max(bytes.len() as u64) > max_bytes {
        let shown = if max_bytes < 1 << 20 { format!("{max_bytes} bytes") } else { format!("{} MiB", max_bytes >> 20) };
        return Err(Error::new(ErrorKind::FileTooLarge, format!("it exceeds the limit of {shown}")));
    }
    Ok(bytes)
}

/// Reads a regular file of UTF-8 text completely.
///
/// # Errors
/// Those of [`read`]; the text is not UTF-8.
pub fn read_text(path: impl AsRef<Path>, max_bytes: u64) -> Result<String> {
    let text = String::from_utf8(read(path, max_bytes)?);
    text.map_err(|error| Error::new(ErrorKind::InvalidData, format!("it is not UTF-8 text: {}", error.utf8_error())))
}

fn kind_of(kind: FileType) -> &'static str {
    if kind.is_fifo() {
        "named pipe"
    } else if kind.is_socket() {
        "socket"
    } else if kind.is_dir() {
        "folder"
    } else {
        "device"
    }
}
