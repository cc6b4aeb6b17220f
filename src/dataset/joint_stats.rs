//! Mean, standard deviation and range of a video's joints, which can be merged over videos without reading the joints
//! again (pairwise update of Chan, Golub and LeVeque 1979).

use ndarray::{ArrayView1, aview1};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use serde::{Deserialize, Serialize};

/// Moments over the frames in which a joint is visible; rows are joints, columns x, y, z in metres. For a posture, rows
/// are its six angles, each with its own visibility, and the first column is the angle in radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointMoments {
    /// Number of frames in which each row is visible.
    #[serde(rename = "n_seen")]
    pub n_visible: Vec<u64>,
    pub mean: Vec<[f64; 3]>,
    /// Sum of squared differences from the mean.
    pub squares: Vec<[f64; 3]>,
    /// Minimum; 0 for a joint that is never visible.
    pub min: Vec<[f64; 3]>,
    /// Maximum; 0 for a joint that is never visible.
    pub max: Vec<[f64; 3]>,
}

impl Default for JointMoments {
    fn default() -> Self {
        Self::with_rows(N_JOINTS)
    }
}

impl JointMoments {
    fn with_rows(n: usize) -> Self {
        let rows = || vec![[0.0; 3]; n];
        Self { n_visible: vec![0; n], mean: rows(), squares: rows(), min: rows(), max: rows() }
    }

    /// Empty moments of postures; the rows are yaw, pitch and roll of the head, then of the trunk.
    pub fn of_posture() -> Self {
        Self::with_rows(3 * PostureChannel::ALL.len())
    }

    /// Adds the visible joints of a motion.
    pub fn add_motion(&mut self, motion: &Motion) {
        for (frame, seen) in motion.joints.outer_iter().zip(motion.mask.outer_iter()) {
            for (joint, row) in frame.outer_iter().enumerate().filter(|(joint, _)| seen[*joint]) {
                self.add_row(joint, row);
            }
        }
    }

    /// Adds the visible (non-NaN) angles of a posture.
    pub fn add_posture(&mut self, posture: &Posture) {
        for (channel, first) in PostureChannel::ALL.into_iter().zip([0, 3]) {
            for ((_, k), angle) in posture.channel(channel).indexed_iter() {
                self.add_row(first + k, aview1(&[*angle, 0.0, 0.0]));
            }
        }
    }

    fn add_row(&mut self, joint: usize, row: ArrayView1<f32>) {
        if row.iter().any(|v| !v.is_finite()) {
            return;
        }
        let first = self.n_visible[joint] == 0;
        self.n_visible[joint] += 1;
        for (k, &value) in row.iter().enumerate() {
            let (value, mean) = (f64::from(value), &mut self.mean[joint][k]);
            let delta = value - *mean;
            *mean += delta / self.n_visible[joint] as f64;
            self.squares[joint][k] += delta * (value - *mean);
            let (min, max) = (&mut self.min[joint][k], &mut self.max[joint][k]);
            *min = if first { value } else { min.min(value) };
            *max = if first { value } else { max.max(value) };
        }
    }

    /// Adds the moments of other frames. Rows that `other` lacks count as never visible.
    pub fn merge(&mut self, other: &JointMoments) {
        let rows = other.mean.iter().zip(&other.squares).zip(other.min.iter().zip(&other.max));
        for (joint, ((mean, squares), (min, max))) in rows.enumerate().take(self.n_visible.len()) {
            let (n, m) = (self.n_visible[joint] as f64, other.n_visible.get(joint).copied().unwrap_or(0) as f64);
            if m == 0.0 {
                continue;
            }
            for k in 0..3 {
                let delta = mean[k] - self.mean[joint][k];
                self.mean[joint][k] += delta * m / (n + m);
                self.squares[joint][k] += squares[k] + delta * delta * n * m / (n + m);
                self.min[joint][k] = if n == 0.0 { min[k] } else { self.min[joint][k].min(min[k]) };
                self.max[joint][k] = if n == 0.0 { max[k] } else { self.max[joint][k].max(max[k]) };
            }
            self.n_visible[joint] += m as u64;
        }
    }

    /// Population standard deviations.
    pub fn std(&self) -> Vec<[f64; 3]> {
        let of = |(squares, n): (&[f64; 3], &u64)| squares.map(|square| (square / (*n).max(1) as f64).sqrt());
        self.squares.iter().zip(&self.n_visible).map(of).collect()
    }
}
