//! The files of an exported generator, with their metadata.

use super::graph::NetworkGraph;
use super::{cepstra, gan, joints, mels, sequence};
use crate::generate::model::{GENERATOR, GenerationChoice, load_with_contents};
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

const SAMPLES: GraphPort = ("samples", F32, "1,samples");
const FRAMES: GraphPort = ("frames", I64, "1");
const JOINTS: GraphPort = ("joints", F32, "frames,49,3");

const MELS_TEXT: &str = "The sound is extended by its mirror image to complete blocks of 32 pose frames. `frames` is the \
                         number of pose frames of the sound.";
const GAN_TEXT: &str = "Retain the first `frames` (an output of the front end) of the joints: the others belong to the \
                        extension of the sound.";
const WORDS_TEXT: &str = "Index of the word at each of 32 (frames / 32 + 1) pose frames: 0 without a word, 1 for a word \
                          outside the vocabulary, 2 for its first. It is the last word that has begun by half a frame \
                          later, unless it has ended half a frame before. `word_times` are the seconds since its start \
                          and until its end, at least 0, or 0 without a word.";
const CEPSTRA_TEXT: &str = "Mel-frequency cepstra of the poses for complete segments, with silence around the sound. \
                            `frames` is the number of pose frames of the sound.";
const SEGMENT_TEXT: &str = "Run segment by segment: segment k reads the cepstra from row k times `segment_frames` on, and \
                            as `previous` the output `next` of the segment before, zeros at first. Where there is a \
                            `state`, it is the `next_state` of the segment before, and `segment_index` is k. `words` has the \
                            words within `words_around_secs` of each pose in a row [poses, W], padded at the end with 0, \
                            or of the segment [1, W]: 1 for a word outside the vocabulary, 2 for its first; 0 without \
                            words.";
const JOINTS_TEXT: &str = "Smooths the poses of all segments, shortened to `frames`, and converts them to joints.";

/// Files of one generator.
struct ModelFiles<'a> {
    out: &'a Path,
    /// Metadata of every file.
    facts: Vec<Fact>,
    written: Vec<PathBuf>,
}

/// Writes the generator of a checkpoint file, for the chosen speaker and variant, as ONNX to `out`, and its front end
/// from samples beside it, `NAME.mel.onnx`; for a sequence network also the conversion of all poses to joints,
/// `NAME.joints.onnx`. `carry_state`: see [`SequenceGenerator::seams`]. Returns the files in the order of their use.
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
    let mut files = ModelFiles { out, facts, written: Vec::new() };
    match trained {
        TrainedSpeaker::Gan(_) => {
            ensure!(!carry_state, "the model of {} has no decoder state: omit --carry-state", trained.name());
            files.gan(checkpoint, choice)?;
        }
        TrainedSpeaker::Sequence(speaker) => files.sequence(&speaker, carry_state)?,
    }
    Ok(files.written)
}

