//! Annotations in the form of COCO-WholeBody (Jin et al. 2020): pictures, and of each person box and points of body,
//! feet, face and hands. A folder holds `images` and `annotations`.

use crate::stage::workdir;
use crate::types::pose2d::{N_BODY, N_HAND};
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Folder of the pictures.
pub const IMAGES: &str = "images";
/// Numbers of a foot's and a face's points: x, y, v each.
pub const N_FOOT_NUMBERS: usize = 3 * 6;
pub const N_FACE_NUMBERS: usize = 3 * 68;
/// The one category.
const PERSON: u64 = 1;
const BODY_NAMES: [&str; N_BODY] = [
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
];
/// Pairs of points that are drawn joined, counted from 1.
const SKELETON: [[usize; 2]; 19] = [
    [16, 14],
    [14, 12],
    [17, 15],
    [15, 13],
    [12, 13],
    [6, 12],
    [7, 13],
    [6, 7],
    [6, 8],
    [7, 9],
    [8, 10],
    [9, 11],
    [2, 3],
    [1, 2],
    [1, 3],
    [2, 4],
    [3, 5],
    [4, 6],
    [5, 7],
];

/// An annotation file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CocoLabels {
    #[serde(default)]
    pub info: CocoInfo,
    #[serde(default)]
    pub licenses: Vec<CocoLicence>,
    pub images: Vec<CocoImage>,
    pub annotations: Vec<CocoPerson>,
    #[serde(default)]
    pub categories: Vec<CocoCategory>,
}

/// What the set is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CocoInfo {
    pub description: String,
    pub version: String,
}

/// Terms of pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CocoLicence {
    pub id: u64,
    pub name: String,
    #[serde(default)]
    pub url: String,
}

/// A picture; `file_name` is relative to the folder of the pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CocoImage {
    pub id: u64,
    pub file_name: String,
    pub width: usize,
    pub height: usize,
    #[serde(default)]
    pub license: u64,
}

/// A person. Points are x, y in px (the centre of the top left pixel is 0, 0) and v: 0 without label (x and y are 0
/// then), 1 hidden, 2 seen. Of a part that is not labelled (`..._valid` false) all numbers are 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools)] // the form has them
pub struct CocoPerson {
    pub id: u64,
    pub image_id: u64,
    pub category_id: u64,
    /// 1 where the box holds a crowd.
    pub iscrowd: u8,
    /// x, y, width, height.
    pub bbox: [f64; 4],
    /// Pixels of the person.
    pub area: f64,
    /// Outlines; empty: not given.
    #[serde(default, skip_deserializing)]
    pub segmentation: Vec<Vec<f64>>,
    /// Labelled points of the body (v > 0).
    pub num_keypoints: usize,
    /// COCO-17.
    pub keypoints: Vec<f64>,
    #[serde(default)]
    pub foot_kpts: Vec<f64>,
    #[serde(default)]
    pub face_kpts: Vec<f64>,
    #[serde(default)]
    pub lefthand_kpts: Vec<f64>,
    #[serde(default)]
    pub righthand_kpts: Vec<f64>,
    #[serde(default)]
    pub face_box: [f64; 4],
    #[serde(default)]
    pub lefthand_box: [f64; 4],
    #[serde(default)]
    pub righthand_box: [f64; 4],
    #[serde(default)]
    pub foot_valid: bool,
    #[serde(default)]
    pub face_valid: bool,
    #[serde(default)]
    pub lefthand_valid: bool,
    #[serde(default)]
    pub righthand_valid: bool,
}

/// What is labelled, with the names of the body's points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CocoCategory {
    pub id: u64,
    pub name: String,
    #[serde(default)]
    pub supercategory: String,
    #[serde(default)]
    pub keypoints: Vec<String>,
    #[serde(default)]
    pub skeleton: Vec<[usize; 2]>,
}

/// A point with its label: x, y, v.
pub type LabelledPoint = [f64; 3];

/// Whether a point has no label, is hidden or can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointLabel {
    None = 0,
    Hidden = 1,
    Seen = 2,
}

/// Points of a person as the form has them, with what follows from them.
pub struct PersonPoints {
    pub body: [LabelledPoint; N_BODY],
    /// Left, right.
    pub hands: [[LabelledPoint; N_HAND]; 2],
}

/// A point's three numbers, rounded to a hundredth of a pixel; zeros without a label.
pub fn labelled([x, y]: [f64; 2], label: PointLabel) -> LabelledPoint {
    let rounded = |px: f64| (100.0 * px).round() / 100.0;
    if label == PointLabel::None { [0.0; 3] } else { [rounded(x), rounded(y), f64::from(label as u8)] }
}

impl CocoPerson {
    /// The person `id` in the picture `image_id`. A hand is valid where any of its points can be seen; its box is that
    /// of its labelled points. Feet and face have no labels.
    pub fn new(id: u64, image_id: u64, bbox: [f64; 4], area: f64, points: &PersonPoints) -> Self {
        let valid = points.hands.map(|hand| hand.iter().any(|[_, _, v]| *v == 2.0));
        let kept = [0, 1].map(|side| if valid[side] { points.hands[side] } else { [[0.0; 3]; N_HAND] });
        let [lefthand_box, righthand_box] = kept.map(|hand| box_of(&hand));
        let [left, right] = kept.map(|hand| hand.concat());
        Self {
            id,
            image_id,
            category_id: PERSON,
            iscrowd: 0,
            bbox,
            area,
            segmentation: Vec::new(),
            num_keypoints: points.body.iter().filter(|[_, _, v]| *v > 0.0).count(),
            keypoints: points.body.concat(),
            foot_kpts: vec![0.0; N_FOOT_NUMBERS],
            face_kpts: vec![0.0; N_FACE_NUMBERS],
            lefthand_kpts: left,
            righthand_kpts: right,
            face_box: [0.0; 4],
            lefthand_box,
            righthand_box,
            foot_valid: false,
            face_valid: false,
            lefthand_valid: valid[0],
            righthand_valid: valid[1],
        }
    }

