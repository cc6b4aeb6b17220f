//! Conversion between sRGB bytes and linear light by tables. They are computed with exactly rounded operations only
//! (without the system's power function), so that images are identical on every machine.

use std::sync::LazyLock;

/// Number of steps of the encoding table; adjacent steps differ by at most 0.4 of a byte.
const N_STEPS: usize = 8192;
/// Number of table entries: a power of two, so that the masked index is always in range.
const N_ENTRIES: usize = 1 << 14;
/// Linear value above which highlights are compressed.
const SHOULDER: f32 = 0.6;

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|byte| decoded(byte as f64 / 255.0) as f32));

static BYTES: LazyLock<[u8; N_ENTRIES]> = LazyLock::new(|| {
    // The nearest byte; `bound` is the midpoint to the next one.
    let bound = |byte: u32| decoded((f64::from(byte) + 0.5) / 255.0);
    let mut byte = 0;
    std::array::from_fn(|step| {
        while byte < 255 && step as f64 / N_STEPS as f64 > bound(byte) {
            byte += 1;
        }
        byte as u8
    })
});

/// Both conversion tables.
#[derive(Clone, Copy)]
pub struct Srgb {
    linear: &'static [f32; 256],
    bytes: &'static [u8; N_ENTRIES],
}

impl Srgb {
    pub fn tables() -> Self {
        Self { linear: &LINEAR, bytes: &BYTES }
    }

    /// sRGB bytes of linear RGB; the fourth component is ignored and values are clamped to 0..1.
    #[inline(always)]
    pub fn bytes(self, linear: [f32; 4]) -> [u8; 3] {
        self.bytes_from_steps(steps(linear))
    }

    /// sRGB bytes of table steps.
    #[inline(always)]
    pub fn bytes_from_steps(self, [r, g, b, _]: Steps) -> [u8; 3] {
        [r, g, b].map(|step| self.bytes[step.to_bits() as usize % N_ENTRIES])
    }

    /// Linear RGB of an sRGB pixel; the fourth component is 0.
    #[inline(always)]
    pub fn linears(self, bytes: [u8; 3]) -> [f32; 4] {
        let [r, g, b] = bytes.map(|byte| self.linear[usize::from(byte)]);
        [r, g, b, 0.0]
    }
}

/// Adding this number rounds a value below 2^14 to an integer in the lowest mantissa bits.
const ROUNDING: f32 = (1 << 23) as f32;

/// Linear RGB as indices of the byte table, in the lowest mantissa bits.
pub type Steps = [f32; 4];

/// Table steps of linear RGB; values are clamped to 0..1.
#[inline(always)]
pub fn steps(linear: [f32; 4]) -> Steps {
    let mut steps = linear;
    for step in &mut steps {
        *step *= N_STEPS as f32;
    }
    // NaN also becomes 0.
    for step in &mut steps {
        *step = if *step > 0.0 { *step } else { 0.0 };
    }
    for step in &mut steps {
        *step = if *step < N_STEPS as f32 { *step } else { N_STEPS as f32 };
    }
    for step in &mut steps {
        *step += ROUNDING;
    }
    steps
}

/// Tone mapping of unbounded linear light to 0..1: the identity up to `SHOULDER`, then a smooth roll-off.
#[inline(always)]
pub fn compressed(scene: [f32; 4]) -> [f32; 4] {
    let mut all = scene;
    for v in &mut all {
        let over = if *v > SHOULDER { *v - SHOULDER } else { 0.0 };
        let plain = if *v < SHOULDER { *v } else { SHOULDER };
        *v = plain + over * (1.0 - SHOULDER) / (over + (1.0 - SHOULDER));
    }
    all
}

/// Linear light of an encoded value 0..1 (IEC 61966-2-1).
fn decoded(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        return encoded / 12.92;
    }
    // x^2.4 is x^2 times its fifth root, to which Newton's method converges from above.
    let x = (encoded + 0.055) / 1.055;
    let square = x * x;
    let mut root = 1.0;
    for _ in 0..40 {
        let fourth = (root * root) * (root * root);
        root -= (root - square / fourth) / 5.0;
    }
    square * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_round_trip_and_the_curve_is_the_standard_one() {
        let srgb = Srgb::tables();
        for byte in 0..=255 {
            assert_eq!(srgb.bytes(srgb.linears([byte, 0, byte])), [byte, 0, byte]);
            let x = f64::from(byte) / 255.0;
            let known = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
            assert!((f64::from(srgb.linears([byte; 3])[0]) - known).abs() < 1e-6);
        }
        assert_eq!(srgb.bytes([-1.0, 2.0, f32::NAN, 0.0]), [0, 255, 0]);
    }

    #[test]
    fn tone_mapping_is_strictly_increasing() {
        let values: Vec<f32> = (0..400).map(|n| compressed([n as f32 / 100.0; 4])[1]).collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]) && values.iter().all(|v| *v < 1.0));
    }
}
