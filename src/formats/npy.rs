//! Motion as a plain `.npy` array [T, 49, 3] in house order, a missing joint NaN. The file does not hold the rate.

use anyhow::{Context as _, ensure};
use ndarray::{Array, Array3, Dimension, IxDyn};
use ndarray_npy::npy::header::Header;
use ndarray_npy::{ReadNpyError, ReadNpyExt as _, ReadableElement, WriteNpyExt as _};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

/// Reads a motion of `fps` from an array of f32 or f64, [T, 49, 3] or [T, 147] (joint after joint); a joint that is not
/// finite is missing, in the mask too.
pub fn read(path: &Path, fps: FrameRate) -> anyhow::Result<Motion> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot open {}", path.display()))?;
    let numbers = parse::<f32, IxDyn>(&bytes).or_else(|error| match error {
        ReadNpyError::WrongDescriptor(_) => Ok(parse::<f64, IxDyn>(&bytes)?.mapv(|v| v as f32)),
        error => Err(error),
    });
    let numbers = numbers.with_context(|| format!("{} is not a .npy file of float32 or float64", path.display()))?;
    let shape = numbers.shape().to_vec();
    let is_motion = matches!(shape[..], [_, N_JOINTS, 3]) || matches!(shape[..], [_, n] if n == 3 * N_JOINTS);
    ensure!(
        is_motion,
        "{} has the shape {shape:?}, expected [frames, {N_JOINTS}, 3] or [frames, {}]",
        path.display(),
        3 * N_JOINTS
    );
    let joints = Array3::from_shape_vec((shape[0], N_JOINTS, 3), numbers.iter().copied().collect())?;
    Ok(Motion::from_joints(fps, joints))
}

/// Most bytes of a header, its magic string and length included.
pub(crate) const MOST_HEADER_BYTES: u64 = 1 << 16;

/// Bytes of a whole file that begins with `head`, as its header promises; `None` where it has no numbers.
pub(crate) fn file_bytes(head: &[u8]) -> Option<u64> {
    if !has_small_header(head) {
        return None;
    }
    let mut rest = head;
    let header = Header::from_reader(&mut rest).ok()?;
    let n_header = (head.len() - rest.len()) as u64;
    // `<f4`, `|b1`: the last digits are the bytes of a number.
    let kind = header.type_descriptor.as_string()?;
    let bytes: u64 = kind.trim_start_matches(['<', '>', '|', '=']).strip_prefix(['f', 'i', 'u', 'b'])?.parse().ok()?;
    header.shape.iter().try_fold(bytes, |n, &axis| n.checked_mul(axis as u64))?.checked_add(n_header)
}

/// An array from the bytes of its file. What the header promises is held against these bytes before anything is
/// allocated for it.
pub(crate) fn parse<T: ReadableElement, D: Dimension>(bytes: &[u8]) -> Result<Array<T, D>, ReadNpyError> {
    if !has_small_header(bytes) {
        return Err(ReadNpyError::MissingData);
    }
    let n_numbers = Header::from_reader(&mut &*bytes)?.shape.iter().try_fold(1usize, |n, axis| n.checked_mul(*axis));
    // A number takes a byte at least; the exact length is checked while reading.
    if n_numbers.is_none_or(|n| n > bytes.len()) {
        return Err(ReadNpyError::MissingData);
    }
    Array::read_npy(bytes)
}

/// Whether the whole header is there, without brackets in brackets in brackets (its parser is recursive).
fn has_small_header(bytes: &[u8]) -> bool {
    let header = match bytes {
        [_, _, _, _, _, _, 1, _, a, b, rest @ ..] => rest.get(..usize::from(u16::from_le_bytes([*a, *b]))),
        [_, _, _, _, _, _, _, _, a, b, c, d, rest @ ..] => rest.get(..u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => None,
    };
    header.is_some_and(|header| header.iter().filter(|byte| b"([{".contains(byte)).count() <= 16)
}

/// Writes the joints. Call it inside `stage::workdir::replace`: it writes in place.
pub fn write(path: &Path, motion: &Motion) -> anyhow::Result<()> {
    write_points(path, &motion.joints)
}

/// Writes points [T, n, 3] of any number a frame; as `write`.
pub fn write_points(path: &Path, points: &Array3<f32>) -> anyhow::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    points.as_standard_layout().write_npy(&mut file)?;
    Ok(file.flush()?)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use ndarray::Ix3;

    /// The file with another shape in its header.
    pub fn with_shape(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
        let header = String::from_utf8_lossy(&bytes[10..128]).replace(old, new);
        [&bytes[..10], format!("{:<117}\n", header.trim_end()).as_bytes(), &bytes[128..]].concat()
    }

    #[test]
    fn a_wrong_shape_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.npy");
        Array3::<f32>::zeros((4, 43, 3)).write_npy(File::create(&path).unwrap()).unwrap();
        let error = read(&path, FrameRate::new(15, 1)).unwrap_err().to_string();
        assert!(error.contains("[4, 43, 3]"), "{error}");
        std::fs::write(&path, "no array").unwrap();
        assert!(read(&path, FrameRate::new(15, 1)).is_err());
    }

    #[test]
    fn a_header_that_promises_too_much_is_an_error() {
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

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(24))]
        #[test]
        fn any_joints_come_back_bit_for_bit(
            bits in proptest::collection::vec(proptest::num::f32::ANY, 3 * N_JOINTS..9 * N_JOINTS),
        ) {
            let n_frames = bits.len() / (3 * N_JOINTS);
            let joints = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, j, k)| bits[(t * N_JOINTS + j) * 3 + k]);
            let motion = Motion::from_joints(FrameRate::new(15, 1), joints);
            let there = |t: usize, j: usize| (0..3).all(|k| motion.joints[[t, j, k]].is_finite());
            proptest::prop_assert!(motion.mask.indexed_iter().all(|((t, j), seen)| *seen == there(t, j)));
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.npy");
            write(&path, &motion).unwrap();
            let again = read(&path, motion.fps).unwrap();
            proptest::prop_assert_eq!(&again.mask, &motion.mask);
            proptest::prop_assert!(again.joints.iter().zip(&motion.joints).all(|(a, b)| a.to_bits() == b.to_bits()));
        }

        #[test]
        fn no_bytes_panic(header in ".{0,100}", bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..100)) {
            let length = (header.len() as u16).to_le_bytes();
            let whole = [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), &bytes].concat();
            let _ = parse::<f32, IxDyn>(&whole);
            let _ = parse::<f32, IxDyn>(&bytes);
        }
    }
}
