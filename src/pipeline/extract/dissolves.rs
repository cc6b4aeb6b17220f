//! Gradual transitions: dissolves, wipes, fades to or from black or white. Let A and B be the first and last frame of
//! a window. In a transition, most cells change from A's colour to B's without turning back, the edges of A are not
//! those of B, few blocks move between nearby frames (a moving camera), and few blocks of the middle frame are in both
//! A and B. Thresholds were set on transitions between real clips, and on pans, zooms, shakes and changes of light.
//! Pushes and slides look like a moving camera and are not detected.

use super::block_match;
use super::thumbnail::{STEP, Thumbnail};

/// Window lengths in frames at 15 fps, and the least share of monotonically changing pixels: longer windows contain
/// more of the speaker's own movement.
pub const WINDOWS: [(usize, f64); 7] =
    [(4, 0.82), (6, 0.78), (8, 0.72), (12, 0.66), (16, 0.60), (24, 0.55), (32, 0.50)];
/// Share of changed cells below which a window is not examined further.
pub const MIN_TURNED: f64 = 0.15;
/// Least ratio of the net colour change to the length of the colour's path.
const MIN_DIRECTNESS: f64 = 0.7;
/// Least correlation for a block of the middle frame to count as present in A and in B.
const IN_BOTH: f32 = 0.8;

/// Share of grid cells that change monotonically from one colour to another; `path_length` is the length of the path
/// of each cell's colour over the window, in 8-bit steps per channel.
pub fn turned(a: &Thumbnail, b: &Thumbnail, path_length: impl Iterator<Item = [u32; 3]>) -> f64 {
    let cells = a.grid.iter().zip(&b.grid).zip(path_length);
    let n = cells.filter(|((a, b), path_length)| is_monotonic(**a, **b, *path_length).unwrap_or(false)).count();
    n as f64 / a.grid.len().max(1) as f64
}

/// Score of a window, 0..`turned`: `turned` reduced by every indication of something else. `least_direct` is the
/// threshold for the window's length.
pub fn score(frames: &[&Thumbnail], turned: f64, least_direct: f64) -> f64 {
    let [a, .., b] = frames else { return 0.0 };
    let mut score = turned * (1.0 - ramp(block_match::edge_correlation(a, b), 0.3, 0.4));
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

/// Share of the changed pixels that went monotonically from A's colour to B's.
fn direct_pixels(frames: &[&Thumbnail]) -> f64 {
    let [a, .., b] = frames else { return 0.0 };
    let n_bytes = a.image.data.len();
    let mut path_length = vec![0u32; n_bytes];
    for pair in frames.windows(2) {
        let bytes = pair[0].image.data.iter().zip(&pair[1].image.data);
        path_length.iter_mut().zip(bytes).for_each(|(path_length, (a, b))| *path_length += u32::from(a.abs_diff(*b)));
    }
    let pixels = a.image.data.as_chunks::<3>().0.iter().zip(b.image.data.as_chunks::<3>().0);
    let changed = pixels
        .zip(path_length.as_chunks::<3>().0)
        .filter_map(|((a, b), path_length)| is_monotonic(*a, *b, *path_length));
    let (n, n_direct) = changed.fold((0, 0), |(n, direct), is_direct| (n + 1, direct + usize::from(is_direct)));
    if n == 0 { 0.0 } else { f64::from(n_direct as u32) / f64::from(n) }
}

/// Whether a colour changed monotonically; `None` if it did not change.
fn is_monotonic(a: [u8; 3], b: [u8; 3], path_length: [u32; 3]) -> Option<bool> {
    let steps: [u8; 3] = std::array::from_fn(|channel| a[channel].abs_diff(b[channel]));
    let widest = (0..3).max_by_key(|channel| steps[*channel])?;
    (steps[widest] > STEP).then(|| f64::from(steps[widest]) > MIN_DIRECTNESS * f64::from(path_length[widest]))
}

/// Linear ramp: 0 up to `low`, 1 from `high`.
pub fn ramp(value: f64, low: f64, high: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}
