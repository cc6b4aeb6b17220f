//! Appearance of an avatar: build, skin, face, hair, clothes. Lengths scale with the rig; colours: linear reflectances.

/// Linear RGB reflectance, 0..1.
pub type Reflectance = [f32; 3];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hairstyle {
    Bald,
    Short,
    /// Shoulder-length.
    Long,
    /// Combed back into a bun.
    Tied,
}

/// Garment of the upper body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Top {
    LongSleeves,
    /// Bare forearms.
    ShortSleeves,
    /// Jacket with lapels, open over a shirt.
    Jacket,
}

/// Pattern of the upper garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weave {
    Plain,
    /// Horizontal stripes in the second colour.
    Stripes,
    Checks,
}

/// Everything in which two avatars of one rig may differ. Factors are relative to the plain avatar.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// Girth of the trunk.
    pub trunk: f64,
    /// Girth of arms and legs.
    pub limbs: f64,
    /// Girth of the waist and of the hips, relative to the trunk's.
    pub waist: f64,
    pub hips: f64,
    /// Depth of the bust, 0 (none) .. 1.
    pub bust: f64,
    /// Girth of the neck.
    pub neck: f64,
    /// Width, height and depth of the head.
    pub head: [f64; 3],
    /// Width of the jaw, size of the nose, fullness of the lips and thickness of the brows.
    pub jaw: f64,
    pub nose: f64,
    pub lips: f64,
    pub brows: f64,
    /// Whether to model eyes, brows and a mouth; without them the head is a mannequin's.
    pub face: bool,
    pub skin: Reflectance,
    pub lip_colour: Reflectance,
    pub iris: Reflectance,
    pub hair: Hairstyle,
    pub hair_colour: Reflectance,
    pub hair_volume: f64,
    /// How far the hair covers the forehead, cm, and how much farther on the right than on the left, -1 .. 1.
    pub fringe: f64,
    pub parting: f64,
    /// Density of the beard, 0 (shaven) .. 1.
    pub beard: f64,
    /// Colour of the frames of glasses; `None` without glasses.
    pub glasses: Option<Reflectance>,
    pub top: Top,
    pub top_colour: Reflectance,
    /// Colour of stripes and checks, or of the shirt under a jacket.
    pub second_colour: Reflectance,
    pub weave: Weave,
    pub collar: bool,
    /// Whether a skirt is worn instead of trousers.
    pub skirt: bool,
    pub legs_colour: Reflectance,
    pub shoes_colour: Reflectance,
}

const SKIN: Reflectance = [0.60, 0.42, 0.33];

impl Appearance {
    /// Default avatar of exported animations: a neutral face and a shirt.
    pub fn plain() -> Self {
        Self {
            trunk: 1.0,
            limbs: 1.0,
            waist: 1.0,
            hips: 1.0,
            bust: 0.0,
            neck: 1.0,
            head: [1.0; 3],
            jaw: 1.0,
            nose: 1.0,
            lips: 1.0,
            brows: 1.0,
            face: true,
            skin: SKIN,
            lip_colour: lip_colour_of(SKIN, 0.5),
            iris: [0.10, 0.055, 0.025],
            hair: Hairstyle::Short,
            hair_colour: [0.050, 0.028, 0.016],
            hair_volume: 1.0,
            fringe: 0.0,
            parting: 0.0,
            beard: 0.0,
            glasses: None,
            top: Top::LongSleeves,
            top_colour: [0.16, 0.30, 0.38],
            second_colour: [0.62, 0.62, 0.60],
            weave: Weave::Plain,
            collar: false,
            skirt: false,
            legs_colour: [0.055, 0.065, 0.085],
            shoes_colour: [0.30, 0.28, 0.26],
        }
    }

    /// The plain avatar with a mannequin's head, without a face.
    pub fn faceless() -> Self {
        Self { face: false, ..Self::plain() }
    }
}

/// Lip colour for a skin colour; `strength` runs from 0 (skin colour) to 1 (lipstick).
pub fn lip_colour_of(skin: Reflectance, strength: f32) -> Reflectance {
    let red = [0.36 + 0.25 * skin[0], 0.05 + 0.12 * skin[1], 0.06 + 0.12 * skin[2]];
    std::array::from_fn(|k| skin[k] + strength * (red[k] - skin[k]))
}
