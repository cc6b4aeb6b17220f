//! Named arrays in a `.npz` file; errors name the file, the array, what was expected and what was found. The meaning
//! of the arrays is documented in the modules of each file (`keypoints_npz`, `joints_npz`).

use super::npy;
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array1, ArrayD, array};
use ndarray_npy::{NpzWriter, ReadNpyError, WriteNpzError};
use orator_base::input;
use orator_base::types::time::FrameRate;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read as _, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Maximum total size of the arrays of a file, bytes: a day of keypoints at 30 fps.
const MAX_BYTES: u64 = 2 << 30;

/// An open `.npz` file.
pub struct Npz {
    path: PathBuf,
    /// Array names, one per archive entry, in archive order.
    names: Vec<String>,
    archive: ZipArchive<BufReader<File>>,
}

/// Expected length of one axis; `None` accepts any length.
pub type AxisLength = Option<usize>;

impl Npz {
    /// Opens the archive.
    ///
    /// # Errors
    ///
    /// The file is missing or no zip archive, or its arrays unpack to more than `MAX_BYTES` (or than the file itself).
    pub fn open(path: &Path) -> Result<Self> {
        let file = input::open(path).with_context(|| format!("cannot open {}", path.display()))?;
        let n_file_bytes = file.metadata().with_context(|| format!("cannot open {}", path.display()))?.len();
        let mut archive = ZipArchive::new(BufReader::new(file))
            .with_context(|| format!("{} is not an .npz file: expected the output of numpy.savez", path.display()))?;
        let mut n_bytes = 0u64;
        for at in 0..archive.len() {
            let entry = archive.by_index_raw(at).with_context(|| format!("{} is damaged", path.display()))?;
            n_bytes = n_bytes.saturating_add(entry.size());
        }
        // Uncompressed arrays take no more memory than disk space, so a large file is acceptable.
        let max_bytes = MAX_BYTES.max(n_file_bytes);
        ensure!(
            n_bytes <= max_bytes,
            "{}: the arrays unpack to more than {} MiB, the limit; save fewer arrays in one file",
            path.display(),
            max_bytes >> 20
        );
        let name = |i| archive.name_for_index(i).unwrap_or_default();
        let names = (0..archive.len()).map(|i| name(i).strip_suffix(".npy").unwrap_or(name(i)).to_owned()).collect();
        Ok(Self { path: path.to_owned(), names, archive })
    }

