//! Memory access for the operators of this crate: slices of tensors, reusable scratch buffers, and matrix products.
//! Every function gives identical bits for any number of threads: work is divided into pieces of fixed size, and each
//! value is summed by one thread in a fixed order.

use super::kernel::{self, TileKernel};
use super::vectorised::exp_f32;
use candle_core::{CpuStorage, DType, Layout, Result, Storage, Tensor, WithDType};
use rayon::prelude::*;
use std::cell::RefCell;
use std::thread::LocalKey;

/// Rows and columns of a matrix product per task.
const TILE: (usize, usize) = (128, 256);
/// Number of values that are summed in parallel lanes.
pub const LANES: usize = 16;
/// Minimum number of values per task of element-wise work.
pub const GRAIN: usize = 16 * 1024;

/// Number types of the operators: f32 for training, f64 for gradient checks.
pub trait Scalar: WithDType {
    fn pool() -> &'static LocalKey<RefCell<Vec<Vec<Self>>>>;
    fn kernel() -> TileKernel<Self>;
    /// e^x; in f32 an approximation that allows vectorised loops.
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
real!(f32, kernel::of_f32, exp_f32);
real!(f64, kernel::of_f64, f64::exp);

/// Returns the values of a contiguous tensor inside an operator.
pub fn slice<'a, T: Scalar>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [T]> {
    let Some((start, end)) = layout.contiguous_offsets() else {
        candle_core::bail!("expected a contiguous tensor, found strides {:?}", layout.stride());
    };
    Ok(&T::cpu_storage_as_slice(storage)?[start..end])
}

/// Calls `f` with the values of a tensor on the CPU; copies them only if the tensor is not contiguous.
pub fn read<T: Scalar, R>(tensor: &Tensor, f: impl FnOnce(&[T]) -> Result<R>) -> Result<R> {
    let tensor = tensor.contiguous()?;
    let (storage, layout) = tensor.storage_and_layout();
    match &*storage {
        Storage::Cpu(storage) => f(slice::<T>(storage, layout)?),
        _ => candle_core::bail!("expected a tensor on the CPU: the operator has no GPU implementation"),
    }
}

pub fn is_f64(dtype: DType) -> Result<bool> {
    match dtype {
        DType::F32 => Ok(false),
        DType::F64 => Ok(true),
        other => candle_core::bail!("expected a tensor of f32 or f64, found {other:?}"),
    }
}

/// Values from `start` to the next cache line, below [`LANES`]. Vectors across two cache lines load at half the speed.
pub fn aligned<T>(start: *const T) -> usize {
    start.align_offset(64).min(LANES - 1)
}

/// Calls `f` with a buffer of `len` values of arbitrary content, aligned to a cache line; later calls reuse the memory.
pub fn scratch<T: Scalar, R>(len: usize, f: impl FnOnce(&mut [T]) -> R) -> R {
    let mut buffer = T::pool().with_borrow_mut(Vec::pop).unwrap_or_default();
    if buffer.len() < len + LANES {
        buffer.resize(len + LANES, T::zero());
    }
    let first = aligned(buffer.as_ptr());
    let result = f(&mut buffer[first..first + len]);
    T::pool().with_borrow_mut(|pool| pool.push(buffer));
    result
}

/// Matrix in memory: element (row, column) is `data[row * row_stride + column * column_stride]`.
#[derive(Clone, Copy)]
pub struct Matrix<'a, T> {
    pub data: &'a [T],
    pub row_stride: usize,
    pub column_stride: usize,
}

impl<'a, T> Matrix<'a, T> {
    /// Creates a row-major matrix with `n_columns` columns.
    pub fn new(data: &'a [T], n_columns: usize) -> Self {
        Self { data, row_stride: n_columns, column_stride: 1 }
    }

    /// Transposed view of the same memory.
    pub fn transposed(self) -> Self {
        Self { data: self.data, row_stride: self.column_stride, column_stride: self.row_stride }
    }

    fn at(self, row: usize, column: usize) -> Self {
        Self { data: &self.data[row * self.row_stride + column * self.column_stride..], ..self }
    }

    /// Returns whether this many rows and columns, at least one of each, lie inside `data`.
    fn holds(&self, rows: usize, columns: usize) -> bool {
        (rows - 1) * self.row_stride + (columns - 1) * self.column_stride < self.data.len()
    }
}

