//! The network with formula weights, compared with `fixtures/reference/whisper_reference.py`, and damaged files.

use super::{TokenAttention, Whisper};
use crate::mel::tests::{golden, signal};
use anyhow::{Context, Result};
use ndarray::{Array2, s};
use serde_json::{Map, json};
use std::fs;
use std::path::Path;

const WIDTH: usize = 32;
const N_TOKENS: usize = 5;
const TOKENS: [u32; N_TOKENS] = [3, 1, 39, 0, 7];

/// Variables of the network in CTranslate2's names, with their shapes.
fn variables() -> Vec<(String, Vec<usize>)> {
    let mut variables = vec![
        ("encoder/conv1/weight".to_owned(), vec![WIDTH, 80, 3]),
        ("encoder/conv2/weight".to_owned(), vec![WIDTH, WIDTH, 3]),
        ("encoder/position_encodings/encodings".to_owned(), vec![12, WIDTH]),
        ("decoder/position_encodings/encodings".to_owned(), vec![16, WIDTH]),
        ("decoder/embeddings/weight".to_owned(), vec![40, WIDTH]),
    ];
    let mut add = |name: String, shape: &[usize]| variables.push((name, shape.to_vec()));
    for name in ["encoder/conv1/bias", "encoder/conv2/bias"] {
        add(name.to_owned(), &[WIDTH]);
    }
    for layer in ["encoder/layer_0", "decoder/layer_0", "decoder/layer_1"] {
        let linears = [("self_attention", &[3, 1][..]), ("attention", &[1, 2, 1]), ("ffn", &[])];
        for (block, outputs) in linears.into_iter().filter(|(block, _)| layer.starts_with('d') || *block != "attention")
        {
            for part in ["gamma", "beta"] {
                add(format!("{layer}/{block}/layer_norm/{part}"), &[WIDTH]);
            }
            let of_width = outputs.iter().map(|n| [n * WIDTH, WIDTH]);
            let shapes = if block == "ffn" { vec![[48, WIDTH], [WIDTH, 48]] } else { of_width.collect() };
            for (i, [n_out, n_in]) in shapes.into_iter().enumerate() {
                add(format!("{layer}/{block}/linear_{i}/weight"), &[n_out, n_in]);
                add(format!("{layer}/{block}/linear_{i}/bias"), &[n_out]);
            }
        }
    }
    for name in
        ["encoder/layer_norm/gamma", "encoder/layer_norm/beta", "decoder/layer_norm/gamma", "decoder/layer_norm/beta"]
    {
        add(name.to_owned(), &[WIDTH]);
    }
    variables
}

/// Value of the formula that the reference uses, a multiple of 1/1024.
fn value(name: &str, i: usize) -> f32 {
    let phase = name.bytes().enumerate().map(|(k, c)| (k + 1) * usize::from(c)).sum::<usize>() % 1009;
    let p = (((i + phase) as f64 * 12.9898).sin() * 43758.5453) % 1.0;
    let value = if name.ends_with("gamma") { 1.0 + 0.2 * p } else { 0.25 * p };
    ((value * 1024.0).round() / 1024.0) as f32
}

/// Bytes of a number that half precision represents exactly.
fn f16(value: f32) -> [u8; 2] {
    let bits = value.to_bits();
    let magnitude = if value == 0.0 { 0 } else { ((bits & 0x7fff_ffff) >> 13) - (112 << 10) };
    ((bits >> 16 & 0x8000 | magnitude) as u16).to_le_bytes()
}

fn ctranslate2() -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u16 + 1).to_le_bytes()[..], text.as_bytes(), &[0]].concat();
    let variables = variables();
    let mut file = [&6u32.to_le_bytes()[..], &text("WhisperSpec"), &3u32.to_le_bytes()].concat();
    file.extend((variables.len() as u32 + 2).to_le_bytes());
    for name in ["encoder/num_heads", "decoder/num_heads"] {
        file.extend([&text(name)[..], &[0, 2], &2u32.to_le_bytes(), &2u16.to_le_bytes()].concat());
    }
    for (name, shape) in variables {
        let n: usize = shape.iter().product();
        file.extend(text(&name));
        file.push(shape.len() as u8);
        file.extend(shape.iter().flat_map(|n| (*n as u32).to_le_bytes()));
        file.push(4);
        file.extend((2 * n as u32).to_le_bytes());
        file.extend((0..n).flat_map(|i| f16(value(&name, i))));
    }
    file.extend(1u32.to_le_bytes());
    file.extend([text("decoder/projection/weight"), text("decoder/embeddings/weight")].concat());
    file
}

