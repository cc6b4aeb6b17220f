//! Labelled hands in text files, one frame per line of u px, v px, depth mm per point: the test labels of NYU (14
//! points, a right hand, no knuckles) and of ICVL (16 points, a left hand), distinguished by the count of numbers per
//! line.

use super::take::{FingerTake, Fingers, Size};
use anyhow::{Context, Result, bail, ensure};
use orator_base::math::order::{lower_median, lower_quantile};
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::BONES;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use std::path::Path;

/// fx, fy, cx, cy of a depth camera, px.
type CameraIntrinsics = [f64; 4];
const NYU_CAMERA: CameraIntrinsics = [588.04, 587.08, 320.0, 240.0];
const ICVL_CAMERA: CameraIntrinsics = [241.42, 241.42, 160.0, 120.0];

/// Point indices of this crate for the NYU points: tip and middle joint of little, ring, middle and index finger, then
/// the thumb's last three.
const NYU: [usize; 11] = [20, 18, 16, 14, 12, 10, 8, 6, 4, 3, 2];
/// Position of NYU's palm point as a share of the distance from the wrist to the middle knuckle (derived from straight
/// fingers, whose knuckle lies there for a proximal phalanx in proportion to the other bones).
const NYU_PALM: f64 = 0.75;

/// Reads a label file.
///
/// # Errors
/// A file that cannot be read, a word that is not a finite number, lines of different or unknown length.
pub fn read(path: &Path) -> Result<FingerTake> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    parse(&text, name).with_context(|| format!("invalid hand labels {}", path.display()))
}

fn parse(text: &str, name: String) -> Result<FingerTake> {
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let number = |n: usize, word: &str| {
        word.parse::<f64>()
            .ok()
            .filter(|v| v.is_finite())
            .with_context(|| format!("invalid number `{word}` in line {}", n + 1))
    };
    let rows: Vec<Vec<f64>> = lines
        .map(|(n, line)| line.split_ascii_whitespace().map(|word| number(n, word)).collect())
        .collect::<Result<_>>()?;
    let width = rows.first().context("the file is empty")?.len();
    if let Some(n) = rows.iter().position(|row| row.len() != width) {
        bail!("frame {} has {} numbers: expected {width}, as in frame 1", n + 1, rows[n].len());
    }
    match width {
        42 => Ok(nyu(&rows, name)),
        48 => icvl(&rows, name),
        _ => bail!("{width} numbers per line: expected 42 (NYU, 14 points) or 48 (ICVL, 16 points)"),
    }
}

/// Points of a line in mm, in camera axes (x right, y down, z away).
fn points(row: &[f64], [fx, fy, cx, cy]: CameraIntrinsics) -> Vec<Vec3> {
    let (uvds, _) = row.as_chunks::<3>();
    uvds.iter().map(|&[u, v, d]| [(u - cx) * d / fx, (v - cy) * d / fy, d]).collect()
}

/// Converts NYU labels. The wrist is the midpoint of its two sides. The middle knuckle is extrapolated from the palm
/// point, as network input only.
fn nyu(rows: &[Vec<f64>], name: String) -> FingerTake {
    let frames = rows.iter().map(|row| {
        let p = points(row, NYU_CAMERA);
        let mut fingers: Fingers = [None; N_HAND];
        NYU.iter().zip(&p).for_each(|(&house, &point)| fingers[house] = Some(point));
        let wrist = vec3::scale(vec3::add(p[11], p[12]), 0.5);
        fingers[0] = Some(wrist);
        fingers[9] = Some(vec3::add(wrist, vec3::scale(vec3::sub(p[13], wrist), 1.0 / NYU_PALM)));
        fingers
    });
    let counted = std::array::from_fn(|j| j == 0 || NYU.contains(&j));
    FingerTake { name, side: Side::Right, frames: frames.collect(), counted, size: Size::MiddleEnd }
}

