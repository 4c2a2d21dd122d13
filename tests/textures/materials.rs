//! Every material whose values are textures: what members follow from them.

use glam::DVec3;
use gpu_trace::materials::texturable::{texturable, texturable_key};
use gpu_trace::materials::{ALL, Material, Texture, Value, forms};
use gpu_trace::verify::bsdf::Subjects;
use gpu_trace::verify::bsdf::twin::{Compared, Wrong, samples, values};

use crate::common::gpu;

/// Questions to each case: what is wrong with what follows from textures is wrong for all. That formulas agree where
/// they are hard is what the tests of materials without textures are for.
const CASES: usize = 500;

#[test]
fn colours_and_roughnesses_may_be_textures() {
    let mut keys: Vec<String> = texturable()
        .iter()
        .map(|t| format!("{}.{}", t.material.unwrap_or("*"), t.key))
        .collect();
    keys.sort();
    // Not: car paint's lobes, indices, what is absorbed.
    assert_eq!(
        keys,
        [
            "*.emission",
            "ashikhmin.diffuse",
            "ashikhmin.specular",
            "car-paint.diffuse",
            "conductor.roughness",
            "dielectric.roughness",
            "diffuse.albedo",
            "disney.base_color",
            "disney.roughness",
            "disney.specular",
            "mirror.reflectance",
            "mix.weight",
            "nylon.diffuse",
            "reflective.albedo",
            "reflective.specular",
            "sheen.color",
            "sheen.roughness",
        ]
    );
    let sheen = texturable_key("sheen", "roughness").expect("it may be a texture");
    assert_eq!(
        (sheen.number, sheen.minimum, sheen.maximum),
        (true, 0.05, 1.0)
    );
    // Each of them is one of its parameters, of that kind.
    for material in ALL {
        for kind in (material.cases)() {
            for key in kind.form().texturable() {
                let own = kind.parameters().into_iter().find(|(k, _)| *k == key.key);
                match own {
                    Some((_, Value::Number(_))) => assert!(key.number),
                    Some((_, Value::Vector(_))) => assert!(!key.number),
                    // What is 0 need not be said.
                    None => assert!(key.number),
                    other => panic!("{other:?}"),
                }
            }
        }
    }
}

/// Where answers are wrong, of all; and how many there are.
fn off(subjects: &Subjects, subject: usize) -> (Compared, Option<Compared>) {
    let ask = |wrong| samples(subjects, subject, CASES, wrong).expect("the probe runs");
    let evaluated = !subjects.kinds()[subject].is_delta();
    let values = evaluated
        .then(|| values(subjects, subject, CASES, Wrong::default()).expect("the probe runs"));
    (ask(Wrong::default()), values)
}

#[test]
fn materials_are_what_their_textures_say() {
    let subjects = Subjects::textured(&gpu(), true);
    let plain = Subjects::textured(&gpu(), false);
    for (subject, kind) in subjects.kinds().iter().enumerate() {
        let name = format!("case {subject}, {}", kind.name());
        let (drawn, evaluated) = off(&subjects, subject);
        eprint!("{name}: ");
        drawn.agreement.assert_holds(drawn.cases);
        if let Some(evaluated) = evaluated {
            evaluated.agreement.assert_holds(evaluated.cases);
        }
        // Companion: without its textures it is another material, unless no key of it may be one.
        if kind.form().texturable().next().is_none() {
            continue;
        }
        let (drawn, evaluated) = off(&plain, subject);
        let fails =
            drawn.agreement.any_fails() || evaluated.is_some_and(|e| e.agreement.any_fails());
        assert!(fails, "{name}");
    }
}

#[test]
fn what_is_derived_is_all_that_follows() {
    // Where members change with a key that may be a texture, the form says that it derives them.
    for kind in ALL.iter().flat_map(|material| (material.cases)()) {
        for key in kind.form().texturable() {
            let value = match key.number {
                true => Value::Number(0.43),
                false => Value::Vector(DVec3::new(0.43, 0.21, 0.34)),
            };
            let other = kind.with(&[(key.key, value)]);
            if other.form() != kind.form() {
                continue;
            }
            let direct = kind.form().textured_member(key);
            let members = kind.form().members.iter();
            let both = kind.members().into_iter().zip(other.members());
            let follows = members.zip(both).any(|(m, (a, b))| *m != direct && a != b);
            assert!(
                !follows || kind.form().derives.is_some(),
                "{}: members follow from {}",
                kind.form().name,
                key.key
            );
        }
    }
    assert!(forms().iter().any(|form| form.derives.is_some()));
}

#[test]
fn bounds_are_those_of_the_brightest_texels() {
    let of = |a: [f64; 3], b: [f64; 3]| {
        let kind = (ALL[0].cases)().swap_remove(0);
        let values = [a, b].map(DVec3::from);
        let texture = Texture::Checker { values, size: 0.5 };
        let key = texturable_key("diffuse", "albedo").expect("it may be a texture");
        Material::new("m", kind).with_texture(key, texture)
    };
    let material = of([0.9, 0.1, 0.2], [0.3, 0.4, 0.1]);
    assert_eq!(material.albedo(), DVec3::new(0.9, 0.4, 0.2));
    assert_eq!(material.moment(0, 2), of([0.9; 3], [0.9; 3]).moment(0, 2));
    assert_eq!(material.kind.color(), material.albedo());
    // Cloth scatters most where it is smoothest.
    let sheen = ALL.iter().find(|m| m.name == "sheen").expect("cloth");
    let kind = (sheen.cases)().swap_remove(1);
    let key = texturable_key("sheen", "roughness").expect("it may be a texture");
    let values = [DVec3::splat(0.1), DVec3::ONE];
    let cloth = Material::new("m", kind.clone());
    let cloth = cloth.with_texture(key, Texture::Checker { values, size: 0.5 });
    let smooth = kind.with(&[("roughness", Value::Number(0.1))]);
    assert_eq!(cloth.albedo(), smooth.albedo());
    assert!(cloth.albedo().x > 1.3 * kind.albedo().x);
    assert!(cloth.warning().is_some(), "it gains energy there");
}
