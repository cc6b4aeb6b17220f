//! Builds the portrait of a video's person from frontal views throughout the video, with constant memory.

use super::landmarks::{self, FacePoint};
use crate::portrait::Portrait;
use crate::pose2d::{appearance, patch};
use anyhow::Result;
use orator_base::math::order::median;
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3;
use orator_base::types::image::Image;
use orator_media::opencv::warp::{self, Region};
use serde::{Deserialize, Serialize};

/// Largest `landmarks::turn` of a frontal view, and of a nearly frontal one; beyond it the face shape is inaccurate.
const FRONTAL: f64 = 0.1;
const NEARLY_FRONTAL: f64 = 0.15;
/// Largest number of stored views, and least number of (most frontal) views for a portrait, if available.
const N_VIEWS: usize = 48;
const MIN_VIEWS: usize = 12;
/// Sampling grid of a region: columns, rows.
const CELLS: [usize; 2] = [10, 6];
/// Side of the face picture in px, and relative to the square around the face.
const PICTURE_PX: usize = 128;
const PICTURE_SCALE: f64 = 1.15;

#[derive(Serialize, Deserialize)]
struct FaceView {
    /// `landmarks::turn`, at least `FRONTAL`.
    turn: f64,
    secs: f64,
    face: Vec<FacePoint>,
    skin: Vec<f32>,
    hair: Vec<f32>,
}

impl FaceView {
    /// Array lengths; equal for all views of a video.
    fn sizes(&self) -> [usize; 3] {
        [self.face.len(), self.skin.len(), self.hair.len()]
    }
}

/// Views of a video collected so far.
#[derive(Default, Serialize, Deserialize)]
pub struct PortraitViews {
    views: Vec<FaceView>,
    /// Least time between two views in seconds; doubled when there are too many frontal views.
    min_gap_secs: f64,
    /// Picture of the most frontal view, and its turn.
    picture: Option<(f64, Image)>,
}

impl PortraitViews {
    /// Adds the face found in a picture at `secs` of the video.
    pub fn add(&mut self, image: &Image, points: &[FacePoint], secs: f64) -> Result<()> {
        let Some((turn, face)) = landmarks::turn(points).zip(normalise_shape(points)) else { return Ok(()) };
        if self.picture.as_ref().is_none_or(|(best, _)| turn < *best) {
            let around = landmarks::region(points);
            let square = Region { side: PICTURE_SCALE * around.side, rotation: 0.0, ..around };
            if let Some(transform) = square.src_from_dst(PICTURE_PX) {
                let mut picture = Image::filled(PICTURE_PX, PICTURE_PX, [0; 3]);
                warp::warp(image, &transform, &mut picture)?;
                self.picture = Some((turn, picture));
            }
        }
        let turn = turn.max(FRONTAL);
        if self.accepts(turn, secs) {
            let [skin, hair] = regions(points).map(|region| colours(image, region));
            self.views.push(FaceView { turn, secs, face, skin, hair });
        }
        Ok(())
    }

    /// Whether all views have equal array lengths and the picture has its expected size.
    pub fn is_valid(&self) -> bool {
        let has_expected_size = |image: &Image| {
            [image.width, image.height] == [PICTURE_PX; 2] && image.data.len() == 3 * PICTURE_PX * PICTURE_PX
        };
        self.views.len() <= N_VIEWS
            && self.views.windows(2).all(|pair| pair[0].sizes() == pair[1].sizes())
            && self.picture.iter().all(|(_, picture)| has_expected_size(picture))
    }

    /// Adds the views of the following part, if their array lengths match.
    pub fn append(&mut self, next: Self) {
        let sizes = self.views.first().map(FaceView::sizes);
        for view in next.views.into_iter().filter(|view| sizes.is_none_or(|sizes| sizes == view.sizes())) {
            if self.accepts(view.turn, view.secs) {
                self.views.push(view);
            }
        }
        let best = |picture: &Option<(f64, Image)>| picture.as_ref().map_or(f64::INFINITY, |(turn, _)| *turn);
        if best(&next.picture) < best(&self.picture) {
            self.picture = next.picture;
        }
    }

