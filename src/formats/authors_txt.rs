//! Motion in the text layout of Rebol et al. 2021: one frame per line, 147 floats `x0 y0 z0 x1 ...` in metres, neck
//! first and at the origin, each finger from TIP to base (in memory: base to tip, see
//! `skeleton::swap_authors_order`). Numbers are formatted as by numpy's `savetxt`. Values are not corrected, only
//! rounded to f32: in the authors' predictions the hand roots (7, 28) are some mm away from the wrists.

use anyhow::{Context as _, bail, ensure};
use ndarray::Array3;
use orator_base::input;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{N_JOINTS, swap_authors_order};
use orator_base::types::time::FrameRate;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers per line.
const N_NUMBERS: usize = 3 * N_JOINTS;
/// Maximum absolute neck coordinate, metres; files beyond it are rejected.
const NECK_TOLERANCE: f32 = 1e-3;

/// Reads a motion at `fps` (15 for the authors' files). `nan` marks a missing joint.
///
/// # Errors
///
/// The line with a wrong number of values, an invalid number or a neck away from the origin; a file without frames.
pub fn read(path: &Path, fps: FrameRate) -> anyhow::Result<Motion> {
    let text = input::read_text(path, input::MAX_DATA).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text, fps).with_context(|| format!("{} is not motion in the authors' layout", path.display()))
}

/// Parses text in the authors' layout; as [`read`].
pub fn parse(text: &str, fps: FrameRate) -> anyhow::Result<Motion> {
    let mut numbers: Vec<f32> = Vec::with_capacity(text.len() / 26);
    for (line, n) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let before = numbers.len();
        for (word, column) in line.split_whitespace().zip(1..) {
            match word.parse::<f32>() {
                Ok(number) => numbers.push(number),
                Err(_) => bail!("line {n}, column {column}: `{word}` is not a number"),
            }
        }
        let found = numbers.len() - before;
        ensure!(found == N_NUMBERS, "line {n}: {found} numbers, expected {N_NUMBERS} ({N_JOINTS} joints x 3)");
        let neck = &numbers[before..before + 3];
        ensure!(
            !neck.iter().any(|v| v.abs() > NECK_TOLERANCE),
            "line {n}: the first joint (the neck) is at {neck:?} m, expected the origin"
        );
    }
    let n_frames = numbers.len() / N_NUMBERS;
    ensure!(n_frames > 0, "the file has no frames");
    let joints = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(frame, joint, axis)| {
        numbers[frame * N_NUMBERS + 3 * swap_authors_order(joint) + axis]
    });
    Ok(Motion::from_joints(fps, joints))
}

/// Formats a motion as text; a missing joint is written as `nan nan nan`.
pub fn format(motion: &Motion) -> String {
    let mut text = String::with_capacity(motion.n_frames() * N_NUMBERS * 26);
    for frame in motion.joints.outer_iter() {
        for n in 0..N_NUMBERS {
            if n > 0 {
                text.push(' ');
            }
            push_number(&mut text, frame[[swap_authors_order(n / 3), n % 3]]);
        }
        text.push('\n');
    }
    text
}

/// Appends a number in numpy's `%.18e` format: signed exponent of at least two digits.
fn push_number(text: &mut String, number: f32) {
    if !number.is_finite() {
        text.push_str("nan");
        return;
    }
    let formatted = format!("{:.18e}", f64::from(number));
    match formatted.split_once('e').map(|(digits, exponent)| (digits, exponent.parse::<i32>())) {
        Some((digits, Ok(exponent))) => {
            let sign = if exponent < 0 { '-' } else { '+' };
            let _ = write!(text, "{digits}e{sign}{:02}", exponent.abs());
        }
        _ => text.push_str(&formatted),
    }
}
