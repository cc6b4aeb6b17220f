//! Annotations of a dataset: a table of all phases with their kinematics, and an ELAN file for every video.

use super::phase::{GesturePhase, PhaseKind, find_phases};
use super::totals::PhaseTotals;
use super::wrist_track::{HANDS, WristTrack};
use anyhow::{Context, Result};
use orator_base::audio::pauses::SpeechLevel;
use orator_base::stage::progress::Progress;
use orator_base::stage::rejection::Rejection;
use orator_base::stage::workdir;
use orator_dataset::index::SampleRef;
use orator_dataset::verify::verify::read_ledgers;
use orator_dataset::write::assemble::LedgerLine;
use orator_dataset::{Dataset, Split};
use orator_formats::eaf::{self, Annotation, AnnotationTier};
use orator_formats::mocap::motion_file::has_ending;
use orator_formats::transcript::Word;
use std::collections::BTreeMap;
use std::path::Path;

/// File name of the table of phases.
pub const PHASES: &str = "phases.csv";
/// Columns of the table: times in seconds from the first picture of the video, lengths in metres, height above the
/// midpoint of the shoulders; the word is that to which a stroke is bound ([`GesturePhase::bound_word`]).
const COLUMNS: &str = "video,hand,phase,start_s,end_s,confidence,amplitude_m,peak_speed_m_s,duration_s,height_m,word";
/// Shortest pause that divides the annotations of speech, seconds.
const MIN_SPEECH_PAUSE_SECS: f64 = 0.3;

/// Counts of what [`annotate`] wrote.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnnotationTotals {
    pub n_videos: usize,
    /// Phases of the left and the right hand.
    pub hands: [PhaseTotals; 2],
    /// Strokes in samples with words, and those of them that are bound to a word.
    pub n_with_words: usize,
    pub n_bound: usize,
}

/// Tiers of a video and its rows of the table.
#[derive(Default)]
struct VideoAnnotations {
    tiers: BTreeMap<String, Vec<Annotation>>,
    rows: Vec<Vec<String>>,
    /// Sound of imported motion.
    sound: Option<String>,
}

impl VideoAnnotations {
    fn add(&mut self, tier: &str, (start_secs, end_secs): (f64, f64), value: String) {
        self.tiers.entry(tier.to_owned()).or_default().push(Annotation { start_secs, end_secs, value });
    }
}

/// Writes `phases.csv` and `VIDEO.eaf` for every video of a dataset into the folder `out`. `media` returns the path of
/// a video or sound, given its file name, relative to `out`.
///
/// # Errors
/// A damaged sample, a file that cannot be written, or an error of `media`.
pub fn annotate(
    dataset: &Dataset,
    out: &Path,
    media: impl Fn(&str) -> Result<String>,
    progress: &dyn Progress,
) -> Result<AnnotationTotals> {
    let mut samples: BTreeMap<String, Vec<(usize, SampleRef)>> = BTreeMap::new();
    for sample in Split::ALL.into_iter().flat_map(|split| dataset.samples(split)) {
        let name = sample.key.to_string();
        let (video, first) = name.rsplit_once('-').unwrap_or((&name, "0"));
        let first = first.parse().with_context(|| format!("the key {name} does not end in its first frame"))?;
        samples.entry(video.to_owned()).or_default().push((first, sample));
    }
    let ledgers = read_ledgers(dataset.dir())?;
    let task = progress.begin("annotations", ledgers.len() as u64);
    let mut totals = AnnotationTotals { n_videos: ledgers.len(), ..AnnotationTotals::default() };
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(COLUMNS.split(','))?;
    for video in &ledgers {
        let mut samples = samples.remove(&video.name).unwrap_or_default();
        samples.sort_by_key(|(first, _)| *first);
        let mut annotations = VideoAnnotations::default();
        annotations.add_rejected(video);
        annotations.add_samples(dataset, &samples, video, &mut totals)?;
        annotations.rows.iter().try_for_each(|row| table.write_record(row))?;
        let sound = annotations.sound.as_deref();
        // The sound of a rejected take is not known.
        let is_rejected_take = sound.is_none() && has_ending(Path::new(&video.file));
        let path = if is_rejected_take { video.file.clone() } else { media(sound.unwrap_or(&video.file))? };
        let text = eaf::write(&path, &annotations.in_order());
        workdir::write_file(&out.join(format!("{}.eaf", video.name)), text.as_bytes())?;
        task.advance(1);
    }
    workdir::write_file(&out.join(PHASES), &table.into_inner()?)?;
    Ok(totals)
}

