//! A name for a scene's values, to tell whether two renders are of the same scene.

use std::fs::File;
use std::hash::Hasher as _;
use std::io::{self, BufRead as _, BufReader};
use std::path::Path;

use fnv::FnvHasher;
use glam::DVec3;

use super::{Environment, Gradient, Handedness, Scene};
use crate::image::Picture;
use crate::materials::mix::Weight;
use crate::materials::texturable::WEIGHT;
use crate::materials::{MaterialKind, Texture, Textured, Value};

/// Hash of everything in the scene that the image depends on: 16 hexadecimal digits.
///
/// Camera, image size, environment and every sphere with its way while the shutter is open and the values of its
/// material count. Names
/// and order of materials, unused materials, the options of `[render]`, comments and the way
/// numbers are written do not. FNV-1a with 64 bits over the values' little-endian bytes: stable
/// over machines and versions, good against accidents, not against forgery.
#[must_use]
pub fn content_hash(scene: &Scene) -> String {
    let mut hash = Fnv::default();
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
    hash.environment(scene.environment.as_ref());
    hash.bytes(&(scene.spheres.len() as u64).to_le_bytes());
    for sphere in &scene.spheres {
        hash.vector(sphere.center);
        hash.number(sphere.radius);
        if sphere.motion != DVec3::ZERO {
            hash.bytes(b"motion");
            hash.vector(sphere.motion);
        }
        hash.bytes(&i64::from(sphere.priority.unwrap_or_default()).to_le_bytes());
        hash.byte(u8::from(sphere.priority.is_some()));
        let material = &scene.materials[sphere.material];
        hash.vector(material.emission);
        hash.kind(&material.kind);
        for Textured { key, texture } in &material.textures {
            hash.texture(key.key, texture);
        }
    }
    format!("{:016x}", hash.0.finish())
}

/// The same of the bytes of a file.
///
/// # Errors
/// If it cannot be read.
pub fn file_hash(path: &Path) -> io::Result<String> {
    let mut hasher = FnvHasher::default();
    let mut file = BufReader::new(File::open(path)?);
    loop {
        let bytes = file.fill_buf()?;
        if bytes.is_empty() {
            return Ok(format!("{:016x}", hasher.finish()));
        }
        hasher.write(bytes);
        let count = bytes.len();
        file.consume(count);
    }
}

#[derive(Default)]
struct Fnv(FnvHasher);

