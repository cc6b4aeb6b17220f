//! YOLOX: one row per grid cell and stride, row-major: centre offset in cells, logarithm of the size in cells,
//! objectness, class probabilities (class 0: person).

use super::boxes;
use anyhow::{Result, ensure};
use orator_base::types::pose2d::PersonBox;

/// Persons from `rows` of `row_len` values, for an input of `width` x `height` px.
///
/// # Errors
/// A number of rows that does not match the grids.
pub fn decode(
    rows: &[f32],
    row_len: usize,
    [height, width]: [usize; 2],
    strides: &[usize],
    min_score: f32,
    max_overlap: f32,
) -> Result<Vec<PersonBox>> {
    let n_cells: usize = strides.iter().map(|stride| (width / stride) * (height / stride)).sum();
    ensure!(
        row_len >= 6 && rows.len() == n_cells * row_len,
        "{} values in rows of {row_len}: expected {n_cells} rows of at least 6 for YOLOX grids of strides {strides:?} \
         on {width}x{height} px",
        rows.len()
    );
    let mut rest = rows.chunks_exact(row_len);
    let mut found = Vec::new();
    for stride in strides {
        let columns = width / stride;
        for (cell, row) in rest.by_ref().take(columns * (height / stride)).enumerate() {
            let score = row[4] * row[5];
            if score > min_score {
                let size = *stride as f32;
                let (x, y) = ((row[0] + (cell % columns) as f32) * size, (row[1] + (cell / columns) as f32) * size);
                let (w, h) = (row[2].exp() * size / 2.0, row[3].exp() * size / 2.0);
                found.extend(boxes::from_corners([x - w, y - h, x + w, y + h], score));
            }
        }
    }
    Ok(boxes::non_max_suppression(found, max_overlap))
}