    /// Whether a view with this turn and time is accepted; removes another view if necessary.
    fn accepts(&mut self, turn: f64, secs: f64) -> bool {
        if let Some(last) = self.views.last().filter(|last| secs - last.secs < self.min_gap_secs) {
            if last.turn <= turn {
                return false;
            }
            self.views.pop();
        }
        let most = self.views.iter().enumerate().max_by(|a, b| a.1.turn.total_cmp(&b.1.turn));
        if let Some((at, most)) = most.filter(|_| self.views.len() >= N_VIEWS) {
            if most.turn > turn {
                self.views.remove(at);
            } else if turn > FRONTAL {
                return false;
            } else {
                self.drop_every_other();
            }
        }
        true
    }

    /// Drops every other view and sets the interval to twice the mean spacing.
    fn drop_every_other(&mut self) {
        let (first, last) = (self.views.first(), self.views.last());
        let secs = first.zip(last).map_or(0.0, |(first, last)| last.secs - first.secs);
        self.min_gap_secs = 2.0 * secs / N_VIEWS as f64;
        let mut at = 0;
        self.views.retain(|_| {
            at += 1;
            at % 2 == 1
        });
    }

    /// Portrait and face picture; `None` if no face was detected.
    pub fn finish(mut self) -> Option<(Portrait, Image)> {
        self.views.sort_by(|a, b| a.turn.total_cmp(&b.turn));
        let n_frontal = self.views.iter().filter(|view| view.turn <= FRONTAL).count();
        self.views.truncate(n_frontal.max(MIN_VIEWS));
        self.views.retain(|view| view.turn <= NEARLY_FRONTAL);
        let face = median_shape(&self.views).unwrap_or_default();
        let mean = |colours: Vec<&Vec<f32>>| {
            let n = colours.len().max(1) as f32;
            let n_numbers = colours.first().map_or(0, |first| first.len());
            (0..n_numbers).map(|at| colours.iter().map(|one| one[at]).sum::<f32>() / n).collect()
        };
        let portrait = Portrait {
            face,
            skin: mean(self.views.iter().map(|view| &view.skin).collect()),
            hair: mean(self.views.iter().map(|view| &view.hair).collect()),
            n_frames: self.views.len(),
        };
        Some((portrait, self.picture?.1))
    }
}

/// Centres the points and scales them to a root mean square distance of 1.
fn normalise_shape(points: &[FacePoint]) -> Option<Vec<FacePoint>> {
    let n = points.len() as f64;
    let middle = vec3::scale(points.iter().fold([0.0; 3], |sum, point| vec3::add(sum, *point)), 1.0 / n);
    let centred: Vec<FacePoint> = points.iter().map(|point| vec3::sub(*point, middle)).collect();
    let size = (centred.iter().map(|point| vec3::norm(*point).powi(2)).sum::<f64>() / n).sqrt();
    (size > 1e-6 && size.is_finite()).then(|| centred.into_iter().map(|point| vec3::scale(point, 1.0 / size)).collect())
}

/// Coordinate-wise median over all views, aligned to the first view, then to their median.
fn median_shape(views: &[FaceView]) -> Option<Vec<FacePoint>> {
    let mut shape = views.first()?.face.clone();
    for _ in 0..2 {
        let aligned = views.iter().filter_map(|view| {
            let fit = similarity(&view.face, &shape)?;
            Some(view.face.iter().map(|point| fit.apply(*point)).collect())
        });
        let aligned: Vec<Vec<FacePoint>> = aligned.collect();
        let middle = |at: usize, axis: usize| median(aligned.iter().map(|face| face[at][axis]));
        let medians = (0..shape.len()).map(|at| Some([middle(at, 0)?, middle(at, 1)?, middle(at, 2)?]));
        shape = normalise_shape(&medians.collect::<Option<Vec<_>>>()?)?;
    }
    // Six digits exceed the accuracy of the measurement.
    Some(shape.into_iter().map(|point| point.map(|v| (v * 1e6).round() / 1e6)).collect())
}

