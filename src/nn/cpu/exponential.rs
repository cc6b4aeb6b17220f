//! The exponential of f32 as loops of vectors can compute it (Cephes' reduction and polynomial).

/// e^x to 2 units in the last place, without a branch, so that a loop over it is vectorised.
#[inline(always)]
pub fn exp_f32(x: f32) -> f32 {
    /// Added to a number of moderate size, leaves its integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.clamp(-87.0, 88.0);
    let rounded = x * std::f32::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    // ln 2 in two parts, the first of few digits.
    let rest = x - n * 0.693_359_4 + n * 2.121_944_4e-4;
    let series = ((((1.987_569_1e-4 * rest + 1.398_199_9e-3) * rest + 8.333_452e-3) * rest + 4.166_579_6e-2) * rest
        + 1.666_666_5e-1)
        * rest
        + 0.5;
    let of_rest = series * rest * rest + rest + 1.0;
    of_rest * f32::from_bits((rounded.to_bits() << 23).wrapping_add(0x3f80_0000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_near() {
        for i in -8000..8000 {
            let x = i as f32 * 0.01;
            assert!((exp_f32(x) / x.exp() - 1.0).abs() < 3e-7, "{x}");
        }
        assert!(exp_f32(-1e9) < 1e-37 && exp_f32(1e9) > 1e38);
    }
}
