//! `measures.npz`: every array of `Measures` by its name, float32 [T].

use super::measure::Measures;
use anyhow::Result;
use ndarray::aview1;
use orator_formats::npz;
use orator_formats::npz::Npz;
use std::path::Path;

impl Measures {
    /// Every array with its name, in the order of the rules.
    pub fn arrays(&self) -> [(&'static str, &[f32]); 20] {
        [
            ("sound", &self.sound),
            ("sound_db", &self.sound_db),
            ("speech", &self.speech),
            ("lip_sync", &self.lip_sync),
            ("still", &self.frame_difference),
            ("person", &self.person),
            ("shoulder_px", &self.shoulder_px),
            ("face", &self.face),
            ("facing", &self.facing),
            ("nose_off", &self.nose_off),
            ("arms", &self.arms),
            ("left_hand", &self.left_hand),
            ("right_hand", &self.right_hand),
            ("left_other", &self.left_other),
            ("right_other", &self.right_other),
            ("rest", &self.rest),
            ("n_people", &self.n_people),
            ("jump", &self.jump),
            ("identity", &self.identity),
            ("shot_score", &self.shot_score),
        ]
    }

    /// Writes `measures.npz`.
    pub fn write(&self, path: &Path) -> Result<()> {
        npz::write(path, |npz| {
            self.arrays().into_iter().try_for_each(|(name, values)| npz.add_array(name, &aview1(values)))
        })
    }

    /// Reads `measures.npz`. Errors name the file and the array that is missing or of another length.
    pub fn read(path: &Path) -> Result<Self> {
        let mut npz = Npz::open(path)?;
        let person = npz.floats("person", &[None])?.into_iter().collect::<Vec<f32>>();
        // Earlier versions did not listen for speech, nor look at mouths, nor at hands at rest.
        let mut newer = |name: &str| -> Result<Vec<f32>> {
            Ok(match npz.has(name) {
                true => npz.floats(name, &[Some(person.len())])?.into_iter().collect(),
                false => vec![f32::NAN; person.len()],
            })
        };
        let (speech, lip_sync) = (newer("speech")?, newer("lip_sync")?);
        let (left_other, right_other, rest) = (newer("left_other")?, newer("right_other")?, newer("rest")?);
        let mut read =
            |name: &str| -> Result<Vec<f32>> { Ok(npz.floats(name, &[Some(person.len())])?.into_iter().collect()) };
        Ok(Self {
            sound: read("sound")?,
            sound_db: read("sound_db")?,
            speech,
            lip_sync,
            frame_difference: read("still")?,
            shoulder_px: read("shoulder_px")?,
            face: read("face")?,
            facing: read("facing")?,
            nose_off: read("nose_off")?,
            arms: read("arms")?,
            left_hand: read("left_hand")?,
            right_hand: read("right_hand")?,
            left_other,
            right_other,
            rest,
            n_people: read("n_people")?,
            jump: read("jump")?,
            identity: read("identity")?,
            shot_score: read("shot_score")?,
            person,
        })
    }
}
