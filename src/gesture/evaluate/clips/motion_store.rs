//! Motion of many clips: in memory while it is little, else in a temporary file where one can be made, so that an
//! evaluation's memory does not grow with what is evaluated.

use anyhow::Result;
use ndarray::{Array3, ArrayView1, ArrayView3};
use orator_media::file_memory::{FileBytes, FileMemory};
use std::ops::Index;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Bytes that are held in memory.
pub const HELD_BYTES: usize = 192 << 20;

/// Keeps motions.
pub struct MotionStore(Mutex<StoreState>);

struct StoreState {
    /// Bytes that may still be held in memory.
    left: usize,
    file: Option<FileMemory>,
}

/// Joints [T, n, 3], metres, kept somewhere.
#[derive(Clone, Debug)]
pub enum StoredMotion {
    /// In memory.
    Held(Array3<f32>),
    /// In the temporary file, with their shape.
    InFile([usize; 3], FileBytes),
}

impl MotionStore {
    /// Keeps all in memory.
    pub fn in_memory() -> Self {
        Self(Mutex::new(StoreState { left: usize::MAX, file: None }))
    }

    /// Keeps what is more than `held` bytes in a temporary file in `folder`, which is opened at once, since a process may
    /// lose the right to make one. All is kept in memory if none can be made.
    pub fn in_folder(folder: &Path, held: usize) -> Self {
        match FileMemory::new(folder) {
            Ok(file) => Self(Mutex::new(StoreState { left: held, file: Some(file) })),
            Err(_) => Self::in_memory(),
        }
    }

    /// Keeps joints [T, n, 3].
    ///
    /// # Errors
    /// The disk of temporary files is full.
    pub fn keep(&self, joints: Array3<f32>) -> Result<StoredMotion> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let left = state.left.checked_sub(joints.len() * size_of::<f32>());
        state.left = left.unwrap_or(state.left);
        let Some(file) = state.file.as_mut().filter(|_| left.is_none()) else { return Ok(StoredMotion::Held(joints)) };
        let (n_frames, n_rows, n_axes) = joints.dim();
        let numbers: Vec<f32> = joints.iter().copied().collect();
        let kept = file.append(bytemuck::cast_slice(&numbers))?;
        Ok(StoredMotion::InFile([n_frames, n_rows, n_axes], kept))
    }
}

impl StoredMotion {
    /// The joints [T, n, 3].
    pub fn view(&self) -> ArrayView3<'_, f32> {
        match self {
            Self::Held(joints) => joints.view(),
            // `keep` wrote as many numbers as the shape has.
            Self::InFile(shape, bytes) => ArrayView1::from(bytemuck::cast_slice(bytes.as_slice()))
                .into_shape_with_order(*shape)
                .unwrap_or_else(|error| panic!("a motion of another length was kept: {error}")),
        }
    }

    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        match self {
            Self::Held(joints) => joints.shape()[0],
            Self::InFile([n_frames, ..], _) => *n_frames,
        }
    }
}

impl Index<[usize; 3]> for StoredMotion {
    type Output = f32;

    fn index(&self, at: [usize; 3]) -> &f32 {
        match self {
            Self::Held(joints) => &joints[at],
            Self::InFile([_, n_rows, n_axes], bytes) => {
                let [t, row, axis] = at;
                &bytemuck::cast_slice::<u8, f32>(bytes.as_slice())[(t * n_rows + row) * n_axes + axis]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::s;

    #[test]
    fn motions_come_back_from_memory_and_from_the_file() {
        let motion = |n: usize| Array3::from_shape_fn((n, 49, 3), |(t, j, k)| (1000 * n + 100 * t + 3 * j + k) as f32);
        let store = MotionStore::in_folder(&std::env::temp_dir(), 3 * 49 * 3 * 4);
        let kept: Vec<StoredMotion> = (0..6).map(|n| store.keep(motion(n)).unwrap()).collect();
        let in_file = kept.iter().filter(|motion| matches!(motion, StoredMotion::InFile(..))).count();
        assert_eq!(in_file, 3);
        drop(store);
        for (n, kept) in kept.iter().enumerate() {
            assert_eq!((kept.view(), kept.n_frames()), (motion(n).view(), n));
        }
        assert_eq!(kept[5][[4, 48, 2]], motion(5)[[4, 48, 2]]);
        // Cut out of longer ones, or not in the order of memory.
        let store = MotionStore::in_folder(&std::env::temp_dir(), 0);
        for part in [
            motion(5).slice_move(s![1..3, ..;2, ..]),
            motion(5).slice_move(s![2..4, .., ..]),
            motion(5).slice_move(s![..1, .., ..]),
            motion(5).slice_move(s![4..4, .., ..]),
            motion(5).permuted_axes([1, 0, 2]),
        ] {
            let kept = store.keep(part.clone()).unwrap();
            assert_eq!((kept.view(), StoredMotion::Held(part.clone()).view()), (part.view(), part.view()));
            assert!(part.indexed_iter().all(|((t, row, axis), v)| kept[[t, row, axis]] == *v));
        }
    }
}
