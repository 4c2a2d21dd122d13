//! The part of the module `bsdf` that lets a mix have other materials in it.

use std::fmt::Write as _;

use super::dispatch::dispatch;
use crate::materials::{Form, mix};

/// What the functions import; `deltas`: whether a part has delta lobes.
pub(super) fn imports(form: &Form, lecture: bool, deltas: bool) -> String {
    let name = form.name;
    let mut all = ["evaluate", "sample"]
        .map(|what| format!("{what}_{name}"))
        .to_vec();
    all.push("NO_PART".into());
    if !lecture || deltas {
        all.extend(["choose_part", "part_material"].map(str::to_owned));
    }
    if lecture && deltas {
        all.push(format!("share_{name}"));
    }
    format!(
        "import package::materials::{name}::{{{}}};\n",
        all.join(", ")
    )
}

/// The functions `sample` and `evaluate`, and where a part has delta lobes `share_of`, the probability of a part's.
pub(super) fn functions(
    form: &Form,
    forms: &[(u32, &Form)],
    lecture: bool,
    deltas: bool,
) -> String {
    let name = form.name;
    let found = match forms.iter().any(|(_, form)| form.offset) {
        true => "part.found = find(part);\n",
        false => "",
    };
    // Uniform directions but for delta lobes.
    let uniform = match (lecture, deltas) {
        (false, _) => String::new(),
        (true, false) => "return sample_uniform(surface, wo, u);\n".into(),
        (true, true) => format!(
            "let share = share_{name}(surface, wo);\n\
             if u.z >= share {{ return sample_beside(surface, wo, u, share); }}\n"
        ),
    };
    let chosen = match lecture && !deltas {
        true => "",
        false => {
            "let chosen = choose_part(surface, wo, u.z);\nown = chosen.place;\nv.z = chosen.z;\n\
             part.material = part_material(surface, own);\n"
        }
    };
    let mut text = format!(
        "fn sample(surface: Surface, wo: vec3f, u: vec4f) -> BsdfSample {{\n\
         var part = surface;\nvar v = u;\nvar own = NO_PART;\n\
         if is_mix(surface.material) {{\n{uniform}{chosen}}}\n{found}\
         let s = sample_part(part, wo, v);\n\
         if own == NO_PART {{ return s; }}\n\
         return sample_{name}(surface, wo, s, own);\n}}\n\
         fn evaluate(surface: Surface, wo: vec3f, wi: vec3f) -> BsdfValue {{\n\
         return evaluate_{name}(surface, wo, wi);\n}}\n"
    );
    if deltas {
        let shares = forms.iter().filter(|(_, form)| !mix::is_mix(form));
        let shares = shares.map(|(code, form)| {
            let share = match (form.delta, form.part_delta) {
                (true, _) => "return 1.0;".to_owned(),
                (_, true) => format!("return share_{}(surface, wo);", form.name),
                _ => "return 0.0;".to_owned(),
            };
            (*code, share)
        });
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "fn share_of(surface: Surface, wo: vec3f) -> f32 {{\n{}}}",
            dispatch("surface.material", shares.collect(), "return 0.0;")
        );
    }
    text
}
