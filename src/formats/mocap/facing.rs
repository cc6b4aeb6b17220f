//! Conversion from the axes and unit of a captured skeleton to those of `types::skeleton`: metres, x image right, y
//! down, z away, neck at the origin, and the speaker turned to face the camera on average over the take. Files state
//! neither unit nor axes: the arm length defines the unit, the spine the vertical, the shoulders the front.

use anyhow::{Context, Result, ensure};
use orator_base::math::order::upper_median;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use std::str::FromStr;

/// Known units: metre, centimetre, millimetre, inch, and the 0.45 inch of old CMU files.
const UNITS: [LengthUnit; 5] = [
    LengthUnit { name: "metre", metres: 1.0 },
    LengthUnit { name: "centimetre", metres: 0.01 },
    LengthUnit { name: "millimetre", metres: 0.001 },
    LengthUnit { name: "inch", metres: 0.0254 },
    LengthUnit { name: "0.45 inch", metres: 0.0254 / 0.45 },
];
/// Symbols of the first four units.
const SYMBOLS: [&str; 4] = ["m", "cm", "mm", "inch"];
/// Typical length of upper arm and forearm of an adult, metres.
const ARM_METRES: f64 = 0.54;
/// Maximum angle to +z at which a speaker still counts as facing +z.
const MAX_FACING_DEGREES: f64 = 60.0;
/// Arm lengths accepted as a person's, metres.
const ARM_RANGE: std::ops::Range<f64> = 0.33..0.85;

/// Unit of length of a captured skeleton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    pub name: &'static str,
    /// Length in metres.
    metres: f64,
}

impl LengthUnit {
    pub const METRE: Self = UNITS[0];
}

/// Parses `m`, `cm`, `mm` or `inch`.
impl FromStr for LengthUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = SYMBOLS.into_iter().zip(UNITS).find(|(symbol, _)| *symbol == text);
        known.map(|(_, unit)| unit).ok_or_else(|| format!("expected one of {}", SYMBOLS.join(", ")))
    }
}

/// Joints of a frame that define the orientation and size of a skeleton, in the source's unit and axes.
#[derive(Clone, Copy, Debug)]
pub struct TorsoLandmarks {
    pub neck: Vec3,
    pub right_shoulder: Vec3,
    pub left_shoulder: Vec3,
    /// Midpoint of the hips, or the root.
    pub hips: Vec3,
    /// Length of upper arm plus forearm, if known.
    pub arm: Option<f64>,
}

/// Rotation and scale from a captured skeleton to the axes and unit of `types::skeleton`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisAlignment {
    /// Directions of the x, y and z axes of `types::skeleton` in the source.
    axes: [Vec3; 3],
    pub metres: f64,
    pub unit: &'static str,
    /// The source axis that points up, such as `+y`.
    pub up: &'static str,
    /// Rotation of the take about the vertical, degrees, from facing along the source's depth axis (z; -y if z is up).
    pub turned_degrees: f64,
}

