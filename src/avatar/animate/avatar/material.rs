//! Materials of an avatar's meshes.

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Material {
    Skin,
    Shirt,
    Trousers,
    Shoes,
    /// Skin of head, neck and lips.
    Face,
    /// Eyes and teeth.
    Eyes,
    Hair,
    /// Frames of glasses.
    Frames,
}

impl Material {
    /// Specular strength, 0 .. 1.
    pub fn gloss(self) -> f32 {
        match self {
            Self::Skin | Self::Face => 0.12,
            Self::Shirt | Self::Trousers => 0.0,
            Self::Shoes | Self::Hair => 0.1,
            Self::Eyes | Self::Frames => 0.7,
        }
    }

    /// Microfacet roughness of glTF, 0 .. 1.
    pub fn roughness(self) -> f64 {
        match self {
            Self::Skin | Self::Face => 0.65,
            Self::Shirt | Self::Trousers => 0.9,
            Self::Shoes => 0.8,
            Self::Hair => 0.7,
            Self::Eyes => 0.15,
            Self::Frames => 0.3,
        }
    }
}
