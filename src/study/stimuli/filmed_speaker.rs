//! Speakers with their clips, the performance of each condition for each clip, and the clips' sounds at equal loudness:
//! everything that is rendered into films.

use super::condition_motion::{CommonBody, CommonVisibility, ConditionModels, ShownMotion, motions, sound_of};
use super::cut::{CutSpeech, MAX_HIDDEN, StudyClip, cut};
use super::film::{self, FilmScene};
use super::speaker_source::SpeakerSource;
use crate::file::{StudyCondition, StudyFile, StudySpeaker};
use crate::pages::assets::SOUND_CHECK_TONES;
use crate::plan::{FilmContent, FilmSound};
use anyhow::{Context, Result, bail, ensure};
use orator_avatar::animate::Performance;
use orator_avatar::animate::export::film_avatar::AvatarStage;
use orator_base::audio::loudness;
use orator_base::stage::progress::Progress;
use orator_base::types::sound::{Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_formats::mocap::motion_file::DEFAULT_FPS;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Target loudness of all films, LUFS (EBU R 128); lowered if a clip would exceed `MAX_AMPLITUDE`.
pub const LOUDNESS_LUFS: f64 = -23.0;
/// Maximum amplitude, relative to full scale.
const MAX_AMPLITUDE: f64 = 0.9;
/// Duration of the fades at the ends of a sound, which avoid clicks, seconds.
const FADE_SECS: f64 = 0.01;

/// Tones of the sound check: frequency in Hz, audible on small loudspeakers too, and amplitude.
const TONE_HZ: f64 = 700.0;
const TONE_AMPLITUDE: f64 = 0.1;
/// Maximum duration of a tone, and duration of its fades, seconds.
const MAX_TONE_SECS: f64 = 0.4;
const TONE_FADE_SECS: f64 = 0.02;

/// Speaker whose speech has been cut into clips.
pub struct CutSpeaker {
    source: SpeakerSource,
    models: ConditionModels,
    pub cut: CutSpeech,
    /// Sounds of the clips, as long as the films.
    pub sounds: Vec<Sound>,
    /// Sound of the sound check, equally long; `None` without clips.
    pub tones: Option<Sound>,
}

pub struct FilmedSpeaker {
    clips: Vec<StudyClip>,
    sounds: Vec<Sound>,
    tones: Option<Sound>,
    film_fps: FrameRate,
    /// By condition, then by clip: index of the clip of the motion, and the motion on the rig.
    performances: BTreeMap<String, Vec<(usize, Performance)>>,
    /// By mismatched condition whose other clips the design draws, then by clip: the motions that it may show.
    drawn: BTreeMap<String, Vec<ShownMotion>>,
    visibilities: Vec<CommonVisibility>,
    body: CommonBody,
    stage: AvatarStage,
}

impl CutSpeaker {
    pub fn name(&self) -> &str {
        &self.source.name
    }

    /// Cuts `n_clips` clips of a speaker, or fewer if there are no more; `rank` orders clips of equal grade.
    pub fn new(file: &StudyFile, speaker: &StudySpeaker, n_clips: usize, rank: impl Fn(&str) -> u64) -> Result<Self> {
        let name = &speaker.name;
        let models = ConditionModels::open(&file.condition, name)?;
        let source = match (&speaker.dataset, &speaker.sounds) {
            (Some(dataset), _) => SpeakerSource::of_dataset(name, dataset, speaker.split)?,
            (None, Some(sounds)) => SpeakerSource::of_sounds(name, sounds, models.fps().unwrap_or(DEFAULT_FPS))?,
            (None, None) => bail!("the speaker {name} has neither a dataset nor sounds"),
        };
        let fps = source.fps;
        let counts = (n_clips, file.clips.stroke_rate_groups);
        let cut = cut(&source, fps.frames_in(file.clips.seconds), counts, rank)?;
        let film_fps = film::film_fps(file.films.layout, fps);
        let mut sounds = Vec::new();
        for of_segment in cut.clips.chunk_by(|a, b| a.segment == b.segment) {
            let segment = source.read(of_segment[0].segment)?;
            for clip in of_segment {
                let n_film_frames = film_fps.frames_in(fps.secs(clip.frames.len()));
                let mut samples = sound_of(&segment, clip, fps);
                samples.resize(sample_at(film_fps, segment.sound.rate, n_film_frames), 0.0);
                sounds.push(fade_ends(Sound { rate: segment.sound.rate, samples }));
            }
        }
        let tones = sounds.first().map(|sound| tones(SOUND_CHECK_TONES, sound.rate, sound.samples.len()));
        Ok(Self { source, models, cut, sounds, tones })
    }

    /// Retargets the motion of every condition to the common rig, for films of `size` px.
    ///
    /// # Errors
    /// A condition has no motion for a clip.
    pub fn filmed(self, file: &StudyFile, size: [usize; 2], progress: &dyn Progress) -> Result<FilmedSpeaker> {
        let Self { source, models, cut, sounds, tones } = self;
        let n_segments = cut.clips.chunk_by(|a, b| a.segment == b.segment).count();
        let task = progress.begin(&format!("motion of {}", source.name), n_segments as u64);
        let drawn = file.drawn_conditions();
        let is_drawn = |condition: &&StudyCondition| drawn.contains_key(condition.name.as_str());
        let conditions: Vec<_> = file.condition.iter().filter(|condition| !is_drawn(condition)).cloned().collect();
        let motions = motions(&source, &cut.clips, &conditions, &models, &|| task.advance(1))?;
        drop(task);
        let drawn = drawn.into_iter().filter_map(|(name, of)| Some((name.to_owned(), motions.get(of)?.clone())));
        let drawn: BTreeMap<String, Vec<ShownMotion>> = drawn.collect();
        let all: Vec<&ShownMotion> = motions.values().flatten().collect();
        let body = CommonBody::of(&source.bone_lengths, &all);
        let visibility = |clip: usize| {
            let own: Vec<&ShownMotion> = motions.values().map(|of_condition| &of_condition[clip]).collect();
            // The films of a clip are shared by participants for whom different motions are drawn.
            let of_clip: Vec<&ShownMotion> = own.iter().copied().chain(drawn.values().flatten()).collect();
            let [of_own, of_all] = [&own, &of_clip].map(|shown| CommonVisibility::of(shown));
            let (of_own, of_all) = of_own.zip(of_all).context("the study has no conditions")?;
            ensure!(
                of_all.n_visible() as f64 >= (1.0 - MAX_HIDDEN) * of_own.n_visible() as f64,
                "the motions drawn for mismatched films have too many undetected joints, which would be hidden in all \
                 films of {}: set mismatched = \"fixed\" in [clips]",
                source.name
            );
            Ok(of_all)
        };
        let visibilities: Vec<CommonVisibility> = (0..cut.clips.len()).map(visibility).collect::<Result<_>>()?;
        let task = progress.begin(&format!("avatar of {}", source.name), all.len() as u64);
        let performances: BTreeMap<String, Vec<(usize, Performance)>> = motions
            .iter()
            .map(|(condition, shown)| {
                let performed = shown.par_iter().zip(&visibilities).map(|(shown, visibility)| {
                    let performance = visibility.performance(shown, &body);
                    task.advance(1);
                    (shown.of, performance)
                });
                (condition.clone(), performed.collect())
            })
            .collect();
        drop(task);
        let shown: Vec<&Performance> = performances.values().flatten().map(|(_, performance)| performance).collect();
        let layout = file.films.layout;
        let stage = film::stage(layout, &shown, size);
        let stage = stage.with_context(|| format!("the speaker {} has no clips", source.name))?;
        let (clips, film_fps) = (cut.clips, film::film_fps(layout, source.fps));
        Ok(FilmedSpeaker { clips, sounds, tones, film_fps, performances, drawn, visibilities, body, stage })
    }
}

/// Normalises all sounds to the same loudness and returns it, LUFS; silent sounds are left unchanged.
pub fn normalise_loudness<'s>(sounds: impl Iterator<Item = &'s mut Sound>) -> f64 {
    let measured: Vec<(&mut Sound, f64)> =
        sounds.filter_map(|sound| loudness::integrated(sound).map(|lufs| (sound, lufs))).collect();
    let loudest = |(sound, lufs): &(&mut Sound, f64)| {
        let peak = sound.samples.iter().map(|v| f64::from(v.abs())).fold(1e-9, f64::max);
        lufs + 20.0 * (MAX_AMPLITUDE / peak).log10()
    };
    let target = measured.iter().map(loudest).fold(LOUDNESS_LUFS, f64::min);
    for (sound, lufs) in measured {
        let gain = 10f64.powf((target - lufs) / 20.0) as f32;
        sound.samples.iter_mut().for_each(|sample| *sample *= gain);
    }
    target
}

