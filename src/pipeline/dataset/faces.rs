//! Overview picture with one face per video; the videos of each person start a new row.

use super::persons::VideoPerson;
use anyhow::Result;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::workdir;
use orator_base::types::image::Image;
use orator_media::opencv::{draw, png};
use std::path::Path;

/// Width and height of a cell in px: the face, and below it the name of the video.
const CELL: [usize; 2] = [144, 160];
const FACE_PX: usize = 128;
const N_COLUMNS: usize = 8;
/// Largest number of rows.
const MAX_ROWS: usize = 40;
const PAPER: [u8; 3] = [255; 3];
const RULE: [u8; 3] = [170; 3];
const INK: [u8; 3] = [30; 3];

/// Writes the faces of groups of videos as PNG.
pub fn write(path: &Path, work: &Path, groups: &[Vec<&VideoPerson>]) -> Result<()> {
    let rows: Vec<(bool, &[&VideoPerson])> = groups
        .iter()
        .flat_map(|group| group.chunks(N_COLUMNS).enumerate().map(|(at, row)| (at == 0, row)))
        .take(MAX_ROWS)
        .collect();
    let mut sheet = Image::filled(N_COLUMNS * CELL[0], rows.len() * CELL[1], PAPER);
    let gap = (CELL[0] - FACE_PX) / 2;
    for (at, (begins_group, row)) in rows.iter().enumerate() {
        let top = at * CELL[1];
        if *begins_group && at > 0 {
            let y = top as f32 + 1.0;
            draw::line(&mut sheet, [0.0, y], [(N_COLUMNS * CELL[0]) as f32, y], 2.0, RULE)?;
        }
        for (column, video) in row.iter().enumerate() {
            let left = column * CELL[0];
            let file = Artifact::FacePicture.path(work, &video.unit);
            if file.exists() {
                let face = png::read(&file)?;
                draw::paste(&mut sheet, &face, [left + gap, top + gap]);
            }
            let name = truncate_to_cell(&video.file)?;
            draw::text(&mut sheet, &name, [(left + gap) as f32, (top + CELL[1] - 8) as f32], TEXT_PX, INK)?;
        }
    }
    workdir::replace(path, |attempt| png::write(attempt, &sheet))
}

/// Height of a capital letter, px.
const TEXT_PX: f32 = 7.0;

/// Truncates a name at the front to fit its cell, because names within a folder usually share their beginning.
fn truncate_to_cell(name: &str) -> Result<String> {
    let mut letters: Vec<char> = name.chars().map(|letter| if letter.is_ascii() { letter } else { '?' }).collect();
    while letters.len() > 3 && draw::text_width(&letters.iter().collect::<String>(), TEXT_PX)? > FACE_PX as f32 {
        letters.remove(0);
    }
    Ok(letters.into_iter().collect())
}
