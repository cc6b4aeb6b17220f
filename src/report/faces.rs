//! Report section on the persons in the videos: one face per video, in a row per person if the videos seem to show
//! several.

use crate::html::{Node, jpeg, node};
use anyhow::Result;
use orator_base::stage::artifacts::Artifact;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_media::ffmpeg;
use orator_media::opencv::png;
use orator_pipeline::dataset::persons::{self, VideoPerson};
use std::path::Path;

/// Maximum number of faces shown per person.
const MAX_FACES: usize = 24;

/// Content of the section; empty if no face was detected.
pub fn section(settings: &Settings, videos: &[Videos]) -> Vec<Node> {
    let work = &settings.work.dir;
    videos
        .iter()
        .flat_map(|of| {
            let is_declared = settings.speaker.iter().any(|entry| entry.name == of.speaker && entry.same_person);
            let persons: Vec<VideoPerson> = of.units.iter().map(|unit| VideoPerson::read(work, unit)).collect();
            let groups = if is_declared { vec![persons.iter().collect()] } else { persons::groups(&persons) };
            of_speaker(work, &of.speaker, &groups, is_declared)
        })
        .collect()
}

fn of_speaker(work: &Path, speaker: &str, groups: &[Vec<&VideoPerson>], is_declared: bool) -> Vec<Node> {
    let about = match (is_declared, groups.len()) {
        (true, _) => format!("{speaker}: all videos show the same person (`same_person = true` in the configuration)."),
        (false, 0 | 1) => format!("{speaker}: all videos appear to show the same person."),
        (false, n) => format!(
            "{speaker}: the videos appear to show {n} persons, an estimate from faces, shoulder width and the colours \
             of skin and hair. Check the faces: exclude videos of another person with `exclude`, or set `same_person = \
             true` under [[speaker]] if all videos show the same person."
        ),
    };
    let rows = groups.iter().enumerate().filter_map(|(at, group)| {
        let cards: Vec<Node> =
            group.iter().take(MAX_FACES).filter_map(|video| card(work, video).ok().flatten()).collect();
        let title = node("h3").class("rule").child(node("span").text(format!("{speaker}, person {}", at + 1)));
        (!cards.is_empty())
            .then(|| node("div").class("gallery").child(title).child(node("div").class("shots").children(cards)))
    });
    let rows: Vec<Node> = rows.collect();
    if rows.is_empty() { Vec::new() } else { std::iter::once(node("p").text(about)).chain(rows).collect() }
}

fn card(work: &Path, video: &VideoPerson) -> Result<Option<Node>> {
    let path = Artifact::FacePicture.path(work, &video.unit);
    if !path.exists() {
        return Ok(None);
    }
    let face = png::read(&path)?;
    let shown = jpeg(&ffmpeg::jpeg::encode(&face)?, [face.width, face.height], &format!("Face in {}", video.file));
    Ok(Some(node("figure").class("card shot").child(shown).child(node("figcaption").text(&video.file))))
}
