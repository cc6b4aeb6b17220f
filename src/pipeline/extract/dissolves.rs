//! Gradual transitions: a dissolve, a wipe, a fade to or from black or white. Of the first frame A of a window, its last B
//! and those between: most cells turn from A's colour to B's without turning back, A's edges are not B's, few blocks are
//! found elsewhere in the next frames (a moving camera), and few blocks of the middle are in both A and B. The bounds are
//! set on transitions between real clips, and on pans, zooms, shakes and changes of light. A push or slide is a moving
//! camera by these measures, and so is not found.

use super::block_match;
use super::thumbnail::{STEP, Thumbnail};

/// Lengths of windows at 15 frames a second, in frames, and the least share of one-way pixels in each: the longer,
/// the more a speaker's own movement adds.
pub const WINDOWS: [(usize, f64); 7] =
    [(4, 0.82), (6, 0.78), (8, 0.72), (12, 0.66), (16, 0.60), (24, 0.55), (32, 0.50)];
/// Share of turned cells below which nothing is looked at.
pub const LEAST_TURNED: f64 = 0.15;
/// Part of a colour's way that must be the direct way.
const DIRECT: f64 = 0.7;
/// Least correlation of a block of the middle with A and with B to be in both.
const IN_BOTH: f32 = 0.8;

/// Share of the grid's cells that go from their first colour to another without turning back; `way` is the way each
/// cell's colour went in the window, in 8-bit steps a channel.
pub fn turned(a: &Thumbnail, b: &Thumbnail, way: impl Iterator<Item = [u32; 3]>) -> f64 {
    let cells = a.grid.iter().zip(&b.grid).zip(way);
    let n = cells.filter(|((a, b), way)| one_way(**a, **b, *way).unwrap_or(false)).count();
    n as f64 / a.grid.len().max(1) as f64
}

/// `turned`, made smaller by whatever speaks for something else: 0 to `turned`. `least_direct` is that of the window's
/// length.
pub fn score(frames: &[&Thumbnail], turned: f64, least_direct: f64) -> f64 {
    let [a, .., b] = frames else { return 0.0 };
    let mut score = turned * (1.0 - ramp(block_match::same_edges(a, b), 0.3, 0.4));
    if score > 0.0 {
        score *= ramp(direct_pixels(frames), least_direct - 0.05, least_direct + 0.03);
    }
    if score > 0.0 {
        let (mid, last) = (frames.len() / 2, frames.len() - 1);
        let steps = [(0, 2), (mid - 1, mid + 1), (last - 2, last), (mid - 2, mid + 2)];
        let moved: f64 = steps.iter().map(|&(from, to)| block_match::moved(frames[from], frames[to])).sum();
        score *= 1.0 - ramp(moved / steps.len() as f64, 0.25, 0.45);
    }
    if score > 0.0 {
        score *= ramp(block_match::missing(frames[frames.len() / 2], &[a, b], IN_BOTH), 0.5, 0.65);
    }
    score
}

/// Share of the changed pixels that went from A's colour to B's without turning back.
fn direct_pixels(frames: &[&Thumbnail]) -> f64 {
    let [a, .., b] = frames else { return 0.0 };
    let n_bytes = a.image.data.len();
    let mut way = vec![0u32; n_bytes];
    for pair in frames.windows(2) {
        let bytes = pair[0].image.data.iter().zip(&pair[1].image.data);
        way.iter_mut().zip(bytes).for_each(|(way, (a, b))| *way += u32::from(a.abs_diff(*b)));
    }
    let pixels = a.image.data.as_chunks::<3>().0.iter().zip(b.image.data.as_chunks::<3>().0);
    let changed = pixels.zip(way.as_chunks::<3>().0).filter_map(|((a, b), way)| one_way(*a, *b, *way));
    let (n, n_direct) = changed.fold((0, 0), |(n, direct), is_direct| (n + 1, direct + usize::from(is_direct)));
    if n == 0 { 0.0 } else { f64::from(n_direct as u32) / f64::from(n) }
}

/// Whether a colour went its way directly; `None` where it did not change.
fn one_way(a: [u8; 3], b: [u8; 3], way: [u32; 3]) -> Option<bool> {
    let steps: [u8; 3] = std::array::from_fn(|channel| a[channel].abs_diff(b[channel]));
    let widest = (0..3).max_by_key(|channel| steps[*channel])?;
    (steps[widest] > STEP).then(|| f64::from(steps[widest]) > DIRECT * f64::from(way[widest]))
}

/// 0 up to `low`, 1 from `high` on.
pub fn ramp(value: f64, low: f64, high: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}
