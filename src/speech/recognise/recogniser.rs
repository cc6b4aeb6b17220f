//! Recognition window by window: each starts where the recognised text of the last one ends.

use super::segments::{WindowText, split_at_timestamps};
use crate::align::token_times::TokenTimes;
use crate::align::word_bounds::WordBounds;
use crate::align::words::words_of;
use crate::decode::language;
use crate::decode::rules::LogitRules;
use crate::decode::window::WindowDecoder;
use crate::mel::log_mel;
use crate::network::{EncodedAudio, Whisper};
use crate::recognised::{Recognised, RecognisedSegment, RecognisedWord};
use crate::spans::{HOP, RATE, SpeechSpans};
use crate::tokenizer::Tokenizer;
use anyhow::{Context as _, Result, bail, ensure};
use ndarray::s;
use std::ops::Range;
use std::path::Path;

/// Temperature above which the text of a window is no prompt for the next one.
const MAX_PROMPT_TEMPERATURE: f32 = 0.5;

/// Probability of the words of a segment that is dropped: text invented in silence and noise.
const MIN_PROBABILITY: f32 = 0.15;

/// Returns the samples, mono at 16 kHz, of a range of sample numbers; ranges are asked for in ascending order and may
/// overlap.
pub type SampleSource<'a> = dyn FnMut(Range<usize>) -> Result<Vec<f32>> + 'a;

/// A Whisper network with its vocabulary.
pub struct Recogniser {
    pub(crate) network: Whisper,
    pub(crate) tokenizer: Tokenizer,
    pub(crate) rules: LogitRules,
}

/// Options of [`Recogniser::recognise`].
#[derive(Clone, Debug, PartialEq)]
pub struct RecogniserOptions {
    /// Code of the language, for example `en`; detected in the first window with speech if not given.
    pub language: Option<String>,
    /// Number of sequences of the beam search; 1 is greedy.
    pub beam: usize,
}

impl Default for RecogniserOptions {
    fn default() -> Self {
        Self { language: None, beam: 5 }
    }
}

/// Language of a sound, and the tokens that request text in it.
pub(crate) struct RecognitionRequest {
    pub(crate) language: String,
    pub(crate) probability: f32,
    pub(crate) tokens: Vec<u32>,
}

/// A window of the sound as the network reads it.
pub(crate) struct EncodedWindow {
    /// Samples of the window.
    pub(crate) range: Range<usize>,
    pub(crate) audio: EncodedAudio,
    bounds: WordBounds,
}

impl EncodedWindow {
    /// Start and end in seconds of the sound.
    pub(crate) fn secs(&self) -> [f64; 2] {
        [self.range.start, self.range.end].map(|at| at as f64 / RATE as f64)
    }

    /// Corrects the times of a word, in seconds of the window, and converts them to those of the sound.
    pub(crate) fn correct(&self, word: &mut RecognisedWord) {
        self.bounds.correct(word);
        let [start_secs, _] = self.secs();
        (word.start_secs, word.end_secs) = (start_secs + word.start_secs, start_secs + word.end_secs);
    }
}

/// Text of a window.
pub(crate) struct TranscribedWindow {
    /// Segments and their tokens.
    pub(crate) segments: Vec<(RecognisedSegment, Vec<u32>)>,
    /// Second of the sound at which the next window starts.
    pub(crate) next_secs: f64,
    /// Temperature of the last search.
    pub(crate) temperature: f32,
}

impl Recogniser {
    /// Reads the network, see [`Whisper::open`], and `tokenizer.json` in the same folder.
    ///
    /// # Errors
    /// A file is missing or damaged, or the vocabulary is that of another network.
    pub fn open(dir: &Path) -> Result<Self> {
        let (network, tokenizer) = (Whisper::open(dir)?, Tokenizer::open(dir)?);
        let config = network.config();
        // One timestamp for each frame of a window and one for its end.
        let n_tokens = tokenizer.timestamp_begin() as usize + config.n_audio_frames + 1;
        ensure!(
            n_tokens <= config.n_vocab && config.max_tokens >= 16,
            "{}: tokenizer.json has {n_tokens} tokens with the timestamps, the network {}; take both from one model",
            dir.display(),
            config.n_vocab
        );
        let rules = LogitRules::new(&tokenizer, &config.suppress_ids);
        Ok(Self { network, tokenizer, rules })
    }

