//! Interlaced pictures: two fields, taken one after the other, on alternating lines. Where something moved between them
//! its edges look like combs. `comb_share` measures that; `interpolate` keeps one field and replaces the lines of the
//! other where it is combed, along edges, so that what stands still keeps every line.

use ffmpeg_next::format::Pixel;
use ffmpeg_next::{ffi, frame};
use orator_base::types::image::Image;

/// Least difference of neighbouring lines in a comb, 8-bit steps of green: one that is counted, and one that is removed
/// in a video that is known to be interlaced.
const STEP: i32 = 10;
const FAINT_STEP: i32 = 5;
/// Pixels to each side, and lines of the other field above and below, that a comb spreads to.
const SPREAD_PX: usize = 4;
/// Farthest step sideways along an edge, px.
const SLANT_PX: isize = 3;

/// Fields of a frame, upper lines first, as frames of half the height that share its memory; `None` where its lines
/// cannot be taken apart.
pub(crate) fn fields(frame: &frame::Video) -> Option<[frame::Video; 2]> {
    if !frame.height().is_multiple_of(4) || frame.format() == Pixel::PAL8 {
        return None;
    }
    let field = |first_line: isize| {
        let mut field = frame::Video::empty();
        // SAFETY: `field` is an empty frame, which becomes a reference to the planes of `frame`. A plane with its lines
        // doubled and half as many of them, begun at line 0 or 1, lies inside the plane: the height is a multiple of 4,
        // so that the lines of a chroma plane are even in number too.
        unsafe {
            let raw = field.as_mut_ptr();
            if ffi::av_frame_ref(raw, frame.as_ptr()) < 0 {
                return None;
            }
            for plane in 0..(*raw).data.len() {
                let line_size = (*raw).linesize[plane];
                if !(*raw).data[plane].is_null() && line_size != 0 {
                    (*raw).data[plane] = (*raw).data[plane].offset(first_line * line_size as isize);
                    (*raw).linesize[plane] = 2 * line_size;
                }
            }
            (*raw).height /= 2;
        }
        Some(field)
    };
    Some([field(0)?, field(1)?])
}

/// Picture whose even lines are those of the first field, the odd ones those of the second.
pub(crate) fn woven([top, bottom]: &[Image; 2]) -> Image {
    let row = 3 * top.width;
    let lines = top.data.chunks_exact(row.max(1)).zip(bottom.data.chunks_exact(row.max(1)));
    let data = lines.flat_map(|(top, bottom)| [top, bottom]).flatten().copied().collect();
    Image { width: top.width, height: 2 * top.height, data }
}

/// Share of the pixels of `image` that are in a comb and have changed in the picture `after` it: lines that alternate
/// four times, by more than what stands still like a striped cloth explains. Every fourth column is looked at.
pub fn comb_share(image: &Image, after: &Image) -> f64 {
    let [width, height] = [image.width, image.height];
    if height < 5 || width == 0 || [after.width, after.height] != [width, height] {
        return 0.0;
    }
    let row = |y: usize| &image.data[3 * y * width..3 * (y + 1) * width];
    let mut n_combed = 0usize;
    for y in 2..height - 2 {
        let lines = [row(y - 2), row(y - 1), row(y), row(y + 1), row(y + 2)];
        let next = &after.data[3 * y * width..3 * (y + 1) * width];
        for at in (1..3 * width).step_by(12) {
            let [a, b, c, d, e] = lines.map(|line| i32::from(line[at]));
            let steps = [b - a, b - c, d - c, d - e];
            let alternates = steps.iter().all(|step| *step > STEP) || steps.iter().all(|step| *step < -STEP);
            n_combed += usize::from(alternates && (c - i32::from(next[at])).abs() > STEP);
        }
    }
    n_combed as f64 / (width.div_ceil(4) * (height - 4)) as f64
}

/// Picture without combs: the lines of one field stay (the even ones if `keeps_even`), the others are interpolated where
/// they are combed.
pub(crate) fn interpolate(image: &Image, keeps_even: bool) -> Image {
    let [width, height] = [image.width, image.height];
    let mut out = image.clone();
    if height < 4 || width == 0 {
        return out;
    }
    let first = usize::from(keeps_even);
    let lines: Vec<usize> = (first..height).step_by(2).collect();
    let combed: Vec<Vec<bool>> = lines.iter().map(|y| combed_line(image, *y)).collect();
    for (at, y) in lines.iter().enumerate() {
        let of = |line: usize| combed.get(line).map(Vec::as_slice);
        let near = [at.checked_sub(1).and_then(of), of(at), of(at + 1)];
        let replaced = spread(&near, width);
        let above = y.checked_sub(1).unwrap_or(1);
        let below = if y + 1 < height { y + 1 } else { above };
        for x in (0..width).filter(|x| replaced[*x]) {
            let pixel = along_edge(image, x, above, below);
            let to = 3 * (y * width + x);
            out.data[to..to + 3].copy_from_slice(&pixel);
        }
    }
    out
}

