//! Visible triangles of an image, found band by band, with triangles that show their outer side first.

use super::samples::{BAND_ROWS, RowBand};
use super::surfaces::{SurfaceTriangle, Surfaces};

#[derive(Clone, Debug)]
pub struct VisibleTriangles {
    size: [usize; 2],
    band: RowBand,
    /// Triangle indices of each band, outer sides before inner ones, and the end of the range for each band and side.
    numbers: Vec<u32>,
    ends: Vec<usize>,
    /// Range of columns that the triangles of each band cover.
    columns: Vec<[u16; 2]>,
}

impl VisibleTriangles {
    pub fn new(size: [usize; 2]) -> Self {
        let n_bands = size[1].div_ceil(BAND_ROWS);
        let (ends, columns) = (vec![0; 2 * n_bands], vec![[0; 2]; n_bands]);
        Self { size, band: RowBand::new(size[0]), numbers: Vec::new(), ends, columns }
    }

    /// Calls `each` with every band that has triangles, its rows and its columns; `background`: its inverse depth.
    pub fn visit(
        &mut self,
        surfaces: &Surfaces,
        background: Option<&[[f32; 4]]>,
        mut each: impl FnMut(&RowBand, [usize; 2], [usize; 2]),
    ) {
        self.sort(surfaces);
        let mut start = 0;
        for (number, (ends, columns)) in self.ends.chunks_exact(2).zip(&self.columns).enumerate() {
            let (outer, inner) = (&self.numbers[start..ends[0]], &self.numbers[ends[0]..ends[1]]);
            start = ends[1];
            let columns = [usize::from(columns[0]), usize::from(columns[1])];
            if columns[0] >= columns[1] {
                continue;
            }
            let rows = [number * BAND_ROWS, ((number + 1) * BAND_ROWS).min(self.size[1])];
            self.band.reset(rows, columns, background);
            for &number in outer {
                let outer = &surfaces.triangles[number as usize];
                self.band.fill(&surfaces.flat(outer), outer.extent, number);
            }
            // Nearly all inner sides are hidden, which the cells detect cheaply.
            if !inner.is_empty() {
                self.band.update_cells(columns);
            }
            for &number in inner {
                let inner = &surfaces.triangles[number as usize];
                let flat = surfaces.flat(inner);
                if !self.band.is_hidden(&flat, inner.extent) {
                    self.band.fill(&flat, inner.extent, number);
                }
            }
            each(&self.band, rows, columns);
        }
    }

    /// Sorts the triangles by band and side; a triangle that overlaps several bands is listed in each.
    fn sort(&mut self, surfaces: &Surfaces) {
        let bands = |rows: [u16; 2]| usize::from(rows[0]) / BAND_ROWS..usize::from(rows[1]).div_ceil(BAND_ROWS);
        self.ends.fill(0);
        self.columns.fill([u16::MAX, 0]);
        for SurfaceTriangle { is_inner, extent: [columns, rows], .. } in &surfaces.triangles {
            for band in bands(*rows) {
                self.ends[2 * band + usize::from(*is_inner)] += 1;
                let [low, high] = self.columns[band];
                self.columns[band] = [low.min(columns[0]), high.max(columns[1])];
            }
        }
        let mut sum = 0;
        for end in &mut self.ends {
            // The entry holds the start of the range until the loop below has filled it.
            (*end, sum) = (sum, sum + *end);
        }
        self.numbers.clear();
        self.numbers.resize(sum, 0);
        for (number, SurfaceTriangle { is_inner, extent: [_, rows], .. }) in surfaces.triangles.iter().enumerate() {
            for band in bands(*rows) {
                let end = &mut self.ends[2 * band + usize::from(*is_inner)];
                self.numbers[*end] = number as u32;
                *end += 1;
            }
        }
    }
}
