//! Overview picture with one face per video; the videos of each person start a new row.

use super::persons::VideoPerson;
use anyhow::Result;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::workdir;
use orator_base::types::image::Image;
use orator_media::opencv::{draw, png};
use std::path::Path;

/// Width and height of a cell in px: the face, and below it the name of the video.
const CELL: [usize; 2] = [144, 186];
const FACE_PX: usize = 128;
const N_COLUMNS: usize = 8;
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
            for (number, line) in lines(&video.file)?.iter().enumerate() {
                let y = top + gap + FACE_PX + LINE_PX * (number + 1);
                draw::text(&mut sheet, line, [(left + gap) as f32, y as f32], TEXT_PX, INK)?;
            }
        }
    }
    workdir::replace(path, |attempt| png::write(attempt, &sheet))
}

/// Height of a capital letter, px.
const TEXT_PX: f32 = 7.0;

/// Distance of two lines of a name, px, and largest number of lines.
const LINE_PX: usize = 14;
const MAX_LINES: usize = 3;

/// Lines of a name in its cell. Of a longer name the end is shown: names in a folder usually share their beginning.
fn lines(name: &str) -> Result<Vec<String>> {
    let (mut lines, mut line) = (Vec::new(), String::new());
    for letter in name.chars().map(|letter| if letter.is_ascii() { letter } else { '?' }) {
        if draw::text_width(&format!("{line}{letter}"), TEXT_PX)? > FACE_PX as f32 {
            lines.push(std::mem::take(&mut line));
        }
        line.push(letter);
    }
    lines.push(line);
    let n_omitted = lines.len().saturating_sub(MAX_LINES);
    let mut shown = lines.split_off(n_omitted);
    if let Some(first) = shown.first_mut().filter(|_| n_omitted > 0) {
        *first = format!("...{}", first.chars().skip(3).collect::<String>());
    }
    Ok(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_wrapped_instead_of_cut() {
        let name = "interview-with-a-long-name-2021-05-14.mp4";
        let wrapped = lines(name).unwrap();
        assert!((2..=MAX_LINES).contains(&wrapped.len()) && wrapped.concat() == name, "{wrapped:?}");
        let long = lines(&name.repeat(4)).unwrap();
        assert!(
            long.len() == MAX_LINES && long[0].starts_with("...") && long.concat().ends_with("05-14.mp4"),
            "{long:?}"
        );
        assert_eq!(lines("a.mp4").unwrap(), ["a.mp4"]);
    }
}
