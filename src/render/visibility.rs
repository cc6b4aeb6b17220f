//! Which triangles a picture shows: its bands one after the other, outer sides before inner ones.

use super::samples::{BAND_ROWS, RowBand};
use super::surfaces::Surfaces;

/// Memory of the search for what is seen.
#[derive(Clone, Debug)]
pub struct VisibleTriangles {
    size: [usize; 2],
    band: RowBand,
    /// Numbers of the triangles of each band, one after the other, and where each band's end.
    numbers: Vec<u32>,
    ends: Vec<usize>,
}

impl VisibleTriangles {
    pub fn new(size: [usize; 2]) -> Self {
        Self { size, band: RowBand::new(size[0]), numbers: Vec::new(), ends: vec![0; size[1].div_ceil(BAND_ROWS)] }
    }

    /// Calls `each` with every band that has triangles, its rows and its columns; `behind` is the nearness of what the
    /// picture shows without them.
    pub fn visit(
        &mut self,
        surfaces: &Surfaces,
        behind: Option<&[[f32; 4]]>,
        mut each: impl FnMut(&RowBand, [usize; 2], [usize; 2]),
    ) {
        self.sort(surfaces);
        let mut start = 0;
        for (number, &end) in self.ends.iter().enumerate() {
            let shown = &self.numbers[start..end];
            start = end;
            let triangle = |number: u32| &surfaces.triangles[number as usize];
            let columns = shown.iter().fold([u16::MAX, 0], |[low, high], &number| {
                let [first, last] = triangle(number).extent[0];
                [low.min(first), high.max(last)]
            });
            let columns = columns.map(usize::from);
            if columns[0] >= columns[1] {
                continue;
            }
            let rows = [number * BAND_ROWS, ((number + 1) * BAND_ROWS).min(self.size[1])];
            self.band.open(rows, columns, behind);
            let of_side =
                |is_inner| shown.iter().map(move |&n| (n, triangle(n))).filter(move |t| t.1.is_inner == is_inner);
            for (number, outer) in of_side(false) {
                self.band.fill(&surfaces.flat(outer), outer.extent, number);
            }
            // Nearly all inner sides are hidden, which their cells tell at once.
            self.band.close_cells(columns);
            for (number, inner) in of_side(true) {
                let flat = surfaces.flat(inner);
                if !self.band.is_hidden(&flat, inner.extent) {
                    self.band.fill(&flat, inner.extent, number);
                }
            }
            each(&self.band, rows, columns);
        }
    }

    /// Sorts the triangles by band; one that reaches into several stands in each.
    fn sort(&mut self, surfaces: &Surfaces) {
        let bands = |number: usize| {
            let [first, last] = surfaces.triangles[number].extent[1].map(usize::from);
            first / BAND_ROWS..last.div_ceil(BAND_ROWS)
        };
        self.ends.fill(0);
        for number in 0..surfaces.triangles.len() {
            bands(number).for_each(|band| self.ends[band] += 1);
        }
        let mut sum = 0;
        for end in &mut self.ends {
            // For now where the band begins.
            (*end, sum) = (sum, sum + *end);
        }
        self.numbers.clear();
        self.numbers.resize(sum, 0);
        for number in 0..surfaces.triangles.len() {
            for band in bands(number) {
                self.numbers[self.ends[band]] = number as u32;
                self.ends[band] += 1;
            }
        }
    }
}
