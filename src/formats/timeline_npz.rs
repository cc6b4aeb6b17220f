//! `timeline.npz`: per-frame values of a video at the dataset rate. Arrays: `source_secs` f64 [T], `repeated` bool
//! [T], `shot_score` f64 [T], `restart` bool [T], `still` f32 [T]; for a long video also `span` bool [T].

use super::npz::{self, Npz};
use anyhow::Result;
use ndarray::aview1;
use std::ops::Range;
use std::path::Path;

/// Per-frame values of a video; all vectors have the same length T.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// Time of the image in the video file, seconds.
    pub source_secs: Vec<f64>,
    /// Whether the frame repeats the image of the previous frame.
    pub repeated: Vec<bool>,
    /// Confidence that the frame is the first one of a shot, 0..1.
    pub shot_score: Vec<f64>,
    /// Whether tracking restarts at this frame because its shot score is high.
    pub restart: Vec<bool>,
    /// Whether a span that is processed separately starts here: tracking restarts, and decoding can start at this
    /// frame. Never set for the first frame.
    pub span: Vec<bool>,
    /// Mean absolute difference from the previous image, in 8-bit intensity levels; 0 for a repeated frame.
    pub frame_difference: Vec<f32>,
}

impl Timeline {
    pub fn n_frames(&self) -> usize {
        self.repeated.len()
    }

    /// The spans of frames that are processed separately, in order; together they cover all frames.
    pub fn spans(&self) -> Vec<Range<usize>> {
        let starts = self.span.iter().enumerate().filter(|(idx, starts)| **starts && *idx > 0).map(|(idx, _)| idx);
        let bounds: Vec<usize> = std::iter::once(0).chain(starts).chain([self.n_frames()]).collect();
        bounds.windows(2).map(|pair| pair[0]..pair[1]).collect()
    }

    /// Reads `timeline.npz`.
    ///
    /// # Errors
    ///
    /// The file is unreadable, or an array is missing or of another length; the message names it.
    pub fn read(path: &Path) -> Result<Self> {
        let mut npz = Npz::open(path)?;
        let repeated: Vec<bool> = npz.bools("repeated", &[None])?.into_iter().collect();
        let length = [Some(repeated.len())];
        Ok(Self {
            source_secs: npz.numbers("source_secs", &length)?.into_iter().collect(),
            shot_score: npz.numbers("shot_score", &length)?.into_iter().collect(),
            restart: npz.bools("restart", &length)?.into_iter().collect(),
            frame_difference: npz.floats("still", &length)?.into_iter().collect(),
            // Files of earlier versions lack this array.
            span: match npz.has("span") {
                true => npz.bools("span", &length)?.into_iter().collect(),
                false => vec![false; repeated.len()],
            },
            repeated,
        })
    }

    /// Writes `timeline.npz`. The bytes are deterministic.
    pub fn write(&self, path: &Path) -> Result<()> {
        npz::write(path, |npz| {
            npz.add_array("source_secs", &aview1(&self.source_secs))?;
            npz.add_array("repeated", &aview1(&self.repeated))?;
            npz.add_array("shot_score", &aview1(&self.shot_score))?;
            npz.add_array("restart", &aview1(&self.restart))?;
            if self.span.contains(&true) {
                npz.add_array("span", &aview1(&self.span))?;
            }
            npz.add_array("still", &aview1(&self.frame_difference))
        })
    }
}