impl FilmedSpeaker {
    fn find(&self, clip: &str) -> Option<usize> {
        let name = clip.rsplit('/').next().unwrap_or(clip);
        self.clips.iter().position(|known| known.name == name)
    }

    /// Name `speaker/clip` of the clip whose motion the left avatar shows in this film, unless the design draws it.
    pub fn motion_of(&self, content: &FilmContent) -> Result<String> {
        let (of, _) = self.shown(content)?;
        Ok(format!("{}/{}", content.speaker, self.clips[*of].name))
    }

    fn shown(&self, content: &FilmContent) -> Result<&(usize, Performance)> {
        let missing = || format!("no motion for the clip {} in the condition {}", content.clip, content.condition);
        let clip = self.find(&content.clip).with_context(missing)?;
        self.performances.get(&content.condition).and_then(|of_condition| of_condition.get(clip)).with_context(missing)
    }

    /// Performance of the left avatar of the film with this content, at the film's rate.
    fn performance(&self, content: &FilmContent) -> Result<Performance> {
        if let Some(motions) = self.drawn.get(&content.condition) {
            let missing = || format!("no motion of the clip {} for the clip {}", content.motion_of, content.clip);
            let visibility = self.find(&content.clip).and_then(|clip| self.visibilities.get(clip));
            let motion = self.find(&content.motion_of).and_then(|of| motions.get(of));
            let (visibility, motion) = visibility.zip(motion).with_context(missing)?;
            return Ok(visibility.performance(motion, &self.body).resampled(self.film_fps));
        }
        let (_, performance) = self.shown(content)?;
        Ok(performance.resampled(self.film_fps))
    }

