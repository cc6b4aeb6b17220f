//! `orator generate --export`: the exported files give the joints of generation in the program's own ONNX Runtime, for
//! networks of every kind.

use crate::fixtures::figures::{FPS, swinging};
use crate::fixtures::models::untrained::{generate, write_untrained_sequence, write_untrained_speaker};
use candle_core::{Device, Tensor as CandleTensor};
use ndarray::{ArrayView3, Axis};
use orator_avatar::animate::rig::rig::bone_metres;
use orator_base::audio::mel;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::PostureChannel;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_formats::transcript::{Word, WordSource};
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::{GENERATOR, GenerationChoice, SpeakerMetadata};
use orator_gesture::generate::normalisation::{ChannelNormalisation, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_gesture::generate::seq2seq::SequenceGenerator;
use orator_gesture::generate::seq2seq::architecture::{self, Architecture};
use orator_gesture::generate::seq2seq::metadata::NETWORK;
use orator_gesture::generate::word_input::{TrainedWords, WordFrameList};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use orator_onnx::{Runtime, SessionKind, session};
use orator_test_support::skip::skip;
use ort::session::{Session, SessionInputValue};
use ort::value::Tensor;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest accepted distance of a joint's coordinate, metres.
pub(crate) const TOLERANCE: f32 = 1e-4;
/// Shorter than a block of 32 frames, which its mirror images fill; some blocks; many blocks.
const SECS: [f64; 3] = [0.3, 2.05, 7.3];
const SPOKEN: [&str; 3] = ["big", "ball", "other"];

/// A rising and falling tone with noise.
pub(crate) fn sound(secs: f64) -> Sound {
    let n = (secs * 16_000.0) as usize;
    let at = |i: usize| {
        let t = i as f64 / 16_000.0;
        let loudness = 0.3 + 0.2 * (5.0 * t).sin();
        loudness * (1400.0 * t + 60.0 * (3.0 * t).sin()).sin() + 0.01 * ((i * 7919 % 1009) as f64 / 1009.0 - 0.5)
    };
    Sound { rate: 16_000, samples: (0..n).map(|i| (at(i) * 32_768.0).round() as f32 / 32_768.0).collect() }
}

fn words() -> Vec<Word> {
    let word = |(i, word): (usize, &&str)| Word {
        word: (*word).to_owned(),
        start_secs: 0.1 + 0.6 * i as f64,
        end_secs: 0.5 + 0.6 * i as f64,
        source: WordSource::Given,
        confidence: None,
    };
    SPOKEN.iter().enumerate().map(word).collect()
}

/// Replaces the initial values of biases, batch norms and speaker layers, which are zeros and ones.
fn disturbed(name: &str, tensor: &CandleTensor) -> CandleTensor {
    let is_norm_weight = name.contains("norm") && name.ends_with("weight");
    let is_factor = is_norm_weight || name.ends_with("running_var") || name == "scale";
    let [around, wide] = if is_factor { [1.0, 0.5] } else { [0.0, 0.2] };
    let wave = (0..tensor.elem_count()).map(|i| (around + wide * ((i + name.len()) as f64 * 1.3).sin()) as f32);
    CandleTensor::from_iter(wave, &Device::Cpu).unwrap().reshape(tensor.dims()).unwrap()
}

/// Writes a checkpoint with random weights; `is_complete`: of two speakers, with words and angles.
pub(crate) fn write_speaker(file: &Path, preset: Preset, fps: FrameRate, is_bones: bool, is_complete: bool) {
    let motion = swinging(1, 40);
    let mut lengths: Vec<f32> = bone_metres(&motion)[1..].iter().map(|&metres| metres as f32).collect();
    lengths[4] = 0.0;
    let (mean, std) = (motion.joints.mean_axis(Axis(0)).unwrap(), motion.joints.std_axis(Axis(0), 0.0));
    let mut normal = Normalisation::new(&mean, &std, lengths);
    let representation = if is_bones {
        Representation::bones(&normal, std::iter::once(Ok(normal.features(&motion)))).unwrap()
    } else {
        Representation::Positions
    };
    let mut network = Config { width: 16, ..Config::from_preset(preset, 144) };
    if is_complete {
        let channel = |channel, n| ChannelNormalisation::new(channel, [9, 9, n], [0.1, -0.2, 0.3], [0.1, 0.2, 0.3]);
        normal.channels = vec![channel(PostureChannel::Head, 9), channel(PostureChannel::Trunk, 0)];
        network = Config { n_out: 150, n_speakers: 2, speaker_weights: true, ..network };
    }
    let vocabulary = serde_json::from_value(serde_json::json!(["ball", "big"])).unwrap();
    let words = is_complete.then_some(TrainedWords { vocabulary, has_word_vectors: false });
    let metadata = SpeakerMetadata::new("host", fps, "", network, normal, representation).with_words(words, 5);
    let mut params = Params::new(7);
    Generator::new(&mut params, &metadata.network).unwrap();
    let mut tensors = params.tensors().unwrap();
    let initial = |(name, tensor): &(&String, &mut CandleTensor)| tensor.rank() == 1 || name.starts_with("speaker.w");
    tensors.iter_mut().filter(initial).for_each(|(name, tensor)| *tensor = disturbed(name, tensor));
    let mut facts = serde_json::json!({ "speaker": metadata });
    if is_complete {
        facts["other_speakers"] = serde_json::json!([SpeakerMetadata { name: "guest".to_owned(), ..metadata }]);
    }
    let mut contents = Contents { facts, tensors: BTreeMap::new() };
    contents.add(GENERATOR, tensors);
    contents.write(file).unwrap();
}

/// ONNX Runtime, if it is installed.
#[track_caller]
fn runtime() -> Option<Runtime> {
    Runtime::load(Path::new(""), Path::new("")).inspect_err(|error| skip(&format!("{error:#}"))).ok()
}

fn floats(shape: &[usize], values: Vec<f32>) -> SessionInputValue<'static> {
    Tensor::from_array((shape.to_vec(), values)).unwrap().into()
}

