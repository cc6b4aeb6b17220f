//! NumPy `.npy` files: motion as a plain array [T, 49, 3] (NaN: missing joint; no frame rate), and the float32 and
//! bool arrays of a shard (version 1.0, little endian, C order), whose rows are located without reading the complete
//! file. Every size in a header is checked against the bytes present before memory is allocated.

use anyhow::{Context as _, bail, ensure};
use ndarray::{Array, Array3, ArrayD, Dimension, IxDyn};
use ndarray_npy::npy::header::Header;
use ndarray_npy::{ReadNpyError, ReadNpyExt as _, ReadableElement, WriteNpyExt as _};
use orator_base::input;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

/// Reads a motion at `fps` from an f32 or f64 array [T, 49, 3] or [T, 147] (joint by joint), in metres. Joints with a
/// non-finite coordinate are missing and cleared in the mask.
pub fn read(path: &Path, fps: FrameRate) -> anyhow::Result<Motion> {
    let bytes = input::read(path, input::MAX_DATA).with_context(|| format!("cannot open {}", path.display()))?;
    let numbers = match typed::<f32>(&bytes) {
        Ok(None) => parse::<f64, IxDyn>(&bytes).map(|array| array.mapv(|v| v as f32)),
        Ok(Some(array)) => Ok(array),
        Err(error) => Err(error),
    };
    let numbers = numbers.with_context(|| format!("{} is not a .npy file of float32 or float64", path.display()))?;
    let shape = numbers.shape().to_vec();
    let is_motion = matches!(shape[..], [_, N_JOINTS, 3]) || matches!(shape[..], [_, n] if n == 3 * N_JOINTS);
    ensure!(
        is_motion,
        "{} has shape {shape:?}, expected [frames, {N_JOINTS}, 3] or [frames, {}]",
        path.display(),
        3 * N_JOINTS
    );
    let joints = Array3::from_shape_vec((shape[0], N_JOINTS, 3), numbers.iter().copied().collect())?;
    Ok(Motion::from_joints(fps, joints))
}

/// Maximum size of a header including magic string and length field, bytes.
pub(crate) const MAX_HEADER_BYTES: u64 = 1 << 16;

/// Total size in bytes of the file that begins with `head`, computed from its header; `None` if the header is invalid
/// or its element type is not numeric.
pub(crate) fn file_bytes(head: &[u8]) -> Option<u64> {
    if !has_small_header(head) {
        return None;
    }
    let mut rest = head;
    let header = Header::from_reader(&mut rest).ok()?;
    let n_header = (head.len() - rest.len()) as u64;
    // The digits of a type descriptor (`<f4`, `|b1`) give the bytes per element.
    let kind = header.type_descriptor.as_string()?;
    let bytes: u64 = kind.trim_start_matches(['<', '>', '|', '=']).strip_prefix(['f', 'i', 'u', 'b'])?.parse().ok()?;
    header.shape.iter().try_fold(bytes, |n, &axis| n.checked_mul(axis as u64))?.checked_add(n_header)
}

/// Parses an array from its file's bytes. The size in the header is checked against them before memory is allocated.
pub(crate) fn parse<T: ReadableElement, D: Dimension>(bytes: &[u8]) -> Result<Array<T, D>, ReadNpyError> {
    if !has_small_header(bytes) {
        return Err(ReadNpyError::MissingData);
    }
    let n_numbers = Header::from_reader(&mut &*bytes)?.shape.iter().try_fold(1usize, |n, axis| n.checked_mul(*axis));
    // Every element takes at least one byte; the exact length is checked by the reader.
    if n_numbers.is_none_or(|n| n > bytes.len()) {
        return Err(ReadNpyError::MissingData);
    }
    Array::read_npy(bytes)
}

/// The array if its elements are of type `T`; `None` if they are of another type.
pub(crate) fn typed<T: ReadableElement>(bytes: &[u8]) -> Result<Option<ArrayD<T>>, ReadNpyError> {
    match parse::<T, IxDyn>(bytes) {
        Err(ReadNpyError::WrongDescriptor(_)) => Ok(None),
        array => array.map(Some),
    }
}

/// Numeric array (f32, f64, i64, i32 or u32) as f64; `None` if its elements are of another type.
pub(crate) fn numbers(bytes: &[u8]) -> Result<Option<ArrayD<f64>>, ReadNpyError> {
    Ok(if let Some(array) = typed::<f32>(bytes)? {
        Some(array.mapv(f64::from))
    } else if let Some(array) = typed::<f64>(bytes)? {
        Some(array)
    } else if let Some(array) = typed::<i64>(bytes)? {
        Some(array.mapv(|v| v as f64))
    } else if let Some(array) = typed::<i32>(bytes)? {
        Some(array.mapv(f64::from))
    } else {
        typed::<u32>(bytes)?.map(|array| array.mapv(f64::from))
    })
}

