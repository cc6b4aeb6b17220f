//! Arrays as NumPy's `.npy` version 1.0, little endian, C order: the two element types of a shard (float32 and
//! bool). Reading checks everything against the bytes at hand before it allocates, so damaged bytes are an error.

use anyhow::{Context, Result, bail, ensure};

/// Enough bytes from the start of any array of a shard to hold its whole header.
pub const HEADER_BYTES: usize = 128;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// An element type of the arrays in a shard.
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

fn header(element: Element, shape: &[usize]) -> Vec<u8> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let shape = shape.trim_end_matches(' ');
    let dict = format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({shape}), }}", element.descr());
    // the data begins at a multiple of 64 bytes, behind spaces and a line feed
    let length = (MAGIC.len() + 2 + dict.len() + 1).next_multiple_of(64) - MAGIC.len() - 2;
    let mut bytes = MAGIC.to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.resize(MAGIC.len() + 2 + length - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// The file of a float32 array of `shape`; `values` in C order.
pub fn write_f32<'a>(shape: &[usize], values: impl Iterator<Item = &'a f32>) -> Vec<u8> {
    let mut bytes = header(Element::F32, shape);
    let data_at = bytes.len();
    bytes.resize(data_at + 4 * shape.iter().product::<usize>(), 0);
    bytes[data_at..].as_chunks_mut::<4>().0.iter_mut().zip(values).for_each(|(place, v)| *place = v.to_le_bytes());
    bytes
}

/// The file of a bool array of `shape`; `values` in C order.
pub fn write_bool<'a>(shape: &[usize], values: impl Iterator<Item = &'a bool>) -> Vec<u8> {
    let mut bytes = header(Element::Bool, shape);
    let data_at = bytes.len();
    bytes.resize(data_at + shape.iter().product::<usize>(), 0);
    bytes[data_at..].iter_mut().zip(values).for_each(|(place, &value)| *place = u8::from(value));
    bytes
}

/// Position of the rows of an array in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    pub data_at: usize,
    pub n_rows: usize,
    pub row_bytes: usize,
}

impl Layout {
    /// Reads the header at the start of `bytes` of a file of `file_bytes`. The array must hold `element`s, its
    /// rows must have the shape `row`, and the file must be exactly as long as the header says.
    pub fn parse(bytes: &[u8], file_bytes: u64, element: Element, row: &[usize]) -> Result<Layout> {
        ensure!(bytes.starts_with(MAGIC), "not a .npy file of version 1.0");
        let length = match bytes.get(8..10) {
            Some(&[low, high]) => usize::from(u16::from_le_bytes([low, high])),
            _ => bail!("the .npy header is cut off"),
        };
        let text = bytes.get(10..10 + length).context("the .npy header is cut off")?;
        let text = std::str::from_utf8(text).context("the .npy header is not text")?;
        let descr = element.descr();
        ensure!(text.contains(&format!("'descr': '{descr}'")), "the array does not hold {descr} values");
        ensure!(text.contains("'fortran_order': False"), "the array is not in C order");
        let shape = text.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
        let (shape, _) = shape.context("the .npy header names no shape")?;
        let numbers = shape.split(',').map(str::trim).filter(|n| !n.is_empty()).map(str::parse::<usize>);
        let shape = numbers.collect::<Result<Vec<_>, _>>().context("the .npy header's shape is not numbers")?;
        let Some((&n_rows, rest)) = shape.split_first() else { bail!("the array has no rows") };
        ensure!(rest == row, "the array has the shape {shape:?}, expected [T, {row:?}]");
        let layout =
            Layout { data_at: 10 + length, n_rows, row_bytes: row.iter().product::<usize>() * element.bytes() };
        let data_bytes = n_rows.checked_mul(layout.row_bytes).and_then(|n| n.checked_add(layout.data_at));
        ensure!(
            data_bytes.is_some_and(|n| n as u64 == file_bytes),
            "the header promises {n_rows} rows, which is not the size of the file ({file_bytes} bytes)"
        );
        Ok(layout)
    }
}

/// Little endian bytes as float32; a rest of fewer than four bytes is left out.
pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Bytes as bool.
pub fn bools(bytes: &[u8]) -> Vec<bool> {
    bytes.iter().map(|&b| b != 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;
    use ndarray_npy::ReadNpyExt;

    #[test]
    fn others_read_what_is_written_and_the_layout_finds_the_rows() {
        let array = Array3::from_shape_fn((7, 49, 3), |(t, j, k)| (t * 1000 + j * 3 + k) as f32 - 0.5);
        let bytes = write_f32(&[7, 49, 3], array.iter());
        assert_eq!(Array3::<f32>::read_npy(&bytes[..]).unwrap(), array);
        let layout = Layout::parse(&bytes[..HEADER_BYTES], bytes.len() as u64, Element::F32, &[49, 3]).unwrap();
        assert_eq!((layout.data_at, layout.n_rows, layout.row_bytes), (128, 7, 588));
        assert_eq!(floats(&bytes[layout.data_at..]), array.iter().copied().collect::<Vec<_>>());
        assert_eq!(header(Element::F32, &[usize::MAX, 59, 3]).len(), HEADER_BYTES);
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
            // either it is noticed, or the rows are where they were
            if let Ok(layout) = Layout::parse(&damaged, bytes.len() as u64, Element::F32, &[3]) {
                assert_eq!(layout.n_rows * layout.row_bytes + layout.data_at, bytes.len());
            }
        }
    }
}
