//! `orator transcribe` on speech synthesised by espeak-ng with known words and times, beside faster-whisper where
//! Python has it, and on sounds without words. `ORATOR_LONG=1` (`make prove`) uses 20 minutes of four voices and ten
//! minutes without words, otherwise half a minute of each.

use crate::fixtures::clips::ffmpeg;
use crate::fixtures::media::spoken::{SynthesisedSpeech, WordComparison};
use crate::robustness::memory::peak_mib;
use orator_base::types::sound::Sound;
use orator_formats::transcript::{Transcript, Word};
use orator_formats::wav;
use orator_test_support::skip::{fetched_model, python};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f32::consts::TAU;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Eighty English sentences.
const SENTENCES: &str = include_str!("../../../fixtures/reference/spoken_sentences.txt");
const VOICES: [&str; 4] = ["en-us", "en-us+f2", "en-gb+m3", "en-gb-x-rp+f4"];
const MODEL: &str = "whisper-tiny-en";
const GERMAN: &str = "Guten Abend. Heute sprechen wir von dem Wetter. In den Bergen liegt noch Schnee, aber im Tal war \
    es schon warm. Morgen kommt der Regen, und am Sonntag scheint wieder die Sonne.";
const RATE: u32 = 16_000;

fn is_long() -> bool {
    std::env::var("ORATOR_LONG").is_ok()
}

/// The sentences in an order of their own for each voice.
fn text(voice: usize, n_sentences: usize) -> String {
    let sentences: Vec<&str> = SENTENCES.lines().collect();
    let chosen = (0..n_sentences).map(|n| sentences[(n * 27 + voice * 20) % sentences.len()]);
    chosen.collect::<Vec<_>>().join(" ")
}

fn words(path: &Path) -> Vec<Word> {
    Transcript::read(path).unwrap().words
}

/// Words that the program recognises in a sound of the folder of `speech`.
#[track_caller]
fn recognised(speech: &SynthesisedSpeech, sound: &str, arguments: &[&str]) -> Vec<Word> {
    let output = speech.transcribe(sound, "words.json").args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    words(&speech.path("words.json"))
}

#[test]
fn words_of_synthesised_speech_are_recognised_with_their_times() {
    let (n_voices, n_sentences) = if is_long() { (4, 80) } else { (1, 8) };
    let faster_whisper = if is_long() { python("faster_whisper") } else { None };
    let (mut ours, mut theirs) = (WordComparison::default(), WordComparison::default());
    let (mut secs, mut our_secs, mut their_secs, mut peak) = (0.0, 0.0, 0.0, 0.0_f64);
    for (n, voice) in VOICES.iter().enumerate().take(n_voices) {
        let Some(speech) = SynthesisedSpeech::new(&text(n, n_sentences), voice, MODEL) else { return };
        secs += speech.words.iter().filter_map(|word| word.end_secs).fold(0.0, f64::max);
        let mut command = speech.transcribe("speech.wav", "words.json");
        command.args(["--language", "en"]).stdout(Stdio::null()).stderr(Stdio::null());
        let started = Instant::now();
        peak = peak.max(peak_mib(command.spawn().unwrap()));
        our_secs += started.elapsed().as_secs_f64();
        ours.add(&speech.words, &words(&speech.path("words.json")));
        if let Some(python) = &faster_whisper {
            let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/faster_whisper_words.py");
            let files = [speech.models.join(MODEL), speech.path("speech.wav"), speech.path("theirs.json")];
            let started = Instant::now();
            assert!(Command::new(python).arg(script).args(&files).status().unwrap().success());
            their_secs += started.elapsed().as_secs_f64();
            theirs.add(&speech.words, &words(&files[2]));
        }
    }
    ours.print(&format!("orator, {secs:.0} s of speech in {our_secs:.0} s, {peak:.0} MiB"));
    if faster_whisper.is_some() {
        theirs.print(&format!("faster-whisper, in {their_secs:.0} s"));
        assert!(our_secs <= 1.3 * their_secs, "{our_secs:.0} s, faster-whisper {their_secs:.0} s");
    }
    let [median, p95] = ours.boundary_errors();
    let max_error_rate = if is_long() { 0.12 } else { 0.2 };
    assert!(ours.error_rate() <= max_error_rate, "{}", ours.error_rate());
    assert!(median <= 0.06 && p95 <= 0.2 && peak <= 600.0, "{median} {p95} {peak}");
    assert!(!is_long() || secs >= 1200.0 && ours.n_spoken >= 2000, "{secs} {}", ours.n_spoken);
}

#[test]
fn speech_at_8_khz_is_recognised() {
    let Some(speech) = SynthesisedSpeech::new(&text(0, 8), VOICES[0], MODEL) else { return };
    if !ffmpeg(&speech.path(""), "-i speech.wav -ar 8000 narrow.wav") {
        return;
    }
    let mut narrow = WordComparison::default();
    narrow.add(&speech.words, &recognised(&speech, "narrow.wav", &["--language", "en"]));
    narrow.print("8 kHz");
    assert!(narrow.error_rate() <= 0.35, "{}", narrow.error_rate());
}

