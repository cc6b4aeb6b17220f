//! Conversion of pixels to network input: channel order, layout, scale, mean and standard deviation in one pass, with
//! a lookup table of 256 values per channel.

use orator_base::types::image::Image;

/// Converter of images to normalised tensors.
pub struct Normaliser {
    /// Per channel in tensor order: the index of its byte in a pixel, and its lookup table.
    channels: [(usize, Box<[f32; 256]>); 3],
    planar: bool,
}

impl Normaliser {
    /// Creates the conversion `(byte * scale - mean) / std`, with `mean` and `std` in the channel order of the tensor.
    /// `bgr`: that order is blue, green, red. `planar`: one plane per channel (NCHW), otherwise interleaved (NHWC).
    pub fn new(bgr: bool, planar: bool, scale: f64, mean: [f64; 3], std: [f64; 3]) -> Self {
        let channel = |c: usize| {
            let table = std::array::from_fn(|byte| ((byte as f64 * scale - mean[c]) / std[c]) as f32);
            (if bgr { 2 - c } else { c }, Box::new(table))
        };
        Self { channels: [channel(0), channel(1), channel(2)], planar }
    }

    /// Writes the image into `tensor` of 3 * width * height numbers; excess elements of a larger tensor are unchanged.
    pub fn fill(&self, image: &Image, tensor: &mut [f32]) {
        let [(i0, t0), (i1, t1), (i2, t2)] = &self.channels;
        let pixels = image.data.chunks_exact(3);
        if self.planar {
            let plane = tensor.len() / 3;
            let (first, rest) = tensor.split_at_mut(plane);
            let (second, third) = rest.split_at_mut(plane);
            for (((pixel, a), b), c) in pixels.zip(first).zip(second).zip(third) {
                *a = t0[usize::from(pixel[*i0])];
                *b = t1[usize::from(pixel[*i1])];
                *c = t2[usize::from(pixel[*i2])];
            }
        } else {
            for (pixel, out) in pixels.zip(tensor.chunks_exact_mut(3)) {
                out[0] = t0[usize::from(pixel[*i0])];
                out[1] = t1[usize::from(pixel[*i1])];
                out[2] = t2[usize::from(pixel[*i2])];
            }
        }
    }
}
