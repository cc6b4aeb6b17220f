//! Sizes of a network and the settings stored beside its weights.

use super::weight_file::WeightFile;
use crate::mel::N_MELS;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_nn::cpu::packed_matrix::COLUMNS;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Vocabulary size from which on a network has tokens for languages.
const MULTILINGUAL_VOCAB: usize = 51_865;

/// Sizes of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct WhisperConfig {
    pub n_mels: usize,
    /// Number of positions of the encoder: 1500 of 20 ms.
    pub n_audio_frames: usize,
    /// Maximum number of tokens of the decoder, including the prompt: 448.
    pub max_tokens: usize,
    pub n_vocab: usize,
    pub width: usize,
    pub n_heads: usize,
    pub n_encoder_layers: usize,
    pub n_decoder_layers: usize,
    /// Layer and head of the cross-attention that follows the position in time.
    pub alignment_heads: Vec<(usize, usize)>,
    /// Tokens that are never output, and those that are not output first.
    pub suppress_ids: Vec<u32>,
    pub suppress_ids_begin: Vec<u32>,
    pub is_multilingual: bool,
}

/// Settings of CTranslate2's `config.json` or of `generation_config.json`.
#[derive(Deserialize, Default)]
#[serde(default)]
struct DecodingFile {
    alignment_heads: Option<Vec<(usize, usize)>>,
    #[serde(alias = "suppress_tokens")]
    suppress_ids: Option<Vec<i64>>,
    #[serde(alias = "begin_suppress_tokens")]
    suppress_ids_begin: Option<Vec<i64>>,
}

/// Part of a transformers `config.json`.
#[derive(Deserialize)]
struct HeadCount {
    encoder_attention_heads: usize,
    decoder_attention_heads: usize,
}

impl WhisperConfig {
    /// Delay of the times that the alignment heads give, seconds, which differs between the published networks; 0 for
    /// those that were not measured. Medians of synthetic speech with known word times, two voices of four.
    pub(crate) fn delay_secs(&self) -> f64 {
        match (self.n_encoder_layers, self.width, self.is_multilingual) {
            // tiny.en
            (4, 384, false) => 0.1,
            // base
            (6, 512, true) => -0.03,
            _ => 0.0,
        }
    }

    /// Derives the sizes from the shapes in `weights` and reads the settings beside them.
    pub(super) fn read(dir: &Path, weights: &WeightFile) -> Result<Self> {
        let sizes = |name: &str, n: usize| {
            let shape = weights.shape(name)?;
            let has_axes = shape.len() == n && !shape.contains(&0);
            ensure!(has_axes, "{}: {name} has shape {shape:?}, expected {n} axes", weights.path().display());
            Ok(shape)
        };
        let embedding = sizes("decoder/embeddings/weight", 2)?;
        let (n_vocab, width) = (embedding[0], embedding[1]);
        let n_mels = sizes("encoder/conv1/weight", 3)?[1];
        let n_audio_frames = sizes("encoder/position_encodings/encodings", 2)?[0];
        let max_tokens = sizes("decoder/position_encodings/encodings", 2)?[0];
        let is_ctranslate2 = weights.is_ctranslate2();
        let (encoder_heads, n_heads) = if is_ctranslate2 {
            (weights.int("encoder/num_heads")?, weights.int("decoder/num_heads")?)
        } else {
            let heads: HeadCount = json(&dir.join("config.json"))?;
            (heads.encoder_attention_heads, heads.decoder_attention_heads)
        };
        ensure!(
            n_mels == N_MELS,
            "{}: the network has {n_mels} mel bands; supported are networks with {N_MELS}",
            weights.path().display()
        );
        ensure!(
            (1..=width).contains(&n_heads) && encoder_heads == n_heads && width.is_multiple_of(n_heads * COLUMNS),
            "{}: {n_heads} heads do not fit a network of width {width}, expected heads of a multiple of {COLUMNS} values",
            weights.path().display()
        );
        let n_layers =
            |part: &str| (0..).take_while(|i| weights.has(&format!("{part}/layer_{i}/ffn/linear_0/weight"))).count();
        let (n_encoder_layers, n_decoder_layers) = (n_layers("encoder"), n_layers("decoder"));
        let path = dir.join(if is_ctranslate2 { "config.json" } else { "generation_config.json" });
        let file: DecodingFile = if path.exists() { json(&path)? } else { DecodingFile::default() };
        // As in OpenAI's code, all heads of the later half of the layers if none are named.
        let later_half = || {
            let layers = n_decoder_layers / 2..n_decoder_layers;
            layers.flat_map(|layer| (0..n_heads).map(move |head| (layer, head))).collect()
        };
        let alignment_heads: Vec<_> = file.alignment_heads.unwrap_or_else(later_half);
        let is_head = |(layer, head): &(usize, usize)| *layer < n_decoder_layers && *head < n_heads;
        ensure!(
            !alignment_heads.is_empty() && alignment_heads.iter().all(is_head),
            "{}: alignment_heads has {alignment_heads:?}, expected pairs of a layer below {n_decoder_layers} and a head \
             below {n_heads}",
            path.display()
        );
        let tokens = |key: &str, ids: Option<Vec<i64>>| {
            let id = |id: &i64| u32::try_from(*id).ok().filter(|id| (*id as usize) < n_vocab);
            let ids = ids.unwrap_or_default();
            ids.iter()
                .map(id)
                .collect::<Option<Vec<u32>>>()
                .with_context(|| format!("{}: {key} has {ids:?}, expected tokens below {n_vocab}", path.display()))
        };
        Ok(Self {
            n_mels,
            n_audio_frames,
            max_tokens,
            n_vocab,
            width,
            n_heads,
            n_encoder_layers,
            n_decoder_layers,
            alignment_heads,
            suppress_ids: tokens("suppress_ids", file.suppress_ids)?,
            suppress_ids_begin: tokens("suppress_ids_begin", file.suppress_ids_begin)?,
            is_multilingual: n_vocab >= MULTILINGUAL_VOCAB,
        })
    }
}

fn json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let read = || anyhow::Ok(serde_json::from_str(&input::read_text(path, input::MAX_TEXT)?)?);
    read().with_context(|| format!("cannot read {}", path.display()))
}
