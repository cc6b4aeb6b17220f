//! Binary glTF 2.0 container: one buffer with its views and accessors, and the file of the buffer and the scene's JSON.

use serde_json::{Value, json};

/// Purpose of a buffer view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    Vertices = 34_962,
    Indices = 34_963,
    /// Matrices and animation.
    Other = 0,
}

/// Buffer under construction, with its views and accessors.
#[derive(Debug, Default)]
pub struct GlbBuffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl GlbBuffer {
    /// The buffer of an existing scene with its data, so that more can be appended.
    pub fn from_scene(scene: &Value, bytes: Vec<u8>) -> Self {
        let list = |key: &str| scene[key].as_array().cloned().unwrap_or_default();
        Self { bytes, views: list("bufferViews"), accessors: list("accessors") }
    }

    /// Appends vectors of `N` floats with their minimum and maximum; returns the index of the accessor. `kind` is one
    /// of `SCALAR`, `VEC3`, `VEC4`, `MAT4`.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str, purpose: BufferUse) -> usize {
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|k| values.iter().map(|value| value[k]).reduce(pick).unwrap_or(0.0)).collect()
        };
        let accessor = json!({
            "componentType": 5126, "count": values.len(), "type": kind,
            "min": bound(f32::min), "max": bound(f32::max),
        });
        self.add(values.iter().flatten().flat_map(|v| v.to_le_bytes()), purpose, accessor)
    }

    /// Appends vectors of four bytes (joint indices); returns the index of the accessor.
    pub fn bytes4(&mut self, values: &[[u8; 4]]) -> usize {
        let accessor = json!({ "componentType": 5121, "count": values.len(), "type": "VEC4" });
        self.add(values.iter().flatten().copied(), BufferUse::Vertices, accessor)
    }

    /// Appends vectors of four normalised 16-bit fractions (weights, colours); returns the index of the accessor.
    pub fn shares4(&mut self, values: &[[u16; 4]]) -> usize {
        let accessor = json!({ "componentType": 5123, "normalized": true, "count": values.len(), "type": "VEC4" });
        self.add(values.iter().flatten().flat_map(|v| v.to_le_bytes()), BufferUse::Vertices, accessor)
    }

    /// Appends triangle corners, as 16-bit numbers if they fit; returns the index of the accessor.
    pub fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let flat = || triangles.iter().flatten();
        let accessor = |kind: u32| json!({ "componentType": kind, "count": 3 * triangles.len(), "type": "SCALAR" });
        if flat().all(|&v| v < u32::from(u16::MAX)) {
            self.add(flat().flat_map(|&v| (v as u16).to_le_bytes()), BufferUse::Indices, accessor(5123))
        } else {
            self.add(flat().flat_map(|&v| v.to_le_bytes()), BufferUse::Indices, accessor(5125))
        }
    }

    /// Appends a view of these bytes and its accessor; returns the index of the accessor.
    fn add(&mut self, bytes: impl Iterator<Item = u8>, purpose: BufferUse, accessor: Value) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset });
        if purpose != BufferUse::Other {
            view["target"] = json!(purpose as u32);
        }
        let mut placed = json!({ "bufferView": self.views.len() });
        if let (Some(placed), Value::Object(accessor)) = (placed.as_object_mut(), accessor) {
            placed.extend(accessor);
        }
        self.views.push(view);
        self.accessors.push(placed);
        self.accessors.len() - 1
    }

    /// Bytes of the file of a scene that refers to these accessors.
    pub fn file(mut self, mut scene: Value) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        scene["accessors"] = json!(self.accessors);
        scene["bufferViews"] = json!(self.views);
        scene["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        let mut text = scene.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut file = Vec::with_capacity(length);
        file.extend(b"glTF");
        file.extend(2_u32.to_le_bytes());
        file.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.bytes)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}