/// The network in the names of transformers, with separate projections.
fn safetensors() -> Vec<u8> {
    let (mut header, mut data) = (Map::new(), Vec::<u8>::new());
    for (name, shape) in variables() {
        let parts = super::weight_file::transformers_names(&name);
        let n = shape.iter().product::<usize>() / parts.len();
        let part_shape = [&[shape[0] / parts.len()], &shape[1..]].concat();
        for (part, stored) in parts.iter().enumerate() {
            let start = data.len();
            data.extend((part * n..(part + 1) * n).flat_map(|i| value(&name, i).to_le_bytes()));
            let entry = json!({"dtype": "F32", "shape": part_shape, "data_offsets": [start, data.len()]});
            header.insert(format!("model.{stored}"), entry);
        }
    }
    let header = serde_json::to_vec(&header).unwrap_or_default();
    [&(header.len() as u64).to_le_bytes()[..], &header, &data].concat()
}

const SETTINGS: &str = r#"{"alignment_heads": [[1, 0], [0, 1]], "suppress_ids": [5], "suppress_ids_begin": [6, 39]}"#;

fn write_ctranslate2(dir: &Path, model: &[u8], settings: &str) -> Result<()> {
    fs::write(dir.join("model.bin"), model)?;
    Ok(fs::write(dir.join("config.json"), settings)?)
}

fn small_network() -> Result<Whisper> {
    let dir = tempfile::tempdir()?;
    write_ctranslate2(dir.path(), &ctranslate2(), SETTINGS)?;
    Whisper::open(dir.path())
}

fn spectrogram() -> Array2<f32> {
    crate::mel::log_mel(&signal(67_267)).slice_move(s![.., ..24])
}

fn assert_close(found: impl IntoIterator<Item = f32>, expected: &[f32], what: &str) {
    let found: Vec<f32> = found.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-4, "{what}: {worst}");
}

#[test]
fn both_formats_give_the_outputs_of_pytorch() -> Result<()> {
    let golden = golden()?.small;
    assert_eq!(golden.tokens, TOKENS);
    let dir = tempfile::tempdir()?;
    fs::write(dir.path().join("model.safetensors"), safetensors())?;
    fs::write(dir.path().join("config.json"), r#"{"encoder_attention_heads": 2, "decoder_attention_heads": 2}"#)?;
    fs::write(dir.path().join("generation_config.json"), SETTINGS.replace("suppress_ids", "suppress_tokens"))?;
    for network in [small_network()?, Whisper::open(dir.path())?] {
        let config = network.config();
        assert_eq!((config.n_encoder_layers, config.n_decoder_layers, config.n_vocab), (1, 2, 40));
        assert_eq!((&config.suppress_ids[..], config.is_multilingual), (&[5][..], false));
        let audio = network.encode(spectrogram().view())?;
        assert_close(audio.states.iter().copied(), &golden.encoded, "encoder");
        let TokenAttention { weights, logits } = network.token_attention(&audio, &TOKENS)?;
        assert_close(logits, &golden.logits, "logits");
        assert_close(weights, &golden.scores, "scores");
    }
    Ok(())
}

/// Logits after the last two tokens, from steps of one and of several beams.
fn stepwise(network: &Whisper) -> Result<[Array2<f32>; 2]> {
    let audio = network.encode(spectrogram().view())?;
    let mut decoder = network.decoder(&audio);
    decoder.step(&[TOKENS[..3].to_vec()])?;
    decoder.reorder(&[0, 0, 0])?;
    let three = decoder.step(&[vec![9], vec![TOKENS[3]], vec![2]])?;
    decoder.reorder(&[2, 1, 1])?;
    Ok([three, decoder.step(&[vec![1], vec![TOKENS[4]], vec![11]])?])
}

#[test]
fn steps_give_the_bits_of_one_pass_for_any_number_of_threads_and_beams() -> Result<()> {
    let network = small_network()?;
    let audio = network.encode(spectrogram().view())?;
    let all = network.token_attention(&audio, &TOKENS)?.logits;
    let other = network.token_attention(&audio, &[&TOKENS[..3], &[2, 1]].concat())?.logits;
    for n_threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
        let [first, second] = pool.install(|| stepwise(&network))?;
        assert_eq!(first.row(1), all.row(3));
        assert_eq!(second.row(1), all.row(4));
        assert_eq!(second.row(0), other.row(4));
        assert_eq!(pool.install(|| network.encode(spectrogram().view()))?.states, audio.states);
    }
    Ok(())
}

