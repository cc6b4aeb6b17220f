//! People of a labelled set.

use super::crop::PersonCrop;
use crate::external::ffmpeg::jpeg;
use crate::external::opencv::warp;
use crate::formats::coco_wholebody::{CocoLabels, IMAGES, LabelledPoint};
use crate::types::image::Image;
use crate::types::pose2d::N_BODY;
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Person in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledPerson {
    /// JPEG file.
    pub picture: PathBuf,
    /// x, y, width, height, px.
    pub bbox: [f64; 4],
    /// Pixels of the person.
    pub area: f64,
    /// COCO-17: x, y, v (0 no label, 1 hidden, 2 seen).
    pub points: [LabelledPoint; N_BODY],
}

impl LabelledPerson {
    /// The part of the picture that the crop shows.
    pub fn picture(&self, crop: &PersonCrop) -> Result<Image> {
        let read = || -> Result<Image> {
            let picture = jpeg::decode(&std::fs::read(&self.picture)?)?;
            let [height, width] = crop.size;
            let mut shown = Image::filled(width, height, [0; 3]);
            warp::warp(&picture, &crop.src_from_dst(), &mut shown)?;
            Ok(shown)
        };
        read().with_context(|| format!("cannot read the picture {}", self.picture.display()))
    }
}

/// Everybody with a labelled point in the part `train` or `val` of the set in `dir`, crowds left out.
pub fn read(dir: &Path, part: &str) -> Result<Vec<LabelledPerson>> {
    let labels = CocoLabels::read(dir, part)?;
    let files: BTreeMap<u64, &str> = labels.images.iter().map(|image| (image.id, image.file_name.as_str())).collect();
    let people = labels.annotations.iter().filter(|person| person.iscrowd == 0 && person.num_keypoints > 0);
    let people = people.filter_map(|person| {
        Some(LabelledPerson {
            picture: dir.join(IMAGES).join(files.get(&person.image_id)?),
            bbox: person.bbox,
            area: person.area,
            points: person.body()?,
        })
    });
    Ok(people.filter(|person| PersonCrop::around(person.bbox, [1, 1]).is_some()).collect())
}
