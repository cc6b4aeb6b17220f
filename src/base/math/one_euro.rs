//! The one-Euro filter (Casiez, Roussel, Vogel 2012): a first-order low pass whose cut-off rises with speed, so that a
//! still hand does not tremble and a fast one does not lag. Causal: a frame is made of itself and those before it.

use super::vec3::{Vec3, add, norm, scale, sub};

/// The filter's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneEuro {
    /// Cut-off at rest, Hz.
    pub rest_hz: f64,
    /// Rise of the cut-off with speed: Hz for a unit a second.
    pub beta: f64,
}

/// Cut-off of the speed itself, Hz (as in the paper).
const SPEED_HZ: f64 = 1.0;

impl OneEuro {
    /// The smoothed run of `fps` frames a second. The speed is the vector's, so that no axis is special.
    pub fn run(&self, fps: f64, values: &[Vec3]) -> Vec<Vec3> {
        let Some(&first) = values.first() else { return Vec::new() };
        let share = |hz: f64| 1.0 / (1.0 + fps / (std::f64::consts::TAU * hz));
        let (mut smooth, mut speed, mut raw) = (first, [0.0; 3], first);
        let mut next = |value: Vec3| {
            speed = mixed(speed, scale(sub(value, raw), fps), share(SPEED_HZ));
            raw = value;
            smooth = mixed(smooth, value, share(self.rest_hz + self.beta * norm(speed)));
            smooth
        };
        values.iter().map(|&value| next(value)).collect()
    }
}

fn mixed(old: Vec3, new: Vec3, share: f64) -> Vec3 {
    add(scale(old, 1.0 - share), scale(new, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_says_the_same() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/smoothing_golden.json")).unwrap();
        for case in golden["one_euro"].as_array().unwrap() {
            let number = |name: &str| case[name].as_f64().unwrap();
            let track = |name: &str| -> Vec<Vec3> { serde_json::from_value(case[name].clone()).unwrap() };
            let filter = OneEuro { rest_hz: number("rest_hz"), beta: number("beta") };
            for (found, expected) in filter.run(number("fps"), &track("input")).iter().zip(track("output")) {
                assert!(norm(sub(*found, expected)) < 1e-12);
            }
        }
    }

    #[test]
    fn rest_is_calm_and_a_fast_move_is_followed() {
        let filter = |beta: f64| OneEuro { rest_hz: 1.0, beta };
        let tremble: Vec<Vec3> = (0..60).map(|t| [if t % 2 == 0 { 0.01 } else { -0.01 }, 0.0, 0.0]).collect();
        assert!(filter(0.5).run(15.0, &tremble)[30..].iter().all(|v| v[0].abs() < 0.004));
        let step: Vec<Vec3> = (0..20).map(|t| [if t < 10 { 0.0 } else { 1.0 }, 0.0, 0.0]).collect();
        let after = |beta: f64| filter(beta).run(15.0, &step)[11][0];
        assert!(after(2.0) > after(0.0) + 0.2);
        assert!(filter(1.0).run(15.0, &[]).is_empty());
    }
}