impl ModelFiles<'_> {
    fn gan(&mut self, checkpoint: &Path, choice: &GenerationChoice) -> Result<()> {
        let (metadata, _, contents) = load_with_contents(checkpoint, choice, &Device::Cpu)?;
        ensure!(
            metadata.network.look_ahead.is_none(),
            "{} is a network for `orator live`, which is not exported: train one without gan.look_ahead_secs",
            checkpoint.display()
        );
        let mels: GraphPort = ("mels", F32, "1,64,mel_frames");
        let about = [("spectrogram", serde_json::to_string(&metadata.audio)?)];
        self.write("mel.onnx", mels::front_end(metadata.fps)?, &[SAMPLES], &[mels, FRAMES], MELS_TEXT, &about)?;

        let graph = NetworkGraph::new(contents.part(GENERATOR));
        gan::add_generator(&graph, &metadata)?;
        let (mut about, mut inputs, mut outputs) = (joint_facts(), vec![mels], vec![JOINTS]);
        if metadata.words.is_some() {
            inputs.extend([("words", I64, "1,frames"), ("word_times", F32, "1,frames,2")]);
            about.push(("words", WORDS_TEXT.to_owned()));
        }
        let channels: Vec<_> = metadata.normalisation.channels.iter().map(|of| of.channel).collect();
        let angles = format!("frames,{}", 3 * channels.len());
        if !channels.is_empty() {
            outputs.push(("angles", F32, &angles));
            about.push(("angles", format!("3 angles in radians for each of {}", serde_json::to_string(&channels)?)));
        }
        self.write("onnx", graph, &inputs, &outputs, GAN_TEXT, &about)
    }

    fn sequence(&mut self, speaker: &SequenceGenerator, carry_state: bool) -> Result<()> {
        let metadata = &speaker.metadata;
        let PoseFormat::Joints { normalisation, representation } = &metadata.poses else {
            bail!(
                "the model of {} animates the BVH skeleton that it was trained on, and only models of the 49 joints can \
                 be exported: train it on a dataset (`orator import`), or use `orator generate --out motion.bvh`",
                metadata.name
            )
        };
        let sizes = &metadata.network;
        let axes = [
            format!("1,cepstra_frames,{N_CEPSTRA}"),
            format!("1,{},{N_CEPSTRA}", sizes.audio_frames()),
            format!("1,{},{}", sizes.previous, sizes.pose),
            format!("1,{},{}", sizes.predicted, sizes.pose),
            format!("frames,{}", sizes.pose),
            format!("1,{}", sizes.hidden),
            format!("{},words", sizes.predicted),
        ];
        let [cepstra, of_segment, previous, predicted, all, state, of_poses] = axes.each_ref().map(String::as_str);
        let outputs = [("cepstra", F32, cepstra), FRAMES];
        self.write("mel.onnx", cepstra::front_end(metadata)?, &[SAMPLES], &outputs, CEPSTRA_TEXT, &[])?;

        let is_carried = speaker.seams(carry_state) == StateAtSeams::Carried;
        let graph = NetworkGraph::new(speaker.tensors());
        sequence::add_network(&graph, metadata, is_carried)?;
        let mut about = vec![("segment_frames", sizes.predicted.to_string())];
        let mut inputs = vec![("cepstra", F32, of_segment), ("previous", F32, previous)];
        let mut outputs = vec![("poses", F32, predicted), ("next", F32, previous)];
        if speaker.reads_words() {
            let (axes, secs) = match metadata.architecture {
                Architecture::Contextual => (of_poses, AROUND_POSE_SECS),
                _ => ("1,words", metadata.words_around_secs),
            };
            inputs.push(("words", I64, axes));
            about.push(("words_around_secs", secs.to_string()));
        }
        if is_carried {
            inputs.extend([("segment_index", I64, "1"), ("state", F32, state)]);
            outputs.push(("next_state", F32, state));
        }
        self.write("onnx", graph, &inputs, &outputs, SEGMENT_TEXT, &about)?;

        let graph = NetworkGraph::new(Default::default());
        let poses = joints::smooth(&graph, "poses")?;
        joints::add_joints(&graph, &poses, representation, normalisation)?;
        self.write("joints.onnx", graph, &[("poses", F32, all)], &[JOINTS], JOINTS_TEXT, &joint_facts())
    }

    /// Writes a graph to the output with this extension.
    fn write(
        &mut self,
        extension: &str,
        graph: NetworkGraph,
        inputs: &[GraphPort],
        outputs: &[GraphPort],
        description: &str,
        about: &[Fact],
    ) -> Result<()> {
        let facts = [&self.facts[..], &[("description", description.to_owned())], about].concat();
        let path = self.out.with_extension(extension);
        write_file(&path, &graph.into_inner().file("gestures", inputs, outputs, &facts))?;
        self.written.push(path);
        Ok(())
    }
}

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
