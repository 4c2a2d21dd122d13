//! `Material` of the module `bsdf`, which has the members that the forms in the kernel need.

use glam::DVec3;

use crate::materials::dielectric::Index;
use crate::materials::texturable::{key_values, smooth_kind, texture_member};
use crate::materials::{Material, Member, MemberValue, forms};
use crate::placement::{PlacedSphere, Placement};
use crate::scene::Scene;

/// What a material's inner side absorbs per unit length of the kernel. Below the normal numbers of f32 it is the least
/// of these, which is as good as nothing on any way that is not infinite.
fn absorption(material: &Material, length: f64) -> [f32; 3] {
    let rounded = |x: f64| match x {
        0.0 => 0.0,
        x => ((x / length) as f32).max(f32::MIN_POSITIVE),
    };
    material.kind.absorption().to_array().map(rounded)
}

/// What says how a material's index depends on the wavelength: 0 where it does not.
fn dispersion(material: &Material) -> [(Member, MemberValue); 3] {
    let (cauchy, terms) = match material.kind.dispersion() {
        Some(Index::Cauchy(terms)) => (terms.y, None),
        Some(Index::Sellmeier(terms)) => (0.0, Some(terms)),
        Some(Index::Constant(_)) | None => (0.0, None),
    };
    let [b, c] = terms.map_or([DVec3::ZERO; 2], |terms| [terms.b, terms.c]);
    // A term of no strength is none, wherever its resonance is.
    let c = DVec3::select(b.cmpeq(DVec3::ZERO), DVec3::ZERO, c);
    [
        (Member::scalar("cauchy"), cauchy.into()),
        (Member::vector("sellmeier_b"), b.into()),
        (Member::vector("sellmeier_c"), c.into()),
    ]
}

/// The spheres about their poles whose materials look at the offset: each has a record of its material for itself,
/// after those of the scene's materials.
pub fn anchored_spheres<'a>(
    scene: &'a Scene,
    placement: &'a Placement,
) -> impl Iterator<Item = usize> + 'a {
    let is_anchored =
        move |i: &usize| scene.materials[placement.spheres[*i].material].is_anchored();
    (0..placement.poles).filter(is_anchored)
}

/// The numbers by which the kernel knows the textures of some keys.
pub type Numbers = Vec<(&'static str, u32)>;

/// What a kernel may want to know of a material, rounded to f32.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialRecord {
    values: Vec<(Member, MemberValue)>,
}

impl MaterialRecord {
    /// The record of `material`, emission times `radiance_scale`, for lengths that are multiplied by `length`.
    ///
    /// # Panics
    /// If the form of the material is not in the list of all forms.
    #[must_use]
    pub fn new(material: &Material, radiance_scale: f64, length: f64) -> Self {
        let form = material.kind.form();
        let code = forms().iter().position(|f| *f == form);
        let code = code.expect("every material is in the list");
        let common = [
            (Member::vector("color"), material.kind.color().into()),
            (Member::word("kind"), MemberValue::Word(code as u32)),
            (
                Member::vector("emission"),
                (material.emission * radiance_scale).into(),
            ),
            (
                Member::vector("absorption"),
                MemberValue::Vector(absorption(material, length)),
            ),
        ];
        let own = form.members.iter().copied().zip(material.kind.members());
        let common = common.into_iter().chain(dispersion(material));
        Self {
            values: common.chain(own).collect(),
        }
    }

    /// The same with the numbers of its textures, and what their values are put in place of.
    #[must_use]
    pub fn with_textures(mut self, material: &Material, numbers: &Numbers) -> Self {
        if numbers.is_empty() {
            return self;
        }
        let kind = &material.kind;
        let smooth = material.smooth_form().unwrap_or(kind.form());
        let code = forms().iter().position(|form| *form == smooth);
        let code = code.expect("every material is in the list");
        self.values
            .push((smooth_kind(), MemberValue::Word(code as u32)));
        let keys = key_values(kind.parameters());
        self.values
            .extend(keys.map(|(member, number)| (member, number.into())));
        let numbers = numbers.iter();
        let members = numbers.map(|(key, n)| (texture_member(key), MemberValue::Word(*n)));
        self.values.extend(members);
        self
    }

    /// The same with a number that only the whole scene tells, of a material that has this member.
    #[must_use]
    pub fn with_word(mut self, member: Member, word: u32) -> Self {
        let mut values = self.values.iter_mut();
        if let Some((_, value)) = values.find(|(own, _)| *own == member) {
            *value = MemberValue::Word(word);
        }
        self
    }

    /// That of a material, with what depends on where the pole of a sphere is.
    #[must_use]
    pub fn of_sphere(material: &Material, sphere: &PlacedSphere, placement: &Placement) -> Self {
        let mut record = Self::new(material, placement.radiance_scale, placement.scale);
        if sphere.pole.is_some() {
            let members = material.kind.form().anchored.iter().copied();
            let values = material
                .kind
                .anchored(sphere.anchor_offset(placement.scale));
            record.values.extend(members.zip(values));
        }
        record
    }

    /// The value of a member; of one that the material does not have, 0, or 1 for a refractive index.
    fn value(&self, member: Member) -> MemberValue {
        let own = self.values.iter().find(|(m, _)| *m == member);
        own.map_or(member.neutral(), |(_, value)| *value)
    }

    /// The member as a WGSL literal.
    #[must_use]
    pub fn literal(&self, member: Member) -> String {
        match self.value(member) {
            MemberValue::Vector([x, y, z]) => format!("vec3f({x:?}f, {y:?}f, {z:?}f)"),
            MemberValue::Scalar(x) => format!("{x:?}f"),
            MemberValue::Word(x) => format!("{x}u"),
        }
    }

    /// The record's bytes in a struct with these members, at these offsets, and this size.
    #[must_use]
    pub fn bytes(&self, members: &[(Member, u32)], size: u32) -> Vec<u8> {
        let mut bytes = vec![0; size as usize];
        for (member, offset) in members {
            let value = self.value(*member);
            let value: &[u8] = match &value {
                MemberValue::Vector(v) => bytemuck::cast_slice(&v[..]),
                MemberValue::Scalar(x) => &x.to_ne_bytes(),
                MemberValue::Word(x) => &x.to_ne_bytes(),
            };
            bytes[*offset as usize..][..value.len()].copy_from_slice(value);
        }
        bytes
    }
}
