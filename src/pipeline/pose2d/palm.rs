//! The palm detector: squares of the picture where hands may be, asked when a hand is lost.

use super::decode::ssd_anchors;
use super::model_input::ModelInput;
use super::region;
use anyhow::{Result, bail};
use orator_base::types::image::Image;
use orator_media::opencv::warp::Region;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

pub struct PalmDetector {
    pub feed: ModelInput,
    decode: Decode,
    anchors: Vec<[f64; 2]>,
}

impl PalmDetector {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        let feed = ModelInput::open(runtime, entry, dir)?;
        let anchors = match &entry.decode {
            Decode::SsdAnchors { strides, .. } => ssd_anchors::anchors(feed.size()[0], strides),
            _ => Vec::new(),
        };
        Ok(Self { feed, decode: entry.decode.clone(), anchors })
    }

    /// The squares around the palms of the picture, surest first.
    pub fn find(&mut self, image: &Image) -> Result<Vec<Region>> {
        let size = self.feed.size()[0];
        let (src_from_dst, outputs) = self.feed.whole(image)?;
        let Decode::SsdAnchors { regressors, scores, min_score, max_overlap, wrist, middle, .. } = &self.decode else {
            bail!("a palm detector cannot be read as {:?}", self.decode)
        };
        let (rows, logits) = (outputs.floats(regressors)?.1, outputs.floats(scores)?.1);
        let found = ssd_anchors::decode(rows, logits, &self.anchors, size, *min_score, *max_overlap)?;
        let region = |palm: ssd_anchors::Detection| {
            let place = |at: usize| palm.places.get(at).map(|place| src_from_dst.apply(*place));
            Some(region::around_palm(place(0)?, place(1)?, place(2 + wrist)?, place(2 + middle)?))
        };
        Ok(found.into_iter().filter_map(region).collect())
    }
}