impl VideoAnnotations {
    fn add_rejected(&mut self, video: &LedgerLine) {
        for rejected in &video.ledger.rejected {
            let value = format!("{}: {}", Rejection::label(&rejected.reason), rejected.message);
            self.add("rejected", (rejected.start_secs, rejected.end_secs), value);
        }
        for failed in &video.ledger.failed {
            let value = format!("failed in {}: {}", failed.stage, failed.error);
            self.add("rejected", (failed.start_secs, failed.end_secs), value);
        }
    }

    /// Adds the speech, words and phases of the samples, which are given with their first frames.
    fn add_samples(
        &mut self,
        dataset: &Dataset,
        samples: &[(usize, SampleRef)],
        video: &LedgerLine,
        totals: &mut AnnotationTotals,
    ) -> Result<()> {
        let mut tracks = [const { Vec::new() }; 2];
        let mut words: Vec<Option<Vec<Word>>> = Vec::new();
        for (first, sample) in samples {
            let sample = dataset.read(sample)?;
            // ELAN plays the sound of imported motion.
            self.sound = sample.meta["imported"]["sound"].as_str().map(str::to_owned);
            let zero_secs = dataset.info().fps.secs(*first);
            for (tracks, (side, _)) in tracks.iter_mut().zip(HANDS) {
                tracks.push(WristTrack::new(&sample.motion, side));
            }
            let spoken = sample.words.as_deref().unwrap_or_default();
            for word in spoken {
                self.add("words", (zero_secs + word.start_secs, zero_secs + word.end_secs), word.word.clone());
            }
            let ranges = SpeechLevel::of(&sample.sound).speech_ranges(MIN_SPEECH_PAUSE_SECS);
            for range in ranges.iter().filter(|_| !dataset.info().no_sound) {
                let is_inside = |word: &&Word| range.contains(&f64::midpoint(word.start_secs, word.end_secs));
                let texts: Vec<&str> = spoken.iter().filter(is_inside).map(|word| word.word.as_str()).collect();
                self.add("speech", (zero_secs + range.start, zero_secs + range.end), texts.join(" "));
            }
            words.push(sample.words);
        }
        for ((tracks, (_, hand)), of_hand) in tracks.iter().zip(HANDS).zip(&mut totals.hands) {
            for (n, phases) in find_phases(tracks).iter().enumerate() {
                of_hand.add(phases, dataset.info().fps.secs(samples[n].1.n_frames));
                let zero_secs = dataset.info().fps.secs(samples[n].0);
                for phase in phases {
                    let words = words[n].as_deref().filter(|_| phase.kind == PhaseKind::Stroke);
                    let word = words.and_then(|words| phase.bound_word(words)).map(|word| word.word.as_str());
                    totals.n_with_words += usize::from(words.is_some());
                    totals.n_bound += usize::from(word.is_some());
                    let span = (zero_secs + phase.start_secs, zero_secs + phase.end_secs);
                    self.add(&format!("{} {hand}", phase.kind.name()), span, format!("{:.2}", phase.confidence));
                    self.rows.push(row(&video.name, hand, phase, span, word.unwrap_or_default()));
                }
            }
        }
        Ok(())
    }

    /// The tiers in the order in which ELAN shows them; all of them, so that files of one project have the same.
    fn in_order(mut self) -> Vec<AnnotationTier> {
        let hands = HANDS.into_iter();
        let hands = hands.flat_map(|(_, hand)| PhaseKind::ALL.map(|kind| format!("{} {hand}", kind.name())));
        let names = ["speech", "words"].map(str::to_owned).into_iter().chain(hands).chain(["rejected".to_owned()]);
        names.map(|name| AnnotationTier { annotations: self.tiers.remove(&name).unwrap_or_default(), name }).collect()
    }
}

/// Row of `COLUMNS`.
fn row(video: &str, hand: &str, phase: &GesturePhase, (start, end): (f64, f64), word: &str) -> Vec<String> {
    let numbers = [start, end, phase.confidence, phase.amplitude, phase.peak_speed, phase.secs(), phase.height];
    let numbers = numbers.map(|value| format!("{value:.3}"));
    let names = [video, hand, phase.kind.name()].map(str::to_owned);
    names.into_iter().chain(numbers).chain([word.to_owned()]).collect()
}