    /// Points of the body; none where their number is wrong.
    pub fn body(&self) -> Option<[LabelledPoint; N_BODY]> {
        let (points, []) = self.keypoints.as_chunks::<3>() else { return None };
        points.try_into().ok()
    }
}

/// x, y, width and height of the box around the labelled points; zeros without any.
fn box_of(points: &[LabelledPoint]) -> [f64; 4] {
    let seen = points.iter().filter(|[_, _, v]| *v > 0.0);
    let [x, y] = [0, 1].map(|k| {
        let along = seen.clone().map(move |point| point[k]);
        (along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max))
    });
    if x.0 > x.1 { [0.0; 4] } else { [x.0, y.0, x.1 - x.0, y.1 - y.0] }
}

impl CocoLabels {
    /// A set without pictures.
    pub fn new(description: &str, licence: &str) -> Self {
        let category = CocoCategory {
            id: PERSON,
            name: "person".to_owned(),
            supercategory: "person".to_owned(),
            keypoints: BODY_NAMES.map(str::to_owned).to_vec(),
            skeleton: SKELETON.to_vec(),
        };
        Self {
            info: CocoInfo { description: description.to_owned(), version: "1.0".to_owned() },
            licenses: vec![CocoLicence { id: 1, name: licence.to_owned(), url: String::new() }],
            images: Vec::new(),
            annotations: Vec::new(),
            categories: vec![category],
        }
    }

    /// File of a part of the set in the folder `dir`.
    pub fn path(dir: &Path, part: &str) -> PathBuf {
        dir.join(format!("annotations/coco_wholebody_{part}.json"))
    }

    /// Writes the file of a part.
    pub fn write(&self, dir: &Path, part: &str) -> Result<()> {
        workdir::write_file(&Self::path(dir, part), &serde_json::to_vec(self)?)
    }

    /// Reads the file of a part. Errors name the file: it is not there, is no annotation file, a person's picture is
    /// not listed, a person has another number of body points, a number is not finite.
    pub fn read(dir: &Path, part: &str) -> Result<Self> {
        let path = Self::path(dir, part);
        let bytes = std::fs::read(&path).with_context(|| {
            format!("cannot read {}; `orator demo draw DIR --labels coco-wholebody` writes such a set", path.display())
        })?;
        let parse = || -> Result<Self> {
            let labels: Self = serde_json::from_slice(&bytes)?;
            let images: BTreeSet<u64> = labels.images.iter().map(|image| image.id).collect();
            for person in &labels.annotations {
                let CocoPerson { id, image_id, bbox, keypoints, .. } = person;
                ensure!(images.contains(image_id), "annotation {id}: the picture {image_id} is not listed");
                ensure!(keypoints.len() == 3 * N_BODY, "annotation {id}: {} numbers, not 51", keypoints.len());
                ensure!(bbox.iter().chain(keypoints).all(|v| v.is_finite()), "annotation {id}: a number is not finite");
            }
            Ok(labels)
        };
        parse().with_context(|| format!("{} holds no annotations in the form of COCO-WholeBody", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_reads_back_and_a_hand_that_nobody_sees_is_not_labelled() {
        let mut points = PersonPoints { body: [[0.0; 3]; N_BODY], hands: [[[0.0; 3]; N_HAND]; 2] };
        points.body[0] = labelled([10.126, 20.0], PointLabel::Seen);
        points.body[9] = labelled([11.0, 21.0], PointLabel::Hidden);
        points.body[10] = labelled([12.0, 22.0], PointLabel::None);
        points.hands[0][4] = labelled([5.0, 6.0], PointLabel::Seen);
        points.hands[0][8] = labelled([9.0, 16.0], PointLabel::Hidden);
        points.hands[1][3] = labelled([9.0, 9.0], PointLabel::Hidden);
        let person = CocoPerson::new(1, 7, [1.0, 2.0, 30.0, 40.0], 600.0, &points);
        assert_eq!(person.body().unwrap()[0], [10.13, 20.0, 2.0]);
        assert_eq!((person.num_keypoints, person.body().unwrap()[10]), (2, [0.0; 3]));
        assert_eq!((person.lefthand_valid, person.lefthand_box), (true, [5.0, 6.0, 4.0, 10.0]));
        assert_eq!((person.righthand_valid, person.righthand_box), (false, [0.0; 4]));
        assert!(person.righthand_kpts.iter().all(|v| *v == 0.0));

        let dir = tempfile::tempdir().unwrap();
        let mut labels = CocoLabels::new("test", "cc0-1.0");
        labels.images.push(CocoImage { id: 7, file_name: "a.jpg".into(), width: 64, height: 48, license: 1 });
        labels.annotations.push(person);
        labels.write(dir.path(), "val").unwrap();
        assert_eq!(CocoLabels::read(dir.path(), "val").unwrap(), labels);

        labels.annotations[0].image_id = 8;
        labels.write(dir.path(), "val").unwrap();
        let text = format!("{:#}", CocoLabels::read(dir.path(), "val").unwrap_err());
        assert!(text.contains("coco_wholebody_val.json") && text.contains("annotation 1"), "{text}");
    }
}
