//! The memory under a tensor, for this room's own operators: slices in, slices out, scratch buffers that are reused,
//! and the one matrix product. Everything here gives the same bits for any number of threads: work is cut into
//! pieces of a fixed size and each number is summed by one thread in one order.

use super::exponential;
use super::kernel;
use super::kernel::TileKernel;
use candle_core::{CpuStorage, DType, Layout, Result, Storage, Tensor, WithDType};
use rayon::prelude::*;
use std::cell::RefCell;
use std::thread::LocalKey;

/// Rows and columns of a product one task computes.
const TILE: (usize, usize) = (128, 256);
/// Numbers summed side by side, as the processor does best.
pub const LANES: usize = 16;
/// A piece of element-wise work is at least this many numbers.
pub const GRAIN: usize = 16 * 1024;

/// The number types our operators are written for: f32 to train with, f64 to prove the gradients with.
pub trait Scalar: WithDType {
    fn pool() -> &'static LocalKey<RefCell<Vec<Vec<Self>>>>;
    /// The loop of the processor at hand.
    fn kernel() -> TileKernel<Self>;
    /// e^x; in f32 an approximation that loops can be vectorised with.
    fn fast_exp(self) -> Self;
}

macro_rules! real {
    ($type:ty, $kernel:path, $exp:path) => {
        impl Scalar for $type {
            fn kernel() -> TileKernel<Self> {
                $kernel()
            }

            #[inline(always)]
            fn fast_exp(self) -> Self {
                $exp(self)
            }

            fn pool() -> &'static LocalKey<RefCell<Vec<Vec<Self>>>> {
                thread_local!(static POOL: RefCell<Vec<Vec<$type>>> = const { RefCell::new(Vec::new()) });
                &POOL
            }
        }
    };
}
real!(f32, kernel::of_f32, exponential::exp_f32);
real!(f64, kernel::of_f64, f64::exp);

/// The numbers of a contiguous tensor inside an operator. Errors when it is not contiguous (callers see to it).
pub fn slice<'a, T: Scalar>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [T]> {
    let Some((start, end)) = layout.contiguous_offsets() else {
        candle_core::bail!("this operator wants contiguous tensors, got strides {:?}", layout.stride());
    };
    Ok(&T::cpu_storage_as_slice(storage)?[start..end])
}

/// Lends the numbers of a tensor on the CPU, copying only when it is not contiguous.
pub fn read<T: Scalar, R>(tensor: &Tensor, f: impl FnOnce(&[T]) -> Result<R>) -> Result<R> {
    let tensor = tensor.contiguous()?;
    let (storage, layout) = tensor.storage_and_layout();
    match &*storage {
        Storage::Cpu(storage) => f(slice::<T>(storage, layout)?),
        _ => candle_core::bail!("this operator runs on the CPU only"),
    }
}

/// Errors unless the tensor holds f32 or f64; true for f64.
pub fn is_f64(dtype: DType) -> Result<bool> {
    match dtype {
        DType::F32 => Ok(false),
        DType::F64 => Ok(true),
        other => candle_core::bail!("this operator is for f32 and f64, got {other:?}"),
    }
}

/// Numbers from `start` to the next start of a line of the cache, less than [`LANES`]: vectors that lie in two lines are loaded
/// at half the speed.
pub fn aligned<T>(start: *const T) -> usize {
    start.align_offset(64).min(LANES - 1)
}

/// Lends a buffer of `len` numbers whose contents are arbitrary, from the start of a line of the cache on; the memory is kept
/// for the next caller.
pub fn scratch<T: Scalar, R>(len: usize, f: impl FnOnce(&mut [T]) -> R) -> R {
    let mut buffer = T::pool().with_borrow_mut(|pool| pool.pop()).unwrap_or_default();
    if buffer.len() < len + LANES {
        buffer.resize(len + LANES, T::zero());
    }
    let first = aligned(buffer.as_ptr());
    let result = f(&mut buffer[first..first + len]);
    T::pool().with_borrow_mut(|pool| pool.push(buffer));
    result
}

/// A matrix in memory: element (row, column) is `data[row * row_stride + column * column_stride]`.
#[derive(Clone, Copy)]
pub struct Matrix<'a, T> {
    pub data: &'a [T],
    pub row_stride: usize,
    pub column_stride: usize,
}

impl<'a, T> Matrix<'a, T> {
    /// A row-major matrix of rows of `n_columns`.
    pub fn new(data: &'a [T], n_columns: usize) -> Self {
        Self { data, row_stride: n_columns, column_stride: 1 }
    }

    /// Transpose: rows and columns swapped, memory untouched.
    pub fn transposed(self) -> Self {
        Self { data: self.data, row_stride: self.column_stride, column_stride: self.row_stride }
    }
}

