//! Anti-aliased drawing of lines, circles, polygons, capsules and text. Points are in fractional pixels (the centre
//! of the top left pixel is 0, 0); edges are blurred about half a pixel outwards. Drawing is clipped to the image,
//! and non-finite points draw nothing.

use anyhow::Context as _;
use opencv::boxed_ref::BoxedRefMut;
use opencv::core::{Mat, Point, Scalar, Vec3b, Vector};
use opencv::imgproc;
use orator_base::types::image::Image;

/// Fractional bits of the coordinates passed to OpenCV: 1/16 px.
const SHIFT: i32 = 4;
/// Largest magnitude of coordinates, px; larger ones are clamped to avoid overflow.
const MAX_COORDINATE_PX: f32 = 30_000.0;
/// Segments per arc of a capsule.
const ARC_STEPS: usize = 12;

/// Draws a line `width_px` wide (at least 1) from `from` to `to`.
pub fn line(image: &mut Image, from: [f32; 2], to: [f32; 2], width_px: f32, rgb: [u8; 3]) -> anyhow::Result<()> {
    let (Some(from), Some(to)) = (fixed(from), fixed(to)) else { return Ok(()) };
    let width = width_px.round().clamp(1.0, 1000.0) as i32;
    draw_on(image, |mat| imgproc::line(mat, from, to, colour(rgb), width, imgproc::LINE_AA, SHIFT))
}

/// Draws a filled circle.
pub fn circle(image: &mut Image, centre: [f32; 2], radius_px: f32, rgb: [u8; 3]) -> anyhow::Result<()> {
    let Some(centre) = fixed(centre) else { return Ok(()) };
    if !radius_px.is_finite() || radius_px < 0.0 {
        return Ok(());
    }
    let radius = (radius_px.min(MAX_COORDINATE_PX) * (1 << SHIFT) as f32).round() as i32;
    draw_on(image, |mat| imgproc::circle(mat, centre, radius, colour(rgb), imgproc::FILLED, imgproc::LINE_AA, SHIFT))
}

/// Draws a filled convex polygon; fewer than 3 corners draw nothing.
pub fn polygon(image: &mut Image, corners: &[[f32; 2]], rgb: [u8; 3]) -> anyhow::Result<()> {
    let Some(points) = corners.iter().map(|&corner| fixed(corner)).collect::<Option<Vector<Point>>>() else {
        return Ok(());
    };
    if points.len() < 3 {
        return Ok(());
    }
    draw_on(image, |mat| imgproc::fill_convex_poly(mat, &points, colour(rgb), imgproc::LINE_AA, SHIFT))
}

/// Draws a limb: the convex hull of a circle of `from_radius_px` at `from` and one of `to_radius_px` at `to`.
pub fn capsule(
    image: &mut Image,
    from: [f32; 2],
    from_radius_px: f32,
    to: [f32; 2],
    to_radius_px: f32,
    rgb: [u8; 3],
) -> anyhow::Result<()> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let distance = dx.hypot(dy);
    if !distance.is_finite() || distance <= (from_radius_px - to_radius_px).abs() {
        let (centre, radius) = if from_radius_px > to_radius_px { (from, from_radius_px) } else { (to, to_radius_px) };
        return circle(image, centre, radius, rgb);
    }
    let direction = dy.atan2(dx);
    // The common tangents touch both circles at this angle from the axis.
    let tangent_angle = ((from_radius_px - to_radius_px) / distance).acos();
    let arc = |centre: [f32; 2], radius: f32, start: f32, sweep: f32| {
        (0..=ARC_STEPS).map(move |step| {
            let angle = start + sweep * step as f32 / ARC_STEPS as f32;
            [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
        })
    };
    let full = std::f32::consts::TAU;
    let outline: Vec<[f32; 2]> = arc(to, to_radius_px, direction - tangent_angle, 2.0 * tangent_angle)
        .chain(arc(from, from_radius_px, direction + tangent_angle, full - 2.0 * tangent_angle))
        .collect();
    polygon(image, &outline, rgb)
}

/// Draws one line of ASCII text whose baseline starts at `at`; capitals are `height_px` tall.
pub fn text(image: &mut Image, text: &str, at: [f32; 2], height_px: f32, rgb: [u8; 3]) -> anyhow::Result<()> {
    if !(at[0].is_finite() && at[1].is_finite()) {
        return Ok(());
    }
    let at = Point::new(
        at[0].clamp(-MAX_COORDINATE_PX, MAX_COORDINATE_PX).round() as i32,
        at[1].clamp(-MAX_COORDINATE_PX, MAX_COORDINATE_PX).round() as i32,
    );
    let (scale, weight) = font(height_px);
    let face = imgproc::FONT_HERSHEY_SIMPLEX;
    draw_on(image, |mat| imgproc::put_text(mat, text, at, face, scale, colour(rgb), weight, imgproc::LINE_AA, false))
}

/// Width in px of a line of text of that height.
pub fn text_width(text: &str, height_px: f32) -> anyhow::Result<f32> {
    let (scale, weight) = font(height_px);
    let size = imgproc::get_text_size(text, imgproc::FONT_HERSHEY_SIMPLEX, scale, weight, &mut 0)
        .context("cannot measure a line of text")?;
    Ok(size.width as f32)
}

/// Copies `cell` into the image with its top left corner at `left`, `top`; rows that do not fit are dropped.
pub fn paste(image: &mut Image, cell: &Image, [left, top]: [usize; 2]) {
    if cell.width == 0 || left + cell.width > image.width {
        return;
    }
    for (y, row) in cell.data.chunks_exact(3 * cell.width).enumerate() {
        let start = 3 * ((top + y) * image.width + left);
        if let Some(target) = image.data.get_mut(start..start + row.len()) {
            target.copy_from_slice(row);
        }
    }
}

/// Scale and stroke width of the font, whose capitals are 21 px tall at scale 1.
fn font(height_px: f32) -> (f64, i32) {
    let height = f64::from(height_px.clamp(4.0, 500.0));
    (height / 21.0, (height / 14.0).round().max(1.0) as i32)
}

fn colour([r, g, b]: [u8; 3]) -> Scalar {
    Scalar::new(f64::from(r), f64::from(g), f64::from(b), 0.0)
}

/// Point in OpenCV's fixed-point coordinates; `None` if it is not finite.
fn fixed([x, y]: [f32; 2]) -> Option<Point> {
    let to_fixed = |v: f32| (v.clamp(-MAX_COORDINATE_PX, MAX_COORDINATE_PX) * (1 << SHIFT) as f32).round() as i32;
    (x.is_finite() && y.is_finite()).then(|| Point::new(to_fixed(x), to_fixed(y)))
}

/// Calls OpenCV on the memory of the image, without copying.
fn draw_on(image: &mut Image, paint: impl FnOnce(&mut BoxedRefMut<Mat>) -> opencv::Result<()>) -> anyhow::Result<()> {
    if image.width == 0 || image.height == 0 {
        return Ok(());
    }
    let rows = i32::try_from(image.height).context("the image is too tall to draw on")?;
    let cols = i32::try_from(image.width).context("the image is too wide to draw on")?;
    let mut mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, cols, &mut image.data)
        .context("the image data does not match the image size")?;
    paint(&mut mat).context("OpenCV cannot draw")
}
