//! Storage for the motion of many clips: in memory up to a limit, then in a temporary file if one can be created, so
//! that the memory of an evaluation does not grow with the number of clips.

use anyhow::Result;
use ndarray::{Array3, ArrayView1, ArrayView3};
use orator_media::file_memory::{FileBytes, FileMemory};
use std::ops::Index;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Default limit of the bytes that are stored in memory.
pub const MEMORY_BYTES: usize = 192 << 20;

pub struct MotionStore(Mutex<StoreState>);

struct StoreState {
    /// Bytes that may still be stored in memory.
    left: usize,
    file: Option<FileMemory>,
}

/// Joints [T, n, 3], metres, in memory or in a file.
#[derive(Clone, Debug)]
pub enum StoredMotion {
    Held(Array3<f32>),
    /// In the temporary file, with their shape.
    InFile([usize; 3], FileBytes),
}

impl MotionStore {
    pub fn in_memory() -> Self {
        Self(Mutex::new(StoreState { left: usize::MAX, file: None }))
    }

    /// Store that holds `memory_bytes` in memory and the rest in a temporary file in `folder`. The file is opened now,
    /// since the process may lose the permission later. If it cannot be created, everything is held in memory.
    pub fn in_folder(folder: &Path, memory_bytes: usize) -> Self {
        match FileMemory::new(folder) {
            Ok(file) => Self(Mutex::new(StoreState { left: memory_bytes, file: Some(file) })),
            Err(_) => Self::in_memory(),
        }
    }

    /// Saves joints [T, n, 3].
    ///
    /// # Errors
    /// The temporary file cannot be written, for instance because the disk is full.
    pub fn keep(&self, joints: Array3<f32>) -> Result<StoredMotion> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let left = state.left.checked_sub(joints.len() * size_of::<f32>());
        state.left = left.unwrap_or(state.left);
        let Some(file) = state.file.as_mut().filter(|_| left.is_none()) else { return Ok(StoredMotion::Held(joints)) };
        let (n_frames, n_rows, n_axes) = joints.dim();
        let values: Vec<f32> = joints.iter().copied().collect();
        let bytes = file.append(bytemuck::cast_slice(&values))?;
        Ok(StoredMotion::InFile([n_frames, n_rows, n_axes], bytes))
    }
}

impl StoredMotion {
    /// View of the joints [T, n, 3].
    pub fn view(&self) -> ArrayView3<'_, f32> {
        match self {
            Self::Held(joints) => joints.view(),
            // `keep` wrote exactly the values of this shape.
            Self::InFile(shape, bytes) => ArrayView1::from(bytemuck::cast_slice(bytes.as_slice()))
                .into_shape_with_order(*shape)
                .unwrap_or_else(|error| panic!("the stored motion has another length: {error}")),
        }
    }

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
