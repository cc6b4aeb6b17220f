//! Stage `extract`. Writes the audio (16 kHz mono s16, its first sample at the first picture; absent without audio),
//! the `Timeline` at the dataset rate, `MediaInfo` and, on request, the pictures as PNG.

use super::reading;
use super::spans;
use super::survey::PictureSurvey;
use crate::sound::extract_wav;
use anyhow::Result;
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_base::text::{counted, length};
use orator_base::types::image::PictureOptions;
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::config::{self, Config, videos};
use orator_formats::media_json::MediaInfo;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::{self, origin};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Stage `extract` for videos.
pub struct ExtractStage {
    settings: config::ExtractConfig,
    /// Per speaker, the entries that name mirrored videos; `folder` is the base of relative paths.
    mirrored: Vec<(String, Vec<String>)>,
    folder: PathBuf,
}

impl ExtractStage {
    /// Creates a stage without mirrored videos.
    pub fn new(settings: &config::ExtractConfig) -> Self {
        Self { settings: settings.clone(), mirrored: Vec::new(), folder: PathBuf::new() }
    }

    /// Creates the stage from a configuration, with the videos that it marks as mirrored.
    pub fn of_config(config: &Config) -> Self {
        let mirrored = config.settings.speaker.iter().map(|speaker| (speaker.name.clone(), speaker.mirrored.clone()));
        let folder = config.file.parent().unwrap_or(Path::new(".")).to_owned();
        Self { settings: config.settings.extract.clone(), mirrored: mirrored.collect(), folder }
    }

    fn is_mirrored(&self, unit: &Unit) -> bool {
        let of_speaker = self.mirrored.iter().filter(|(speaker, _)| *speaker == unit.speaker);
        of_speaker.flat_map(|(_, entries)| entries).any(|entry| videos::names(entry, &unit.source, &self.folder))
    }
}

impl Stage for ExtractStage {
    fn name(&self) -> &'static str {
        StageName::Extract.as_str()
    }

    fn version(&self) -> u32 {
        6
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        // The audio offset is measured and corrected by later stages, so `fix_offset` does not affect this one.
        let mut settings = json!(self.settings);
        settings.as_object_mut().map(|settings| settings.remove("fix_offset"));
        json!({
            "extract": settings,
            "sample_rate": SAMPLE_RATE,
            "mirrored": self.is_mirrored(unit),
            "ffmpeg": ffmpeg::version(),
        })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        Ok(vec![Input { role: "video".into(), path: unit.source.clone() }])
    }

    /// Reads the pictures once, and again for each of: an active area smaller than the picture, and export as PNG.
    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let rate = self.settings.rate();
        let mut pictures = PictureOptions { mirrored: self.is_mirrored(unit), deinterlace: false };
        let open = |pictures| Ok::<_, anyhow::Error>(FrameReader::open(&unit.source, rate)?.with_options(pictures));
        let mut reader = open(pictures)?;
        let hdr = reader.hdr().map(str::to_owned);
        let mut survey = PictureSurvey::new(rate);
        let mut read = reading::read(&mut reader, rate, None, Some(&mut survey), progress)?;
        pictures.deinterlace = survey.is_interlaced();
        let active_area = survey.active_area();
        if active_area.is_some() {
            read = reading::read(&mut open(pictures)?, rate, active_area, None, progress)?;
        }
        if self.settings.keep_frames {
            reading::write_pictures(&mut open(pictures)?, &Artifact::Frames.within(out), progress)?;
        }
        // Joined recordings cannot be sought, so they are one span.
        if reader.damage().is_none() && reader.joins_secs().is_empty() {
            spans::mark(&mut read, || open(pictures), active_area, rate)?;
        }
        let timeline = read.timeline;
        timeline.write(&Artifact::Timeline.within(out))?;
        let sound = Artifact::Sound.within(out);
        let sound = extract_wav(&unit.source, self.settings.audio_track, &sound, SAMPLE_RATE)?;
        let audio_secs = sound.as_ref().map(|sound| sound.secs);
        let audio_tracks = sound.as_ref().map(|sound| sound.tracks.clone()).filter(|tracks| tracks.n_tracks > 1);

        let n_frames = timeline.n_frames();
        let n_cuts = timeline.restart.iter().filter(|restart| **restart).count();
        let opposite_phase_secs = sound.as_ref().map_or(0.0, |sound| sound.opposite_phase_secs);
        let damage: Vec<String> = reader.damage().into_iter().chain(sound.and_then(|sound| sound.damage)).collect();
        let damage = (!damage.is_empty()).then(|| damage.join(", "));
        let video = reader.info().video.as_ref();
        let media = MediaInfo {
            duration_secs: reader.duration_secs(),
            n_frames,
            fps: rate,
            image_size: reader.image_size(),
            rotation: video.map(|video| video.rotation),
            codec: video.map(|video| video.codec.clone()),
            source_fps: video.and_then(|video| video.fps),
            has_audio: audio_secs.is_some(),
            audio_secs,
            damage,
            pictures,
            active_area,
            hdr,
            n_resizes: read.n_resizes,
            audio_tracks,
            first_image_secs: origin::start_secs(&unit.source)?,
            joins_secs: reader.joins_secs(),
            opposite_phase_secs,
            keypoints_from: None,
        };
        media.write(&Artifact::MediaInfo.within(out))?;

        let sound = audio_secs.map_or("no audio".to_owned(), |secs| format!("{} of audio", length(secs)));
        let cuts = counted(n_cuts, "cut");
        let mut facts = serde_json::to_value(&media)?.as_object().cloned().unwrap_or_default();
        facts.insert("n_cuts".into(), n_cuts.into());
        let note = |damage: &String| format!("; the file is damaged, its readable part is used: {damage}");
        let damage = media.damage.as_ref().map(note).unwrap_or_default();
        let notes = media.notes().iter().fold(String::new(), |text, note| text + "; " + note);
        Ok(Report { line: format!("{} at {rate}, {cuts}, {sound}{notes}{damage}", counted(n_frames, "frame")), facts })
    }
}

/// Picture options that `extract` determined for `unit`; the defaults if it has not run.
pub fn picture_options(work: &Path, unit: &Unit) -> PictureOptions {
    MediaInfo::read(&Artifact::MediaInfo.path(work, unit))
        .map_or_else(|_| PictureOptions::default(), |media| media.pictures)
}
