//! Detectors: all persons in a picture, among whom `tracker` chooses the speaker, and palms, used when a hand is lost.

use super::decode::{boxes, ssd_anchors, yolox_grid};
use super::model_input::ModelInput;
use super::region;
use anyhow::{Result, bail};
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;
use orator_media::opencv::warp::Region;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

pub struct Detector {
    pub input: ModelInput,
    decode: Decode,
}

impl Detector {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        Ok(Self { input: ModelInput::open(runtime, entry, dir)?, decode: entry.decode.clone() })
    }

    /// Persons in the picture, in px, by descending score.
    pub fn find(&mut self, image: &Image) -> Result<Vec<PersonBox>> {
        let size = self.input.size();
        let (src_from_dst, outputs) = self.input.run_letterboxed(image)?;
        let found = match &self.decode {
            Decode::Detections { boxes: output, labels, person, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(output)?;
                if shape.last() != Some(&5) {
                    bail!("invalid shape {shape:?} of the detector output {output:?}: expected rows of 5 values");
                }
                let labels = labels.as_ref().map(|name| outputs.integers(name)).transpose()?.map(|(_, labels)| labels);
                boxes::detections(rows, labels, *person, *min_score, *max_overlap)
            }
            Decode::YoloxGrid { predictions, strides, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(predictions)?;
                let row_len = shape.last().map_or(0, |len| usize::try_from(*len).unwrap_or(0));
                yolox_grid::decode(rows, row_len, size, strides, *min_score, *max_overlap)?
            }
            other => bail!("a person detector cannot have outputs of the kind {other:?}"),
        };
        let to_picture = |person: PersonBox| {
            let at = |x: f32, y: f32| src_from_dst.apply([f64::from(x), f64::from(y)]).map(|px| px as f32);
            let [x, y] = at(person.x, person.y);
            let [right, bottom] = at(person.x + person.width, person.y + person.height);
            PersonBox { x, y, width: right - x, height: bottom - y, score: person.score }
        };
        Ok(found.into_iter().map(to_picture).collect())
    }
}

pub struct PalmDetector {
    pub input: ModelInput,
    decode: Decode,
    anchors: Vec<[f64; 2]>,
}

impl PalmDetector {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        let input = ModelInput::open(runtime, entry, dir)?;
        let anchors = match &entry.decode {
            Decode::SsdAnchors { strides, .. } => ssd_anchors::anchors(input.size()[0], strides),
            _ => Vec::new(),
        };
        Ok(Self { input, decode: entry.decode.clone(), anchors })
    }

    /// Hand regions around the palms in the picture, by descending score.
    pub fn find(&mut self, image: &Image) -> Result<Vec<Region>> {
        let size = self.input.size()[0];
        let (src_from_dst, outputs) = self.input.run_letterboxed(image)?;
        let Decode::SsdAnchors { regressors, scores, min_score, max_overlap, wrist, middle, .. } = &self.decode else {
            bail!("a palm detector cannot have outputs of the kind {:?}", self.decode)
        };
        let (rows, logits) = (outputs.floats(regressors)?.1, outputs.floats(scores)?.1);
        let found = ssd_anchors::decode(rows, logits, &self.anchors, size, *min_score, *max_overlap)?;
        let region = |palm: ssd_anchors::Detection| {
            let point = |at: usize| palm.points.get(at).map(|point| src_from_dst.apply(*point));
            Some(region::around_palm(point(0)?, point(1)?, point(2 + wrist)?, point(2 + middle)?))
        };
        Ok(found.into_iter().filter_map(region).collect())
    }
}
