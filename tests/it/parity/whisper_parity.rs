//! The published weights of Whisper tiny.en give the encoder output, logits, attention and tokens of PyTorch for ten sounds
//! (`fixtures/reference/whisper_reference.py`).

use orator_speech::mel::log_mel;
use orator_speech::network::{EncodedAudio, Whisper};
use orator_test_support::skip::fetched_model;
use std::f64::consts::TAU;

#[derive(serde::Deserialize)]
struct Golden {
    tiny_en: Vec<Outputs>,
}

#[derive(serde::Deserialize)]
struct Outputs {
    tokens: Vec<u32>,
    encoded: Vec<f32>,
    logits: Vec<f32>,
    scores: Vec<f32>,
}

/// Sound of the reference: a rising tone, a steady tone, and a hash as noise.
fn sound(number: usize) -> Vec<f32> {
    let nth = number as f64;
    let value = |i: usize| {
        let t = i as f64 / 16_000.0;
        let noise = ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        let (rising, steady) = (200.0 + 90.0 * nth + (700.0 - 60.0 * nth) * t, 440.0 - 37.0 * nth);
        0.4 * (TAU * rising * t).sin() + 0.2 * (TAU * steady * t).sin() + 0.05 * noise
    };
    (0..67_267 + 30_000 * number).map(|i| value(i) as f32).collect()
}

/// The most probable tokens after `prompt`, up to `end`, searched one by one.
fn greedy(network: &Whisper, audio: &EncodedAudio, prompt: &[u32], end: u32) -> anyhow::Result<Vec<u32>> {
    let (mut decoder, mut tokens, mut new) = (network.decoder(audio), prompt.to_vec(), prompt.to_vec());
    while tokens.last() != Some(&end) && tokens.len() < prompt.len() + 12 {
        let logits = decoder.step(&[new])?;
        let best = (0..logits.ncols()).max_by(|&a, &b| logits[[0, a]].total_cmp(&logits[[0, b]]));
        new = vec![best.unwrap() as u32];
        tokens.extend(&new);
    }
    Ok(tokens)
}

fn assert_close<'a>(found: impl Iterator<Item = &'a f32>, expected: &[f32], name: &str) {
    let found: Vec<f32> = found.copied().collect();
    assert_eq!(found.len(), expected.len(), "{name}");
    let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-3, "{name}: {worst}");
}

#[test]
fn tiny_en_gives_the_outputs_of_pytorch() -> anyhow::Result<()> {
    let Some(models) = fetched_model("whisper-tiny-en/model.bin") else { return Ok(()) };
    let golden: Golden = serde_json::from_str(include_str!("../../../fixtures/reference/whisper_golden.json"))?;
    let network = Whisper::open(&models.join("whisper-tiny-en"))?;
    let heads = &network.config().alignment_heads;
    let recorded = [(1, 0), (3, 4)].map(|head| heads.iter().position(|found| *found == head).unwrap());
    assert_eq!(golden.tiny_en.len(), 10);
    for (number, golden) in golden.tiny_en.iter().enumerate() {
        let audio = network.encode(log_mel(&sound(number)).view())?;
        // The recorded values are every 300th position, every 48th channel and every 6007th token.
        let encoded = audio.states.outer_iter().step_by(300).flat_map(|row| row.into_iter().step_by(48));
        assert_close(encoded, &golden.encoded, "encoder");
        let attention = network.token_attention(&audio, &golden.tokens)?;
        let logits = attention.logits.outer_iter().flat_map(|row| row.into_iter().step_by(6007));
        assert_close(logits, &golden.logits, "logits");
        for (head, expected) in recorded.into_iter().zip(golden.scores.chunks(golden.tokens.len() * 5)) {
            let scores = attention.weights.index_axis(ndarray::Axis(0), head);
            let scores = scores.outer_iter().flat_map(|row| row.into_iter().step_by(300));
            assert_close(scores, expected, "scores");
        }
        let (prompt, end) = (&golden.tokens[..2], *golden.tokens.last().unwrap());
        assert_eq!(greedy(&network, &audio, prompt, end)?, golden.tokens, "sound {number}");
    }
    Ok(())
}
