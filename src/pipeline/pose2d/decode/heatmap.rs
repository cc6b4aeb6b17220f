//! Heatmap decoding, one map per keypoint: position and score of the peak, refined to sub-cell precision from its
//! neighbourhood. `dark` follows Zhang et al. 2020, "Distribution-Aware Coordinate Representation for Human Pose
//! Estimation", section 3.2: blur, then one Newton step on the logarithm.

use super::points::{MAX_AXIS_LEN, ScoredPoint, finite, peak};
use anyhow::{Result, ensure};
use orator_media::opencv::blur::GaussianBlur;
use orator_onnx::Refine;

/// Largest plausible Newton step, in cells.
const MAX_STEP: f64 = 1.5;

/// Keypoints from maps of shape [1, K, rows, columns], in px of an input of `[height, width]`.
///
/// # Errors
/// An invalid shape.
pub fn decode(
    shape: &[i64],
    maps: &[f32],
    input_size: [usize; 2],
    refine: Refine,
    gaussian: &GaussianBlur,
) -> Result<Vec<ScoredPoint>> {
    let &[1, _, rows @ 1..=MAX_AXIS_LEN, columns @ 1..=MAX_AXIS_LEN] = shape else {
        anyhow::bail!("invalid shape {shape:?} of heat maps: expected [1, K, rows, columns]")
    };
    let (rows, columns) = (rows as usize, columns as usize);
    ensure!(
        maps.len().is_multiple_of(rows * columns),
        "{} values are not a multiple of a map of {rows}x{columns}",
        maps.len()
    );
    let cell_px = [input_size[1] as f64 / columns as f64, input_size[0] as f64 / rows as f64];
    let position = |map: &[f32]| {
        let Some((at, height)) = peak(map) else { return [0.0; 3] };
        let (x, y) = (at % columns, at / columns);
        let [dx, dy] = match refine {
            Refine::None => [0.0; 2],
            Refine::Quarter => quarter(map, columns, x, y),
            Refine::Dark => dark(map, columns, x, y, gaussian),
        };
        finite([(x as f64 + dx) * cell_px[0], (y as f64 + dy) * cell_px[1], f64::from(height)])
    };
    Ok(maps.chunks_exact(rows * columns).map(position).collect())
}

/// Offset of a quarter cell towards the higher neighbour on each axis.
fn quarter(map: &[f32], columns: usize, x: usize, y: usize) -> [f64; 2] {
    let rows = map.len() / columns;
    if x == 0 || y == 0 || x + 1 >= columns || y + 1 >= rows {
        return [0.0; 2];
    }
    let at = |x: usize, y: usize| map[y * columns + x];
    let towards = |low: f32, high: f32| {
        if high > low {
            0.25
        } else if high < low {
            -0.25
        } else {
            0.0
        }
    };
    [towards(at(x - 1, y), at(x + 1, y)), towards(at(x, y - 1), at(x, y + 1))]
}

/// Newton step from the peak cell; zero at the edge or if it is implausible.
fn dark(map: &[f32], columns: usize, x: usize, y: usize, gaussian: &GaussianBlur) -> [f64; 2] {
    let rows = map.len() / columns;
    if x < 2 || y < 2 || x + 2 >= columns || y + 2 >= rows {
        return [0.0; 2];
    }
    let log = |dx: isize, dy: isize| {
        let value = gaussian.at(map, columns, x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        f64::from(value.max(1e-10)).ln()
    };
    let centre = 2.0 * log(0, 0);
    let (gx, gy) = (0.5 * (log(1, 0) - log(-1, 0)), 0.5 * (log(0, 1) - log(0, -1)));
    let (gxx, gyy) = (0.25 * (log(2, 0) - centre + log(-2, 0)), 0.25 * (log(0, 2) - centre + log(0, -2)));
    let gxy = 0.25 * (log(1, 1) - log(-1, 1) - log(1, -1) + log(-1, -1));
    let determinant = gxx * gyy - gxy * gxy;
    let step = [-(gyy * gx - gxy * gy) / determinant, -(gxx * gy - gxy * gx) / determinant];
    let is_plausible = determinant.abs() > 1e-12 && step.iter().all(|cells| cells.abs() < MAX_STEP);
    if is_plausible { step } else { [0.0; 2] }
}