/// Whether the header is complete and has few brackets: its parser is recursive, so nesting would overflow the stack.
fn has_small_header(bytes: &[u8]) -> bool {
    let header = match bytes {
        [_, _, _, _, _, _, 1, _, a, b, rest @ ..] => rest.get(..usize::from(u16::from_le_bytes([*a, *b]))),
        [_, _, _, _, _, _, _, _, a, b, c, d, rest @ ..] => rest.get(..u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => None,
    };
    header.is_some_and(|header| header.iter().filter(|byte| b"([{".contains(byte)).count() <= 16)
}

/// Writes the joints as [T, 49, 3]. This writes in place, so call it inside `stage::workdir::replace`.
pub fn write(path: &Path, motion: &Motion) -> anyhow::Result<()> {
    write_points(path, &motion.joints)
}

/// Writes points [T, n, 3] for any n, in place like [`write`].
pub fn write_points(path: &Path, points: &Array3<f32>) -> anyhow::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    points.as_standard_layout().write_npy(&mut file)?;
    Ok(file.flush()?)
}

/// Number of bytes at the start of a shard's array that always contain its header.
pub const HEADER_BYTES: usize = 128;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Element type of a shard array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    F32,
    Bool,
}

impl Element {
    const fn descr(self) -> &'static str {
        match self {
            Element::F32 => "<f4",
            Element::Bool => "|b1",
        }
    }

    const fn bytes(self) -> usize {
        match self {
            Element::F32 => 4,
            Element::Bool => 1,
        }
    }
}

fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let shape = shape.trim_end_matches(' ');
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // The header is padded with spaces and a line feed, so that the data starts at a multiple of 64 bytes.
    let length = (MAGIC.len() + 2 + dict.len() + 1).next_multiple_of(64) - MAGIC.len() - 2;
    let mut bytes = MAGIC.to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.resize(MAGIC.len() + 2 + length - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// File contents of a float32 array of `shape`; `values` in C order.
pub fn write_f32<'a>(shape: &[usize], values: impl Iterator<Item = &'a f32>) -> Vec<u8> {
    let mut bytes = header(Element::F32.descr(), shape);
    bytes.reserve(4 * shape.iter().product::<usize>());
    values.for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    bytes
}

/// File contents of a bool array of `shape`; `values` in C order.
pub fn write_bool<'a>(shape: &[usize], values: impl Iterator<Item = &'a bool>) -> Vec<u8> {
    let mut bytes = header(Element::Bool.descr(), shape);
    bytes.extend(values.map(|&value| u8::from(value)));
    bytes
}

/// File contents of a scalar string.
pub(crate) fn write_text(text: &str) -> Vec<u8> {
    let mut bytes = header(&format!("<U{}", text.chars().count()), &[]);
    bytes.extend(text.chars().flat_map(|character| u32::from(character).to_le_bytes()));
    bytes
}

/// Location of the rows of an array in its file, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    pub data_at: usize,
    pub n_rows: usize,
    pub row_bytes: usize,
}

impl Layout {
    /// Parses the header at the start of `bytes`; the complete file has `file_bytes` bytes.
    ///
    /// # Errors
    ///
    /// The elements are not `element`, the rows not of shape `row`, or the file is not as long as the header implies.
    pub fn parse(bytes: &[u8], file_bytes: u64, element: Element, row: &[usize]) -> anyhow::Result<Layout> {
        ensure!(bytes.starts_with(MAGIC), "not a .npy file of version 1.0");
        let length = match bytes.get(8..10) {
            Some(&[low, high]) => usize::from(u16::from_le_bytes([low, high])),
            _ => bail!("the .npy header is truncated"),
        };
        let text = bytes.get(10..10 + length).context("the .npy header is truncated")?;
        let text = std::str::from_utf8(text).context("the .npy header is not text")?;
        let descr = element.descr();
        ensure!(text.contains(&format!("'descr': '{descr}'")), "the array does not have {descr} values");
        ensure!(text.contains("'fortran_order': False"), "the array is not in C order");
        let shape = text.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
        let (shape, _) = shape.context("the .npy header has no shape")?;
        let numbers = shape.split(',').map(str::trim).filter(|n| !n.is_empty()).map(str::parse::<usize>);
        let shape = numbers.collect::<Result<Vec<_>, _>>().context("the shape in the .npy header is not numeric")?;
        let Some((&n_rows, rest)) = shape.split_first() else { bail!("the array has no rows") };
        ensure!(rest == row, "the array has shape {shape:?}, expected [T, {row:?}]");
        let layout =
            Layout { data_at: 10 + length, n_rows, row_bytes: row.iter().product::<usize>() * element.bytes() };
        let data_bytes = n_rows.checked_mul(layout.row_bytes).and_then(|n| n.checked_add(layout.data_at));
        ensure!(
            data_bytes.is_some_and(|n| n as u64 == file_bytes),
            "the header states {n_rows} rows, which does not match the file size ({file_bytes} bytes)"
        );
        Ok(layout)
    }
}

