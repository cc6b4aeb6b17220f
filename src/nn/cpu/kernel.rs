//! The innermost loop of every convolution: a tile of up to [`MAX_ROWS`] rows and several vectors of sums, which stay
//! in registers while products are added. Written once and compiled for AVX-512, for AVX2 and for any processor; the
//! version is selected at run time.

/// Maximum number of rows of a tile.
pub const MAX_ROWS: usize = 6;

/// Work on one tile: over all steps k, an outer and an inner loop, it sums `to[row][column] = from[row][column] +
/// rows[row][at(k)] * right[at(k)][column]`.
pub struct TileJob<T> {
    /// Addresses of each row's left factors, of the initial values of its sums, and of its results.
    pub rows: [*const T; MAX_ROWS],
    pub from: [*const T; MAX_ROWS],
    pub to: [*mut T; MAX_ROWS],
    /// Address of the right factors: vectors of columns.
    pub right: *const T,
    pub outer: TileSteps,
    pub inner: TileSteps,
}

/// `n` steps, with the strides of the left and the right factors.
#[derive(Clone, Copy, Debug)]
pub struct TileSteps {
    pub n: usize,
    pub left: usize,
    pub right: usize,
}

#[derive(Clone, Copy)]
pub struct TileKernel<T> {
    /// Number of values in a vector.
    pub lanes: usize,
    /// Maximum number of vectors side by side in a tile: 1, 2 or 4.
    pub max_vectors: usize,
    /// Runs a job with the given numbers of rows and vectors (1, 2 or 4).
    ///
    /// # Safety
    /// Every address that the job reads is readable, and those of `to` are writable by this thread alone.
    pub run: unsafe fn(&TileJob<T>, usize, usize),
}

macro_rules! rows {
    ($job:ident, $n_rows:ident, $tile:ident, $vectors:literal) => {
        match $n_rows {
            1 => $tile::<1, $vectors>($job),
            2 => $tile::<2, $vectors>($job),
            3 => $tile::<3, $vectors>($job),
            4 => $tile::<4, $vectors>($job),
            5 => $tile::<5, $vectors>($job),
            6 => $tile::<6, $vectors>($job),
            _ => unreachable!("a tile of {} rows", $n_rows),
        }
    };
}

/// Tile loop and the dispatch on its size, for one processor type and one number type.
macro_rules! kernel {
    ($(#[$attribute:meta])* $tile:ident, $choose:ident, $number:ty, $lanes:literal, $vectors:literal;
     $zero:path, $load:path, $store:path, $broadcast:path, $add_product:expr) => {
        $(#[$attribute])*
        unsafe fn $tile<const ROWS: usize, const VECTORS: usize>(job: &TileJob<$number>) {
            // SAFETY: guaranteed by the caller.
            unsafe {
                let mut sums = [[$zero(); VECTORS]; ROWS];
                for (sums, from) in sums.iter_mut().zip(&job.from) {
                    for (v, sum) in sums.iter_mut().enumerate() {
                        *sum = $load(from.add(v * $lanes));
                    }
                }
                let mut rows = [std::ptr::null(); ROWS];
                rows.copy_from_slice(&job.rows[..ROWS]);
                let mut right_of_outer = job.right;
                for outer in 0..job.outer.n {
                    let (mut left, mut right) = (outer * job.outer.left, right_of_outer);
                    for _ in 0..job.inner.n {
                        let mut factors = [$zero(); VECTORS];
                        for (v, factor) in factors.iter_mut().enumerate() {
                            *factor = $load(right.add(v * $lanes));
                        }
                        for (sums, row) in sums.iter_mut().zip(&rows) {
                            let one: $number = *row.add(left);
                            let one = $broadcast(one);
                            for (sum, factor) in sums.iter_mut().zip(&factors) {
                                *sum = $add_product(one, *factor, *sum);
                            }
                        }
                        left += job.inner.left;
                        right = right.wrapping_add(job.inner.right);
                    }
                    right_of_outer = right_of_outer.wrapping_add(job.outer.right);
                }
                for (sums, to) in sums.iter().zip(&job.to) {
                    for (v, sum) in sums.iter().enumerate() {
                        $store(to.add(v * $lanes), *sum);
                    }
                }
            }
        }

        #[allow(unreachable_patterns)] // `$vectors` may be 1 or 2
        pub(crate) unsafe fn $choose(job: &TileJob<$number>, n_rows: usize, n_vectors: usize) {
            // SAFETY: guaranteed by the caller.
            unsafe {
                match n_vectors {
                    1 => rows!(job, n_rows, $tile, 1),
                    2 => rows!(job, n_rows, $tile, 2),
                    $vectors => rows!(job, n_rows, $tile, $vectors),
                    _ => unreachable!("a tile of {n_vectors} vectors"),
                }
            }
        }
    };
}

/// Operations on four values for processors without a specific implementation.
mod any {
    pub(super) fn zero<T: Copy + Default>() -> [T; 4] {
        [T::default(); 4]
    }

    pub(super) unsafe fn load<T: Copy>(at: *const T) -> [T; 4] {
        // SAFETY: guaranteed by the caller.
        unsafe { at.cast::<[T; 4]>().read_unaligned() }
    }

    pub(super) unsafe fn store<T: Copy>(at: *mut T, values: [T; 4]) {
        // SAFETY: guaranteed by the caller.
        unsafe { at.cast::<[T; 4]>().write_unaligned(values) };
    }

    pub(super) fn broadcast<T: Copy>(value: T) -> [T; 4] {
        [value; 4]
    }
}

fn add_product<T: std::ops::Mul<Output = T> + std::ops::Add<Output = T> + Copy>(
    a: [T; 4],
    b: [T; 4],
    sum: [T; 4],
) -> [T; 4] {
    std::array::from_fn(|i| a[i] * b[i] + sum[i])
}

kernel!(any_tile_f32, any_f32, f32, 4, 2; any::zero, any::load, any::store, any::broadcast, add_product);
kernel!(any_tile_f64, any_f64, f64, 4, 2; any::zero, any::load, any::store, any::broadcast, add_product);

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::TileJob;
    #[allow(clippy::wildcard_imports)] // intrinsics
    use std::arch::x86_64::*;

    kernel!(
        #[target_feature(enable = "avx512f")]
        wide_tile_f32, wide_f32, f32, 16, 4;
        _mm512_setzero_ps, _mm512_loadu_ps, _mm512_storeu_ps, _mm512_set1_ps, _mm512_fmadd_ps
    );
    kernel!(
        #[target_feature(enable = "avx512f")]
        wide_tile_f64, wide_f64, f64, 8, 4;
        _mm512_setzero_pd, _mm512_loadu_pd, _mm512_storeu_pd, _mm512_set1_pd, _mm512_fmadd_pd
    );
    kernel!(
        #[target_feature(enable = "avx2,fma")]
        half_tile_f32, half_f32, f32, 8, 2;
        _mm256_setzero_ps, _mm256_loadu_ps, _mm256_storeu_ps, _mm256_set1_ps, _mm256_fmadd_ps
    );
    kernel!(
        #[target_feature(enable = "avx2,fma")]
        half_tile_f64, half_f64, f64, 4, 2;
        _mm256_setzero_pd, _mm256_loadu_pd, _mm256_storeu_pd, _mm256_set1_pd, _mm256_fmadd_pd
    );
}

/// Defines a function that selects the kernel of this processor for a number type, from kernels with their lanes.
macro_rules! choose_kernel {
    ($choose:ident, $number:ty, $wide:ident: $wide_lanes:literal, $half:ident: $half_lanes:literal, $any:ident) => {
        pub fn $choose() -> TileKernel<$number> {
            #[cfg(target_arch = "x86_64")]
            {
                if std::arch::is_x86_feature_detected!("avx512f") {
                    return TileKernel { lanes: $wide_lanes, max_vectors: 4, run: x86::$wide };
                }
                if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                    return TileKernel { lanes: $half_lanes, max_vectors: 2, run: x86::$half };
                }
            }
            TileKernel { lanes: 4, max_vectors: 2, run: $any }
        }
    };
}

