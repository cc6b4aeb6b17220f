//! HDR pictures (ITU-R BT.2100, PQ or HLG) as SDR ones. Light is brought to the scale on which the reference white of
//! BT.2408 (203 cd/m2) is 1, stays as it is up to a knee, is rolled off above it, and is coded with the gamma of BT.1886.
//! Colours of BT.2020 become those of BT.709 (BT.2087).

use ffmpeg_next::{color, frame};

/// Luminance of the reference white, and of the brightest HLG picture, cd/m2.
const WHITE: f32 = 203.0;
const HLG_PEAK: f32 = 1000.0;
/// Share of the reference white up to which light is unchanged.
const KNEE: f32 = 0.8;
const GAMMA: f32 = 2.4;
/// Entries of the tables.
const N_STEPS: usize = 4096;

/// Transfer function of an HDR picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HdrTransfer {
    Pq,
    Hlg,
}

impl HdrTransfer {
    /// Transfer function of `frame`; `None` for SDR.
    pub fn of(frame: &frame::Video) -> Option<Self> {
        match frame.color_transfer_characteristic() {
            color::TransferCharacteristic::SMPTE2084 => Some(Self::Pq),
            color::TransferCharacteristic::ARIB_STD_B67 => Some(Self::Hlg),
            _ => None,
        }
    }

    /// Short name: `PQ` or `HLG`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pq => "PQ",
            Self::Hlg => "HLG",
        }
    }

    /// Light of a signal 0..1: in reference whites (PQ), or of the scene, 0..1 (HLG).
    fn light(self, signal: f64) -> f64 {
        match self {
            Self::Pq => {
                let (m1, m2) = (2610.0 / 16384.0, 2523.0 / 32.0);
                let (c1, c2, c3) = (3424.0 / 4096.0, 2413.0 / 128.0, 2392.0 / 128.0);
                let root = signal.powf(1.0 / m2);
                10_000.0 * ((root - c1).max(0.0) / (c2 - c3 * root)).powf(1.0 / m1) / f64::from(WHITE)
            }
            Self::Hlg if signal <= 0.5 => signal * signal / 3.0,
            Self::Hlg => {
                let (a, b, c) = (0.178_832_77, 0.284_668_92, 0.559_910_73);
                (((signal - c) / a).exp() + b) / 12.0
            }
        }
    }
}

/// Tone mapping of one kind of picture.
pub(crate) struct ToneMapper {
    transfer: HdrTransfer,
    has_wide_gamut: bool,
    /// Light by the signal, and 8-bit values by the square root of SDR light.
    light: Vec<f32>,
    coded: Vec<u8>,
}

impl ToneMapper {
    pub fn new(transfer: HdrTransfer, has_wide_gamut: bool) -> Self {
        let share = |step: usize| step as f64 / (N_STEPS - 1) as f64;
        let light = (0..N_STEPS).map(|step| transfer.light(share(step)) as f32).collect();
        let coded = |step| (255.0 * share(step).powf(2.0 / f64::from(GAMMA))).round() as u8;
        Self { transfer, has_wide_gamut, light, coded: (0..N_STEPS).map(coded).collect() }
    }

    /// Appends a row of 16-bit little-endian RGB as 8-bit RGB.
    pub fn push_row(&self, row: &[u8], out: &mut Vec<u8>) {
        for pixel in row.as_chunks::<6>().0 {
            let signal = |at: usize| (usize::from(u16::from_le_bytes([pixel[at], pixel[at + 1]])) * N_STEPS) >> 16;
            out.extend(self.sdr([0, 2, 4].map(|at| self.light[signal(at)])));
        }
    }

    fn sdr(&self, mut light: [f32; 3]) -> [u8; 3] {
        if self.transfer == HdrTransfer::Hlg {
            // Light of the display by the system gamma of 1.2.
            let luminance = dot([0.2627, 0.6780, 0.0593], light).max(1e-9);
            light = light.map(|part| part * luminance.powf(0.2) * (HLG_PEAK / WHITE));
        }
        if self.has_wide_gamut {
            light = [
                dot([1.660_5, -0.587_6, -0.072_8], light),
                dot([-0.124_6, 1.132_9, -0.008_3], light),
                dot([-0.018_2, -0.100_6, 1.118_7], light),
            ];
        }
        let most = light.into_iter().fold(0.0, f32::max);
        // One factor for all three channels keeps the hue.
        let factor = if most > KNEE { rolled_off(most) / most } else { 1.0 };
        light.map(|part| {
            let step = (part * factor).clamp(0.0, 1.0).sqrt() * (N_STEPS - 1) as f32;
            self.coded[(step + 0.5) as usize]
        })
    }
}

/// Light above the knee, compressed toward 1 without a kink.
fn rolled_off(light: f32) -> f32 {
    let above = (light - KNEE) / (1.0 - KNEE);
    KNEE + (1.0 - KNEE) * above / (1.0 + above)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(transfer: HdrTransfer, signal: f64) -> u8 {
        let value = ((signal * 65535.0).round() as u16).to_le_bytes();
        let mut out = Vec::new();
        ToneMapper::new(transfer, true).push_row(&[value; 3].concat(), &mut out);
        assert!(out[0].abs_diff(out[1]) <= 1 && out[1].abs_diff(out[2]) <= 1, "{out:?}");
        out[1]
    }

    #[test]
    fn reference_levels_come_out_where_bt_2408_puts_them() {
        // BT.2408, table 1: the reference white is 58 % PQ and 75 % HLG, an 18 % gray card 38 % of both.
        for (transfer, white) in [(HdrTransfer::Pq, 0.58), (HdrTransfer::Hlg, 0.75)] {
            assert!((240..=248).contains(&gray(transfer, white)), "{}", gray(transfer, white));
            let card = 255.0 * (26.0f64 / 203.0).powf(1.0 / 2.4);
            let got = f64::from(gray(transfer, 0.38));
            assert!((got - card).abs() < 4.0, "{transfer:?}: {got}, expected {card}");
            assert_eq!(gray(transfer, 0.0), 0);
            assert!(gray(transfer, 1.0) >= 252);
        }
    }

    #[test]
    fn brighter_stays_brighter_and_hue_stays() {
        for transfer in [HdrTransfer::Pq, HdrTransfer::Hlg] {
            let levels: Vec<u8> = (0..=100).map(|step| gray(transfer, f64::from(step) / 100.0)).collect();
            assert!(levels.is_sorted(), "{levels:?}");
        }
        let tones = ToneMapper::new(HdrTransfer::Pq, false);
        let [r, g, b] = tones.sdr([4.0, 2.0, 1.0]).map(|value| (f32::from(value) / 255.0).powf(GAMMA));
        assert!((r / g - 2.0).abs() < 0.1 && (g / b - 2.0).abs() < 0.1, "{r} {g} {b}");
    }
}