/// Little-endian bytes as float32; a trailing remainder of fewer than four bytes is ignored.
pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Bytes as bool; every non-zero byte is true.
pub fn bools(bytes: &[u8]) -> Vec<bool> {
    bytes.iter().map(|&b| b != 0).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use ndarray::Ix3;

    /// The file contents with another shape in the header.
    pub(crate) fn with_shape(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
        let header = String::from_utf8_lossy(&bytes[10..128]).replace(old, new);
        [&bytes[..10], format!("{:<117}\n", header.trim_end()).as_bytes(), &bytes[128..]].concat()
    }

    #[test]
    fn header_larger_than_the_file_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.npy");
        let mut bytes = Vec::new();
        Array3::<f32>::zeros((2, N_JOINTS, 3)).write_npy(&mut bytes).unwrap();
        for shape in ["(1000000000000, 49, 3)", "(18446744073709551615, 49, 3)", "(3, 49, 3)", "((((((((((((((((((2"] {
            std::fs::write(&path, with_shape(&bytes, "(2, 49, 3)", shape)).unwrap();
            assert!(read(&path, FrameRate::new(15, 1)).is_err(), "{shape}");
        }
        for end in 0..bytes.len() {
            assert!(parse::<f32, Ix3>(&bytes[..end]).is_err());
        }
    }

    #[test]
    fn written_arrays_are_valid_npy_and_layout_locates_rows() {
        let array = Array3::from_shape_fn((7, 49, 3), |(t, j, k)| (t * 1000 + j * 3 + k) as f32 - 0.5);
        let bytes = write_f32(&[7, 49, 3], array.iter());
        assert_eq!(Array3::<f32>::read_npy(&bytes[..]).unwrap(), array);
        let layout = Layout::parse(&bytes[..HEADER_BYTES], bytes.len() as u64, Element::F32, &[49, 3]).unwrap();
        assert_eq!((layout.data_at, layout.n_rows, layout.row_bytes), (128, 7, 588));
        assert_eq!(floats(&bytes[layout.data_at..]), array.iter().copied().collect::<Vec<_>>());
        assert_eq!(header(Element::F32.descr(), &[usize::MAX, 59, 3]).len(), HEADER_BYTES);
        let flags = [true, false, true, true];
        let bytes = write_bool(&[2, 2], flags.iter());
        assert_eq!(ndarray::Array2::<bool>::read_npy(&bytes[..]).unwrap().into_raw_vec_and_offset().0, flags);
    }

    #[test]
    fn damaged_bytes_are_an_error() {
        let bytes = write_f32(&[2, 3], [1.0; 6].iter());
        for end in 0..bytes.len() {
            assert!(Layout::parse(&bytes[..end], end as u64, Element::F32, &[3]).is_err());
        }
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            // Either the damage is detected, or the rows are still located correctly.
            if let Ok(layout) = Layout::parse(&damaged, bytes.len() as u64, Element::F32, &[3]) {
                assert_eq!(layout.n_rows * layout.row_bytes + layout.data_at, bytes.len());
            }
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(24))]
        #[test]
        fn joints_round_trip_bit_for_bit(
            bits in proptest::collection::vec(proptest::num::f32::ANY, 3 * N_JOINTS..9 * N_JOINTS),
        ) {
            let n_frames = bits.len() / (3 * N_JOINTS);
            let joints = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, j, k)| bits[(t * N_JOINTS + j) * 3 + k]);
            let motion = Motion::from_joints(FrameRate::new(15, 1), joints);
            let is_finite_joint = |t: usize, j: usize| (0..3).all(|k| motion.joints[[t, j, k]].is_finite());
            proptest::prop_assert!(motion.mask.indexed_iter().all(|((t, j), m)| *m == is_finite_joint(t, j)));
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.npy");
            write(&path, &motion).unwrap();
            let again = read(&path, motion.fps).unwrap();
            proptest::prop_assert_eq!(&again.mask, &motion.mask);
            proptest::prop_assert!(again.joints.iter().zip(&motion.joints).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}