fn integers(shape: &[usize], values: Vec<i64>) -> SessionInputValue<'static> {
    Tensor::from_array((shape.to_vec(), values)).unwrap().into()
}

/// A session of an exported file, which has metadata and no control flow.
fn open(runtime: &Runtime, file: &Path) -> Session {
    let bytes = std::fs::read(file).unwrap();
    for kind in [&b"\x22\x02If"[..], b"\x22\x04Loop", b"\x22\x04Scan"] {
        assert!(!bytes.windows(kind.len()).any(|part| part == kind), "{}: {kind:?}", file.display());
    }
    let session = session(runtime, &bytes, SessionKind::OnePicture).unwrap();
    let metadata = session.metadata().unwrap();
    for key in ["program", "checkpoint_blake3", "speaker", "frame_rate", "sample_rate", "description"] {
        assert!(metadata.custom(key).is_some_and(|value| !value.is_empty()), "{}: {key}", file.display());
    }
    drop(metadata);
    session
}

/// Shape and values of outputs.
fn run(session: &mut Session, inputs: Vec<(&str, SessionInputValue)>, output: &str) -> (Vec<usize>, Vec<f32>) {
    let outputs = session.run(inputs).unwrap();
    let (shape, values) = outputs[output].try_extract_tensor::<f32>().unwrap();
    (shape.iter().map(|n| *n as usize).collect(), values.to_vec())
}

/// Features of a sound [1, ..., ...] and its number of frames, by the front end.
fn features(session: &mut Session, sound: &Sound) -> (Vec<usize>, Vec<f32>, usize) {
    let inputs = vec![("samples", floats(&[1, sound.samples.len()], sound.samples.clone()))];
    let outputs = session.run(inputs).unwrap();
    let (shape, values) = outputs[0].try_extract_tensor::<f32>().unwrap();
    let frames = outputs["frames"].try_extract_tensor::<i64>().unwrap().1[0] as usize;
    (shape.iter().map(|n| *n as usize).collect(), values.to_vec(), frames)
}