choose_kernel!(of_f32, f32, wide_f32: 16, half_f32: 8, any_f32);
choose_kernel!(of_f64, f64, wide_f64: 8, half_f64: 4, any_f64);

/// Splits columns into panels of the width of tiles, widest first: (first column, number of vectors). The last panel
/// may extend beyond `n_columns`.
pub fn panels<T>(kernel: &TileKernel<T>, n_columns: usize) -> Vec<(usize, usize)> {
    let (mut panels, mut first, mut left) = (Vec::new(), 0, n_columns.div_ceil(kernel.lanes));
    while left > 0 {
        let n = [4, 2, 1].into_iter().find(|n| *n <= left && *n <= kernel.max_vectors).unwrap_or(1);
        panels.push((first, n));
        first += n * kernel.lanes;
        left -= n;
    }
    panels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agrees(kernel: TileKernel<f64>) {
        for n_vectors in [1, 2, 4].into_iter().filter(|n| *n <= kernel.max_vectors) {
            for n_rows in 1..=MAX_ROWS {
                let (n_columns, n_steps) = (n_vectors * kernel.lanes, 5);
                let left: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.5).collect();
                let right: Vec<f64> = (0..2000).map(|i| f64::from(i % 17)).collect();
                let mut sums = vec![1.0; MAX_ROWS * n_columns];
                let start = sums.as_mut_ptr();
                let to = std::array::from_fn(|row| start.wrapping_add(row * n_columns));
                let job = TileJob {
                    rows: std::array::from_fn(|row| &raw const left[row * 20]),
                    from: to.map(<*mut f64>::cast_const),
                    to,
                    right: right.as_ptr(),
                    outer: TileSteps { n: 2, left: 10, right: 400 },
                    inner: TileSteps { n: n_steps, left: 2, right: 60 },
                };
                // SAFETY: all addresses lie inside the vectors above.
                unsafe { (kernel.run)(&job, n_rows, n_vectors) };
                for (i, sum) in sums.iter().enumerate() {
                    let (row, column) = (i / n_columns, i % n_columns);
                    let steps = (0..2).flat_map(|outer| (0..n_steps).map(move |inner| (outer, inner)));
                    let product = |(outer, inner): (usize, usize)| {
                        left[row * 20 + outer * 10 + inner * 2] * right[outer * 400 + inner * 60 + column]
                    };
                    let expected = if row < n_rows { 1.0 + steps.map(product).sum::<f64>() } else { 1.0 };
                    assert_eq!(*sum, expected, "{n_rows} rows, {n_vectors} vectors");
                }
            }
        }
    }

    #[test]
    fn tiles_of_every_processor_type_are_correct() {
        agrees(of_f64());
        agrees(TileKernel { lanes: 4, max_vectors: 2, run: any_f64 });
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            agrees(TileKernel { lanes: 4, max_vectors: 2, run: x86::half_f64 });
        }
    }

    #[test]
    fn panels_cover_all_columns() {
        let kernel = TileKernel { lanes: 16, max_vectors: 4, run: any_f32 };
        assert_eq!(panels(&kernel, 144), [(0, 4), (64, 4), (128, 1)]);
        assert_eq!(panels(&kernel, 96), [(0, 4), (64, 2)]);
        assert_eq!(panels(&kernel, 1), [(0, 1)]);
    }
}
