//! Operations on vectors of three f64 for rotations and skeletons.

/// A vector x, y, z.
pub type Vec3 = [f64; 3];

pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn scale(a: Vec3, by: f64) -> Vec3 {
    [a[0] * by, a[1] * by, a[2] * by]
}

pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Direction of `a`; `None` if its length is not greater than `min_length` or is NaN.
pub fn unit(a: Vec3, min_length: f64) -> Option<Vec3> {
    let length = norm(a);
    (length > min_length).then(|| scale(a, 1.0 / length))
}

/// Component of `a` perpendicular to the unit vector `axis`.
pub fn across(a: Vec3, axis: Vec3) -> Vec3 {
    sub(a, scale(axis, dot(a, axis)))
}

/// Returns a unit vector perpendicular to the unit vector `a`.
pub fn any_across(a: Vec3) -> Vec3 {
    let smallest = (0..3).min_by(|&i, &j| a[i].abs().total_cmp(&a[j].abs())).unwrap_or(0);
    let mut pick = [0.0; 3];
    pick[smallest] = 1.0;
    let side = across(pick, a);
    scale(side, 1.0 / norm(side))
}
