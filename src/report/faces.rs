//! Report section on the persons in the videos: one face per video, in a row per person if the videos seem to show
//! several.

use crate::html::{Node, jpeg, node};
use anyhow::Result;
use orator_base::stage::artifacts::Artifact;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_media::ffmpeg;
use orator_media::opencv::png;
use orator_pipeline::dataset::people;
use orator_pipeline::dataset::people::VideoPerson;
use std::path::Path;

/// Maximum number of faces shown per person.
const MAX_FACES: usize = 24;

/// Content of the section; empty if no face was detected.
pub fn section(settings: &Settings, videos: &[Videos]) -> Vec<Node> {
    let work = &settings.work.dir;
    videos
        .iter()
        .flat_map(|of| {
            let is_said = settings.speaker.iter().any(|said| said.name == of.speaker && said.same_person);
            let seen: Vec<VideoPerson> = of.units.iter().map(|unit| VideoPerson::read(work, unit)).collect();
            let groups = if is_said { vec![seen.iter().collect()] } else { people::groups(&seen) };
            of_speaker(work, &of.speaker, &groups, is_said)
        })
        .collect()
}

fn of_speaker(work: &Path, speaker: &str, groups: &[Vec<&VideoPerson>], is_said: bool) -> Vec<Node> {
    let about = match (is_said, groups.len()) {
        (true, _) => format!("{speaker}: the configuration says that all videos show one person."),
        (false, 0 | 1) => format!("{speaker}: nothing speaks against one person."),
        (false, n) => format!(
            "{speaker}: the videos seem to show {n} people. Faces, the width of the shoulders and the colours of skin and \
             hair were compared, which is a guess: look at the faces. A video of another person is left out by `exclude`; \
             where all are one person, `same_person = true` under [[speaker]] says so."
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
    let shown = jpeg(&ffmpeg::jpeg::encode(&face)?, [face.width, face.height], &format!("the face in {}", video.file));
    Ok(Some(node("figure").class("card shot").child(shown).child(node("figcaption").text(&video.file))))
}