impl AxisAlignment {
    /// Fits the alignment to all frames of a take; without `units`, the unit of length is detected from the arms.
    ///
    /// # Errors
    ///
    /// No frame has neck, shoulders and hips; the arm length is not a person's in any known unit; the spine follows
    /// no axis; the shoulders are vertical, or turn so much that the take has no front.
    pub fn fit(frames: &[TorsoLandmarks], units: Option<LengthUnit>) -> Result<Self> {
        let frames: Vec<&TorsoLandmarks> = frames.iter().filter(|f| f.is_finite()).collect();
        ensure!(!frames.is_empty(), "no frame has a neck, shoulders and hips");
        let LengthUnit { name: unit, metres } =
            units.map_or_else(|| detect_unit(frames.iter().filter_map(|f| f.arm).collect()), Ok)?;
        let sum = |of: &dyn Fn(&TorsoLandmarks) -> Vec3| frames.iter().fold([0.0; 3], |sum, f| vec3::add(sum, of(f)));
        let spine = sum(&|f| vec3::sub(f.neck, f.hips));
        let (up_axis, up) = vertical_axis(spine)?;
        // Each frame contributes a unit vector, regardless of the apparent shoulder width from above.
        let level =
            |f: &TorsoLandmarks| vec3::unit(vec3::across(vec3::sub(f.left_shoulder, f.right_shoulder), up), 1e-9);
        let side = sum(&|f| level(f).unwrap_or_default());
        let steadiness = vec3::norm(side) / frames.len() as f64;
        let x = vec3::unit(side, 1e-9).context("the shoulders are vertically above each other")?;
        ensure!(
            steadiness > 0.05,
            "the speaker turns too much to determine the front (steadiness {steadiness:.2} of 1): cut the take"
        );
        let y = vec3::scale(up, -1.0);
        // Facing -z: x points to the speaker's left, and the axes are right-handed.
        let z = vec3::cross(x, y);
        // At rest the speaker's left is +x of the source, whichever axis is up.
        let rest = [1.0, 0.0, 0.0];
        let (cos, sin) = (vec3::dot(rest, x), vec3::dot(vec3::cross(rest, x), up));
        Ok(Self { axes: [x, y, z], metres, unit, up: up_axis, turned_degrees: -sin.atan2(cos).to_degrees() })
    }

    /// The alignment without rotation; `None` unless the source is y up and faces +z within `MAX_FACING_DEGREES`.
    pub fn unrotated(&self) -> Option<Self> {
        let faces_front = self.up == "+y" && self.turned_degrees.abs() <= MAX_FACING_DEGREES;
        let axes = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
        faces_front.then_some(Self { axes, turned_degrees: 0.0, ..*self })
    }

    /// Rotation from the axes of the source to those of an animation rig (x to the left, y up, z forward).
    pub fn rotation(&self) -> Rotation {
        let [x, y, z] = self.axes;
        Rotation::from_axes(x, vec3::scale(y, -1.0), vec3::scale(z, -1.0)).inverse()
    }

    /// Position of a joint in the axes of `types::skeleton`, metres from the neck.
    pub fn align_joint(&self, joint: Vec3, neck: Vec3) -> Vec3 {
        let from_neck = vec3::scale(vec3::sub(joint, neck), self.metres);
        self.axes.map(|axis| vec3::dot(axis, from_neck))
    }
}

impl TorsoLandmarks {
    fn is_finite(&self) -> bool {
        [self.neck, self.right_shoulder, self.left_shoulder, self.hips].iter().flatten().all(|v| v.is_finite())
    }
}

/// Unit in which the median arm length is closest to an adult's.
fn detect_unit(arms: Vec<f64>) -> Result<LengthUnit> {
    let arm = upper_median(arms).context("no frame has an arm from which to derive the unit")?;
    let deviation = |unit: LengthUnit| (arm * unit.metres / ARM_METRES).ln().abs();
    let plausible = UNITS.into_iter().filter(|unit| ARM_RANGE.contains(&(arm * unit.metres)));
    let best = plausible.min_by(|&a, &b| deviation(a).total_cmp(&deviation(b)));
    best.with_context(|| {
        format!(
            "the arms are {arm:.4} long, which is implausible in every known unit: {}; \
             `orator animate` and `orator import` accept another scale with --units",
            UNITS.map(|unit| unit.name).join(", ")
        )
    })
}

/// Name and direction of the axis that the spine follows.
fn vertical_axis(spine: Vec3) -> Result<(&'static str, Vec3)> {
    const NAMES: [[&str; 2]; 3] = [["-x", "+x"], ["-y", "+y"], ["-z", "+z"]];
    let axis = (0..3).max_by(|&a, &b| spine[a].abs().total_cmp(&spine[b].abs())).unwrap_or(1);
    let length = vec3::norm(spine);
    ensure!(
        spine[axis].abs() > 0.8 * length && length > 0.0,
        "the spine is not along any axis ({spine:.1?} from hips to neck over the take): the speaker must stand or sit"
    );
    let up = spine[axis] > 0.0;
    let mut direction = [0.0; 3];
    direction[axis] = if up { 1.0 } else { -1.0 };
    Ok((NAMES[axis][usize::from(up)], direction))
}
