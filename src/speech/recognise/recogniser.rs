//! Recognition window by window: each starts where the recognised text of the last one ends.

use super::segments::{WindowText, split_at_timestamps};
use crate::align::token_times::{FRAME_SECS, TokenTimes};
use crate::align::words::{shorten_long_words, words_of};
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

/// Text of a window.
pub(crate) struct HeardWindow {
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
            let audio = self.encode(source, &window, &spans)?;
            let request = match &mut request {
                Some(request) => request,
                none => none.insert(self.detect_language(&audio)?),
            };
            let last_secs = segments.last().map_or(0.0, |segment| segment.end_secs);
            let heard = self.transcribe(&audio, &window, request, (options.beam, &previous), last_secs)?;
            for (segment, tokens) in heard.segments {
                if spans.overlap(segment.start_secs, segment.end_secs) {
                    segments.push(segment);
                    previous.extend(tokens);
                }
            }
            if heard.temperature > MAX_PROMPT_TEMPERATURE {
                previous.clear();
            }
            previous.drain(..previous.len().saturating_sub(self.network.config().max_tokens));
            let next = ((heard.next_secs * RATE as f64) as usize / HOP * HOP).min(window.end);
            from = next.max(window.start + HOP);
            progress(from as f64 / RATE as f64);
        }
        let words = segments.iter_mut().flat_map(|segment| &mut segment.words);
        words.for_each(|word| self.correct_delay(word, n_samples));
        let (language, language_probability) = request.map_or((String::new(), 0.0), |it| (it.language, it.probability));
        Ok(Recognised { language, language_probability, segments })
    }

    /// Removes the delay of the network from the times of a word in a sound of `n_samples`.
    pub(crate) fn correct_delay(&self, word: &mut RecognisedWord, n_samples: usize) {
        let (delay, end) = (self.network.config().delay_secs(), n_samples as f64 / RATE as f64);
        // An end beyond that of the sound stays.
        let on_sound = |secs: f64| (secs - delay).clamp(0.0, secs.max(end));
        (word.start_secs, word.end_secs) = (on_sound(word.start_secs), on_sound(word.end_secs));
    }

    /// Decodes an encoded window with a beam search after the text `previous`. `last_secs` is the end of the speech before.
    pub(crate) fn transcribe(
        &self,
        audio: &EncodedAudio,
        window: &Range<usize>,
        request: &RecognitionRequest,
        (beam, previous): (usize, &[u32]),
        last_secs: f64,
    ) -> Result<HeardWindow> {
        let decoder = WindowDecoder {
            tokenizer: &self.tokenizer,
            rules: &self.rules,
            request: &request.tokens,
            max_tokens: self.network.config().max_tokens,
            beam: beam.max(1),
        };
        let decoded = decoder.decode(|| self.network.decoder(audio), previous, window.start as u64)?;
        let temperature = decoded.temperature;
        let [start_secs, end_secs] = [window.start, window.end].map(|at| at as f64 / RATE as f64);
        if decoded.is_silence() || decoded.is_repetitive() {
            return Ok(HeardWindow { segments: Vec::new(), next_secs: end_secs, temperature });
        }
        let text = split_at_timestamps(&decoded.tokens, self.tokenizer.timestamp_begin(), end_secs - start_secs);
        let WindowText { phrases, next_secs, is_complete } = text;
        let is_text = |token: &u32| *token < self.tokenizer.eot();
        let tokens: Vec<Vec<u32>> =
            phrases.iter().map(|phrase| phrase.tokens.iter().copied().filter(is_text).collect()).collect();
        let times = self.token_times(audio, request, &tokens.concat(), window.len())?;
        let (mut segments, mut first) = (Vec::new(), 0);
        for (phrase, tokens) in phrases.iter().zip(&tokens) {
            let mut words = words_of(&self.tokenizer, &request.language, tokens, &times, first);
            first += tokens.len();
            for word in &mut words {
                word.start_secs += start_secs;
                word.end_secs += start_secs;
            }
            segments.push(RecognisedSegment {
                start_secs: start_secs + phrase.start_secs,
                end_secs: start_secs + phrase.end_secs,
                text: self.tokenizer.decode(tokens).trim().to_owned(),
                words,
            });
        }
        shorten_long_words(&mut segments, last_secs);
        let last_word = segments.iter().rev().find_map(|segment| segment.words.last());
        let next = last_word.map(|word| word.end_secs).filter(|&secs| !is_complete && secs > start_secs);
        let found = segments.into_iter().zip(phrases);
        let found = found.filter(|(segment, phrase)| !segment.words.is_empty() && phrase.start_secs < phrase.end_secs);
        let segments = found.map(|(segment, phrase)| (segment, phrase.tokens)).collect();
        Ok(HeardWindow { segments, next_secs: next.unwrap_or(start_secs + next_secs), temperature })
    }

    /// Encodes a window; `spans` silence the rest.
    pub(crate) fn encode(
        &self,
        source: &mut SampleSource,
        window: &Range<usize>,
        spans: &SpeechSpans,
    ) -> Result<EncodedAudio> {
        let mut samples = source(window.clone())?;
        samples.resize(window.len(), 0.0);
        spans.silence(&mut samples, window.start);
        let mut mel = log_mel(&samples);
        // Frames after the end are no silence, but the mean of the scale, as in training.
        let n_frames = (window.len() / HOP).min(mel.ncols());
        mel.slice_mut(s![.., n_frames..]).fill(0.0);
        self.network.encode(mel.view())
    }

    /// Times of text tokens in an encoded window of `n_samples`.
    pub(crate) fn token_times(
        &self,
        audio: &EncodedAudio,
        request: &RecognitionRequest,
        text: &[u32],
        n_samples: usize,
    ) -> Result<TokenTimes> {
        let mut tokens = request.tokens.clone();
        tokens.push(self.tokenizer.no_timestamps());
        let n_prompt = tokens.len();
        let n_text = text.len().min(self.network.config().max_tokens - n_prompt - 1);
        tokens.extend(&text[..n_text]);
        tokens.push(self.tokenizer.eot());
        let attention = self.network.token_attention(audio, &tokens)?;
        let n_frames = (n_samples as f64 / RATE as f64 / FRAME_SECS) as usize;
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
