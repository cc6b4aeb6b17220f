//! Frontmost triangle of four samples in each pixel.

/// Parts of a pixel that vertices are rounded to. Sums and products of them stay whole numbers that f32 (triangles of up
/// to `SMALL` parts) and f64 hold exactly, so that triangles that share an edge leave no gap.
pub const PARTS: i32 = 16;
const SMALL: i32 = 120 * PARTS;
/// Samples of a pixel from its centre, parts: a rotated grid.
const SPOTS: [[i32; 2]; 4] = [[-2, -6], [6, -2], [-6, 2], [2, 6]];
const FURTHEST_SPOT: i32 = 6;
/// Triangle of a sample that no triangle covers.
pub const NO_TRIANGLE: u32 = u32::MAX;
/// Width of the cells in which hidden triangles are told at once, px.
const CELL: usize = 8;

/// Rectangle of pixels: first column and row, column and row after the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelBounds {
    pub from: [usize; 2],
    pub to: [usize; 2],
}

/// Triangle in the picture.
#[derive(Clone, Copy, Debug)]
pub struct FlatTriangle {
    /// Corners, parts of a pixel from the centre of the top left one.
    pub corners: [[i32; 2]; 3],
    /// One over the depth of the corners, 1/cm.
    pub nearness: [f32; 3],
}

impl FlatTriangle {
    /// Twice the area; negative where the corners run counter-clockwise as one sees them.
    pub fn area(&self) -> i64 {
        let [a, b, c] = self.corners.map(|corner| corner.map(i64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    }

    /// Pixels that may have a sample within the triangle, in a picture of `size`.
    fn bounds(&self, size: [usize; 2]) -> PixelBounds {
        let ends = [0, 1].map(|k| {
            let [a, b, c] = self.corners.map(|corner| corner[k]);
            let first = (a.min(b).min(c) - FURTHEST_SPOT + PARTS - 1).div_euclid(PARTS);
            let last = (a.max(b).max(c) + FURTHEST_SPOT).div_euclid(PARTS) + 1;
            [first, last].map(|v| v.clamp(0, size[k] as i32) as usize)
        });
        PixelBounds { from: [ends[0][0], ends[1][0]], to: [ends[0][1], ends[1][1]] }
    }
}

/// Depth and triangle of all samples of a picture.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    pub size: [usize; 2],
    /// One over the depth, 1/cm; 0 is infinitely far.
    pub nearness: Vec<[f32; 4]>,
    pub triangles: Vec<[u32; 4]>,
    /// Least nearness in each cell, once `close_cells` has run.
    cells: Vec<f32>,
}

impl Samples {
    pub fn new(size: [usize; 2]) -> Self {
        let n = size[0] * size[1];
        let cells = vec![0.0; size[0].div_ceil(CELL) * size[1].div_ceil(CELL)];
        Self { size, nearness: vec![[0.0; 4]; n], triangles: vec![[NO_TRIANGLE; 4]; n], cells }
    }

    /// Takes all triangles out of an area; `behind` is the nearness of what is there without them.
    pub fn clear(&mut self, area: PixelBounds, behind: Option<&[[f32; 4]]>) {
        for y in area.from[1]..area.to[1] {
            let row = y * self.size[0] + area.from[0]..y * self.size[0] + area.to[0];
            match behind {
                Some(behind) => self.nearness[row.clone()].copy_from_slice(&behind[row.clone()]),
                None => self.nearness[row.clone()].fill([0.0; 4]),
            }
            self.triangles[row].fill([NO_TRIANGLE; 4]);
        }
    }

    /// Notes how far each cell of an area reaches, for `is_hidden`.
    pub fn close_cells(&mut self, area: PixelBounds) {
        let n_columns = self.size[0].div_ceil(CELL);
        for cell_y in area.from[1] / CELL..area.to[1].div_ceil(CELL) {
            for cell_x in area.from[0] / CELL..area.to[0].div_ceil(CELL) {
                let mut least = [f32::INFINITY; 4];
                for y in cell_y * CELL..((cell_y + 1) * CELL).min(self.size[1]) {
                    let row = y * self.size[0];
                    let columns = row + cell_x * CELL..row + ((cell_x + 1) * CELL).min(self.size[0]);
                    for pixel in &self.nearness[columns] {
                        (0..4).for_each(|k| least[k] = if pixel[k] < least[k] { pixel[k] } else { least[k] });
                    }
                }
                self.cells[cell_y * n_columns + cell_x] = least[0].min(least[1]).min(least[2]).min(least[3]);
            }
        }
    }

    /// Whether a triangle lies behind everything in the cells it may touch.
    pub fn is_hidden(&self, triangle: &FlatTriangle) -> bool {
        let bounds = triangle.bounds(self.size);
        let nearest = triangle.nearness[0].max(triangle.nearness[1]).max(triangle.nearness[2]);
        let n_columns = self.size[0].div_ceil(CELL);
        let mut rows = bounds.from[1] / CELL..bounds.to[1].div_ceil(CELL);
        rows.all(|y| {
            let mut columns = bounds.from[0] / CELL..bounds.to[0].div_ceil(CELL);
            columns.all(|x| nearest < self.cells[y * n_columns + x])
        })
    }

