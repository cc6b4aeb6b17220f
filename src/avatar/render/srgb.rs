//! sRGB bytes and linear light, by tables that are made with exactly specified arithmetic (no power function of the
//! system), so that a picture has the same bytes on every machine.

use std::sync::LazyLock;

/// Steps of the encoding table; one is at most 0.4 of a byte apart from its neighbour.
const N_STEPS: usize = 8192;
/// Entries of the table: as many as the bits that are looked at hold, so that none is outside it.
const N_ENTRIES: usize = 1 << 14;
/// Linear value from which on highlights are compressed.
const SHOULDER: f32 = 0.6;

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|byte| decoded(byte as f64 / 255.0) as f32));

static BYTES: LazyLock<[u8; N_ENTRIES]> = LazyLock::new(|| {
    // The byte whose range, between the middles to its neighbours, holds the value.
    let bound = |byte: u32| decoded((f64::from(byte) + 0.5) / 255.0);
    let mut byte = 0;
    std::array::from_fn(|step| {
        while byte < 255 && step as f64 / N_STEPS as f64 > bound(byte) {
            byte += 1;
        }
        byte as u8
    })
});

/// Both tables at hand.
#[derive(Clone, Copy)]
pub struct Srgb {
    linear: &'static [f32; 256],
    bytes: &'static [u8; N_ENTRIES],
}

impl Srgb {
    pub fn tables() -> Self {
        Self { linear: &LINEAR, bytes: &BYTES }
    }

    /// Bytes of linear RGB (the fourth number is none); values outside 0..1 have the byte of the nearest end.
    #[inline(always)]
    pub fn bytes(self, linear: [f32; 4]) -> [u8; 3] {
        self.bytes_of(steps(linear))
    }

    /// Bytes of linear RGB as steps of the table.
    #[inline(always)]
    pub fn bytes_of(self, [r, g, b, _]: Steps) -> [u8; 3] {
        [r, g, b].map(|step| self.bytes[step.to_bits() as usize % N_ENTRIES])
    }

    /// Linear light of the bytes of a pixel.
    #[inline(always)]
    pub fn linears(self, bytes: [u8; 3]) -> [f32; 4] {
        let [r, g, b] = bytes.map(|byte| self.linear[usize::from(byte)]);
        [r, g, b, 0.0]
    }
}

/// Sums with numbers up to a quarter of 2^16 are rounded to whole ones, which stand in the lowest bits.
const WHOLE: f32 = (1 << 23) as f32;

/// Linear RGB in steps of the table of bytes, which the lowest bits of the numbers hold.
pub type Steps = [f32; 4];

/// Steps of linear RGB; values outside 0..1 have those of the nearest end.
#[inline(always)]
pub fn steps(linear: [f32; 4]) -> Steps {
    let mut steps = linear;
    for step in &mut steps {
        *step *= N_STEPS as f32;
    }
    // Also 0 for NaN.
    for step in &mut steps {
        *step = if *step > 0.0 { *step } else { 0.0 };
    }
    for step in &mut steps {
        *step = if *step < N_STEPS as f32 { *step } else { N_STEPS as f32 };
    }
    for step in &mut steps {
        *step += WHOLE;
    }
    steps
}

/// Linear light 0..1 for a scene's linear light, which has no upper end: equal up to the shoulder, then less and less.
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
    // x^2.4 = x^2 times the fifth root of x^2, which Newton's method finds from above.
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
    fn bytes_come_back_and_the_curve_is_that_of_the_standard() {
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
    fn the_shoulder_never_turns_back() {
        let values: Vec<f32> = (0..400).map(|n| compressed([n as f32 / 100.0; 4])[1]).collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]) && values.iter().all(|v| *v < 1.0));
    }
}
