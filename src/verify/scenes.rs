//! Scenes for tests.

use std::fmt::Write as _;

use crate::error::Result;
use crate::scene::Scene;
use crate::scene::load::load_str;

/// A scene that asks for no effect.
pub const EMPTY: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n\
                     [image]\nwidth = 16\nheight = 16\n";

/// The text of a scene, piece by piece.
#[derive(Clone, Debug, Default)]
pub struct SceneText(String);

impl SceneText {
    /// A camera at `position` that looks at `look_at` with a field of view of 36 degrees.
    #[must_use]
    pub fn new(position: [f64; 3], look_at: [f64; 3]) -> Self {
        Self(format!(
            "[camera]\nposition = {position:?}\nlook_at = {look_at:?}\nfov = 36.0\n\
             [image]\nwidth = 16\nheight = 16\n"
        ))
    }

    /// The same in a constant environment of radiance `gray`.
    #[must_use]
    pub fn environment(mut self, gray: f64) -> Self {
        let _ = writeln!(self.0, "[environment]\nradiance = {:?}", [gray; 3]);
        self
    }

    /// With a material; `members` are lines of the scene file.
    #[must_use]
    pub fn material(mut self, name: &str, members: &str) -> Self {
        let _ = writeln!(self.0, "[material.{name}]\n{members}");
        self
    }

    /// With a gray diffuse material.
    #[must_use]
    pub fn diffuse(self, name: &str, albedo: f64, emission: f64) -> Self {
        let (albedo, emission) = ([albedo; 3], [emission; 3]);
        self.material(
            name,
            &format!("type = \"diffuse\"\nalbedo = {albedo:?}\nemission = {emission:?}"),
        )
    }

    /// With glass.
    #[must_use]
    pub fn dielectric(self, name: &str, ior: f64) -> Self {
        self.material(name, &format!("type = \"dielectric\"\nior = {ior:?}"))
    }

    /// With a sphere.
    #[must_use]
    pub fn sphere(mut self, center: [f64; 3], radius: f64, material: &str) -> Self {
        let _ = writeln!(
            self.0,
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\""
        );
        self
    }

    /// The scene.
    ///
    /// # Errors
    /// If the text is no scene.
    pub fn load(&self) -> Result<Scene> {
        Ok(load_str("check", &self.0)?.scene)
    }
}
