//! A material as a scene has it: how it scatters light, what it emits, and which of its values are textures.

use std::collections::BTreeMap;

use glam::DVec3;

use super::texturable::{EMISSION, ROUGHNESS, WEIGHT};
use super::texture::{Texture, Textured};
use super::{Form, MaterialKind, Texturable, Value};

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name by which spheres refer to it.
    pub name: String,
    /// How it scatters light; where textures are, with the largest value of each channel.
    pub kind: MaterialKind,
    /// Radiance emitted on both sides of the surface; zero for most materials. Of a texture the largest of each
    /// channel.
    pub emission: DVec3,
    /// The keys that are textures, each once.
    pub textures: Vec<Textured>,
}

/// The value of a key as its material takes it.
pub(crate) fn parameter(key: &Texturable, value: DVec3) -> (&'static str, Value) {
    let value = match key.number {
        true => Value::Number(value.x),
        false => Value::Vector(value),
    };
    (key.key, value)
}

impl Material {
    /// One that neither emits nor has textures.
    #[must_use]
    pub fn new(name: &str, kind: MaterialKind) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            emission: DVec3::ZERO,
            textures: Vec::new(),
        }
    }

    /// The same with a texture for the value of a key.
    #[must_use]
    pub fn with_texture(mut self, key: &'static Texturable, texture: Texture) -> Self {
        let largest = texture.largest();
        match key.key {
            EMISSION => self.emission = largest,
            _ => self.kind = self.kind.with(&[parameter(key, largest)]),
        }
        self.textures.retain(|textured| textured.key != key);
        self.textures.push(Textured { key, texture });
        self
    }

    /// Whether all that its surface does is to reflect by Lambert's law, with a light of its own or not.
    #[must_use]
    pub fn is_diffuse(&self) -> bool {
        self.kind.form().lambertian
    }

    /// The texture of a key.
    #[must_use]
    pub fn texture(&self, key: &str) -> Option<&Texture> {
        let mut all = self.textures.iter();
        all.find(|textured| textured.key.key == key)
            .map(|textured| &textured.texture)
    }

    /// All textures that are looked up where it is, with their keys: its own, those of a mix's parts, and weights of
    /// mixes in the mix.
    #[must_use]
    pub fn looked_up(&self) -> Vec<(&'static str, &Texture)> {
        let own = self.textures.iter().map(|t| (t.key.key, &t.texture));
        let parts = self.kind.parts().iter().flat_map(|part| {
            let weights = part.texture_weights().map(|(_, texture)| (WEIGHT, texture));
            part.material.looked_up().into_iter().chain(weights)
        });
        own.chain(parts).collect()
    }

    /// Whether the pattern of one of these is about the sphere's centre.
    #[must_use]
    pub fn has_patterns(&self) -> bool {
        let all = self.looked_up();
        let mut all = all.iter();
        all.any(|(_, texture)| !matches!(texture, Texture::Image(_)))
    }

    /// Whether the kernel has a record of it for each sphere that is about its pole.
    #[must_use]
    pub fn is_anchored(&self) -> bool {
        self.has_patterns() || self.forms().any(|form| !form.anchored.is_empty())
    }

    /// The mean of what is emitted over a sphere.
    #[must_use]
    pub fn mean_emission(&self) -> DVec3 {
        self.texture(EMISSION).map_or(self.emission, Texture::mean)
    }

    /// The forms that it has somewhere: that of `kind`, and the smooth one where its roughness is 0; of a mix those of its
    /// parts, too.
    pub fn forms(&self) -> impl Iterator<Item = &'static Form> {
        let own = self.kind.form();
        let smooth = self.smooth_form();
        let parts = self.kind.parts().iter();
        let parts: Vec<&Form> = parts
            .flat_map(|part| part.material.forms().collect::<Vec<_>>())
            .collect();
        let own = std::iter::once(own).chain(smooth.filter(move |smooth| *smooth != own));
        own.chain(parts)
    }

    /// The form where its roughness is 0, if that is a texture and 0 somewhere.
    #[must_use]
    pub fn smooth_form(&self) -> Option<&'static Form> {
        let roughness = self.texture(ROUGHNESS)?;
        let smooth = roughness.least().x == 0.0;
        smooth.then(|| self.kind.with(&[(ROUGHNESS, Value::Number(0.0))]).form())
    }

    /// The material with what its textures are at their extremes, all with all; without textures itself.
    fn extremes(&self) -> Vec<MaterialKind> {
        let mut kinds = vec![self.kind.clone()];
        let scattering = |textured: &&Textured| textured.key.key != EMISSION;
        for Textured { key, texture } in self.textures.iter().filter(scattering) {
            let values = texture.extremes();
            let with = |kind: &MaterialKind| {
                let with = |value: &DVec3| kind.with(&[parameter(key, *value)]);
                values.iter().map(with).collect::<Vec<_>>()
            };
            kinds = kinds.iter().flat_map(with).collect();
        }
        kinds
    }

    /// The share of the light that it scatters, at most, by channel: the largest at the extremes of its textures.
    #[must_use]
    pub fn albedo(&self) -> DVec3 {
        let extremes = self.extremes();
        let albedos = extremes.iter().map(|kind| kind.albedo());
        albedos.fold(DVec3::ZERO, DVec3::max)
    }

    /// The same of [`moment`](crate::materials::Bsdf::moment).
    #[must_use]
    pub fn moment(&self, channel: usize, k: i32) -> f64 {
        let extremes = self.extremes();
        let moments = extremes.iter().map(|kind| kind.moment(channel, k));
        moments.fold(0.0, f64::max)
    }

    /// What is legal and probably not meant, and what to change; of several extremes each kind of words once.
    #[must_use]
    pub fn warning(&self) -> Option<[String; 2]> {
        let extremes = self.extremes();
        let warnings = extremes.iter().filter_map(|kind| kind.warning());
        // By what to do, since figures differ; the largest of them is the last by its words.
        let mut said: BTreeMap<String, String> = BTreeMap::new();
        for [what, help] in warnings {
            let before = said.entry(help).or_default();
            if *before < what {
                *before = what;
            }
        }
        said.into_iter().next().map(|(help, what)| [what, help])
    }
}
