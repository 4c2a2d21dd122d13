//! Forms of materials in the kernel.

use glam::DVec3;

/// What of a material is in the kernel together: a set of functions, chosen by the kind code.
#[derive(Debug, PartialEq, Eq)]
pub struct Form {
    /// Its name: of its effect, and of `sample_NAME` and `evaluate_NAME` in the kernel.
    pub name: &'static str,
    /// The `type` of its material in scene files, with hyphens, and of its module, with underscores.
    pub material: &'static str,
    /// What it adds, in a few words.
    pub what: &'static str,
    /// Whether it scatters light in delta lobes alone.
    pub delta: bool,
    /// Whether it has a delta lobe beside others: `sample` takes it where u.z is below its probability, and the
    /// kernel has that as `share_NAME(surface, wo)`.
    pub part_delta: bool,
    /// Whether paths cross the surface.
    pub transmits: bool,
    /// Of one that does not: whether it looks at the index before the surface.
    pub relative: bool,
    /// Whether it reflects by Lambert's law and does nothing else, so that values of cells can stand for what it
    /// reflects.
    pub lambertian: bool,
    /// How light goes by a sphere of it, where images of lamps are looked for in such spheres.
    pub imaging: Option<Imaging>,
    /// Whether it looks at where on the sphere the point is: `Surface::offset`, which no other kernel has. The kernel asks
    /// it once a vertex, by `find_NAME(surface)`, and keeps the answer in `Surface::found`.
    pub offset: bool,
    /// Members of the kernel's `Material` that it reads, besides those that all have.
    pub members: &'static [Member],
    /// Of one that looks at the offset: members that depend on where the pole of a sphere is that is about its pole.
    /// Such a sphere has a record of the material for itself; without pole frames no kernel has them.
    pub anchored: &'static [Member],
    /// Where members follow from the values of keys that may be textures: the kernel's `derive_NAME(material)` makes
    /// them anew from those values, and from the numbers of these keys of the scene file, which it finds as
    /// `key_KEY`.
    pub derives: Option<&'static [&'static str]>,
}

impl Form {
    /// The form with the name of its material that has nothing special.
    #[must_use]
    pub const fn of(material: &'static str) -> Self {
        Self {
            name: material,
            material,
            what: "",
            delta: false,
            part_delta: false,
            transmits: false,
            relative: false,
            lambertian: false,
            imaging: None,
            offset: false,
            members: &[],
            anchored: &[],
            derives: None,
        }
    }

    /// Whether the lecture's estimator draws its directions, uniformly from the hemisphere. Delta lobes have none to
    /// draw, and where paths cross the surface that is no hemisphere: it chooses its own directions.
    #[must_use]
    pub const fn is_hemispherical(&self) -> bool {
        !self.delta && !self.transmits
    }

    /// Whether it scatters light through the surface, so that lamps beyond it are looked for.
    #[must_use]
    pub const fn is_translucent(&self) -> bool {
        self.transmits && !self.delta
    }
}

/// How light goes by a sphere that scatters it in delta lobes alone: what is known of these before a path meets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imaging {
    /// By one lobe, about the mirror direction, of the material's colour whatever the angle.
    Reflects,
    /// By that lobe and a refracted one, with the shares that [`fresnel`](super::fresnel::fresnel) says for the material's
    /// index. `sample` takes the first where u.z is 0, unless that has no share, and the other where it is 1.
    Refracts,
}

/// A member of the kernel's `Material`. Materials may share one, of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub kind: MemberKind,
}

/// The type of a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemberKind {
    /// `vec3f`
    Vector,
    /// `f32`
    Scalar,
    /// `u32`
    Word,
}

impl Member {
    /// A `vec3f`.
    #[must_use]
    pub const fn vector(name: &'static str) -> Self {
        let kind = MemberKind::Vector;
        Self { name, kind }
    }

    /// An `f32`.
    #[must_use]
    pub const fn scalar(name: &'static str) -> Self {
        let kind = MemberKind::Scalar;
        Self { name, kind }
    }

    /// The value for materials that do not have it: 0, but 1 for a refractive index.
    #[must_use]
    pub fn neutral(self) -> MemberValue {
        match self.kind {
            MemberKind::Vector => MemberValue::Vector([0.0; 3]),
            MemberKind::Scalar if self.name == "ior" => MemberValue::Scalar(1.0),
            MemberKind::Scalar => MemberValue::Scalar(0.0),
            MemberKind::Word => MemberValue::Word(0),
        }
    }

    /// A `u32`.
    #[must_use]
    pub const fn word(name: &'static str) -> Self {
        let kind = MemberKind::Word;
        Self { name, kind }
    }
}

/// The value of a member, rounded to f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MemberValue {
    /// Of a `vec3f`.
    Vector([f32; 3]),
    /// Of an `f32`.
    Scalar(f32),
    /// Of a `u32`.
    Word(u32),
}

impl MemberValue {
    /// Its type.
    #[must_use]
    pub fn kind(&self) -> MemberKind {
        match self {
            Self::Vector(_) => MemberKind::Vector,
            Self::Scalar(_) => MemberKind::Scalar,
            Self::Word(_) => MemberKind::Word,
        }
    }
}

impl From<DVec3> for MemberValue {
    fn from(v: DVec3) -> Self {
        Self::Vector(v.as_vec3().to_array())
    }
}

impl From<f64> for MemberValue {
    fn from(x: f64) -> Self {
        Self::Scalar(x as f32)
    }
}
