//! The published weights of Whisper tiny.en give the encoder output, logits and attention of PyTorch
//! (`fixtures/reference/whisper_reference.py`).

use orator_speech::mel::log_mel;
use orator_speech::network::Whisper;
use orator_test_support::skip::fetched_model;
use std::f64::consts::TAU;

#[derive(serde::Deserialize)]
struct Golden {
    tiny_en: Outputs,
}

#[derive(serde::Deserialize)]
struct Outputs {
    tokens: Vec<u32>,
    encoded: Vec<f32>,
    logits: Vec<f32>,
    scores: Vec<f32>,
}

/// Sound of the reference: a rising tone, a steady tone, and a hash as noise.
fn sound(n: usize) -> Vec<f32> {
    let value = |i: usize| {
        let t = i as f64 / 16_000.0;
        let noise = ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        0.4 * (TAU * (200.0 + 700.0 * t) * t).sin() + 0.2 * (TAU * 440.0 * t).sin() + 0.05 * noise
    };
    (0..n).map(|i| value(i) as f32).collect()
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
    let golden = golden.tiny_en;
    let network = Whisper::open(&models.join("whisper-tiny-en"))?;
    let audio = network.encode(log_mel(&sound(67_267)).view())?;
    // The recorded values are every 100th position, every 48th channel and every 3001st token.
    let encoded = audio.states.outer_iter().step_by(100).flat_map(|row| row.into_iter().step_by(48));
    assert_close(encoded, &golden.encoded, "encoder");
    let attention = network.token_attention(&audio, &golden.tokens)?;
    let logits = attention.logits.outer_iter().flat_map(|row| row.into_iter().step_by(3001));
    assert_close(logits, &golden.logits, "logits");
    let heads = &network.config().alignment_heads;
    let recorded = [(1, 0), (3, 4)].map(|head| heads.iter().position(|found| *found == head));
    for (head, expected) in recorded.into_iter().zip(golden.scores.chunks(golden.tokens.len() * 15)) {
        let scores = attention.weights.index_axis(ndarray::Axis(0), head.unwrap());
        let scores = scores.outer_iter().flat_map(|row| row.into_iter().step_by(100));
        assert_close(scores, expected, "scores");
    }
    Ok(())
}