/// `product = left x right`, [m, depth] x [depth, n], row-major; `product` is overwritten.
pub fn matmul<T: Scalar>(product: &mut [T], left: Matrix<T>, right: Matrix<T>, m: usize, n: usize, depth: usize) {
    if m == 0 || n == 0 {
        return;
    }
    let last_index = |matrix: Matrix<T>, rows: usize, columns: usize| {
        (rows - 1) * matrix.row_stride + (columns - 1) * matrix.column_stride
    };
    assert!(product.len() == m * n && depth > 0, "product of {m} x {n} over {depth}");
    assert!(last_index(left, m, depth) < left.data.len() && last_index(right, depth, n) < right.data.len());
    let strides = |matrix: Matrix<T>| (matrix.row_stride as isize, matrix.column_stride as isize);
    let (left_strides, right_strides) = (strides(left), strides(right));
    let (tiles_down, tiles_across) = (m.div_ceil(TILE.0), n.div_ceil(TILE.1));
    let start = OutputStart(product.as_mut_ptr());
    (0..tiles_down * tiles_across).into_par_iter().for_each(|tile| {
        let (row, column) = (tile / tiles_across * TILE.0, tile % tiles_across * TILE.1);
        let left = &left.data[row * left.row_stride..];
        let right = &right.data[column * right.column_stride..];
        // SAFETY: the asserts above bound every address gemm reads; it writes rows `row..` and columns `column..` of
        // `product`, row-major, and no other task writes these.
        unsafe {
            gemm::gemm(
                TILE.0.min(m - row),
                TILE.1.min(n - column),
                depth,
                start.at(row * n + column),
                1,
                n as isize,
                false,
                left.as_ptr(),
                left_strides.1,
                left_strides.0,
                right.as_ptr(),
                right_strides.1,
                right_strides.0,
                T::zero(),
                T::one(),
                false,
                false,
                false,
                gemm::Parallelism::None,
            );
        }
    });
}

/// Adds `left x right`, [m, depth] x [depth, n], to `sum`, row-major, on this thread alone.
pub fn add_product<T: Scalar>(sum: &mut [T], left: Matrix<T>, right: Matrix<T>, m: usize, n: usize, depth: usize) {
    if m == 0 || n == 0 || depth == 0 {
        return;
    }
    let last_index = |matrix: Matrix<T>, rows: usize, columns: usize| {
        (rows - 1) * matrix.row_stride + (columns - 1) * matrix.column_stride
    };
    assert!(sum.len() == m * n, "product of {m} x {n} over {depth}");
    assert!(last_index(left, m, depth) < left.data.len() && last_index(right, depth, n) < right.data.len());
    // SAFETY: the asserts bound every address gemm reads and writes.
    unsafe {
        gemm::gemm(
            m,
            n,
            depth,
            sum.as_mut_ptr(),
            1,
            n as isize,
            true,
            left.data.as_ptr(),
            left.column_stride as isize,
            left.row_stride as isize,
            right.data.as_ptr(),
            right.column_stride as isize,
            right.row_stride as isize,
            T::one(),
            T::one(),
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

/// New numbers, which `write` writes without zeros having been there before.
///
/// # Safety
/// `write` writes every one of the `len` numbers, and reads none that it has not written.
pub unsafe fn written<T: Scalar>(len: usize, write: impl FnOnce(OutputStart<T>)) -> Vec<T> {
    let mut values = Vec::with_capacity(len);
    write(OutputStart(values.as_mut_ptr()));
    // SAFETY: all are written, as the caller promises.
    unsafe { values.set_len(len) };
    values
}

/// Where a result begins: tasks write disjoint parts of it.
#[derive(Clone, Copy)]
pub struct OutputStart<T>(*mut T);

// SAFETY: only the address is shared; who writes where is the affair of those who call `at`.
unsafe impl<T: Send> Send for OutputStart<T> {}
unsafe impl<T: Send> Sync for OutputStart<T> {}

impl<T> OutputStart<T> {
    /// Start of `values`, which nobody else uses meanwhile.
    pub fn new(values: &mut [T]) -> Self {
        Self(values.as_mut_ptr())
    }

    /// The result from `offset` on.
    ///
    /// # Safety
    /// `offset` lies inside the result.
    pub unsafe fn from(self, offset: usize) -> Self {
        // SAFETY: the caller's.
        Self(unsafe { self.at(offset) })
    }

    /// # Safety
    /// `offset` lies inside the result.
    pub unsafe fn at(self, offset: usize) -> *mut T {
        unsafe { self.0.add(offset) }
    }
}

/// The sum of `values`, always in the same order.
pub fn sum<T: Scalar>(values: &[T]) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [T::zero(); LANES];
    for chunk in chunks {
        lanes.iter_mut().zip(chunk).for_each(|(lane, v)| *lane += *v);
    }
    lanes.iter().chain(rest).map(|v| v.to_f64()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_the_definition() {
        let (m, n, depth) = (145, 300, 33);
        let left: Vec<f64> = (0..m * depth).map(|i| (i as f64 * 0.7).sin()).collect();
        let right: Vec<f64> = (0..n * depth).map(|i| (i as f64 * 0.3).cos()).collect();
        let mut product = vec![f64::NAN; m * n];
        // The right side is stored [n, depth].
        matmul(&mut product, Matrix::new(&left, depth), Matrix::new(&right, depth).transposed(), m, n, depth);
        for row in 0..m {
            for column in 0..n {
                let expected: f64 = (0..depth).map(|k| left[row * depth + k] * right[column * depth + k]).sum();
                assert!((product[row * n + column] - expected).abs() < 1e-12);
            }
        }
    }
}
