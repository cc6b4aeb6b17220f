//! Sound in memory.

use serde::{Deserialize, Serialize};

/// The rate of all sound inside the pipeline, in samples a second.
pub const SAMPLE_RATE: u32 = 16_000;

/// Mono samples in -1..1 at `rate` samples a second.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Samples a second.
    pub rate: u32,
    /// Amplitudes, -1..1.
    pub samples: Vec<f32>,
}

impl Sound {
    /// Length in seconds.
    pub fn secs(&self) -> f64 {
        self.samples.len() as f64 / f64::from(self.rate.max(1))
    }
}

/// Sound tracks of a file, and the one taken.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AudioTracks {
    pub n_tracks: usize,
    /// Number of the track, from 1.
    pub taken: usize,
    /// Language of each, as the file names it; empty: not named.
    pub languages: Vec<String>,
}
