//! `measures.npz`: the arrays of `Measures` by name, float32 [T].

use super::measure::Measures;
use anyhow::Result;
use ndarray::aview1;
use orator_formats::npz::{self, Npz};
use std::path::Path;

/// Arrays that files of earlier versions lack: speech, lip synchrony, and resting hands.
const OPTIONAL: [&str; 5] = ["speech", "lip_sync", "left_other", "right_other", "rest"];

/// Names and arrays of measures, in the order of the rules.
macro_rules! arrays {
    ($of:ident, $($borrow:tt)+) => {
        [
            ("sound", $($borrow)+ $of.sound),
            ("sound_db", $($borrow)+ $of.sound_db),
            ("speech", $($borrow)+ $of.speech),
            ("lip_sync", $($borrow)+ $of.lip_sync),
            ("still", $($borrow)+ $of.frame_difference),
            ("person", $($borrow)+ $of.person),
            ("shoulder_px", $($borrow)+ $of.shoulder_px),
            ("face", $($borrow)+ $of.face),
            ("facing", $($borrow)+ $of.facing),
            ("nose_off", $($borrow)+ $of.nose_off),
            ("arms", $($borrow)+ $of.arms),
            ("left_hand", $($borrow)+ $of.left_hand),
            ("right_hand", $($borrow)+ $of.right_hand),
            ("left_other", $($borrow)+ $of.left_other),
            ("right_other", $($borrow)+ $of.right_other),
            ("rest", $($borrow)+ $of.rest),
            ("n_people", $($borrow)+ $of.n_persons),
            ("jump", $($borrow)+ $of.jump),
            ("identity", $($borrow)+ $of.identity),
            ("shot_score", $($borrow)+ $of.shot_score),
        ]
    };
}

impl Measures {
    /// Names and arrays, in the order of the rules.
    pub fn arrays(&self) -> [(&'static str, &[f32]); 20] {
        arrays!(self, &)
    }

    /// Writes `measures.npz`.
    pub fn write(&self, path: &Path) -> Result<()> {
        npz::write(path, |npz| {
            self.arrays().into_iter().try_for_each(|(name, values)| npz.add_array(name, &aview1(values)))
        })
    }

    /// Reads `measures.npz`.
    ///
    /// # Errors
    /// The file with the array that is missing or has another length.
    pub fn read(path: &Path) -> Result<Self> {
        let mut npz = Npz::open(path)?;
        let n_frames = npz.floats("person", &[None])?.len();
        let mut read = Self::default();
        for (name, values) in arrays!(read, &mut) {
            *values = if OPTIONAL.contains(&name) && !npz.has(name) {
                vec![f32::NAN; n_frames]
            } else {
                npz.floats(name, &[Some(n_frames)])?.into_iter().collect()
            };
        }
        Ok(read)
    }
}