/// Largest difference between the joints of a motion and the first of `joints` [frames, 49, 3].
pub(crate) fn difference(motion: &Motion, joints: &[f32]) -> f32 {
    let n = motion.n_frames();
    let joints = ArrayView3::from_shape((n, 49, 3), &joints[..n * 49 * 3]).unwrap();
    let worst = (&motion.joints - &joints).iter().fold(0.0f32, |worst, v| worst.max(v.abs()));
    assert!(motion.joints.iter().all(|v| v.is_finite()) && joints.iter().all(|v| v.is_finite()));
    // The largest range of a coordinate over time.
    let extreme =
        |pick: fn(f32, f32) -> f32| motion.joints.map_axis(Axis(0), |of| of.iter().copied().reduce(pick).unwrap());
    let range = (extreme(f32::max) - extreme(f32::min)).iter().fold(0.0f32, |range, v| range.max(*v));
    eprintln!("ONNX: joints move by {range:.3} m and differ by {worst:.2e} m");
    assert!(n < 9 || range > 10.0 * TOLERANCE, "the motion is constant");
    worst
}

pub(crate) fn export(dir: &Path, args: &str) {
    let output = generate(dir, args);
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn exported_gans_of_every_kind_give_the_joints_of_generation() {
    let Some(runtime) = runtime() else { return };
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let ntsc = FrameRate::new(30_000, 1001);
    for (name, preset, fps, is_bones, is_complete) in [
        ("light", Preset::Light, FPS, true, false),
        ("positions", Preset::Light, FrameRate::new(25, 1), false, false),
        ("paper", Preset::Paper, ntsc, true, false),
        ("complete", Preset::Light, FPS, true, true),
    ] {
        let file = dir.join(format!("{name}.safetensors"));
        write_speaker(&file, preset, fps, is_bones, is_complete);
        let speaker = is_complete.then(|| "guest".to_owned());
        let flags = speaker.as_ref().map_or(String::new(), |speaker| format!("--speaker {speaker}"));
        export(dir, &format!("--checkpoint {name}.safetensors --export {name}.onnx {flags}"));
        let generator =
            GestureGenerator::open_as(&file, &GenerationChoice { speaker, seed: None }, &Device::Cpu).unwrap();
        let mut front_end = open(&runtime, &dir.join(format!("{name}.mel.onnx")));
        let mut network = open(&runtime, &dir.join(format!("{name}.onnx")));
        for secs in SECS {
            let (sound, words) = (sound(secs), words());
            let (motion, posture) = generator.motion_and_posture(&sound, &words).unwrap();
            let (shape, mels, frames) = features(&mut front_end, &sound);
            assert_eq!(frames, motion.n_frames(), "{name}, {secs} s");
            let expected = mel::log_mel(&sound.samples);
            let at = |(t, band): (usize, usize)| mels[band * shape[2] + t];
            let off = expected.indexed_iter().fold(0.0f32, |worst, (i, value)| worst.max((value - at(i)).abs()));
            eprintln!("ONNX: {name}, {secs} s: mels differ by {off:.2e}");
            // The Fourier transform of the program rounds to float32, which quiet bands beside loud ones show.
            assert!(off < 5e-4, "{name}, {secs} s: {off}");
            let padded = (frames / 32 + 1) * 32;
            let inputs = |mels: &[f32]| {
                let mut inputs = vec![("mels", floats(&shape, mels.to_vec()))];
                if let Some(known) = generator.known_words() {
                    let mut list = WordFrameList::default();
                    list.push(&known.numbered(&words).unwrap().0, fps, (0..padded).map(|t| fps.secs(t)));
                    let spoken = list.frames(None).unwrap();
                    let numbers = spoken.numbers.flatten_all().unwrap().to_vec1::<u32>().unwrap();
                    assert!([1, 2, 3].iter().all(|number| numbers.contains(number) || secs < 2.0));
                    inputs.push(("words", integers(&[1, padded], numbers.into_iter().map(i64::from).collect())));
                    let times = spoken.times.flatten_all().unwrap().to_vec1().unwrap();
                    inputs.push(("word_times", floats(&[1, padded, 2], times)));
                }
                inputs
            };
            let (of_joints, joints) = run(&mut network, inputs(&mels), "joints");
            assert_eq!(of_joints, [padded, 49, 3]);
            let worst = difference(&motion, &joints);
            eprintln!("ONNX: {name}, {secs} s: joints differ by {worst:.2e} m");
            assert!(worst < TOLERANCE, "{name}, {secs} s: {worst}");
            if let Some(posture) = posture {
                let (_, angles) = run(&mut network, inputs(&mels), "angles");
                for (t, row) in angles.chunks(6).take(frames).enumerate() {
                    for (channel, values) in PostureChannel::ALL.into_iter().zip(row.chunks(3)) {
                        let expected = posture.channel(channel).row(t).to_vec();
                        let differs = |(a, b): (&f32, &f32)| (a - b).abs() > TOLERANCE || a.is_nan() != b.is_nan();
                        assert!(!values.iter().zip(&expected).any(differs), "{values:?} {expected:?}");
                    }
                }
            }
        }
        let metadata = network.metadata().unwrap();
        let facts = [("frame_rate", format!("{}/{}", fps.num, fps.den)), ("sample_rate", "16000".to_owned())];
        facts.iter().for_each(|(key, value)| assert_eq!(metadata.custom(key).as_ref(), Some(value)));
        assert!(metadata.custom("joints").unwrap().starts_with("Neck,RShoulder,"));
        assert!(metadata.custom("units").unwrap().starts_with("metres"));
        assert_eq!(metadata.custom("vocabulary").as_deref(), is_complete.then_some(r#"["ball","big"]"#));
        let audio: serde_json::Value =
            serde_json::from_str(&front_end.metadata().unwrap().custom("spectrogram").unwrap()).unwrap();
        assert_eq!(audio["n_mels"], 64);
    }
}

/// Writes a sequence network with random weights; `audio-context` is `audio` with a GRU over the audio around a frame.
pub(crate) fn write_sequence(file: &Path, architecture: Architecture, has_context: bool) {
    write_untrained_sequence(file, architecture, false, &["ball", "big"]);
    let mut contents = Contents::read(file).unwrap();
    let speaker = SequenceGenerator::open(file).unwrap();
    let mut network = speaker.metadata.network.clone();
    network.audio_context = has_context;
    let mut params = Params::new(3);
    architecture::network(architecture, &mut params, &network).unwrap();
    contents.facts["speaker"]["network"] = serde_json::to_value(&network).unwrap();
    let mut tensors = params.tensors().unwrap();
    let norms = tensors.iter_mut().filter(|(name, _)| name.contains("norm.") || *name == "scale");
    norms.for_each(|(name, tensor)| *tensor = disturbed(name, tensor));
    contents.tensors.clear();
    contents.add(NETWORK, tensors);
    contents.write(file).unwrap();
}

/// Joints of an exported sequence network, run segment by segment.
fn sequence_joints(
    runtime: &Runtime,
    dir: &Path,
    speaker: &SequenceGenerator,
    sound: &Sound,
    is_carried: bool,
) -> Vec<f32> {
    let [mut front_end, mut network, mut decoder] =
        ["model.mel.onnx", "model.onnx", "model.joints.onnx"].map(|file| open(runtime, &dir.join(file)));
    let (_, cepstra, frames) = features(&mut front_end, sound);
    let (of, sizes) = (&speaker.metadata, &speaker.metadata.network);
    let n_padded = frames.next_multiple_of(sizes.predicted);
    let expected = architecture::audio_features(sound, of.fps, frames, n_padded, sizes.context);
    assert_eq!(cepstra.len(), expected.len());
    let off = expected.iter().zip(&cepstra).fold(0.0f32, |worst, (a, b)| worst.max((a - b).abs()));
    assert!(off < TOLERANCE, "cepstra differ by {off}");
    let (spoken, _) = speaker.known_words().numbered(&words()).unwrap();
    let (mut previous, mut state) = (vec![0.0; sizes.previous * sizes.pose], vec![0.0; sizes.hidden]);
    let mut poses = Vec::new();
    for (segment, first) in (0..frames).step_by(sizes.predicted).enumerate() {
        let rows = cepstra[26 * first..26 * (first + sizes.audio_frames())].to_vec();
        let mut inputs = vec![
            ("cepstra", floats(&[1, sizes.audio_frames(), 26], rows)),
            ("previous", floats(&[1, sizes.previous, sizes.pose], previous)),
        ];
        let read = architecture::words_tensor(of.architecture, &[of.words_of_segment(&spoken, first)]).unwrap();
        if let Some(read) = read {
            let numbers = read.flatten_all().unwrap().to_vec1::<u32>().unwrap();
            let shape = &read.dims()[read.rank() - 2..];
            inputs.push(("words", integers(shape, numbers.into_iter().map(i64::from).collect())));
        }
        if is_carried {
            inputs.push(("segment_index", integers(&[1], vec![segment as i64])));
            inputs.push(("state", floats(&[1, sizes.hidden], state.clone())));
        }
        let outputs = network.run(inputs).unwrap();
        let values = |name: &str| outputs[name].try_extract_tensor::<f32>().unwrap().1.to_vec();
        poses.extend(values("poses"));
        previous = values("next");
        if is_carried {
            state = values("next_state");
        }
    }
    poses.truncate(frames * sizes.pose);
    run(&mut decoder, vec![("poses", floats(&[frames, sizes.pose], poses))], "joints").1
}

#[test]
fn exported_sequence_networks_give_the_joints_of_generation() {
    let Some(runtime) = runtime() else { return };
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let file = dir.join("host.safetensors");
    for (architecture, has_context) in [
        (Architecture::Audio, true),
        (Architecture::Adversarial, false),
        (Architecture::Words, false),
        (Architecture::Contextual, false),
        (Architecture::Autoencoder, false),
    ] {
        write_sequence(&file, architecture, has_context);
        let speaker = SequenceGenerator::open(&file).unwrap();
        for is_carried in [false, true] {
            if is_carried && !speaker.has_state() {
                continue;
            }
            let flag = if is_carried { " --carry-state" } else { "" };
            export(dir, &format!("--checkpoint host.safetensors --export model.onnx{flag}"));
            for secs in SECS {
                let sound = sound(secs);
                let prepared = speaker.prepare(&sound, &words()).unwrap();
                let motion = speaker.motion(&speaker.generate(&prepared, speaker.seams(is_carried)).unwrap()).unwrap();
                let joints = sequence_joints(&runtime, dir, &speaker, &sound, is_carried);
                let worst = difference(&motion, &joints);
                eprintln!("ONNX: {architecture:?}, carried {is_carried}, {secs} s: joints differ by {worst:.2e} m");
                assert!(worst < TOLERANCE && joints.len() == motion.n_frames() * 147, "{architecture:?}: {worst}");
            }
        }
    }
}

#[test]
fn invalid_exports_are_rejected_without_output() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    write_untrained_sequence(&dir.join("captured.safetensors"), Architecture::Audio, true, &[]);
    std::fs::create_dir(dir.join("folder.onnx")).unwrap();
    for (args, expected) in [
        ("--checkpoint gone.safetensors --export a.onnx", "gone.safetensors does not exist"),
        ("--checkpoint host.safetensors --export a.bin", "expected a file that ends in .onnx"),
        ("--checkpoint host.safetensors --export folder.onnx", "expected a file that ends in .onnx"),
        ("--checkpoint host.safetensors --export host.safetensors", "host.safetensors is the checkpoint"),
        ("--checkpoint host.safetensors --carry-state --export a.onnx", "omit --carry-state"),
        ("--checkpoint host.safetensors --seed 1 --export a.onnx", "without dropout"),
        ("--checkpoint captured.safetensors --export a.onnx", "animates the BVH skeleton"),
        ("--checkpoint host.safetensors --audio a.wav --out a.bvh --export a.onnx", "cannot be used with"),
        ("--export a.onnx", "--checkpoint"),
    ] {
        let output = generate(dir, args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && text.contains(expected), "{args}: {text}");
        let is_written = std::fs::read_dir(dir).unwrap().any(|entry| entry.unwrap().path().ends_with("a.onnx"));
        assert!(!is_written, "{args}");
    }
}
