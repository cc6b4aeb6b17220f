//! The files of an exported generator, with their metadata.

use super::graph::NetworkGraph;
use super::{gan, mels};
use crate::generate::model::{GENERATOR, GenerationChoice, SpeakerMetadata, load_with_contents};
use crate::generate::seq2seq::metadata::is_sequence_kind;
use anyhow::{Result, ensure};
use candle_core::Device;
use orator_base::audio::mel::N_MELS;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::workdir::write_file;
use orator_base::types::skeleton::{self, N_JOINTS};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_formats::checkpoint;
use orator_nn::gan::generator::FRAMES_MULTIPLE;
use orator_nn::gan::words::N_TIMES;
use orator_onnx::convert::{Dim, ElementType, GraphPort};
use std::path::{Path, PathBuf};

/// A generator that was exported.
#[derive(Clone, Debug)]
pub struct ExportedModel {
    /// Name of the speaker.
    pub name: String,
    pub fps: FrameRate,
    /// Files in the order in which they are run.
    pub files: Vec<PathBuf>,
}

/// Files that [`export`] writes for the output `out`, in the order in which they are run.
pub fn files(out: &Path) -> [PathBuf; 2] {
    [out.with_extension("mel.onnx"), out.to_owned()]
}

/// Writes the generator of a checkpoint file, for the chosen speaker and variant, as ONNX to `out`, and its front end
/// beside it (see [`files`]).
///
/// # Errors
/// A checkpoint that cannot be read; an unknown speaker, or a variant of a network without variants; an output that is
/// not `.onnx` or cannot be written; a network that has no ONNX form.
pub fn export(checkpoint: &Path, choice: &GenerationChoice, out: &Path) -> Result<ExportedModel> {
    ensure!(
        out.extension().is_some_and(|extension| extension == "onnx"),
        "--export {}: expected a file name that ends in .onnx",
        out.display()
    );
    ensure!(!out.is_dir(), "output {} is a folder, expected a file", out.display());
    let kind = &checkpoint::facts(checkpoint)?["speaker"]["kind"];
    ensure!(
        !is_sequence_kind(kind),
        "{} is a checkpoint of `orator train seq2seq`, which cannot be exported",
        checkpoint.display()
    );
    let (metadata, _, contents) = load_with_contents(checkpoint, choice, &Device::Cpu)?;
    let mut common = common_facts(checkpoint, &metadata.name, metadata.fps)?;
    common.push(("sample_rate", SAMPLE_RATE.to_string()));
    common.push(("spectrogram", serde_json::to_string(&metadata.audio)?));
    let [front_end, network] = files(out);

    let mels_shape = [Dim::Size(1), Dim::Size(N_MELS), Dim::Any("mel_frames")];
    let mels_port: GraphPort = ("mels", ElementType::F32, &mels_shape);
    let samples: GraphPort = ("samples", ElementType::F32, &[Dim::Size(1), Dim::Any("samples")]);
    let frames: GraphPort = ("frames", ElementType::I64, &[Dim::Size(1)]);
    let text = "The sound is extended by its mirror image to complete blocks of 32 pose frames. `frames` is the number \
                of pose frames of the sound itself.";
    let facts = [&common[..], &[("description", text.to_owned())]].concat();
    let graph = mels::front_end(metadata.fps)?;
    write(&front_end, graph, (&[samples], &[mels_port, frames]), &facts)?;

    let mut graph = NetworkGraph::new(contents.part(GENERATOR));
    gan::add_generator(&mut graph, &metadata)?;
    let n_frames = Dim::Any("pose_frames");
    let (words_shape, times_shape) = ([Dim::Size(1), n_frames], [Dim::Size(1), n_frames, Dim::Size(N_TIMES)]);
    let mut inputs = vec![mels_port];
    let mut outputs: Vec<GraphPort> =
        vec![("joints", ElementType::F32, &[Dim::Any("pose_frames"), Dim::Size(N_JOINTS), Dim::Size(3)])];
    if metadata.words.is_some() {
        inputs.push(("words", ElementType::I64, &words_shape));
        inputs.push(("word_times", ElementType::F32, &times_shape));
    }
    let angles_shape = [n_frames, Dim::Size(3 * metadata.normalisation.channels.len())];
    if !metadata.normalisation.channels.is_empty() {
        outputs.push(("angles", ElementType::F32, &angles_shape));
    }
    let facts = [common, generator_facts(&metadata)?].concat();
    write(&network, graph, (&inputs, &outputs), &facts)?;
    Ok(ExportedModel { name: metadata.name, fps: metadata.fps, files: vec![front_end, network] })
}

fn write(
    path: &Path,
    graph: NetworkGraph,
    (inputs, outputs): (&[GraphPort], &[GraphPort]),
    facts: &[(&str, String)],
) -> Result<()> {
    let facts: Vec<(String, String)> = facts.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    write_file(path, &graph.graph.file("gestures", inputs, outputs, &facts))
}

/// Metadata of every file.
fn common_facts(checkpoint: &Path, name: &str, fps: FrameRate) -> Result<Vec<(&'static str, String)>> {
    Ok(vec![
        ("program", format!("orator {}", env!("CARGO_PKG_VERSION"))),
        ("checkpoint_blake3", hash_file(checkpoint)?),
        ("speaker", name.to_owned()),
        ("frame_rate", format!("{}/{}", fps.num, fps.den)),
    ])
}

/// Metadata about the joints.
fn joint_facts() -> Vec<(&'static str, String)> {
    let list = |of: &dyn Fn(usize) -> String| (0..N_JOINTS).map(of).collect::<Vec<_>>().join(",");
    let parent = |joint: usize| skeleton::parent(joint).map_or("-1".to_owned(), |parent| parent.to_string());
    vec![
        ("joints", list(&skeleton::name)),
        ("parents", list(&parent)),
        ("units", "metres from the neck; x to the right of the image, y down, z away from the camera".to_owned()),
    ]
}

/// Metadata of the network of a GAN.
fn generator_facts(metadata: &SpeakerMetadata) -> Result<Vec<(&'static str, String)>> {
    let mut facts = joint_facts();
    let text = "Retain the first `frames` (output of the front end) of the joints: the others belong to the extension.";
    facts.push(("description", text.to_owned()));
    if let Some(words) = &metadata.words {
        facts.push(("vocabulary", serde_json::to_string(words.vocabulary.words())?));
        let text = format!(
            "`words` has the index of the word at each of F pose frames, {FRAMES_MULTIPLE} (frames / \
             {FRAMES_MULTIPLE} + 1) in all: 0 without a word, 1 for a word outside the vocabulary, 2 for its first. The \
             word is the last that has begun by half a frame later, unless it has ended half a frame before. \
             `word_times` are the seconds since its start and until its end, at least 0, or 0 without a word."
        );
        facts.push(("words", text));
    }
    let channels = metadata.normalisation.channels.iter();
    let channels: Vec<serde_json::Value> =
        channels.map(|of| serde_json::to_value(of.channel)).collect::<serde_json::Result<_>>()?;
    if !channels.is_empty() {
        facts.push(("angles", format!("{}; 3 each, radians", serde_json::to_string(&channels)?)));
    }
    Ok(facts)
}
