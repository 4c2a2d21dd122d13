//! `cargo xtask gallery`: the pictures of docs/gallery.md, each by the command that is shown beside it, with what its
//! kernel holds.

use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;

use crate::{cargo, program, root, run};

const USAGE: &str = "\
Usage: cargo xtask gallery [NAMES...]

Renders the pictures of docs/gallery.md, or those that are named, and writes the page anew: some ten
minutes on two cores.
";

const PAGE: &str = "docs/gallery.md";
const FOLDER: &str = "docs/images/gallery";

/// A picture.
struct Picture {
    /// Of the file, and of its heading in small letters.
    name: &'static str,
    /// What the program is asked for, but for the output.
    command: &'static str,
    /// What is to be seen.
    text: &'static str,
}

const PICTURES: [Picture; 12] = [
    Picture {
        name: "everything",
        command: "scenes/everything.toml --size 480x300 --spp 128",
        text: "Nearly everything in one scene: rough and smooth metals, car paint with flakes under a coat, cloth, nylon, \
               Disney's and Ashikhmin's plastic, glass that absorbs, has a bubble of air in it, is frosted or disperses \
               light, an image, a checker and noise for textures, rust mixed into copper, a ball that flies past, a lamp, a sky, a lens.",
    },
    Picture {
        name: "car-paint",
        command: "car-paint --size 600x250 --spp 512",
        text: "Measured silver, and three paints with flakes of other sizes, densities and spreads under a clear coat \
               (docs/car-paint.md).",
    },
    Picture {
        name: "frosted-glass",
        command: "frosted-glass --size 480x300 --spp 512",
        text: "Rough glass by Walter's model, clear to frosted, with colour that grows with the way through it.",
    },
    Picture {
        name: "prism",
        command: "prism --size 256x192 --spp 8192 --adaptive",
        text: "Glass whose index depends on the wavelength: the light that a lamp sends through it falls apart.",
    },
    Picture {
        name: "textures",
        command: "scenes/textures.toml --size 480x300 --spp 512",
        text: "An image on a ball, a checker on a ground of radius 1e6, noise in a colour and in the roughness of copper.",
    },
    Picture {
        name: "mix",
        command: "mix --size 480x300 --spp 128",
        text: "Mixtures of two materials, by a number and by textures.",
    },
    Picture {
        name: "motion",
        command: "motion --size 480x300 --spp 256",
        text: "Balls that move while the shutter is open.",
    },
    Picture {
        name: "sky",
        command: "scenes/sky.toml --size 480x300 --spp 1024",
        text: "Light from an image all around, whose sun is one texel: it is sampled as a lamp is.",
    },
    Picture {
        name: "disney",
        command: "disney --size 600x250 --spp 512",
        text: "The principled model: plastic, skin, two metals, one of them brushed, velvet, lacquer.",
    },
    Picture {
        name: "ashikhmin",
        command: "ashikhmin --size 600x250 --spp 512",
        text: "Anisotropic Phong: plastic from dull to polished, and metals brushed along and around an axis.",
    },
    Picture {
        name: "sheen",
        command: "sheen --size 600x250 --spp 256",
        text: "Cloth of rising roughness, lit from behind.",
    },
    Picture {
        name: "nylon",
        command: "nylon --size 600x250 --spp 256",
        text: "The ABC model of smooth plastics.",
    },
];

/// Renders, and writes the page.
///
/// # Errors
/// If the program fails, or a picture is not there.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    let known = |name: &String| PICTURES.iter().any(|picture| picture.name == name);
    if !arguments.iter().all(known) {
        return Err(USAGE.into());
    }
    run(cargo().args(["build", "--release"]))?;
    let folder = root().join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(|e| format!("{FOLDER}: {e}"))?;
    for picture in &PICTURES {
        if arguments.is_empty() || arguments.iter().any(|name| name == picture.name) {
            let file = format!("{FOLDER}/{}", picture.name);
            let said = ask(&format!(
                "render {} --progress none -o {file}.png",
                picture.command
            ))?;
            std::fs::write(root().join(format!("{file}.txt")), said)
                .map_err(|e| format!("{file}.txt: {e}"))?;
        }
    }
    std::fs::write(root().join(PAGE), page()?).map_err(|e| format!("{PAGE}: {e}"))
}

/// What the release build answers.
fn ask(words: &str) -> Result<String, String> {
    eprintln!("$ gpu-trace {words}");
    let output = Command::new(program("release"))
        .args(words.split(' '))
        .current_dir(root())
        .env("NODEVICE_SELECT", "1")
        .output()
        .map_err(|e| e.to_string())?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(format!("gpu-trace {words}: {}\n{text}", output.status));
    }
    String::from_utf8(output.stdout).map_err(|e| e.to_string())
}

fn page() -> Result<String, String> {
    let mut page = String::from(
        "# Gallery\n\nA scene for most materials and effects, by the command beside it, with the line that it prints and what \
         its kernel holds. What one of these costs is in [effects.md](effects.md); `gpu-trace effects SCENE --measure` says \
         it for a scene. `cargo xtask gallery` made this page.\n",
    );
    for Picture {
        name,
        command,
        text,
    } in &PICTURES
    {
        let said = root().join(format!("{FOLDER}/{name}.txt"));
        let said =
            std::fs::read_to_string(&said).map_err(|e| format!("{}: {e}", said.display()))?;
        let said = said.replace(&format!("{FOLDER}/"), "");
        let scene = command.split(' ').next().unwrap_or(command);
        let asked: Value = serde_json::from_str(&ask(&format!("effects {scene} --json"))?)
            .map_err(|e| format!("effects {scene}: {e}"))?;
        let rows = asked["effects"].as_array().into_iter().flatten();
        let used = rows.filter(|row| row["used"] == true);
        let names: Vec<String> = used
            .filter_map(|row| Some(format!("`{}`", row["name"].as_str()?)))
            .collect();
        let _ = write!(
            page,
            "\n## {name}\n\n![{name}](images/gallery/{name}.png)\n\n{text}\n\n    gpu-trace {command} -o {name}.png\n\n    \
             {}\n\nIn the kernel, {} lines: {}.\n",
            said.trim(),
            asked["kernel_lines"],
            names.join(", "),
        );
    }
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::PICTURES;
    use crate::root;

    #[test]
    fn pictures_are_of_scenes_that_are_there() {
        for picture in &PICTURES {
            let scene = picture.command.split(' ').next().unwrap_or_default();
            let file = match scene.strip_suffix(".toml") {
                Some(_) => root().join(scene),
                None => root().join(format!("scenes/{scene}.toml")),
            };
            assert!(file.is_file(), "{}: {}", picture.name, file.display());
        }
    }
}