    /// Recognises the text of a sound of `n_samples` at 16 kHz. `speech` are the ranges of seconds with speech; outside of
    /// them, nothing is recognised. `progress` is called with the number of seconds done so far. Memory does not grow
    /// with the length of the sound.
    ///
    /// # Errors
    /// The network does not know the language, or `source` fails.
    pub fn recognise(
        &self,
        source: &mut SampleSource,
        n_samples: usize,
        speech: &[Range<f64>],
        options: &RecogniserOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recognised> {
        let spans = SpeechSpans::new(speech, n_samples);
        let mut request = options.language.as_deref().map(|code| self.request(code)).transpose()?;
        let (mut segments, mut previous): (Vec<RecognisedSegment>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut from = 0;
        while let Some(window) = spans.window(from) {
            let window = self.encode(source, window, &spans)?;
            let request = match &mut request {
                Some(request) => request,
                none => none.insert(self.detect_language(&window.audio)?),
            };
            let transcribed = self.transcribe(&window, request, options.beam, &previous)?;
            for (segment, tokens) in transcribed.segments {
                if spans.overlap(segment.start_secs, segment.end_secs) {
                    segments.push(segment);
                    previous.extend(tokens);
                }
            }
            if transcribed.temperature > MAX_PROMPT_TEMPERATURE {
                previous.clear();
            }
            previous.drain(..previous.len().saturating_sub(self.network.config().max_tokens));
            let next = ((transcribed.next_secs * RATE as f64) as usize / HOP * HOP).min(window.range.end);
            from = next.max(window.range.start + HOP);
            progress(from as f64 / RATE as f64);
        }
        let (language, language_probability) = request.map_or((String::new(), 0.0), |it| (it.language, it.probability));
        Ok(Recognised { language, language_probability, segments })
    }

    /// Decodes a window with a beam search after the text `previous`.
    pub(crate) fn transcribe(
        &self,
        window: &EncodedWindow,
        request: &RecognitionRequest,
        beam: usize,
        previous: &[u32],
    ) -> Result<TranscribedWindow> {
        let decoder = WindowDecoder {
            tokenizer: &self.tokenizer,
            rules: &self.rules,
            request: &request.tokens,
            max_tokens: self.network.config().max_tokens,
            beam: beam.max(1),
        };
        let decoded = decoder.decode(|| self.network.decoder(&window.audio), previous, window.range.start as u64)?;
        let temperature = decoded.temperature;
        let [start_secs, end_secs] = window.secs();
        if decoded.is_silence() || decoded.is_repetitive() {
            return Ok(TranscribedWindow { segments: Vec::new(), next_secs: end_secs, temperature });
        }
        let text = split_at_timestamps(&decoded.tokens, self.tokenizer.timestamp_begin(), end_secs - start_secs);
        let WindowText { phrases, next_secs, is_complete } = text;
        let is_text = |token: &u32| *token < self.tokenizer.eot();
        let tokens: Vec<Vec<u32>> =
            phrases.iter().map(|phrase| phrase.tokens.iter().copied().filter(is_text).collect()).collect();
        let times = self.token_times(window, request, &tokens.concat())?;
        let (mut segments, mut first, mut last_secs) = (Vec::new(), 0, 0.0);
        for (phrase, tokens) in phrases.into_iter().zip(&tokens) {
            let mut words = words_of(&self.tokenizer, &request.language, tokens, &times, first);
            first += tokens.len();
            last_secs = words.last().map_or(last_secs, |word| word.end_secs);
            words.iter_mut().for_each(|word| window.correct(word));
            if let (Some(from), Some(to)) = (words.first(), words.last())
                && phrase.start_secs < phrase.end_secs
                && words.iter().any(|word| word.probability >= MIN_PROBABILITY)
            {
                let (start_secs, end_secs) = (from.start_secs, to.end_secs);
                let text = self.tokenizer.decode(tokens).trim().to_owned();
                segments.push((RecognisedSegment { start_secs, end_secs, text, words }, phrase.tokens));
            }
        }
        // The end of the last word before its correction, which must not be recognised again.
        let next_secs = if is_complete || last_secs <= 0.0 { next_secs } else { last_secs };
        Ok(TranscribedWindow { segments, next_secs: start_secs + next_secs, temperature })
    }

    /// Encodes a window; `spans` silence the rest.
    pub(crate) fn encode(
        &self,
        source: &mut SampleSource,
        range: Range<usize>,
        spans: &SpeechSpans,
    ) -> Result<EncodedWindow> {
        let mut samples = source(range.clone())?;
        samples.resize(range.len(), 0.0);
        spans.silence(&mut samples, range.start);
        let mut mel = log_mel(&samples);
        // Frames after the end are no silence, but the mean of the scale, as in training.
        let n_frames = (range.len() / HOP).min(mel.ncols());
        mel.slice_mut(s![.., n_frames..]).fill(0.0);
        let bounds = WordBounds::new(mel.slice(s![.., ..n_frames]), self.network.config().delay_secs());
        Ok(EncodedWindow { range, audio: self.network.encode(mel.view())?, bounds })
    }

    /// Times of text tokens in a window.
    pub(crate) fn token_times(
        &self,
        window: &EncodedWindow,
        request: &RecognitionRequest,
        text: &[u32],
    ) -> Result<TokenTimes> {
        let mut tokens = request.tokens.clone();
        tokens.push(self.tokenizer.no_timestamps());
        let n_prompt = tokens.len();
        let n_text = text.len().min(self.network.config().max_tokens - n_prompt - 1);
        tokens.extend(&text[..n_text]);
        tokens.push(self.tokenizer.eot());
        let attention = self.network.token_attention(&window.audio, &tokens)?;
        let n_frames = window.range.len() / (2 * HOP);
        Ok(TokenTimes::new(&attention, n_prompt, &text[..n_text], n_frames, self.tokenizer.eot()))
    }

    /// The request for text in a language.
    pub(crate) fn request(&self, code: &str) -> Result<RecognitionRequest> {
        let is_multilingual = self.network.config().is_multilingual;
        let Some(token) = self.tokenizer.language(code).filter(|_| is_multilingual || code == "en") else {
            let known = if is_multilingual { "a code such as `en` or `de`" } else { "`en`, the only one" };
            bail!("the speech recogniser does not know the language `{code}`; expected {known}");
        };
        let request = [self.tokenizer.sot(), token, self.tokenizer.transcribe()];
        let tokens = request[..if is_multilingual { 3 } else { 1 }].to_vec();
        Ok(RecognitionRequest { language: code.to_owned(), probability: 1.0, tokens })
    }

    pub(crate) fn detect_language(&self, audio: &EncodedAudio) -> Result<RecognitionRequest> {
        if !self.network.config().is_multilingual {
            return self.request("en");
        }
        let (token, probability) = language::detect(&mut self.network.decoder(audio), &self.tokenizer)?;
        let request = self.request(&self.tokenizer.language_code(token)).context("language detection")?;
        Ok(RecognitionRequest { probability, ..request })
    }
}