#[test]
fn wrong_tokens_and_sizes_are_errors() -> Result<()> {
    let network = small_network()?;
    let audio = network.encode(spectrogram().view())?;
    let mut decoder = network.decoder(&audio);
    for tokens in [vec![], vec![vec![]], vec![vec![1], vec![2]], vec![vec![40]], vec![vec![1; 17]]] {
        assert!(decoder.step(&tokens).is_err(), "{tokens:?}");
    }
    assert!(decoder.reorder(&[1]).is_err() && decoder.reorder(&[]).is_err());
    assert!(decoder.step(&[vec![1; 16]]).is_ok() && decoder.step(&[vec![1]]).is_err());
    assert!(network.encode(Array2::zeros((80, 22)).view()).is_err());
    Ok(())
}

#[test]
fn damaged_files_are_errors_that_name_the_file() -> Result<()> {
    let dir = tempfile::tempdir()?;
    let model = ctranslate2();
    let message = |model: &[u8], settings: &str| -> Result<Option<String>> {
        write_ctranslate2(dir.path(), model, settings)?;
        Ok(Whisper::open(dir.path()).err().map(|error| format!("{error:#}")))
    };
    for n in (0..300).chain((300..model.len()).step_by(1999)).chain(model.len() - 60..model.len()) {
        let text = message(&model[..n], SETTINGS)?.with_context(|| format!("{n} bytes were read"))?;
        assert!(text.contains("model.bin") && text.contains("truncated"), "{n}: {text}");
    }
    for at in 0..250 {
        let mut wrong = model.clone();
        wrong[at] = !wrong[at];
        let text = message(&wrong, SETTINGS)?.unwrap_or_default();
        assert!(text.is_empty() || text.contains("model.bin"), "{at}: {text}");
    }
    let replaced = |from: &[u8], to: &[u8]| {
        let at = model.windows(from.len()).position(|window| window == from).unwrap_or_default();
        [&model[..at], to, &model[at + from.len()..]].concat()
    };
    let nan =
        [&b"encoder/layer_norm/beta\0\x01\x20\0\0\0\x04\x40\0\0\0"[..], &f16(value("encoder/layer_norm/beta", 0))]
            .concat();
    for (wrong, expected) in [
        (replaced(b"decoder/layer_1/ffn/linear_1/bias", b"decoder/layer_1/ffn/linear_9/bias"), "linear_1/bias"),
        (replaced(&nan, &[&nan[..nan.len() - 2], &[0, 0x7c]].concat()), "not finite"),
        ([&model[..], &[0]].concat(), "unexpected data"),
        (replaced(b"WhisperSpec", b"WhisperSpek"), "WhisperSpek"),
    ] {
        let text = message(&wrong, SETTINGS)?.context("it was read")?;
        assert!(text.contains("model.bin") && text.contains(expected), "{text}");
    }
    for (from, to) in [("[0, 1]", "[2, 1]"), ("[5]", "[40]"), ("39", "-1"), ("[6", "6")] {
        let text = message(&model, &SETTINGS.replace(from, to))?.context("it was read")?;
        assert!(text.contains("config.json"), "{text}");
    }
    fs::remove_file(dir.path().join("model.bin"))?;
    let file = safetensors();
    for n in [0, 7, 8, 100, 3000, file.len() - 1] {
        fs::write(dir.path().join("model.safetensors"), &file[..n])?;
        let text = Whisper::open(dir.path()).err().context("it was read")?;
        assert!(format!("{text:#}").contains("model.safetensors"), "{text:#}");
    }
    Ok(())
}
