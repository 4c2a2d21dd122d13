//! A name for a scene's values, to tell whether two renders are of the same scene.

use glam::DVec3;

use super::{Handedness, MaterialKind, Scene};

/// Hash of everything in the scene that the image depends on: 16 hexadecimal digits.
///
/// Camera, image size, environment and every sphere with the values of its material count. Names
/// and order of materials, unused materials, the options of `[render]`, comments and the way
/// numbers are written do not. FNV-1a with 64 bits over the values' little-endian bytes: stable
/// over machines and versions, good against accidents, not against forgery.
#[must_use]
pub fn content_hash(scene: &Scene) -> String {
    let mut hash = Fnv::new();
    let camera = &scene.camera;
    hash.vector(camera.position);
    hash.vector(camera.look_at);
    hash.vector(camera.up);
    hash.number(camera.fov);
    hash.byte(match camera.handedness {
        Handedness::Right => 0,
        Handedness::Left => 1,
    });
    hash.number(camera.aperture_radius);
    // A pinhole has everything in focus.
    if camera.aperture_radius > 0.0 {
        hash.number(camera.focus_distance);
    }
    hash.bytes(&scene.width.to_le_bytes());
    hash.bytes(&scene.height.to_le_bytes());
    hash.vector(scene.environment.unwrap_or_default());
    hash.bytes(&(scene.spheres.len() as u64).to_le_bytes());
    for sphere in &scene.spheres {
        hash.vector(sphere.center);
        hash.number(sphere.radius);
        hash.bytes(&i64::from(sphere.priority.unwrap_or_default()).to_le_bytes());
        hash.byte(u8::from(sphere.priority.is_some()));
        let material = &scene.materials[sphere.material];
        hash.vector(material.emission);
        hash.kind(&material.kind);
    }
    format!("{:016x}", hash.0)
}

struct Fnv(u64);

impl Fnv {
    // Offset basis and prime: Fowler, Noll, Vo; draft-eastlake-fnv.
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.byte(byte);
        }
    }

    fn number(&mut self, number: f64) {
        // The two zeros are equal.
        self.bytes(&(number + 0.0).to_bits().to_le_bytes());
    }

    fn vector(&mut self, vector: DVec3) {
        for number in vector.to_array() {
            self.number(number);
        }
    }

    fn kind(&mut self, kind: &MaterialKind) {
        self.bytes(kind.name().as_bytes());
        match *kind {
            MaterialKind::Diffuse { albedo } => self.vector(albedo),
            MaterialKind::Mirror { reflectance } => self.vector(reflectance),
            MaterialKind::Dielectric { ior } => self.number(ior),
            MaterialKind::Reflective {
                albedo,
                specular,
                epsilon,
                mu,
            } => {
                self.vector(albedo);
                self.vector(specular);
                self.number(epsilon);
                self.number(mu);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv_has_its_published_values() {
        let mut hash = Fnv::new();
        hash.bytes(b"foobar");
        assert_eq!(hash.0, 0x8594_4171_f739_67e8);
    }
}