    /// Array names, in file order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether the file contains array `name`.
    pub fn has(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// Numeric array of any float or integer type, converted to f64.
    pub fn numbers(&mut self, name: &str, shape: &[AxisLength]) -> Result<ArrayD<f64>> {
        let found = npy::numbers(&self.bytes(name)?);
        let Some(array) = self.readable(name, found)? else {
            bail!("{}: array `{name}` has an unsupported type; save it as float32 or float64", self.path.display());
        };
        self.check(name, array.shape(), shape)?;
        Ok(array)
    }

    pub fn floats(&mut self, name: &str, shape: &[AxisLength]) -> Result<ArrayD<f32>> {
        let bytes = self.bytes(name)?;
        if let Some(array) = self.readable(name, npy::typed(&bytes))? {
            self.check(name, array.shape(), shape)?;
            return Ok(array);
        }
        Ok(self.numbers(name, shape)?.mapv(|v| v as f32))
    }

    pub fn bools(&mut self, name: &str, shape: &[AxisLength]) -> Result<ArrayD<bool>> {
        let found = npy::typed(&self.bytes(name)?);
        let Some(array) = self.readable(name, found)? else {
            bail!("{}: array `{name}` must be of type bool", self.path.display());
        };
        self.check(name, array.shape(), shape)?;
        Ok(array)
    }

    /// Frame rate in array `name`: either numerator and denominator, or one number of frames per second.
    pub fn frame_rate(&mut self, name: &str) -> Result<FrameRate> {
        let values = self.numbers(name, &[])?.into_raw_vec_and_offset().0;
        let rate = match values[..] {
            [rate] => FrameRate::nearest(rate),
            [num, den] if num >= 1.0 && den >= 1.0 && num.max(den) <= 1e9 && num.fract() + den.fract() == 0.0 => {
                Some(FrameRate::new(num as u32, den as u32))
            }
            [num, den] => FrameRate::nearest(num / den),
            _ => None,
        };
        rate.with_context(|| {
            format!(
                "{}: invalid frame rate `{name}` {values:?}: expected one number, or numerator and denominator",
                self.path.display()
            )
        })
    }

    /// Scalar string (`<U`, four bytes per character); `None` if the array is missing or is not a single string.
    pub fn text(&mut self, name: &str) -> Option<String> {
        let bytes = self.has(name).then(|| self.bytes(name).ok()).flatten()?;
        let data_at = bytes.iter().position(|&byte| byte == b'\n')? + 1;
        let header = std::str::from_utf8(bytes.get(10..data_at)?).ok()?;
        let one_text =
            header.contains("'descr': '<U") && ["()", "(1,)"].iter().any(|s| header.contains(&format!("'shape': {s}")));
        let characters = bytes.get(data_at..)?.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let characters =
            characters.take_while(|&character| character != 0).map(|l| char::from_u32(l).unwrap_or('\u{fffd}'));
        one_text.then(|| characters.collect())
    }

    /// Raw bytes of the array's `.npy` entry; the size in its header is checked before the data are decompressed.
    fn bytes(&mut self, name: &str) -> Result<Vec<u8>> {
        let Some(at) = self.names.iter().position(|n| n == name) else {
            bail!("{} has no array `{name}`; found: {}", self.path.display(), self.names.join(", "));
        };
        let unreadable = || format!("{}: array `{name}` cannot be read", self.path.display());
        let entry = self.archive.by_index(at).with_context(unreadable)?;
        let stated = entry.size();
        // An entry may unpack to more bytes than the archive declares: read one byte past that size to detect it.
        let mut entry = entry.take(stated.saturating_add(1));
        let mut bytes = Vec::new();
        entry.by_ref().take(npy::MAX_HEADER_BYTES).read_to_end(&mut bytes).with_context(unreadable)?;
        if let Some(in_header) = npy::file_bytes(&bytes) {
            ensure!(
                in_header == stated,
                "{}: array `{name}` has {stated} bytes, but its header states {in_header}: copy or save the file again",
                self.path.display()
            );
        }
        entry.read_to_end(&mut bytes).with_context(unreadable)?;
        ensure!(bytes.len() as u64 == stated, "{}: its size differs from the stated {stated} bytes", unreadable());
        Ok(bytes)
    }

    /// Adds the names of the file and the array to a read error.
    fn readable<T>(&self, name: &str, found: Result<T, ReadNpyError>) -> Result<T> {
        found.with_context(|| format!("{}: array `{name}` cannot be read", self.path.display()))
    }

    /// Checks the shape of an array; an empty `expected` accepts every shape.
    fn check(&self, name: &str, shape: &[usize], expected: &[AxisLength]) -> Result<()> {
        let fits =
            shape.len() == expected.len() && shape.iter().zip(expected).all(|(&n, want)| want.is_none_or(|w| w == n));
        if !expected.is_empty() && !fits {
            let expected: Vec<String> =
                expected.iter().map(|axis| axis.map_or_else(|| "T".to_owned(), |n| n.to_string())).collect();
            bail!("{}: array `{name}` has shape {shape:?}, expected [{}]", self.path.display(), expected.join(", "));
        }
        Ok(())
    }
}

/// Writes the arrays that `add` adds to a new file. The bytes are deterministic.
pub fn write(path: &Path, add: impl FnOnce(&mut NpzWriter<NpzOutput>) -> Result<(), WriteNpzError>) -> Result<()> {
    let attempt = || -> Result<()> {
        let mut npz = NpzWriter::new(NpzOutput::create(path)?);
        add(&mut npz)?;
        npz.finish()?.finish()
    };
    attempt().with_context(|| format!("cannot write {}", path.display()))
}

/// Writer that records its first error for `finish` and ignores all later writes. `NpzWriter` writes the end of the
/// archive when it is dropped, even after an error, and would print that this failed.
pub struct NpzOutput<W = BufWriter<File>> {
    to: W,
    at: u64,
    error: Option<io::Error>,
}

impl NpzOutput {
    pub(crate) fn create(path: &Path) -> Result<Self> {
        Ok(Self::new(BufWriter::new(File::create(path)?)))
    }
}

impl<W: Write + Seek> NpzOutput<W> {
    fn new(to: W) -> Self {
        Self { to, at: 0, error: None }
    }

    /// Flushes the file. Errors: the first error of any write.
    pub(crate) fn finish(mut self) -> Result<()> {
        let flushed = self.to.flush();
        Ok(self.error.map_or(flushed, Err)?)
    }

    /// Result of an I/O operation, or `otherwise` if this or an earlier operation failed.
    fn step<T>(&mut self, otherwise: T, step: impl FnOnce(&mut W) -> io::Result<T>) -> T {
        if self.error.is_some() {
            return otherwise;
        }
        step(&mut self.to).unwrap_or_else(|error| {
            self.error = Some(error);
            otherwise
        })
    }
}

impl<W: Write + Seek> Write for NpzOutput<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.step((), |to| to.write_all(bytes));
        self.at += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.step((), W::flush);
        Ok(())
    }
}

impl<W: Write + Seek> Seek for NpzOutput<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let otherwise = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            SeekFrom::End(_) => self.at,
        };
        self.at = self.step(otherwise, |file| file.seek(to));
        Ok(self.at)
    }
}

