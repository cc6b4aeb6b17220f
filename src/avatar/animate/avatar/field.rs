//! Shapes as signed distance fields (cm, negative inside): tapered limbs, joined by smooth unions and cut by planes.

use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub};

/// Rounded cone between two points, with a radius at each.
#[derive(Clone, Copy, Debug)]
pub struct RoundCone {
    ends: [Vec3; 2],
    radii: [f64; 2],
    /// Unit vector and factor by which the radii are scaled along it.
    flat: Option<(Vec3, f64)>,
}

impl RoundCone {
    pub fn new(ends: [Vec3; 2], radii: [f64; 2]) -> Self {
        Self { ends, radii, flat: None }
    }

    /// Scales all radii along the unit vector `axis` by `factor`.
    pub fn flattened(self, axis: Vec3, factor: f64) -> Self {
        Self { flat: Some((axis, factor)), ..self }
    }

    /// Signed distance of a point; exact for equal radii without flattening.
    pub fn distance(&self, point: Vec3) -> f64 {
        let [a, b] = self.ends;
        let along = sub(b, a);
        let share = (dot(sub(point, a), along) / dot(along, along).max(1e-12)).clamp(0.0, 1.0);
        let from = sub(sub(point, a), scale(along, share));
        let radius = self.radii[0] + share * (self.radii[1] - self.radii[0]);
        let far = norm(from);
        let Some((axis, factor)) = self.flat else { return far - radius };
        // The limb is round in a space stretched along the axis; the ratio of the lengths maps the distance back.
        let stretched = norm(add(from, scale(axis, dot(from, axis) * (1.0 / factor - 1.0))));
        if stretched < 1e-9 { -radius * factor.min(1.0) } else { (stretched - radius) * far / stretched }
    }

    /// Corners of the axis-aligned bounding box.
    pub fn bounds(&self) -> [Vec3; 2] {
        let reach = self.radii[0].max(self.radii[1]) * self.flat.map_or(1.0, |(_, factor)| factor.max(1.0));
        let [a, b] = self.ends;
        [[0, 1, 2].map(|k| a[k].min(b[k]) - reach), [0, 1, 2].map(|k| a[k].max(b[k]) + reach)]
    }
}

/// Smooth union of two distances, rounded within `blend` cm of their intersection.
pub fn smooth_union(a: f64, b: f64, blend: f64) -> f64 {
    let near = (blend - (a - b).abs()).max(0.0);
    a.min(b) - near * near / (4.0 * blend.max(1e-9))
}

/// Smooth union of limbs, cut by planes.
#[derive(Clone, Debug, Default)]
pub struct Form {
    /// Each limb with the width of its blend with the previous ones, cm.
    limbs: Vec<(RoundCone, f64)>,
    /// Each plane as a point, its outward unit normal and the rounding of the edge, cm.
    cuts: Vec<(Vec3, Vec3, f64)>,
}

impl Form {
    #[must_use]
    pub fn with(mut self, limb: RoundCone, blend: f64) -> Self {
        self.limbs.push((limb, blend));
        self
    }

    /// Removes the side that `normal` points to.
    #[must_use]
    pub fn cut(mut self, point: Vec3, normal: Vec3, edge: f64) -> Self {
        self.cuts.push((point, normal, edge));
        self
    }

    pub fn distance(&self, point: Vec3) -> f64 {
        let grown = self.limbs.iter().fold(f64::INFINITY, |d, (limb, blend)| {
            if d.is_finite() { smooth_union(d, limb.distance(point), *blend) } else { limb.distance(point) }
        });
        self.cuts.iter().fold(grown, |d, (at, normal, edge)| -smooth_union(-d, -dot(sub(point, *at), *normal), *edge))
    }

    /// Corners of the axis-aligned bounding box.
    pub fn bounds(&self) -> [Vec3; 2] {
        bounding_box(self.limbs.iter().map(|(limb, blend)| {
            let [low, high] = limb.bounds();
            [low.map(|v| v - blend / 4.0), high.map(|v| v + blend / 4.0)]
        }))
    }
}

/// Corners of the bounding box of several boxes.
pub fn bounding_box(boxes: impl Iterator<Item = [Vec3; 2]>) -> [Vec3; 2] {
    boxes.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], [a, b]| {
        [[0, 1, 2].map(|k| low[k].min(a[k])), [0, 1, 2].map(|k| high[k].max(b[k]))]
    })
}