/// Boxes (x, y, width, height in px) of the cheeks with the nose, and of the hair above the forehead.
fn regions(points: &[FacePoint]) -> [[f64; 4]; 2] {
    let end = |axis: usize, of: fn(f64, f64) -> f64, from: f64| points.iter().map(|p| p[axis]).fold(from, of);
    let [left, top] = [0, 1].map(|axis| end(axis, f64::min, f64::INFINITY));
    let [width, height] = [end(0, f64::max, f64::NEG_INFINITY) - left, end(1, f64::max, f64::NEG_INFINITY) - top];
    [
        [left + 0.25 * width, top + 0.35 * height, 0.5 * width, 0.3 * height],
        [left + 0.2 * width, top - 0.22 * height, 0.6 * width, 0.15 * height],
    ]
}

fn colours(image: &Image, region: [f64; 4]) -> Vec<f32> {
    appearance::distribution(&patch::colours(image, region, CELLS)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Face with the chin lowered by `chin`, rotated about the vertical axis and shifted.
    fn face(chin: f64, turn: f64) -> Vec<FacePoint> {
        let (sin, cos) = turn.sin_cos();
        let vertex = |k: usize| {
            let (u, v) = ((k % 18) as f64 / 17.0 - 0.5, (k / 18) as f64 / 25.0 - 0.5);
            let [x, y, z] = match k {
                33 => [-30.0, -20.0, 0.0],
                263 => [30.0, -20.0, 0.0],
                landmarks::NOSE_TIP => [0.0, 10.0, -20.0],
                _ => [80.0 * u, 120.0 * v + if v > 0.3 { chin } else { 0.0 }, 90.0 * u * u],
            };
            [300.0 + x * cos + z * sin, 200.0 + y, z * cos - x * sin]
        };
        (0..landmarks::N_LANDMARKS).map(vertex).collect()
    }

    fn portrait(chin: f64, skin: u8) -> (Portrait, Image) {
        let image = Image::filled(640, 480, [skin, 100, 90]);
        let mut views = PortraitViews::default();
        for t in 0..200 {
            let turn = 0.0125 * f64::from(t % 40);
            views.add(&image, &face(chin, turn), f64::from(t) / 15.0).unwrap();
        }
        assert!(views.views.len() <= N_VIEWS);
        views.finish().unwrap()
    }

    #[test]
    fn face_shape_is_independent_of_rotation_and_distinguishes_chins() {
        let ((one, picture), (other, _)) = (portrait(0.0, 150), portrait(12.0, 60));
        assert!((MIN_VIEWS..=N_VIEWS).contains(&one.n_frames) && picture.width == PICTURE_PX);
        assert!(one.face_distance(&portrait(0.0, 90).0).unwrap() < 1.0);
        assert!(one.face_distance(&other).unwrap() > 20.0);
        assert!(one.face_distance(&portrait(0.0, 90).0).is_some() && one.colour_distance(&other) > 15.0);
        assert!(PortraitViews::default().finish().is_none());
    }

    #[test]
    fn invalid_points_give_no_portrait() {
        let image = Image::filled(64, 48, [1; 3]);
        let mut views = PortraitViews::default();
        views.add(&image, &[], 0.0).unwrap();
        views.add(&image, &vec![[f64::NAN; 3]; landmarks::N_LANDMARKS], 0.1).unwrap();
        views.add(&image, &vec![[7.0; 3]; landmarks::N_LANDMARKS], 0.2).unwrap();
        assert!(views.finish().is_none());
    }
}