impl Fnv {
    fn byte(&mut self, byte: u8) {
        self.bytes(&[byte]);
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
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

    fn environment(&mut self, environment: Option<&Environment>) {
        match environment {
            None => self.vector(DVec3::ZERO),
            Some(Environment::Constant(radiance)) => self.vector(*radiance),
            Some(Environment::Gradient(Gradient {
                zenith,
                horizon,
                ground,
            })) => {
                self.bytes(b"gradient");
                for radiance in [zenith, horizon, ground] {
                    self.vector(*radiance);
                }
            }
            Some(Environment::Sky(sky)) => {
                self.bytes(b"image");
                self.vector(sky.scale());
                self.number(sky.rotation());
                self.image(sky.image());
            }
        }
    }

    fn image(&mut self, image: &Picture) {
        self.bytes(&image.width.to_le_bytes());
        self.bytes(&image.height.to_le_bytes());
        for value in image.pixels.as_flattened() {
            self.bytes(&value.to_bits().to_le_bytes());
        }
    }

    fn texture(&mut self, key: &str, texture: &Texture) {
        self.bytes(key.as_bytes());
        match texture {
            Texture::Checker { values, size } => {
                self.bytes(b"checker");
                self.vector(values[0]);
                self.vector(values[1]);
                self.number(*size);
            }
            Texture::Noise {
                values,
                size,
                octaves,
            } => {
                self.bytes(b"noise");
                self.vector(values[0]);
                self.vector(values[1]);
                self.number(*size);
                self.bytes(&octaves.to_le_bytes());
            }
            Texture::Image(image) => {
                self.bytes(b"image");
                self.vector(image.axis());
                self.image(image.image());
            }
        }
    }

    fn kind(&mut self, kind: &MaterialKind) {
        self.bytes(kind.name().as_bytes());
        for (_, value) in kind.parameters() {
            self.value(value);
        }
        for part in kind.parts() {
            self.byte(part.second.into());
            for factor in &part.inner {
                self.byte(factor.second.into());
                match &factor.weight {
                    Weight::Number(weight) => self.number(*weight),
                    Weight::Texture(texture) => self.texture(WEIGHT, texture),
                }
            }
            self.kind(&part.material.kind);
            for Textured { key, texture } in &part.material.textures {
                self.texture(key.key, texture);
            }
        }
    }

    fn value(&mut self, value: Value) {
        match value {
            Value::Number(number) => self.number(number),
            Value::Vector(vector) => self.vector(vector),
            Value::Pair(pair) => {
                self.number(pair.x);
                self.number(pair.y);
            }
            Value::Vectors(vectors) => vectors.into_iter().for_each(|v| self.vector(v)),
            // What they name counts.
            Value::Names(_) => {}
            Value::File { content, .. } => self.bytes(&content.to_le_bytes()),
            // Tables may be left out: their keys say which there are.
            Value::Table(values) => {
                for (key, value) in values {
                    self.bytes(key.as_bytes());
                    self.value(value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::ALL;
    use crate::scene::load::load_str;

    const TEXT: &str = r#"
        camera = { position = [0, 0, -4], look_at = [0, 0, 6], fov = 36, aperture_radius = 0.1, focus_distance = 4 }
        image = { width = 64, height = 48 }
        render = { spp = 16, max_bounces = 8 }
        environment = { radiance = [0.7, 0.8, 1] }
        material.glass = { type = "dielectric", ior = 1.5 }
        material.matte = { type = "diffuse", albedo = [0.1, 0.2, 0.3] }
        material.shiny = { type = "reflective", albedo = [0.1, 0.2, 0.3], specular = [1, 1, 1], epsilon = 0.01, mu = 9 }
        material.chrome = { type = "mirror", reflectance = [0.1, 0.2, 0.3] }
        material.sprayed = { type = "car-paint", preset = "polaris-silber", m = [0.3, 0.2, 0.1], clearcoat = { ior = 1.5 } }
        sphere = [
            { center = [0, 0, 0], radius = 1, material = "glass", priority = 0 },
            { center = [3, 0, 0], radius = 1, material = "matte" },
            { center = [6, 0, 0], radius = 1, material = "shiny" },
            { center = [9, 0, 0], radius = 1, material = "chrome" },
            { center = [12, 0, 0], radius = 1, material = "sprayed" },
        ]
    "#;

    fn scene() -> Scene {
        load_str("scene", TEXT).expect("good").scene
    }

    #[test]
    fn fnv_has_its_published_values() {
        let mut hash = Fnv::default();
        hash.bytes(b"foobar");
        assert_eq!(hash.0.finish(), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn every_value_of_the_image_changes_the_hash() {
        let gradient = |zenith| {
            let [horizon, ground] = [DVec3::ZERO; 2];
            Some(Environment::Gradient(Gradient {
                zenith,
                horizon,
                ground,
            }))
        };
        let mut changed: Vec<Scene> = [DVec3::ONE, DVec3::X]
            .map(|zenith| Scene {
                environment: gradient(zenith),
                ..scene()
            })
            .into();
        let changes: [fn(&mut Scene); 16] = [
            |scene| scene.camera.position.x = 1e-300,
            |scene| scene.camera.look_at.y = 1.0,
            |scene| scene.camera.up.z = 1.0,
            |scene| scene.camera.fov = 36.000_000_000_000_01,
            |scene| scene.camera.handedness = Handedness::Left,
            |scene| scene.camera.aperture_radius = 0.2,
            |scene| scene.camera.focus_distance = 5.0,
            |scene| std::mem::swap(&mut scene.width, &mut scene.height),
            |scene| scene.environment = None,
            |scene| scene.spheres[0].center.x = 1.0,
            |scene| scene.spheres[1].radius = 2.0,
            |scene| scene.spheres[1].motion.y = 1.0,
            |scene| scene.spheres[2].motion.y = 1.0,
            |scene| scene.spheres[0].priority = None,
            |scene| scene.materials[3].emission.y = 1.0,
            |scene| scene.spheres.swap(0, 1),
        ];
        let mut hashes = vec![content_hash(&scene())];
        for alter in changes {
            let mut scene = scene();
            alter(&mut scene);
            changed.push(scene);
        }
        hashes.extend(changed.iter().map(content_hash));
        let count = hashes.len();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), count);
        assert!(hashes.iter().all(|hash| hash.len() == 16), "{hashes:?}");
    }

    /// The value with another number in it; `None` where what it names counts.
    fn altered(value: &Value) -> Option<Value> {
        let other = |x: f64| if x == 0.0 { 0.25 } else { 0.5 * x };
        let vector = |v: DVec3| v.with_z(other(v.z));
        Some(match value {
            Value::Number(x) => Value::Number(other(*x)),
            Value::Vector(v) => Value::Vector(vector(*v)),
            Value::Pair(pair) => Value::Pair(pair.with_y(other(pair.y))),
            Value::Vectors(all) => Value::Vectors(all.iter().map(|v| vector(*v)).collect()),
            Value::Table(values) => {
                let inner = values.iter();
                let inner = inner.filter_map(|(key, value)| Some((*key, altered(value)?)));
                Value::Table(inner.collect())
            }
            Value::Names(_) | Value::File { .. } => return None,
        })
    }

    #[test]
    fn every_parameter_of_every_material_changes_the_hash() {
        let hash = |kind: &MaterialKind| {
            let mut scene = scene();
            scene.materials[0].kind = kind.clone();
            content_hash(&scene)
        };
        for material in ALL {
            let mut changed = 0;
            for kind in (material.cases)() {
                let mut hashes = vec![hash(&kind)];
                for (key, value) in kind.parameters() {
                    let Some(value) = altered(&value) else {
                        continue;
                    };
                    hashes.push(hash(&kind.with(&[(key, value)])));
                    changed += 1;
                }
                let count = hashes.len();
                hashes.sort();
                hashes.dedup();
                assert_eq!(hashes.len(), count, "{kind:?}");
            }
            assert!(changed > 0, "{}", material.name);
        }
    }

    #[test]
    fn what_the_image_does_not_depend_on_does_not_count() {
        let mut other = scene();
        other.render.spp = None;
        other.camera.position.x = -0.0;
        other.materials.reverse();
        for sphere in &mut other.spheres {
            sphere.material = 4 - sphere.material;
        }
        other.materials[0].name = "other".to_owned();
        other.materials.push(other.materials[0].clone());
        assert_eq!(content_hash(&other), content_hash(&scene()));
        let [mut near, mut far] = [scene(), scene()];
        near.camera.aperture_radius = 0.0;
        far.camera.aperture_radius = 0.0;
        far.camera.focus_distance = 9.0;
        assert_eq!(content_hash(&near), content_hash(&far), "a pinhole");
    }
}
