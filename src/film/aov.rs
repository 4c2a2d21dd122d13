//! What a pixel can hold beside its light: that light by the kind of its path, and what is seen first.

/// Kinds of light paths: Heckbert, "Adaptive Radiosity Textures for Bidirectional Ray Tracing"
/// (SIGGRAPH 1990), from the light L to the eye E by events D and S. S are mirrors, glass, and the lobe of
/// a reflective material. Every path is of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightClass {
    /// L E: light that is seen itself.
    Emission,
    /// L D E: light on what is seen.
    Direct,
    /// L (D|S)* D D E: light that other diffuse surfaces send there.
    Indirect,
    /// L (D|S)* S E: whatever is seen in mirrors and glass.
    Specular,
    /// L (D|S)* S D E: light that comes there through glass or from mirrors.
    Caustic,
}

/// Sums over a pixel's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AovSums {
    /// Radiance of the paths of each class; together that of all paths, to rounding.
    pub classes: [[f64; 3]; 5],
    /// Unit normals of the surfaces seen first, on the viewer's side; nothing for a sample that sees none.
    pub normal: [f64; 3],
    /// Colours of these: albedo or reflectance, 1 for glass.
    pub albedo: [f64; 3],
    /// Distances along the view axis from the camera, in scene units, of the samples that see a surface.
    pub depth: f64,
    /// How many these are.
    pub hits: f64,
}

impl AovSums {
    /// The numbers of one pixel.
    pub const NUMBERS: usize = 23;

    /// All numbers: the classes by their order, red, green and blue of each; normal, albedo, depth, hits.
    #[must_use]
    pub fn to_numbers(&self) -> [f64; Self::NUMBERS] {
        let mut numbers = [0.0; Self::NUMBERS];
        numbers[..15].copy_from_slice(self.classes.as_flattened());
        numbers[15..18].copy_from_slice(&self.normal);
        numbers[18..21].copy_from_slice(&self.albedo);
        (numbers[21], numbers[22]) = (self.depth, self.hits);
        numbers
    }

    /// What [`to_numbers`](Self::to_numbers) was of.
    #[must_use]
    pub fn of_numbers(numbers: &[f64; Self::NUMBERS]) -> Self {
        let three = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
        Self {
            classes: [0, 1, 2, 3, 4].map(|class| three(3 * class)),
            normal: three(15),
            albedo: three(18),
            depth: numbers[21],
            hits: numbers[22],
        }
    }

    /// Adds the sums of further samples.
    pub fn add(&mut self, other: &Self) {
        let pairs = self.classes.as_flattened_mut().iter_mut();
        pairs
            .zip(other.classes.as_flattened())
            .for_each(|(a, b)| *a += b);
        for c in 0..3 {
            self.normal[c] += other.normal[c];
            self.albedo[c] += other.albedo[c];
        }
        self.depth += other.depth;
        self.hits += other.hits;
    }
}
