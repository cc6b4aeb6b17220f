//! Window sizes and axis orders: images are channels first (NCHW) in ONNX and channels last (NHWC) in TensorFlow.

use anyhow::{Context, Result, ensure};

/// Maximum size of one axis; products of two are far from overflow.
pub(crate) const MAX_SIZE: usize = 1 << 24;

/// Index in NHWC of each axis of NCHW.
pub(crate) const CHANNELS_FIRST: [usize; 4] = [0, 3, 1, 2];

/// Checks a size read from a file. Errors: the number is not in 1..=`MAX_SIZE`.
pub(crate) fn size(number: i64) -> Result<usize> {
    let size = usize::try_from(number).ok().filter(|size| (1..=MAX_SIZE).contains(size));
    size.with_context(|| format!("invalid size {number}: expected 1 to {MAX_SIZE}"))
}

/// Decodes little-endian 32-bit integers.
pub(crate) fn int32s(raw: &[u8]) -> impl Iterator<Item = i32> {
    raw.as_chunks().0.iter().map(|int| i32::from_le_bytes(*int))
}

/// The four sizes of a 4-D tensor. Errors: another number of axes; the message names `what`.
pub(crate) fn four(what: &str, dims: &[usize]) -> Result<[usize; 4]> {
    dims.try_into().ok().with_context(|| format!("{what} has shape {dims:?}, expected 4 axes"))
}

/// Transposes a tensor of shape `dims`, so that axis `k` of the result is axis `order[k]` of the input. Errors: the
/// length of `raw` does not match `dims` with `n_bytes` per element.
pub(crate) fn transposed(raw: &[u8], n_bytes: usize, dims: [usize; 4], order: [usize; 4]) -> Result<Vec<u8>> {
    let expected = dims.iter().try_fold(n_bytes, |product: usize, dim| product.checked_mul(*dim));
    ensure!(
        expected == Some(raw.len()) && !raw.is_empty(),
        "a weight of shape {dims:?} with {n_bytes} bytes per value cannot have {} bytes",
        raw.len()
    );
    let steps = [dims[1] * dims[2] * dims[3], dims[2] * dims[3], dims[3], 1];
    let (sizes, steps) = (order.map(|axis| dims[axis]), order.map(|axis| steps[axis] * n_bytes));
    let mut out = Vec::with_capacity(raw.len());
    for i in 0..sizes[0] {
        for j in 0..sizes[1] {
            for k in 0..sizes[2] {
                let row = i * steps[0] + j * steps[1] + k * steps[2];
                for l in 0..sizes[3] {
                    let start = row + l * steps[3];
                    out.extend_from_slice(&raw[start..start + n_bytes]);
                }
            }
        }
    }
    Ok(out)
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct SlidingWindow {
    pub kernel: usize,
    pub stride: usize,
    pub dilation: usize,
}

impl SlidingWindow {
    /// Zeros before and after an axis of `size` for TensorFlow's SAME padding, for `size / stride` steps, rounded up.
    pub(crate) fn same_padding(self, size: usize) -> (usize, usize) {
        let extent = (size.div_ceil(self.stride) - 1) * self.stride + (self.kernel - 1) * self.dilation + 1;
        let total = extent.saturating_sub(size);
        (total / 2, total - total / 2)
    }

    /// Number of steps over an axis of `size`, which includes padding. Errors: the window is larger than the axis.
    pub(crate) fn n_steps(self, size: usize) -> Result<usize> {
        let extent = (self.kernel - 1) * self.dilation + 1;
        ensure!(extent <= size, "a window of {extent} does not fit into an axis of {size}");
        Ok((size - extent) / self.stride + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_transposed() {
        let raw: Vec<u8> = (0..12).collect();
        // [1, 2, 3, 2] channels last to [1, 2, 2, 3].
        let out = transposed(&raw, 1, [1, 2, 3, 2], CHANNELS_FIRST).unwrap();
        assert_eq!(out, [0, 2, 4, 6, 8, 10, 1, 3, 5, 7, 9, 11]);
        assert_eq!(transposed(&raw, 2, [1, 1, 3, 2], [0, 1, 3, 2]).unwrap()[..6], [0, 1, 4, 5, 8, 9]);
        assert!(transposed(&raw, 2, [1, 2, 3, 2], CHANNELS_FIRST).is_err());
        assert!(transposed(&raw, 2, [usize::MAX, 2, 3, 2], CHANNELS_FIRST).is_err());
    }

    #[test]
    fn same_padding_yields_the_expected_size() {
        let window = SlidingWindow { kernel: 3, stride: 2, dilation: 1 };
        assert_eq!((window.same_padding(8), window.same_padding(7)), ((0, 1), (1, 1)));
        assert_eq!(window.n_steps(9).unwrap(), 4);
        assert!(window.n_steps(2).is_err());
        assert_eq!(SlidingWindow { dilation: 4, stride: 1, ..window }.same_padding(5), (4, 4));
    }
}
