//! The gallery: scenes that are part of the program.

use std::path::{MAIN_SEPARATOR, Path};

use super::direct;
use super::load::{Loaded, load_file_at, load_str};
use super::particles::look::Look;
use super::suggest::nearest;
use crate::error::{Error, Result};
use crate::particles::Format;

/// The scene that is rendered when none is named.
pub const DEFAULT: &str = "lecture";

/// A scene that is part of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it shows, in one line.
    pub description: &'static str,
    /// The scene file.
    pub text: &'static str,
}

/// All built-in scenes, the default one first.
pub const GALLERY: &[Builtin] = &[
    Builtin {
        name: DEFAULT,
        description: "the lecture's room: two diffuse spheres between walls of radius 1000",
        text: include_str!("../../scenes/lecture.toml"),
    },
    Builtin {
        name: "lecture-reflective",
        description: "the same with the lecture's reflective material on three of its spheres",
        text: include_str!("../../scenes/lecture-reflective.toml"),
    },
    Builtin {
        name: "glass",
        description: "a mirror ball and a glass ball in a room of huge spheres, with a caustic",
        text: include_str!("../../scenes/glass.toml"),
    },
    Builtin {
        name: "field",
        description: "480 spheres of all materials under a sky, through a thin lens",
        text: include_str!("../../scenes/field.toml"),
    },
    Builtin {
        name: "ashikhmin",
        description: "the anisotropic Phong model: plastic from dull to polished, and brushed metals",
        text: include_str!("../../scenes/ashikhmin.toml"),
    },
    Builtin {
        name: "disney",
        description: "the principled model of 2012: plastic, skin, metals, velvet, lacquer",
        text: include_str!("../../scenes/disney.toml"),
    },
    Builtin {
        name: "sheen",
        description: "cloth of rising roughness, lit from behind",
        text: include_str!("../../scenes/sheen.toml"),
    },
    Builtin {
        name: "nylon",
        description: "nylon as measured, dyed, and with other distributions of microfacets",
        text: include_str!("../../scenes/nylon.toml"),
    },
    Builtin {
        name: "car-paint",
        description: "car paint as measured, and with flakes of metal under a clear coat",
        text: include_str!("../../scenes/car-paint.toml"),
    },
    Builtin {
        name: "frosted-glass",
        description: "frosted and tinted glass balls on a table, one around a lamp",
        text: include_str!("../../scenes/frosted-glass.toml"),
    },
    Builtin {
        name: "prism",
        description: "coloured caustics of glass whose index depends on the wavelength",
        text: include_str!("../../scenes/prism.toml"),
    },
    Builtin {
        name: "mix",
        description: "mixes of materials: rust on iron, gold on lacquer, dust on a mirror, dirt and lichen on a car's paint",
        text: include_str!("../../scenes/mix.toml"),
    },
    Builtin {
        name: "motion",
        description: "balls that roll, fall and fly, and a lamp that does, while the shutter is open",
        text: include_str!("../../scenes/motion.toml"),
    },
];

/// The names of the built-in scenes, the default one first.
pub fn names() -> impl Iterator<Item = &'static str> {
    GALLERY.iter().map(|builtin| builtin.name)
}

/// The built-in scene of that name.
#[must_use]
pub fn get(name: &str) -> Option<&'static Builtin> {
    GALLERY.iter().find(|builtin| builtin.name == name)
}

/// The scene that a command line's `SCENE` means.
///
/// Nothing means the default scene. A word that ends as a particle file does is one. A word with a path
/// separator or ending in `.toml` is always a file. Any other word is an existing file, else a built-in scene.
///
/// # Errors
/// Those of [`load_file_at`], and [`Error::Usage`] for a word that is neither.
pub fn resolve(argument: Option<&str>) -> Result<Loaded> {
    resolve_as(argument, &Look::default(), None)
}

/// The same, with a particle file shown as `look` says, and in a scene file those that name no frame and have
/// several at a frame.
///
/// # Errors
/// Those of [`resolve`], and [`Error::Usage`] if a look is asked for and the word is no particle file.
pub fn resolve_as(argument: Option<&str>, look: &Look, frame: Option<u64>) -> Result<Loaded> {
    let particles = argument
        .map(Path::new)
        .filter(|path| Format::of_path(path).is_some());
    if let Some(path) = particles {
        return direct::load(path, look);
    }
    if let Some(option) = look.given() {
        return Err(Error::Usage(format!(
            "{option}: it is for particle files; in a scene file it is a key of `[[particles]]`"
        )));
    }
    let word = argument.unwrap_or(DEFAULT);
    let separator = word.contains('/') || word.contains(MAIN_SEPARATOR);
    let path = Path::new(word);
    let toml = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    // A directory that happens to be called like a built-in scene does not hide it.
    if argument.is_some() && (separator || toml || path.is_file()) {
        return load_file_at(path, frame);
    }
    if let Some(builtin) = get(word) {
        return load_str(builtin.name, builtin.text);
    }
    if path.exists() {
        return load_file_at(path, frame);
    }
    let known = names().collect::<Vec<_>>().join(", ");
    let meant =
        nearest(word, names()).map_or_else(String::new, |name| format!("; did you mean `{name}`?"));
    Err(Error::Usage(format!(
        "no scene `{}`: neither a file nor a built-in scene ({known}){meant}",
        word.escape_debug()
    )))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::Handedness;
    use super::*;
    use crate::materials::diffuse::Diffuse;

    #[test]
    fn the_default_scene_is_the_lecture() {
        let scene = resolve(None).expect("lecture").scene;
        assert_eq!(scene.spheres.len(), 7);
        assert_eq!(scene.camera.handedness, Handedness::Left);
        let cyan = scene
            .materials
            .iter()
            .find(|m| m.name == "cyan")
            .expect("cyan");
        let albedo = DVec3::new(0.878, 1.0, 1.0);
        assert_eq!(cyan.kind, Diffuse { albedo }.into());
        assert_eq!(scene.spheres[4].center.y, 1001.0);
    }

    #[test]
    fn words_are_files_or_built_in_scenes() {
        let error = resolve(Some("lecure")).expect_err("neither");
        assert!(matches!(error, Error::Usage(_)), "{error:?}");
        let text = error.to_string();
        assert!(
            text.contains("did you mean `lecture`?") && text.contains("field"),
            "{text}"
        );
        for file in ["./lecture", "lecture.toml", "scenes/none"] {
            let error = resolve(Some(file)).expect_err("no such file");
            assert!(matches!(error, Error::File { .. }), "{file}: {error:?}");
        }
    }
}
