//! Index arithmetic for one axis of a convolution: the inputs of each output, and the outputs that contribute to the
//! gradient of each input. The sums are computed in `direct_conv`.

use std::ops::Range;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConvAxis {
    pub n_in: usize,
    pub n_out: usize,
    pub kernel: usize,
    pub stride: usize,
    /// Number of zeros before the first input.
    pub pad: usize,
}

/// Zeros around the input of a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Padding {
    /// TensorFlow's "same", see [`ConvAxis::same`].
    Same,
    /// Only before the input, see [`ConvAxis::causal`].
    Causal,
    None,
}

impl Padding {
    pub fn axis(self, n_in: usize, kernel: usize, stride: usize) -> ConvAxis {
        match self {
            Self::Same => ConvAxis::same(n_in, kernel, stride),
            Self::Causal => ConvAxis::causal(n_in, kernel, stride),
            Self::None => ConvAxis::valid(n_in, kernel, stride),
        }
    }
}

impl ConvAxis {
    /// TensorFlow's "same" padding: ceil(n_in / stride) outputs; the smaller half of the padding comes first.
    pub fn same(n_in: usize, kernel: usize, stride: usize) -> Self {
        let n_out = n_in.div_ceil(stride);
        let total = ((n_out.max(1) - 1) * stride + kernel).saturating_sub(n_in);
        Self { n_in, n_out, kernel, stride, pad: total / 2 }
    }

    /// ceil(n_in / stride) outputs, where output i reads no input after the last one of its own, `stride * (i + 1) - 1`.
    pub fn causal(n_in: usize, kernel: usize, stride: usize) -> Self {
        Self { n_in, n_out: n_in.div_ceil(stride), kernel, stride, pad: kernel.saturating_sub(stride) }
    }

    /// No padding: one output for every `stride`-th position at which the kernel fits; none if it does not fit.
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

    /// Windows of the backward pass. The gradient of an input depends on its position modulo the stride, so there are
    /// `stride` convolutions of the output's gradient, each with every `stride`-th kernel offset in descending order.
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

    /// Outputs for which kernel offset `k` lies inside the input.
    pub fn inside(&self, k: usize) -> Range<usize> {
        let start = self.pad.saturating_sub(k).div_ceil(self.stride).min(self.n_out);
        start..(self.n_in + self.pad).saturating_sub(k).div_ceil(self.stride).clamp(start, self.n_out)
    }
}

/// Windows of the sums along one axis: window `v` reads from position `first + v * step` on, one position for each of
/// `kernel_offsets`, and writes its result at position `to_first + v * to_step`.
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
    /// Number of positions read by `n` successive windows.
    pub fn receptive_field(&self, n: usize) -> usize {
        (n.max(1) - 1) * self.step + self.kernel_offsets.len()
    }
}
