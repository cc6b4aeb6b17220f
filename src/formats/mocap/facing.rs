//! From the axes and the unit of a captured skeleton to those of `types::skeleton`: metres, x image right, y down, z away,
//! the neck at the origin, and the speaker turned about the vertical so that over the take they face the camera. Files
//! state neither unit nor axes: the arms define the unit, the spine the vertical, the shoulders the front.

use anyhow::{Context, Result, bail, ensure};
use orator_base::math::order::upper_median;
use orator_base::math::vec3::{self, Vec3};

/// Units that motion comes in, metres: metre, centimetre, millimetre, inch, and the 0.45 inch of old CMU files.
const UNITS: [(&str, f64); 5] =
    [("metre", 1.0), ("centimetre", 0.01), ("millimetre", 0.001), ("inch", 0.0254), ("0.45 inch", 0.0254 / 0.45)];
/// Upper arm and forearm of people, metres: the common adult's, and what is taken for a person's at all.
const ARM_METRES: f64 = 0.54;
/// A speaker who sits a little askew still faces +z.
const MOST_DEGREES: f64 = 60.0;
const ARM_RANGE: std::ops::Range<f64> = 0.33..0.85;

/// Joints of a frame that define how a skeleton stands, in the source's unit and axes.
#[derive(Clone, Copy, Debug)]
pub struct TorsoLandmarks {
    pub neck: Vec3,
    pub right_shoulder: Vec3,
    pub left_shoulder: Vec3,
    /// Between the hips, or the root.
    pub hips: Vec3,
    /// Upper arm and forearm together.
    pub arm: Option<f64>,
}

/// Rotation and scale from a captured skeleton to the axes and the unit of `types::skeleton`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisAlignment {
    /// Directions of the axes x, y, z of `types::skeleton` in the source.
    axes: [Vec3; 3],
    pub metres: f64,
    pub unit: &'static str,
    /// The source's axis that points up, as `+y`.
    pub up: &'static str,
    /// Degrees by which the take was turned about the vertical, counted from facing along the source's depth axis
    /// (z, of a z-up source -y).
    pub turned_degrees: f64,
}

impl AxisAlignment {
    /// Alignment of a take by all of its frames. Errors: no frame with neck, shoulders and hips; arms that are no
    /// person's in any known unit; shoulders that lie above each other or turn so much that no side is the front.
    pub fn fit(frames: &[TorsoLandmarks]) -> Result<Self> {
        let frames: Vec<&TorsoLandmarks> = frames.iter().filter(|f| f.is_finite()).collect();
        ensure!(!frames.is_empty(), "no frame has a neck, shoulders and hips");
        let (unit, metres) = unit(frames.iter().filter_map(|f| f.arm).collect())?;
        let sum = |of: &dyn Fn(&TorsoLandmarks) -> Vec3| frames.iter().fold([0.0; 3], |sum, f| vec3::add(sum, of(f)));
        let spine = sum(&|f| vec3::sub(f.neck, f.hips));
        let (up_axis, up) = upright(spine)?;
        // the side of every frame counts the same, however wide the shoulders seem from above
        let level =
            |f: &TorsoLandmarks| vec3::unit(vec3::across(vec3::sub(f.left_shoulder, f.right_shoulder), up), 1e-9);
        let side = sum(&|f| level(f).unwrap_or_default());
        let steadiness = vec3::norm(side) / frames.len() as f64;
        let x = vec3::unit(side, 1e-9).context("the shoulders lie above each other")?;
        ensure!(
            steadiness > 0.05,
            "the speaker turns round so much that the take has no front (steadiness {steadiness:.2} of 1): cut it"
        );
        let y = vec3::scale(up, -1.0);
        // facing -z: the cross of right-handed axes, x to the speaker's left
        let z = vec3::cross(x, y);
        // at rest the speaker's left is the source's +x, whichever axis is up
        let rest = [1.0, 0.0, 0.0];
        let (cos, sin) = (vec3::dot(rest, x), vec3::dot(vec3::cross(rest, x), up));
        Ok(Self { axes: [x, y, z], metres, unit, up: up_axis, turned_degrees: -sin.atan2(cos).to_degrees() })
    }

    /// Axes without the turn, for a source that is y up and faces +z (within `MOST_DEGREES`) already.
    pub fn as_it_stands(&self) -> Option<Self> {
        let faces = self.up == "+y" && self.turned_degrees.abs() <= MOST_DEGREES;
        let axes = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
        faces.then_some(Self { axes, turned_degrees: 0.0, ..*self })
    }

    /// A joint of a frame in the axes of `types::skeleton`, metres from the neck.
    pub fn place(&self, joint: Vec3, neck: Vec3) -> Vec3 {
        let from_neck = vec3::scale(vec3::sub(joint, neck), self.metres);
        self.axes.map(|axis| vec3::dot(axis, from_neck))
    }
}

impl TorsoLandmarks {
    fn is_finite(&self) -> bool {
        [self.neck, self.right_shoulder, self.left_shoulder, self.hips].iter().flatten().all(|v| v.is_finite())
    }
}

/// The unit in which the median arm is most like an adult's.
fn unit(arms: Vec<f64>) -> Result<(&'static str, f64)> {
    let arm = upper_median(arms).context("no frame has an arm whose length would tell the unit")?;
    let unlikely = |metres: f64| (arm * metres / ARM_METRES).ln().abs();
    let fits = |metres: f64| ARM_RANGE.contains(&(arm * metres));
    let best = UNITS.into_iter().filter(|u| fits(u.1)).min_by(|a, b| unlikely(a.1).total_cmp(&unlikely(b.1)));
    let Some(unit) = best else {
        bail!("its arms are {arm:.4} long, which is a person's in none of: {}", UNITS.map(|u| u.0).join(", "))
    };
    Ok(unit)
}

/// The axis that the spine follows.
fn upright(spine: Vec3) -> Result<(&'static str, Vec3)> {
    const NAMES: [[&str; 2]; 3] = [["-x", "+x"], ["-y", "+y"], ["-z", "+z"]];
    let axis = (0..3).max_by(|&a, &b| spine[a].abs().total_cmp(&spine[b].abs())).unwrap_or(1);
    let length = vec3::norm(spine);
    ensure!(
        spine[axis].abs() > 0.8 * length && length > 0.0,
        "the spine follows none of the axes ({spine:.1?} from hips to neck over the take): the speaker does not stand or sit"
    );
    let up = spine[axis] > 0.0;
    let mut direction = [0.0; 3];
    direction[axis] = if up { 1.0 } else { -1.0 };
    Ok((NAMES[axis][usize::from(up)], direction))
}
