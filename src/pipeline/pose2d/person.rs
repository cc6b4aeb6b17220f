//! The person detector: all people of a picture. `tracker` chooses the speaker among them.

use super::decode::{boxes, yolox_grid};
use super::model_input::ModelInput;
use anyhow::{Result, bail};
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

/// Finds people in a picture.
pub struct Detector {
    pub feed: ModelInput,
    decode: Decode,
}

impl Detector {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        Ok(Self { feed: ModelInput::open(runtime, entry, dir)?, decode: entry.decode.clone() })
    }

    /// The people in the picture, surest first, in px.
    pub fn find(&mut self, image: &Image) -> Result<Vec<PersonBox>> {
        let size = self.feed.size();
        let (src_from_dst, outputs) = self.feed.whole(image)?;
        let found = match &self.decode {
            Decode::Detections { boxes: output, labels, person, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(output)?;
                if shape.last() != Some(&5) {
                    bail!("the output {output:?} of a detector must have rows of 5 numbers, its shape is {shape:?}");
                }
                let labels = labels.as_ref().map(|name| outputs.integers(name)).transpose()?.map(|(_, labels)| labels);
                boxes::detections(rows, labels, *person, *min_score, *max_overlap)
            }
            Decode::YoloxGrid { predictions, strides, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(predictions)?;
                let row_len = shape.last().map_or(0, |len| usize::try_from(*len).unwrap_or(0));
                yolox_grid::decode(rows, row_len, size, strides, *min_score, *max_overlap)?
            }
            other => bail!("a person detector cannot be read as {other:?}"),
        };
        let place = |person: PersonBox| {
            let at = |x: f32, y: f32| src_from_dst.apply([f64::from(x), f64::from(y)]).map(|px| px as f32);
            let [x, y] = at(person.x, person.y);
            let [right, bottom] = at(person.x + person.width, person.y + person.height);
            PersonBox { x, y, width: right - x, height: bottom - y, score: person.score }
        };
        Ok(found.into_iter().map(place).collect())
    }
}
