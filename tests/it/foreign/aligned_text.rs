//! `orator transcribe --text` on speech synthesised by espeak-ng, with known word times, by the model whisper-tiny-en.
//! `ORATOR_LONG=1` (`make prove`) aligns more than eight minutes of speech, otherwise half a minute.

use crate::fixtures::media::spoken::{KnownWord, SynthesisedSpeech};
use orator_formats::transcript::{Transcript, WordSource};
use std::process::Output;

const SENTENCES: [&str; 14] = [
    "Good evening, everybody.",
    "Today I want to talk about the way that people move their hands while they speak.",
    "When we explain something difficult, our fingers draw shapes in the air, and the listener understands us better.",
    "She paid 350 dollars for a ticket in 1998.",
    "Some researchers believe that gestures help the speaker to find the right words.",
    "Others think that they are a second language, older than the one we write.",
    "In my first year at the university, I watched hundreds of hours of video, and I counted every movement.",
    "Nobody paid me for that work.",
    "Please put the blue box next to the window.",
    "It's a matter of trust, and of patience.",
    "We went through the forest, across the river, and up the hill.",
    "The weather in Chicago was terrible last winter.",
    "Kubernetes and TypeScript are words no dictionary from that time contains.",
    "Can you hear me now, or should I speak a little louder?",
];
const UNRELATED_TEXT: &str = "the committee met on tuesday to consider a proposal from the ministry of agriculture \
    concerning the price of wheat and barley members asked whether farmers in the northern provinces would receive \
    any support during winter the chairman replied that money was short and that every department had been told to \
    save a tenth of its budget";

/// Speaks `n_sentences`, ordered so that none is repeated within a minute.
#[track_caller]
fn synthesise(n_sentences: usize) -> Option<SynthesisedSpeech> {
    let text: Vec<&str> = (0..n_sentences).map(|n| SENTENCES[(n * 5 + n / 14) % 14]).collect();
    SynthesisedSpeech::new(&text.join(" "), "en-us+f2", "whisper-tiny-en")
}

/// Transcript that the program writes for `text` and this speech, or its error output.
fn aligned(speech: &SynthesisedSpeech, file: &str, text: impl AsRef<[u8]>) -> Result<Transcript, String> {
    std::fs::write(speech.path(file), text).unwrap();
    let output = align(speech, "speech.wav", file, "out.words.json");
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    Ok(Transcript::read(&speech.path("out.words.json")).unwrap())
}

fn align(speech: &SynthesisedSpeech, sound: &str, text: &str, out: &str) -> Output {
    speech.transcribe(sound, out).args(["--text", text, "--language", "en"]).output().unwrap()
}

