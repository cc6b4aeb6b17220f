//! Procrustes alignment: the similarity (rotation, uniform scale, translation; no reflection) that best maps one set
//! of points onto another in the least-squares sense, by Horn's unit quaternion (Closed-form solution of absolute
//! orientation using unit quaternions, 1987, section 4).

/// Similarity transform `to = scale * rotation * from + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    pub scale: f64,
    pub rotation: [[f64; 3]; 3],
    pub shift: [f64; 3],
}

impl Similarity {
    pub fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.scale * (0..3).map(|k| self.rotation[i][k] * p[k]).sum::<f64>() + self.shift[i])
    }
}

/// Returns the best similarity from `from` onto `to`, which are paired by index. `None` for unequal counts, fewer than
/// three pairs, a non-finite number, or if all points of `from` coincide.
pub fn similarity(from: &[[f64; 3]], to: &[[f64; 3]]) -> Option<Similarity> {
    let n = from.len();
    if n != to.len() || n < 3 || from.iter().chain(to).flatten().any(|v| !v.is_finite()) {
        return None;
    }
    let (from_mean, to_mean) = (mean(from), mean(to));
    let mut s = [[0.0; 3]; 3]; // s[a][b] = sum of from[a] * to[b], both centred
    let mut spread = 0.0;
    for (p, q) in from.iter().zip(to) {
        for a in 0..3 {
            spread += (p[a] - from_mean[a]).powi(2);
            for b in 0..3 {
                s[a][b] += (p[a] - from_mean[a]) * (q[b] - to_mean[b]);
            }
        }
    }
    if spread < 1e-18 {
        return None;
    }
    let n4 = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    let rotation = matrix_of(largest_eigenvector(n4));
    let along: f64 = (0..3).map(|i| (0..3).map(|k| rotation[i][k] * s[k][i]).sum::<f64>()).sum();
    let scale = along / spread;
    let shift =
        std::array::from_fn(|i| to_mean[i] - scale * (0..3).map(|k| rotation[i][k] * from_mean[k]).sum::<f64>());
    Some(Similarity { scale, rotation, shift })
}

fn mean(points: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64)
}

/// Rotation matrix of the unit quaternion (w, x, y, z).
pub fn matrix_of([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut vectors = [[0.0; 4]; 4];
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _sweep in 0..32 {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q].abs() < 1e-300 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (row_p, row_q) = (a[p], a[q]);
                a[p] = std::array::from_fn(|k| c * row_p[k] - s * row_q[k]);
                a[q] = std::array::from_fn(|k| s * row_p[k] + c * row_q[k]);
                for row in &mut vectors {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let best = (0..4).fold(0, |best, i| if a[i][i] > a[best][best] { i } else { best });
    std::array::from_fn(|k| vectors[k][best])
}