/// Pixels of line `y` that both lines beside it are brighter than, or both darker, and the pixel beside each of them.
fn combed_line(image: &Image, y: usize) -> Vec<bool> {
    let green = |x: usize, y: usize| i32::from(image.data[3 * (y * image.width + x) + 1]);
    if y == 0 || y + 1 >= image.height {
        return vec![false; image.width];
    }
    let is_combed = |x: usize| {
        let (up, down) = (green(x, y) - green(x, y - 1), green(x, y) - green(x, y + 1));
        up.signum() == down.signum() && up.abs().min(down.abs()) > FAINT_STEP
    };
    let combed: Vec<bool> = (0..image.width).map(is_combed).collect();
    let beside = |x: usize| combed[x.saturating_sub(1)..(x + 2).min(image.width)].contains(&true);
    (0..image.width).map(beside).collect()
}

/// Pixels within `SPREAD_PX` of a comb: two combed lines of one field at least, one of which is near. A single line is a
/// thin thing, no comb.
fn spread(near: &[Option<&[bool]>; 3], width: usize) -> Vec<bool> {
    let is_set = |line: usize, x: usize| near[line].is_some_and(|line| line[x]);
    let mut until = 0;
    let mut replaced = vec![false; width];
    for x in 0..width {
        if (0..3).filter(|line| is_set(*line, x)).count() >= 2 {
            let start = x.saturating_sub(SPREAD_PX).max(until);
            until = (x + SPREAD_PX + 1).min(width);
            replaced[start.min(until)..until].fill(true);
        }
    }
    replaced
}

/// Mean of a pixel of the line above and one of the line below that lie on one edge through (x, between them): the
/// direction in which three pixels differ least, the upright one of two equal.
fn along_edge(image: &Image, x: usize, above: usize, below: usize) -> [u8; 3] {
    let width = image.width as isize;
    let x = x as isize;
    let green = |x: isize, y: usize| i32::from(image.data[3 * (y * image.width + x as usize) + 1]);
    let differ = |slant: isize| {
        let pairs = (-1..=1).map(|side| {
            let (up, down) = (x + slant + side, x - slant + side);
            (green(up.clamp(0, width - 1), above) - green(down.clamp(0, width - 1), below)).abs()
        });
        pairs.sum::<i32>()
    };
    let fits = |slant: &isize| x + slant >= 0 && x - slant >= 0 && x + slant < width && x - slant < width;
    let slants = (-SLANT_PX..=SLANT_PX).filter(fits);
    let slant = slants.min_by_key(|slant| (differ(*slant) + 2 * slant.abs() as i32, slant.abs())).unwrap_or(0);
    let up = image.pixel((x + slant) as usize, above);
    let down = image.pixel((x - slant) as usize, below);
    std::array::from_fn(|channel| (u16::from(up[channel]) + u16::from(down[channel])).div_ceil(2) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bright disc at `x` on a wall with a thin line, 120 x 80.
    fn disc(x: f64) -> Image {
        let mut image = Image::filled(120, 80, [40; 3]);
        for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (column, line) = ((at % 120) as f64, (at / 120) as f64);
            let value = (20.5 - (column - x).hypot(line - 40.0)).clamp(0.0, 1.0);
            *pixel = [if at / 120 == 7 { 200 } else { (40.0 + 180.0 * value) as u8 }; 3];
        }
        image
    }

    fn interlaced(even: &Image, odd: &Image) -> Image {
        let field = |image: &Image, first: usize| {
            let lines = image.data.chunks_exact(3 * image.width).skip(first).step_by(2);
            Image { width: image.width, height: image.height / 2, data: lines.flatten().copied().collect() }
        };
        woven(&[field(even, 0), field(odd, 1)])
    }

    fn error(a: &Image, b: &Image) -> f64 {
        let sum: u64 = a.data.iter().zip(&b.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        sum as f64 / a.data.len() as f64
    }

    #[test]
    fn combs_are_measured_and_removed_toward_the_first_field() {
        let (before, after) = (disc(50.0), disc(62.0));
        let combed = interlaced(&before, &after);
        let next = interlaced(&disc(74.0), &disc(86.0));
        assert!(comb_share(&combed, &next) > 0.01);
        for (keeps_even, truth) in [(true, &before), (false, &after)] {
            let mended = interpolate(&combed, keeps_even);
            assert!(comb_share(&mended, &next) == 0.0);
            assert!(
                error(&mended, truth) < 0.15 * error(&combed, truth),
                "{} {}",
                error(&mended, truth),
                error(&combed, truth)
            );
        }
    }

    #[test]
    fn what_stands_still_and_thin_lines_stay() {
        let still = disc(50.0);
        assert_eq!(comb_share(&still, &disc(62.0)), 0.0);
        for keeps_even in [true, false] {
            assert_eq!(interpolate(&still, keeps_even), still);
        }
        let mut striped = still.clone();
        striped.data.chunks_exact_mut(3 * 120).step_by(2).for_each(|line| line.fill(90));
        assert_eq!(comb_share(&striped, &striped), 0.0);
        for size in [[0, 0], [1, 1], [3, 4], [1, 9]] {
            let tiny = Image::filled(size[0], size[1], [7; 3]);
            assert_eq!(interpolate(&tiny, true), tiny);
            assert_eq!(comb_share(&tiny, &tiny), 0.0);
        }
    }
}