/// Computes `product = left x right`, [m, depth] x [depth, n], row-major; overwrites `product`.
pub fn matmul<T: Scalar>(product: &mut [T], left: Matrix<T>, right: Matrix<T>, m: usize, n: usize, depth: usize) {
    if m == 0 || n == 0 {
        return;
    }
    let fits = product.len() == m * n && depth > 0 && left.holds(m, depth) && right.holds(depth, n);
    assert!(fits, "operands do not fit a product of {m} x {n} over {depth}");
    let (tiles_down, tiles_across) = (m.div_ceil(TILE.0), n.div_ceil(TILE.1));
    let start = SharedOutputPtr::new(product);
    (0..tiles_down * tiles_across).into_par_iter().for_each(|tile| {
        let (row, column) = (tile / tiles_across * TILE.0, tile % tiles_across * TILE.1);
        let sizes = [TILE.0.min(m - row), TILE.1.min(n - column), depth];
        // SAFETY: the assert bounds the factors; each tile writes its own rows and columns of `product`, row-major.
        unsafe {
            gemm_on_this_thread(start.at(row * n + column), n, false, left.at(row, 0), right.at(0, column), sizes);
        }
    });
}

/// Adds `left x right`, [m, depth] x [depth, n], to `sum`, row-major, on the calling thread.
pub fn add_product<T: Scalar>(sum: &mut [T], left: Matrix<T>, right: Matrix<T>, m: usize, n: usize, depth: usize) {
    if m == 0 || n == 0 || depth == 0 {
        return;
    }
    let fits = sum.len() == m * n && left.holds(m, depth) && right.holds(depth, n);
    assert!(fits, "operands do not fit a product of {m} x {n} over {depth}");
    // SAFETY: the assert bounds the factors and the sum.
    unsafe { gemm_on_this_thread(sum.as_mut_ptr(), n, true, left, right, [m, n, depth]) };
}

/// Computes `left x right`, [m, depth] x [depth, n], into rows at `to` with distance `stride`: added or overwriting.
///
/// # Safety
/// The factors have this many rows and columns, and `to` this many rows, which no other thread reads or writes.
unsafe fn gemm_on_this_thread<T: Scalar>(
    to: *mut T,
    stride: usize,
    adds: bool,
    left: Matrix<T>,
    right: Matrix<T>,
    [m, n, depth]: [usize; 3],
) {
    let strides = |matrix: Matrix<T>| (matrix.column_stride as isize, matrix.row_stride as isize);
    let ((left_column, left_row), (right_column, right_row)) = (strides(left), strides(right));
    let (left, right) = (left.data.as_ptr(), right.data.as_ptr());
    let (of_sum, one, alone) = (if adds { T::one() } else { T::zero() }, T::one(), gemm::Parallelism::None);
    // SAFETY: guaranteed by the caller.
    unsafe {
        gemm::gemm(
            m,
            n,
            depth,
            to,
            1,
            stride as isize,
            adds,
            left,
            left_column,
            left_row,
            right,
            right_column,
            right_row,
            of_sum,
            one,
            false,
            false,
            false,
            alone,
        );
    }
}

/// Allocates `len` values that `write` initialises, without zeroing them first.
///
/// # Safety
/// `write` writes every one of the `len` values, and reads none that it has not written.
pub unsafe fn written<T: Scalar>(len: usize, write: impl FnOnce(SharedOutputPtr<T>)) -> Vec<T> {
    let mut values = Vec::with_capacity(len);
    write(SharedOutputPtr(values.as_mut_ptr()));
    // SAFETY: the caller guarantees that all values are written.
    unsafe { values.set_len(len) };
    values
}

/// Pointer to the start of a result of which tasks write disjoint parts.
#[derive(Clone, Copy)]
pub struct SharedOutputPtr<T>(*mut T);

// SAFETY: callers of `at` write disjoint ranges and do not outlive the slice.
unsafe impl<T: Send> Send for SharedOutputPtr<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for SharedOutputPtr<T> {}

impl<T> SharedOutputPtr<T> {
    /// Creates a pointer to the start of `values`, which must not be accessed otherwise in the meantime.
    pub fn new(values: &mut [T]) -> Self {
        Self(values.as_mut_ptr())
    }

    /// Pointer to the result from `offset` on.
    ///
    /// # Safety
    /// `offset` lies inside the result.
    pub unsafe fn from(self, offset: usize) -> Self {
        // SAFETY: guaranteed by the caller.
        Self(unsafe { self.at(offset) })
    }

    /// # Safety
    /// `offset` lies inside the result.
    pub unsafe fn at(self, offset: usize) -> *mut T {
        // SAFETY: guaranteed by the caller.
        unsafe { self.0.add(offset) }
    }
}

/// Sums `values` in a fixed order.
pub fn sum<T: Scalar>(values: &[T]) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [T::zero(); LANES];
    for chunk in chunks {
        lanes.iter_mut().zip(chunk).for_each(|(lane, v)| *lane += *v);
    }
    lanes.iter().chain(rest).map(|v| v.to_f64()).sum()
}
