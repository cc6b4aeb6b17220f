//! Output of an archive that stays silent behind an error.

use anyhow::Result;
use std::io::{self, Seek, SeekFrom, Write};

/// Writer that keeps its first error for `finish` and takes what follows without writing it: an archive that is dropped
/// behind an error writes its end, and would print that it cannot.
pub struct NpzOutput {
    to: Box<dyn WriteAndSeek>,
    at: u64,
    error: Option<io::Error>,
}

trait WriteAndSeek: Write + Seek {}

impl<T: Write + Seek> WriteAndSeek for T {}

impl NpzOutput {
    /// Output to `to`.
    pub(super) fn new(to: impl Write + Seek + 'static) -> Self {
        Self { to: Box::new(to), at: 0, error: None }
    }

    /// Flushes what was written. Errors: the first one of any write.
    pub(super) fn finish(mut self) -> Result<()> {
        self.to.flush()?;
        Ok(self.error.map_or(Ok(()), Err)?)
    }

    fn keep<T>(&mut self, done: io::Result<T>, otherwise: T) -> T {
        done.unwrap_or_else(|error| {
            self.error.get_or_insert(error);
            otherwise
        })
    }
}

impl Write for NpzOutput {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = if self.error.is_none() {
            let written = self.to.write(bytes);
            self.keep(written, bytes.len())
        } else {
            bytes.len()
        };
        self.at += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.error.is_none() {
            let flushed = self.to.flush();
            self.keep(flushed, ());
        }
        Ok(())
    }
}

impl Seek for NpzOutput {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let otherwise = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            SeekFrom::End(_) => self.at,
        };
        self.at = if self.error.is_none() {
            let sought = self.to.seek(to);
            self.keep(sought, otherwise)
        } else {
            otherwise
        };
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array1;
    use ndarray_npy::NpzWriter;
    use std::io::Cursor;

    /// Disk with room for `left` more bytes.
    struct Disk {
        bytes: Cursor<Vec<u8>>,
        left: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let n = bytes.len().min(self.left);
            self.left -= n;
            if n == 0 && !bytes.is_empty() {
                Err(io::ErrorKind::StorageFull.into())
            } else {
                self.bytes.write(&bytes[..n])
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.bytes.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_one_error_at_the_end() {
        let write = |left: usize| {
            let mut npz = NpzWriter::new(NpzOutput::new(Disk { bytes: Cursor::default(), left }));
            let added = npz
                .add_array("a", &Array1::<f64>::zeros(100))
                .and_then(|()| npz.add_array("b", &Array1::<f64>::zeros(9)));
            (added.is_ok(), npz.finish().map_err(anyhow::Error::from).and_then(NpzOutput::finish))
        };
        assert!(write(10_000).1.is_ok());
        for left in (0..1200).step_by(37) {
            let (is_added, finished) = write(left);
            let error = finished.unwrap_err();
            let kind = error.downcast_ref::<io::Error>().map(io::Error::kind);
            assert!(is_added && kind == Some(io::ErrorKind::StorageFull), "{left}: {error:?}");
        }
    }
}
