//! One axis of a convolution: which inputs an output hears, and which outputs an input's gradient comes from. Indices
//! only; the sums are in `conv`.

use std::ops::Range;

/// How kernels lie over one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConvAxis {
    pub n_in: usize,
    pub n_out: usize,
    pub kernel: usize,
    pub stride: usize,
    /// Zeros before the first input.
    pub pad: usize,
}

impl ConvAxis {
    /// TensorFlow's "same": ceil(n_in / stride) places come out; the smaller half of the padding goes first.
    pub fn same(n_in: usize, kernel: usize, stride: usize) -> Self {
        let n_out = n_in.div_ceil(stride);
        let total = ((n_out.max(1) - 1) * stride + kernel).saturating_sub(n_in);
        Self { n_in, n_out, kernel, stride, pad: total / 2 }
    }

    /// Every `stride`-th place the kernel fits on; none where it does not.
    pub fn valid(n_in: usize, kernel: usize, stride: usize) -> Self {
        Self { n_in, n_out: (n_in + stride).saturating_sub(kernel) / stride, kernel, stride, pad: 0 }
    }

    pub fn forward(&self) -> AxisWindows {
        AxisWindows {
            n_from: self.n_in,
            first: -(self.pad as isize),
            step: self.stride,
            kernel_offsets: (0..self.kernel).collect(),
            n: self.n_out,
            n_to: self.n_out,
            to_first: 0,
            to_step: 1,
        }
    }

    /// The gradient's way back: an input's gradient depends on its place modulo the stride, so there are `stride`
    /// convolutions of the output's gradient, each with every `stride`-th tap, last tap first.
    pub fn backward(&self) -> Vec<AxisWindows> {
        let of_phase = |phase: usize| {
            let kernel_offsets: Vec<usize> = (phase..self.kernel).step_by(self.stride).rev().collect();
            // Input i = stride * u + phase - pad, for u in first..=last.
            let first = self.pad.saturating_sub(phase).div_ceil(self.stride);
            let last = (self.n_in - 1 + self.pad).checked_sub(phase)? / self.stride;
            Some(AxisWindows {
                n_from: self.n_out,
                first: first as isize + 1 - kernel_offsets.len() as isize,
                step: 1,
                n: (last + 1).checked_sub(first)?,
                kernel_offsets,
                n_to: self.n_in,
                to_first: self.stride * first + phase - self.pad,
                to_step: self.stride,
            })
        };
        (0..self.stride).filter_map(of_phase).filter(|windows| windows.n > 0).collect()
    }

    /// Outputs whose tap `k` falls inside the input.
    pub fn inside(&self, k: usize) -> Range<usize> {
        let start = self.pad.saturating_sub(k).div_ceil(self.stride).min(self.n_out);
        start..(self.n_in + self.pad).saturating_sub(k).div_ceil(self.stride).clamp(start, self.n_out)
    }
}

/// Sums over one axis: the one of window `v` reads from `first + v * step` on, a place for each of `taps`, and its
/// result is place `to_first + v * to_step`.
#[derive(Clone, Debug)]
pub struct AxisWindows {
    pub n_from: usize,
    pub first: isize,
    pub step: usize,
    pub kernel_offsets: Vec<usize>,
    pub n: usize,
    pub n_to: usize,
    pub to_first: usize,
    pub to_step: usize,
}

impl AxisWindows {
    /// Places read by so many windows.
    pub fn receptive_field(&self, n: usize) -> usize {
        (n.max(1) - 1) * self.step + self.kernel_offsets.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_padding_is_tensorflows() {
        let same = |n_in, kernel, stride| ConvAxis::same(n_in, kernel, stride);
        let first =
            [(209, 4, 2), (63, 4, 2), (64, 4, 2), (16, 4, 1)].map(|(n, kernel, stride)| same(n, kernel, stride));
        assert_eq!(first.map(|axis| axis.pad), [1, 1, 1, 1]);
        assert_eq!(first.map(|axis| axis.n_out), [105, 32, 32, 16]);
        assert_eq!([9, 11, 2].map(|n| ConvAxis::valid(n, 3, 3).n_out), [3, 3, 0]);
    }
}
