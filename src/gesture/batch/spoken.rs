//! What is to be spoken, and what is told of motion that was written.

use orator_avatar::animate::export::file::FigureOptions;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde::Serialize;
use std::path::Path;

/// Speech whose motion is wanted.
#[derive(Clone, Copy, Debug)]
pub struct SpeechSource<'a> {
    /// A file with sound.
    pub audio: &'a Path,
    /// What is said in it.
    pub transcript: Option<&'a Path>,
    /// What a decoder begins a segment with.
    pub seams: StateAtSeams,
    /// The figure in the files.
    pub figure: FigureOptions,
}

/// A sound whose motion was written.
#[derive(Clone, Debug)]
pub struct SpokenMotion {
    /// Seconds of sound.
    pub secs: f64,
    /// Frames of motion.
    pub n_frames: usize,
    /// Seconds it took to make the motion, files not counted.
    pub motion_secs: f64,
    /// What a user should know of the sound and its transcript.
    pub note: Option<String>,
    /// Of motion made segment after segment.
    pub segments: Option<SegmentFacts>,
}

/// What is known of motion made segment after segment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentFacts {
    /// What segments were begun with.
    pub state: StateAtSeams,
    /// Mean step over a seam as a share of the mean step elsewhere, as generated and smoothed, of the motion written.
    pub seam_jump: [f64; 2],
    /// As `seam_jump`, of segments begun in the other way.
    pub other_seam_jump: [f64; 2],
    /// Words of the transcript, and those of them that were trained with; `None`: no transcript was read.
    pub words: Option<[usize; 2]>,
}
