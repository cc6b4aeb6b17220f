//! Triangles as they stand in the world.

/// Triangle mesh in world axes (cm, y up), counter-clockwise seen from outside; all vertex lists are equally long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub points: Vec<[f32; 3]>,
    /// Unit outward normals.
    pub normals: Vec<[f32; 3]>,
    /// Linear RGB reflectance, 0..1.
    pub colours: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Number of the first triangles that enclose volumes, whose inner sides nobody sees.
    pub n_closed: usize,
    /// Label of each vertex, for instance the joint that moves it; a triangle has that of its first vertex.
    pub labels: Vec<u16>,
    /// Strength of the highlight, 0 (cloth) .. 1 (glass).
    pub gloss: f32,
}
