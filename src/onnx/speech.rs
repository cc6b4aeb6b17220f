//! Speech detection model (Silero VAD, version 6, 16 kHz): it processes consecutive windows of audio, each with the
//! end of the previous window and the recurrent state.

use super::model::{Outputs, SessionKind, open_session};
use super::{ModelEntry, ModelError, Port, Runtime};
use anyhow::{Result, anyhow, ensure};
use orator_base::text::counted;
use ort::session::Session;
use ort::value::TensorRef;
use std::path::Path;

/// Samples per window, at 16 kHz.
pub const WINDOW: usize = 512;
/// Samples of the previous window that precede each window.
const CONTEXT: usize = 64;
/// Shape of the recurrent state.
const STATE: [i64; 3] = [2, 1, 128];
/// Sample rate, which is an input of the model.
const RATE: i64 = 16_000;
/// Names of the inputs and outputs.
const INPUTS: [&str; 3] = ["input", "state", "sr"];
const OUTPUTS: [&str; 2] = ["output", "stateN"];

/// The model at the start of an audio signal, on one thread.
pub struct SpeechModel {
    id: String,
    session: Session,
    /// Context followed by the window.
    input: [f32; CONTEXT + WINDOW],
    state: Vec<f32>,
}

impl SpeechModel {
    /// Opens the file of `entry` in the folder `dir`. Errors are documented in [`ModelError`].
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self, ModelError> {
        let session = open_session(runtime, entry, dir, SessionKind::OnePicture)?;
        let n_state: i64 = STATE.iter().product();
        Ok(Self {
            id: entry.id.clone(),
            session,
            input: [0.0; CONTEXT + WINDOW],
            state: vec![0.0; usize::try_from(n_state).unwrap_or_default()],
        })
    }

    /// Probability of speech, 0..1, in the next window; a window of fewer than 512 samples is padded with silence.
    pub fn probability(&mut self, window: &[f32]) -> Result<f32> {
        ensure!(window.len() <= WINDOW, "a window has {} samples, expected at most {WINDOW}", window.len());
        let (sound, silence) = self.input[CONTEXT..].split_at_mut(window.len());
        sound.copy_from_slice(window);
        silence.fill(0.0);
        let failed = |error: &dyn std::fmt::Display| anyhow!("the model {} failed: {error}", self.id);
        let shape = [1, (CONTEXT + WINDOW) as i64];
        let inputs = ort::inputs![
            INPUTS[0] => TensorRef::from_array_view((shape, self.input.as_slice())).map_err(|e| failed(&e))?,
            INPUTS[1] => TensorRef::from_array_view((STATE, self.state.as_slice())).map_err(|e| failed(&e))?,
            INPUTS[2] => TensorRef::from_array_view(((), [RATE].as_slice())).map_err(|e| failed(&e))?,
        ];
        let outputs = self.session.run(inputs).map_err(|error| failed(&error))?;
        let outputs = Outputs::Session(&self.id, outputs);
        let (probability, state) = (outputs.floats(OUTPUTS[0])?.1, outputs.floats(OUTPUTS[1])?.1);
        ensure!(
            probability.len() == 1 && state.len() == self.state.len(),
            "the model {} returned {} and a state of {} values, expected 1 and {}",
            self.id,
            counted(probability.len(), "value"),
            state.len(),
            self.state.len()
        );
        let probability = probability[0];
        self.state.copy_from_slice(state);
        self.input.copy_within(WINDOW.., 0);
        Ok(probability)
    }
}

/// Checks the description of a speech model: its inputs and outputs must be those of this file.
pub(super) fn check(entry: &ModelEntry) -> Result<()> {
    let shapes: [&[i64]; 3] = [&[1, (CONTEXT + WINDOW) as i64], &STATE, &[]];
    let is_same = |(port, (name, shape)): (&Port, (&str, &[i64]))| port.name == name && port.shape == shape;
    let has_inputs = entry.inputs.len() == 3 && entry.inputs.iter().zip(INPUTS.into_iter().zip(shapes)).all(is_same);
    ensure!(has_inputs, "a speech model must have the inputs input [1, 576], state [2, 1, 128] and sr []");
    let has_output = |name: &str| entry.outputs.iter().any(|port| port.name == name);
    ensure!(OUTPUTS.into_iter().all(has_output), "a speech model must have the outputs output and stateN");
    Ok(())
}
