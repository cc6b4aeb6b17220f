//! The files of an exported generator, with their metadata.

use super::graph::NetworkGraph;
use super::{cepstra, gan, joints, mels, sequence};
use crate::generate::model::{GENERATOR, GenerationChoice, SpeakerMetadata, load_with_contents};
use crate::generate::seq2seq::SequenceGenerator;
use crate::generate::seq2seq::architecture::{AROUND_POSE_SECS, Architecture};
use crate::generate::seq2seq::poses::PoseFormat;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Result, bail, ensure};
use candle_core::Device;
use orator_base::audio::mfcc::N_CEPSTRA;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::workdir::write_file;
use orator_base::types::skeleton::{self, N_JOINTS};
use orator_nn::seq2seq::predict::StateAtSeams;
use orator_onnx::convert::ElementType::{F32, I64};
use orator_onnx::convert::GraphPort;
use std::path::{Path, PathBuf};

/// Metadata of a file: key and value.
type Fact = (&'static str, String);

/// Writes the generator of a checkpoint file, for the chosen speaker and variant, as ONNX to `out`, and its front end
/// from samples beside it, `NAME.mel.onnx`; for a sequence network also the conversion of all poses to joints,
/// `NAME.joints.onnx`. `carry_state` is that of [`SequenceGenerator::seams`]. Returns the files in the order of their use.
///
/// # Errors
/// A checkpoint that cannot be read; an unknown speaker, or a variant of a network without variants; an output that is
/// not `.onnx` or cannot be written; a network that animates a captured skeleton.
pub fn export(checkpoint: &Path, choice: &GenerationChoice, out: &Path, carry_state: bool) -> Result<Vec<PathBuf>> {
    let is_onnx = out.extension().is_some_and(|extension| extension == "onnx") && !out.is_dir();
    ensure!(is_onnx, "--export {}: expected a file that ends in .onnx", out.display());
    let trained = TrainedSpeaker::open_as(checkpoint, choice, &Device::Cpu)?;
    let mut facts = vec![
        ("program", format!("orator {}", env!("CARGO_PKG_VERSION"))),
        ("checkpoint_blake3", hash_file(checkpoint)?),
        ("speaker", trained.name().to_owned()),
        ("frame_rate", format!("{}/{}", trained.fps().num, trained.fps().den)),
        ("sample_rate", trained.rate().to_string()),
    ];
    if let Some(words) = trained.known_words() {
        facts.push(("vocabulary", serde_json::to_string(words.vocabulary.words())?));
    }
    match trained {
        TrainedSpeaker::Gan(_) => {
            ensure!(!carry_state, "{} has no state: omit --carry-state", checkpoint.display());
            gan(checkpoint, choice, out, &facts)
        }
        TrainedSpeaker::Sequence(speaker) => sequence(&speaker, out, carry_state, &facts),
    }
}

fn gan(checkpoint: &Path, choice: &GenerationChoice, out: &Path, facts: &[Fact]) -> Result<Vec<PathBuf>> {
    let (metadata, _, contents) = load_with_contents(checkpoint, choice, &Device::Cpu)?;
    let front_end = out.with_extension("mel.onnx");
    let mels: GraphPort = ("mels", F32, "1,64,mel_frames");
    let text = "The sound is extended by its mirror image to complete blocks of 32 pose frames. `frames` is the number \
                of pose frames of the sound.";
    let about = [("spectrogram", serde_json::to_string(&metadata.audio)?), ("description", text.to_owned())];
    let graph = mels::front_end(metadata.fps)?;
    write(&front_end, graph, (&[SAMPLES], &[mels, FRAMES]), &[facts, &about].concat())?;

    let graph = NetworkGraph::new(contents.part(GENERATOR));
    gan::add_generator(&graph, &metadata)?;
    let (mut inputs, mut outputs) = (vec![mels], vec![("joints", F32, JOINTS)]);
    if metadata.words.is_some() {
        inputs.extend([("words", I64, "1,frames"), ("word_times", F32, "1,frames,2")]);
    }
    let n_angles = 3 * metadata.normalisation.channels.len();
    let angles = format!("frames,{n_angles}");
    outputs.extend((n_angles > 0).then_some(("angles", F32, &*angles)));
    let about = [joint_facts(), generator_facts(&metadata)?].concat();
    write(out, graph, (&inputs, &outputs), &[facts, &about].concat())?;
    Ok(vec![front_end, out.to_owned()])
}

/// Metadata of the network of a GAN.
fn generator_facts(metadata: &SpeakerMetadata) -> Result<Vec<Fact>> {
    let text = "Retain the first `frames` (an output of the front end) of the joints: the others belong to the \
                extension of the sound.";
    let mut facts = vec![("description", text.to_owned())];
    if metadata.words.is_some() {
        let text = "Index of the word at each of 32 (frames / 32 + 1) pose frames: 0 without a word, 1 for a word outside \
                    the vocabulary, 2 for its first. It is the last word that has begun by half a frame later, unless it \
                    has ended half a frame before. `word_times` are the seconds since its start and until its end, at \
                    least 0, or 0 without a word.";
        facts.push(("words", text.to_owned()));
    }
    let channels = &metadata.normalisation.channels;
    let names = channels.iter().map(|of| serde_json::to_value(of.channel)).collect::<serde_json::Result<Vec<_>>>()?;
    if !names.is_empty() {
        facts.push(("angles", format!("3 angles in radians for each of {}", serde_json::to_string(&names)?)));
    }
    Ok(facts)
}

fn sequence(speaker: &SequenceGenerator, out: &Path, carry_state: bool, facts: &[Fact]) -> Result<Vec<PathBuf>> {
    let metadata = &speaker.metadata;
    let PoseFormat::Joints { normalisation, representation } = &metadata.poses else {
        bail!(
            "the model of {} animates the BVH skeleton that it was trained on, whose joints the ONNX file cannot have: \
             train on a dataset of 49 joints (`orator import`), or use `orator generate --out motion.bvh`",
            metadata.name
        )
    };
    let [front_end, decoder] = ["mel.onnx", "joints.onnx"].map(|extension| out.with_extension(extension));
    let sizes = &metadata.network;
    let text = "Mel-frequency cepstra of the poses, with silence around the sound, for complete segments. `frames` is the \
                number of pose frames of the sound.";
    let cepstra: GraphPort = ("cepstra", F32, &format!("1,cepstra_frames,{N_CEPSTRA}"));
    let graph = cepstra::front_end(metadata)?;
    let about = [("description", text.to_owned())];
    write(&front_end, graph, (&[SAMPLES], &[cepstra, FRAMES]), &[facts, &about].concat())?;

    let is_carried = speaker.seams(carry_state) == StateAtSeams::Carried;
    let graph = NetworkGraph::new(speaker.tensors());
    sequence::add_network(&graph, metadata, is_carried)?;
    let of_segment = format!("1,{},{N_CEPSTRA}", sizes.audio_frames());
    let [previous, predicted] = [sizes.previous, sizes.predicted].map(|n| format!("1,{n},{}", sizes.pose));
    let (words, state) = (format!("{},words", sizes.predicted), format!("1,{}", sizes.hidden));
    let mut about = vec![("segment_frames", sizes.predicted.to_string()), ("description", SEGMENT_TEXT.to_owned())];
    let mut inputs = vec![("cepstra", F32, &*of_segment), ("previous", F32, &*previous)];
    let mut outputs = vec![("poses", F32, &*predicted), ("next", F32, &*previous)];
    if speaker.reads_words() {
        let is_of_poses = metadata.architecture == Architecture::Contextual;
        let (axes, secs) =
            if is_of_poses { (&*words, AROUND_POSE_SECS) } else { ("1,words", metadata.words_around_secs) };
        inputs.push(("words", I64, axes));
        about.push(("words_around_secs", secs.to_string()));
    }
    if is_carried {
        inputs.extend([("segment", I64, "1"), ("state", F32, &*state)]);
        outputs.push(("next_state", F32, &*state));
    }
    write(out, graph, (&inputs, &outputs), &[facts, &about].concat())?;

    let graph = NetworkGraph::new(Default::default());
    let smoothed = joints::smooth(&graph, "poses")?;
    joints::add_joints(&graph, &smoothed, representation, normalisation)?;
    let text = "The poses of all segments, shortened to `frames`, are smoothed and converted to joints.";
    let about = [joint_facts(), vec![("description", text.to_owned())]].concat();
    let poses = format!("frames,{}", sizes.pose);
    write(&decoder, graph, (&[("poses", F32, &poses)], &[("joints", F32, JOINTS)]), &[facts, &about].concat())?;
    Ok(vec![front_end, out.to_owned(), decoder])
}

/// How to run a sequence network.
const SEGMENT_TEXT: &str = "Run segment by segment: segment k reads the cepstra from row k times `segment_frames` on, \
     and as `previous` the output `next` of the segment before, zeros at first. Where there is a `state`, it is the \
     `next_state` of the segment before, and `segment` is k. `words` has the words within `words_around_secs` of each pose in a row [poses, W], padded \
     at the end with 0, or of the segment [1, W]: 1 for a word outside the vocabulary, 2 for its first; 0 without words.";

const SAMPLES: GraphPort = ("samples", F32, "1,samples");
const FRAMES: GraphPort = ("frames", I64, "1");
const JOINTS: &str = "frames,49,3";

/// Metadata about the joints.
fn joint_facts() -> Vec<Fact> {
    let list = |of: &dyn Fn(usize) -> String| (0..N_JOINTS).map(of).collect::<Vec<_>>().join(",");
    let parent = |joint: usize| skeleton::parent(joint).map_or("-1".to_owned(), |parent| parent.to_string());
    vec![
        ("joints", list(&skeleton::name)),
        ("parents", list(&parent)),
        ("units", "metres from the neck; x to the right of the image, y down, z away from the camera".to_owned()),
    ]
}

fn write(path: &Path, graph: NetworkGraph, ports: (&[GraphPort], &[GraphPort]), facts: &[Fact]) -> Result<()> {
    write_file(path, &graph.into_inner().file("gestures", ports.0, ports.1, facts))
}