/// Numerator and denominator, as [`Npz::frame_rate`] reads them.
pub fn rate(fps: FrameRate) -> Array1<f64> {
    array![f64::from(fps.num), f64::from(fps.den)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::arr0;

    #[test]
    fn full_disk_is_reported_once_by_finish() {
        let write = |left: usize| {
            let mut disk = vec![0; left];
            let mut npz = NpzWriter::new(NpzOutput::new(io::Cursor::new(&mut disk[..])));
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
            assert!(is_added && kind == Some(io::ErrorKind::WriteZero), "{left}: {error:?}");
        }
    }

    /// Writes an archive whose entry `body.npy` has these bytes.
    fn archive(path: &Path, bytes: &[u8], compression: zip::CompressionMethod) {
        let options = zip::write::SimpleFileOptions::default().compression_method(compression);
        let mut zip = zip::ZipWriter::new(File::create(path).unwrap());
        zip.start_file("body.npy", options).unwrap();
        zip.write_all(bytes).unwrap();
        zip.finish().unwrap();
    }

    /// `.npy` bytes of an array of five numbers with another shape in the header.
    fn npy_with_shape(shape: &str) -> Vec<u8> {
        let mut bytes = Vec::new();
        ndarray_npy::WriteNpyExt::write_npy(&Array1::<f32>::zeros(5), &mut bytes).unwrap();
        npy::tests::with_shape(&bytes, "(5,)", shape)
    }

    fn file_with(dir: &Path, add: impl FnOnce(&mut NpzWriter<NpzOutput>) -> Result<(), WriteNpzError>) -> PathBuf {
        let path = dir.join("a.npz");
        write(&path, add).unwrap();
        path
    }

    #[test]
    fn frame_rate_is_a_number_or_a_fraction() {
        let dir = tempfile::tempdir().unwrap();
        let path = file_with(dir.path(), |npz| {
            npz.add_array("one", &arr0(15i64))?;
            npz.add_array("ntsc", &array![29.97f64])?;
            npz.add_array("pair", &rate(FrameRate::new(30000, 1001)))?;
            npz.add_array("bad", &array![f64::NAN])
        });
        let mut npz = Npz::open(&path).unwrap();
        assert_eq!(npz.frame_rate("one").unwrap(), FrameRate::new(15, 1));
        assert_eq!(npz.frame_rate("ntsc").unwrap(), FrameRate::new(30000, 1001));
        assert_eq!(npz.frame_rate("pair").unwrap(), FrameRate::new(30000, 1001));
        assert!(npz.frame_rate("bad").is_err());
    }

    #[test]
    fn errors_name_the_file_the_array_and_the_shape() {
        let dir = tempfile::tempdir().unwrap();
        let path = file_with(dir.path(), |npz| npz.add_array("body", &Array1::<f32>::zeros(5)));
        let mut npz = Npz::open(&path).unwrap();
        let text = format!("{:#}", npz.floats("body", &[None, Some(17)]).unwrap_err());
        assert!(text.contains("a.npz") && text.contains("[5]") && text.contains("[T, 17]"), "{text}");
        let text = format!("{:#}", npz.floats("hand", &[]).unwrap_err());
        assert!(text.contains("no array `hand`") && text.contains("body"), "{text}");
        std::fs::write(dir.path().join("b.npz"), b"no zip").unwrap();
        assert!(Npz::open(&dir.path().join("b.npz")).is_err());
        assert!(Npz::open(&dir.path().join("none.npz")).is_err());
    }

    /// Writes an archive of one array: `n_bytes` bytes, a header with this shape and then zeros.
    fn packed(path: &Path, shape: &str, n_bytes: usize) {
        let mut bytes = npy_with_shape(shape);
        bytes.resize(n_bytes, 0);
        archive(path, &bytes, zip::CompressionMethod::Deflated);
    }

    #[test]
    fn arrays_larger_than_declared_are_rejected() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        packed(&path, "(2097120,)", 8 << 20);
        assert!(std::fs::metadata(&path).unwrap().len() < 20_000);
        Npz::open(&path).unwrap().floats("body", &[]).unwrap();
        // Replaces the size in the local header and in the central directory.
        let stated = |n: u32| {
            let bytes = std::fs::read(&path).unwrap();
            let old = (8u32 << 20).to_le_bytes();
            let offsets: Vec<usize> = (0..bytes.len() - 4).filter(|&at| bytes[at..at + 4] == old).collect();
            let mut bytes = bytes.clone();
            offsets.iter().for_each(|&at| bytes[at..at + 4].copy_from_slice(&n.to_le_bytes()));
            let changed = dir.path().join("b.npz");
            std::fs::write(&changed, bytes).unwrap();
            Npz::open(&changed).and_then(|mut npz| npz.floats("body", &[])).map(drop)
        };
        let text = format!("{:#}", stated(1 << 20).unwrap_err());
        assert!(text.contains("b.npz") && text.contains("`body` has 1048576 bytes, but its header states"), "{text}");
        let text = format!("{:#}", stated(u32::MAX - 1).unwrap_err());
        assert!(text.contains("b.npz") && text.contains("unpack to more than 2048 MiB"), "{text}");
        packed(&path, "(8,)", 8 << 20);
        let text = format!("{:#}", Npz::open(&path).unwrap().floats("body", &[]).unwrap_err());
        assert!(text.contains("has 8388608 bytes, but its header states 160"), "{text}");
        archive(&path, &npy_with_shape("(1000000000000,)"), zip::CompressionMethod::Stored);
        let text = format!("{:#}", Npz::open(&path).unwrap().floats("body", &[]).unwrap_err());
        assert!(text.contains("a.npz") && text.contains("body"), "{text}");
    }
}