    /// Performances of the film with this content at the film's rate, left to right.
    pub fn performances(&self, content: &FilmContent) -> Result<Vec<Performance>> {
        let right = content.right_alone().map(|right| self.performance(&right));
        std::iter::once(self.performance(content)).chain(right).collect()
    }

    pub fn scene<'a>(&'a self, content: &FilmContent, performances: &'a [Performance]) -> FilmScene<'a> {
        let sound = match content.sound {
            FilmSound::Speech => self.find(&content.clip).and_then(|clip| self.sounds.get(clip)),
            FilmSound::Silence => None,
            FilmSound::Tones => self.tones.as_ref(),
        };
        FilmScene { performances, stage: &self.stage, sound, number: content.number }
    }
}

fn fade_ends(mut sound: Sound) -> Sound {
    let n = ((FADE_SECS * f64::from(sound.rate)) as usize).min(sound.samples.len());
    let length = sound.samples.len();
    for at in 0..n {
        let gain = at as f32 / n as f32;
        sound.samples[at] *= gain;
        sound.samples[length - 1 - at] *= gain;
    }
    sound
}

/// The sound check: `n` evenly spaced tones separated by silence of at least their duration, over `length` samples.
pub fn tones(n: usize, rate: u32, length: usize) -> Sound {
    let rate_hz = f64::from(rate.max(1));
    let apart = length as f64 / rate_hz / (n + 1) as f64;
    let secs = (apart / 2.0).min(MAX_TONE_SECS);
    let fade = TONE_FADE_SECS.min(secs / 4.0);
    let sample = |at: usize| {
        let time = at as f64 / rate_hz;
        let nearest = (time / apart).round().clamp(1.0, n.max(1) as f64);
        let left = secs / 2.0 - (time - nearest * apart).abs();
        let gain = if n == 0 { 0.0 } else { (left / fade).clamp(0.0, 1.0) };
        (TONE_AMPLITUDE * (0.5 - 0.5 * (PI * gain).cos()) * (TAU * TONE_HZ * time).sin()) as f32
    };
    Sound { rate, samples: (0..length).map(sample).collect() }
}