/// Converts ICVL labels, whose finger points are the midpoints of the three last bones and whose palm point is the
/// middle of the palm. Distances between such midpoints shrink when the finger bends. The joints follow from them: two
/// bones of known lengths meet at a joint on the side opposite to the bend. The wrist is placed behind the palm so
/// that the palm has its share of the hand's length.
fn icvl(rows: &[Vec<f64>], name: String) -> Result<FingerTake> {
    let frames: Vec<Vec<Vec3>> = rows.iter().map(|row| points(row, ICVL_CAMERA)).collect();
    let mut hands: Vec<Fingers> = vec![[None; N_HAND]; frames.len()];
    for (finger, [_, one, two, _]) in BONES.into_iter().enumerate() {
        let [first, second, third] = [1, 2, 3].map(|k| 3 * finger + k);
        let distances = frames.iter().map(|p| vec3::norm(vec3::sub(p[second], p[first])));
        // Half the length of the two bones: in most frames fingers are straight, and labels err to both sides.
        let together = lower_quantile(distances, 0.7).context("the file has no frame")?;
        let a = together * one / (one + two);
        for (p, hand) in frames.iter().zip(&mut hands) {
            let joint = joint_between(p[first], p[second], p[third], a, together - a);
            let last = vec3::sub(vec3::scale(p[second], 2.0), joint);
            let root = 1 + 4 * finger;
            hand[root] = Some(vec3::sub(vec3::scale(p[first], 2.0), joint));
            hand[root + 1] = Some(joint);
            hand[root + 2] = Some(last);
            hand[root + 3] = Some(vec3::sub(vec3::scale(p[third], 2.0), last));
        }
    }
    let size = |hand: &Fingers| Some(vec3::norm(vec3::sub(hand[10]?, hand[9]?)) as f32);
    let phalanx = f64::from(lower_median(hands.iter().filter_map(size)).context("the file has no frame")?);
    ensure!(phalanx > 1e-3, "all points of the middle finger coincide");
    let palm = phalanx * BONES[2][0] / BONES[2][1];
    for (p, hand) in frames.iter().zip(&mut hands) {
        let knuckles = [5, 9, 13, 17].map(|j| hand[j].unwrap_or_default());
        let middle = vec3::scale(knuckles.into_iter().fold([0.0; 3], vec3::add), 0.25);
        let back = vec3::unit(vec3::sub(p[0], middle), 1e-9).unwrap_or_default();
        hand[0] = Some(vec3::add(middle, vec3::scale(back, palm)));
    }
    Ok(FingerTake { name, side: Side::Left, frames: hands, counted: [true; N_HAND], size: Size::Phalanx })
}

/// Joint between two bones with midpoints `first` and `second` at distances `a` and `b` from it; the finger bends
/// towards `third`.
fn joint_between(first: Vec3, second: Vec3, third: Vec3, a: f64, b: f64) -> Vec3 {
    let along = vec3::sub(second, first);
    let distance = vec3::norm(along).min(a + b).max((a - b).abs() + 1e-9);
    let along = vec3::unit(along, 1e-9).unwrap_or([0.0, 1.0, 0.0]);
    let foot = (a * a - b * b + distance * distance) / (2.0 * distance);
    let height = (a * a - foot * foot).max(0.0).sqrt();
    let bent = vec3::across(vec3::sub(third, second), along);
    let side = vec3::unit(bent, 1e-9).unwrap_or_default();
    vec3::add(first, vec3::sub(vec3::scale(along, foot), vec3::scale(side, height)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::motion::hand_bones::relaxed;

    fn line(points: &[Vec3], [fx, fy, cx, cy]: CameraIntrinsics) -> String {
        let numbers = points.iter().flat_map(|&[x, y, z]| [fx * x / z + cx, fy * y / z + cy, z]);
        numbers.map(|v| format!("{v} ")).collect::<String>() + "\n"
    }

    fn far(left: f64) -> Vec<Vec3> {
        relaxed().iter().map(|&[x, y, z]| [left * 1000.0 * x, 1000.0 * y, 600.0 + 1000.0 * z]).collect()
    }

    #[test]
    fn nyu_points_find_their_places() {
        let hand = far(1.0);
        let wrist = hand[0];
        let mut p: Vec<Vec3> = NYU.iter().map(|&j| hand[j]).collect();
        p.extend([vec3::add(wrist, [9.0, 0.0, 0.0]), vec3::sub(wrist, [9.0, 0.0, 0.0])]);
        p.push(vec3::add(wrist, vec3::scale(vec3::sub(hand[9], wrist), 0.75)));
        let take = parse(&line(&p, NYU_CAMERA).repeat(2), "n".into()).unwrap();
        assert!(!take.has_knuckles() && !take.counted[9] && take.side == Side::Right);
        let truth = &take.truths().unwrap()[1];
        let off = |j: usize| vec3::norm(vec3::sub(truth.hand[j], relaxed()[j]));
        assert!(NYU.iter().all(|&j| off(j) < 3e-3) && off(9) < 3e-3 && !truth.there[5]);
    }

    #[test]
    fn icvl_joints_follow_from_the_middles_of_bones() {
        let hand = far(-1.0);
        let middle = |a: usize, b: usize| vec3::scale(vec3::add(hand[a], hand[b]), 0.5);
        let mut p = vec![vec3::scale(vec3::add(hand[0], hand[9]), 0.5)];
        for root in [1, 5, 9, 13, 17] {
            p.extend([0, 1, 2].map(|k| middle(root + k, root + k + 1)));
        }
        let take = parse(&line(&p, ICVL_CAMERA).repeat(3), "i".into()).unwrap();
        let truth = &take.truths().unwrap()[0];
        // Bone lengths are estimated from straight fingers; here all are bent, hence the tolerance.
        let off: Vec<f64> = (1..N_HAND).map(|j| vec3::norm(vec3::sub(truth.hand[j], relaxed()[j]))).collect();
        assert!(off.iter().all(|o| *o < 0.02), "{off:?}");
    }

    #[test]
    fn other_files_say_what_is_known() {
        for (text, says) in [("", "empty"), ("1 2 3", "42"), ("1 x", "`x`"), ("1 2\n1", "frame 2"), ("NaN", "line 1")] {
            let text = format!("{:#}", parse(text, String::new()).unwrap_err());
            assert!(text.contains(says), "{text}");
        }
        assert!(parse(&"0 ".repeat(48), String::new()).is_err());
    }
}