    /// Puts a triangle, seen from either side, wherever it is frontmost.
    pub fn fill(&mut self, triangle: &FlatTriangle, number: u32) {
        let area = triangle.area();
        let bounds = triangle.bounds(self.size);
        if area == 0 || bounds.from[0] >= bounds.to[0] || bounds.from[1] >= bounds.to[1] {
            return;
        }
        let [a, b, c] = triangle.corners;
        let extent = |k: usize| a[k].max(b[k]).max(c[k]) - a[k].min(b[k]).min(c[k]);
        if extent(0) <= SMALL && extent(1) <= SMALL {
            self.fill_with::<f32>(triangle, area, bounds, number);
        } else {
            self.fill_with::<f64>(triangle, area, bounds, number);
        }
    }

    #[inline(always)]
    fn fill_with<T: Whole>(&mut self, triangle: &FlatTriangle, area: i64, bounds: PixelBounds, number: u32) {
        let FlatTriangle { corners, nearness } = triangle;
        let sign = area.signum();
        let start = [0, 1].map(|k| bounds.from[k] as i64 * i64::from(PARTS));
        // Edge functions: at least 0 on the inner side, at the four samples of the first pixel; their steps.
        let mut edges = [[T::ZERO; 4]; 3];
        let mut steps = [[T::ZERO; 2]; 3];
        for side in 0..3 {
            let [p, q] = [corners[(side + 1) % 3], corners[(side + 2) % 3]].map(|corner| corner.map(i64::from));
            let slope = [(p[1] - q[1]) * sign, (q[0] - p[0]) * sign];
            edges[side] = SPOTS.map(|spot| {
                let from = [0, 1].map(|k| start[k] + i64::from(spot[k]) - p[k]);
                T::of(slope[0] * from[0] + slope[1] * from[1])
            });
            steps[side] = slope.map(|v| T::of(v * i64::from(PARTS)));
        }
        // The plane of nearness over the picture.
        let [from_a, from_b] = [1, 2].map(|n| [0, 1].map(|k| (corners[n][k] - corners[0][k]) as f32));
        let rise = [nearness[1] - nearness[0], nearness[2] - nearness[0]];
        let per_area = 1.0 / area as f32;
        let slope = [
            (rise[0] * from_b[1] - rise[1] * from_a[1]) * per_area,
            (rise[1] * from_a[0] - rise[0] * from_b[0]) * per_area,
        ];
        let first = SPOTS.map(|spot| {
            let from = [0, 1].map(|k| (start[k] + i64::from(spot[k]) - i64::from(corners[0][k])) as f32);
            nearness[0] + slope[0] * from[0] + slope[1] * from[1]
        });
        let per_pixel = slope.map(|v| v * PARTS as f32);
        for y in bounds.from[1]..bounds.to[1] {
            let down = per_pixel[1] * (y - bounds.from[1]) as f32;
            let row = y * self.size[0];
            let columns = row + bounds.from[0]..row + bounds.to[0];
            let pixels = self.nearness[columns.clone()].iter_mut().zip(&mut self.triangles[columns]);
            let [mut e0, mut e1, mut e2] = edges;
            for (column, (front, triangles)) in pixels.enumerate() {
                let along = per_pixel[0] * column as f32 + down;
                let inner: [T; 4] = std::array::from_fn(|k| least(least(e0[k], e1[k]), e2[k]));
                let here: [f32; 4] = std::array::from_fn(|k| first[k] + along);
                for k in 0..4 {
                    let is_front = (inner[k] >= T::ZERO) & (here[k] > front[k]);
                    front[k] = if is_front { here[k] } else { front[k] };
                    triangles[k] = if is_front { number } else { triangles[k] };
                }
                for k in 0..4 {
                    e0[k] = e0[k] + steps[0][0];
                    e1[k] = e1[k] + steps[1][0];
                    e2[k] = e2[k] + steps[2][0];
                }
            }
            for (edge, step) in edges.iter_mut().zip(steps) {
                edge.iter_mut().for_each(|v| *v = *v + step[1]);
            }
        }
    }
}

/// Floating-point number that holds whole ones exactly.
trait Whole: Copy + PartialOrd + std::ops::Add<Output = Self> {
    const ZERO: Self;
    fn of(whole: i64) -> Self;
}

impl Whole for f32 {
    const ZERO: Self = 0.0;
    fn of(whole: i64) -> Self {
        whole as Self
    }
}

impl Whole for f64 {
    const ZERO: Self = 0.0;
    fn of(whole: i64) -> Self {
        whole as Self
    }
}

#[inline(always)]
fn least<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}