#[test]
fn two_languages_in_one_sound_are_a_transcript_in_the_first() {
    let Some(english) = SynthesisedSpeech::new(&text(0, 8), VOICES[0], "whisper-base") else { return };
    let Some(german) = SynthesisedSpeech::new(GERMAN, "de", "whisper-base") else { return };
    let german = german.path("speech.wav");
    let join = format!("-i speech.wav -i {} -filter_complex [0:a][1:a]concat=v=0:a=1 both.wav", german.display());
    if !ffmpeg(&english.path(""), &join) {
        return;
    }
    let found = recognised(&english, "both.wav", &[]);
    let end_secs = english.words.iter().filter_map(|word| word.end_secs).fold(0.0, f64::max);
    let (first, second): (Vec<Word>, Vec<Word>) = found.into_iter().partition(|word| word.start_secs < end_secs);
    let mut compared = WordComparison::default();
    compared.add(&english.words, &first);
    compared.print("English before German");
    eprintln!("German: {}", second.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" "));
    assert!(compared.error_rate() <= 0.3 && !second.is_empty(), "{} {}", compared.error_rate(), second.len());
}

/// Silence, noise and music of `secs` each.
fn sounds_without_words(secs: usize) -> Vec<(&'static str, Vec<f32>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(47);
    let n = secs * RATE as usize;
    let white: Vec<f32> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut poles = [0.0_f32; 3];
    let pink = white.iter().map(|value| {
        let filters = [(0.998, 0.099), (0.963, 0.297), (0.57, 1.053)];
        poles.iter_mut().zip(filters).for_each(|(pole, (decay, gain))| *pole = *pole * decay + value * gain);
        poles.iter().sum::<f32>() + 0.185 * value
    });
    let pink: Vec<f32> = pink.collect();
    let mut level = 0.0_f32;
    let brown = white.iter().map(|value| {
        level = 0.995 * level + value;
        level
    });
    let brown: Vec<f32> = brown.collect();
    let secs_of = |n: usize| n as f32 / RATE as f32;
    let wave = |hertz: f32, n: usize| (TAU * (hertz * secs_of(n)).fract()).sin();
    let tone = (0..n).map(|n| wave(220.0, n)).collect();
    // Four chords of three notes with overtones, each struck once a second.
    let chord = |n: usize| {
        let root = [220.0_f32, 174.6, 261.6, 196.0][n / (2 * RATE as usize) % 4];
        let notes =
            [1.0_f32, 1.26, 1.5].into_iter().flat_map(|note| [1.0_f32, 2.0, 3.0].map(|overtone| (note, overtone)));
        let sum: f32 = notes.map(|(note, overtone)| wave(root * note * overtone, n) / overtone).sum();
        sum * (-2.0 * secs_of(n % RATE as usize)).exp()
    };
    let chords: Vec<f32> = (0..n).map(chord).collect();
    // A melody and drums with the chords.
    let music = (0..n).map(|n| {
        let (note, beat) = (n / (RATE as usize / 4), secs_of(n % (RATE as usize / 2)));
        let hertz = [440.0_f32, 494.0, 523.0, 587.0, 659.0, 698.0, 784.0][note * 5 % 7];
        let melody = wave(hertz, n) + 0.5 * wave(2.0 * hertz, n) + 0.3 * wave(3.0 * hertz, n);
        melody + 0.5 * chords[n] + 2.0 * white[n] * (-20.0 * beat).exp()
    });
    let music = music.collect();
    let silence = vec![0.0; n];
    vec![
        ("silence", silence),
        ("white", white),
        ("pink", pink),
        ("brown", brown),
        ("tone", tone),
        ("chords", chords),
        ("music", music),
    ]
}

#[test]
fn no_word_is_invented_in_silence_noise_and_music() {
    let (Some(models), Some(_)) =
        (fetched_model("whisper-tiny-en/model.bin"), fetched_model("silero_vad_16k_op15.onnx"))
    else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let sounds = sounds_without_words(if is_long() { 90 } else { 5 });
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["transcribe", "--language", "en", "--out", "words"]).current_dir(dir.path());
    command.arg("--set").arg(format!("models.dir={}", models.display()));
    for (name, samples) in &sounds {
        let power = samples.iter().map(|value| value * value).sum::<f32>() / samples.len() as f32;
        let scale = 0.1 / power.sqrt().max(0.1);
        let samples = samples.iter().map(|value| (value * scale).clamp(-1.0, 1.0)).collect();
        wav::write(&dir.path().join(name).with_extension("wav"), &Sound { rate: RATE, samples }).unwrap();
        command.arg(format!("{name}.wav"));
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for (name, _) in &sounds {
        let found = words(&dir.path().join(format!("words/{name}.json")));
        let found: Vec<&str> = found.iter().map(|word| word.word.as_str()).collect();
        assert!(found.is_empty(), "{name}: {found:?}");
    }
}