/// Sorted absolute errors of the boundaries of aligned words, seconds; `known` is `None` for a mismatched word.
fn boundary_errors(found: &Transcript, known: &[Option<(Option<f64>, Option<f64>)>]) -> Vec<f64> {
    assert_eq!(found.words.len(), known.len());
    let aligned = found.words.iter().zip(known).filter(|(word, _)| word.source == WordSource::Aligned);
    let mut errors: Vec<f64> = aligned
        .filter_map(|(word, known)| Some((word, (*known)?)))
        .flat_map(|(word, (start, end))| [start.map(|s| s - word.start_secs), end.map(|s| s - word.end_secs)])
        .flatten()
        .map(f64::abs)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Share of the words selected by `is_selected` that are marked as mismatched.
fn marked_share(found: &Transcript, is_selected: impl Fn(usize) -> bool) -> f64 {
    let selected: Vec<_> = (0..found.words.len()).filter(|&n| is_selected(n)).collect();
    let marked = selected.iter().filter(|&&n| found.words[n].source == WordSource::Interpolated);
    assert!(marked.clone().all(|&n| found.words[n].confidence == Some(0.0)));
    marked.count() as f64 / selected.len() as f64
}

#[test]
fn words_of_plain_text_are_aligned_to_the_audio() {
    let n_sentences = if std::env::var("ORATOR_LONG").is_ok() { 140 } else { 8 };
    let Some(speech) = synthesise(n_sentences) else { return };
    let text: Vec<&str> = speech.words.iter().map(|word| word.word.as_str()).collect();
    let found = aligned(&speech, "text.txt", text.join("\n")).unwrap();
    let times = |word: &KnownWord| (word.start_secs, word.end_secs);
    let known: Vec<_> = speech.words.iter().map(|word| Some(times(word))).collect();
    let errors = boundary_errors(&found, &known);
    let (median, p95) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
    let mismatched = marked_share(&found, |_| true);
    let secs = found.words.last().unwrap().end_secs;
    eprintln!(
        "{} words in {secs:.0} s: boundaries off by {:.0} ms (median), {:.0} ms (95 %); {:.1} % marked",
        text.len(),
        1000.0 * median,
        1000.0 * p95,
        100.0 * mismatched
    );
    assert!(median <= 0.06 && p95 <= 0.2 && mismatched <= 0.07, "{median} {p95} {mismatched}");
    assert!(n_sentences < 100 || secs > 480.0, "{secs}");
}

#[test]
fn mismatched_words_are_marked_and_do_not_shift_the_others() {
    let Some(speech) = synthesise(8) else { return };
    let other: Vec<&str> = UNRELATED_TEXT.split_whitespace().collect();
    let words = &speech.words;
    let is_replaced = |n: usize| n % 25 >= 20 && n / 25 < 3;
    // One spoken sentence is missing in the text.
    let chosen: Vec<usize> = (0..words.len()).filter(|n| !(32..42).contains(n)).collect();
    let text =
        chosen.iter().map(|&n| if is_replaced(n) { other[(5 * n) % other.len()] } else { words[n].word.as_str() });
    let found = aligned(&speech, "text.txt", text.collect::<Vec<_>>().join(" ")).unwrap();
    let known: Vec<_> =
        chosen.iter().map(|&n| (!is_replaced(n)).then_some((words[n].start_secs, words[n].end_secs))).collect();
    let errors = boundary_errors(&found, &known);
    let far = errors.iter().filter(|error| **error > 0.2).count() as f64 / errors.len() as f64;
    let (mismatched, matching) =
        (marked_share(&found, |n| is_replaced(chosen[n])), marked_share(&found, |n| !is_replaced(chosen[n])));
    eprintln!(
        "words marked: mismatched {mismatched:.2}, matching {matching:.2}; boundaries off by over 0.2 s: {far:.3}"
    );
    assert!(mismatched >= 0.7 && matching <= 0.15 && far <= 0.05, "{mismatched} {matching} {far}");

    let error = aligned(&speech, "other.txt", UNRELATED_TEXT).unwrap_err();
    assert!(error.contains("words match the") && error.contains("of audible speech"), "{error}");
}

#[test]
fn unalignable_input_is_an_error_with_its_location() {
    let Some(speech) = synthesise(1) else { return };
    let error = |file: &str, text: &[u8]| aligned(&speech, file, text).unwrap_err();
    assert!(error("text.txt", b"so\nsch\xf6n").contains("line 2: byte 0xf6"));
    assert!(error("text.txt", b" \n").contains("contains no words"));
    assert!(error("text.txt", "\u{434}\u{430} \u{43d}\u{435}\u{442}".as_bytes()).contains("of audible speech"));
    let (out, absent) = ("silent.words.json", speech.path("silent.words.json"));
    std::fs::write(speech.path("text.txt"), "Good evening").unwrap();
    // The WAV header of the speech, followed by silence.
    let mut silent = std::fs::read(speech.path("speech.wav")).unwrap();
    silent[44..].fill(0);
    std::fs::write(speech.path("silent.wav"), silent).unwrap();
    let output = align(&speech, "silent.wav", "text.txt", out);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("expected the transcript of audible speech")
            && !absent.exists()
    );
    let output = align(&speech, "text.txt", "text.txt", out);
    assert!(!output.status.success() && !absent.exists());
}
