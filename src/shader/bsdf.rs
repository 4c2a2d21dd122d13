//! The module `bsdf`: the struct `Material` and the dispatch to the materials in use.

use std::fmt::Write as _;

use super::dispatch::dispatch;
use super::{mixes, textures};
use crate::effects::{Effect, Effects};
use crate::materials::{Form, Member, MemberKind, mix};

/// The members of `Material` in a kernel with `effects`, in its order: what all materials have, and what
/// the forms in use need. A vector is followed by a scalar as long as there are both, so that they share
/// 16 bytes.
///
/// Every member is where its type alone puts it: naga writes GLSL without offsets, and drops `@align`
/// (gfx-rs/wgpu issue 4374).
#[must_use]
pub fn members(effects: &Effects) -> Vec<Member> {
    let mut own: Vec<Member> = Vec::new();
    if effects.has(Effect::Emission) {
        own.push(Member::vector("emission"));
    }
    if effects.has(Effect::Absorption) {
        own.push(Member::vector("absorption"));
    }
    if effects.has(Effect::Dispersion) {
        own.push(Member::vector("sellmeier_b"));
        own.push(Member::vector("sellmeier_c"));
        own.push(Member::scalar("cauchy"));
    }
    for (_, form) in effects.forms() {
        let anchored = match effects.has(Effect::Pole) {
            true => form.anchored,
            false => &[],
        };
        for member in form.members.iter().chain(anchored) {
            if !own.contains(member) {
                own.push(*member);
            }
        }
    }
    for member in textures::members(effects) {
        if !own.contains(&member) {
            own.push(member);
        }
    }
    let (vectors, scalars): (Vec<Member>, Vec<Member>) =
        own.into_iter().partition(|m| m.kind == MemberKind::Vector);
    let mut members = vec![Member::vector("color"), Member::word("kind")];
    let mut scalars = scalars.into_iter();
    for vector in vectors {
        members.push(vector);
        members.extend(scalars.next());
    }
    members.extend(scalars);
    members
}

/// Bytes of a texel of the texture of materials.
const TEXEL: u32 = 16;

/// Where each of the [`members`] is in a record of the texture `material_texels` of `shaders/scene/data.wesl`, in bytes,
/// and the bytes of a record, which are whole texels: a vector begins one, and what follows it fits behind.
#[must_use]
pub fn record_of(effects: &Effects) -> (Vec<(Member, u32)>, u32) {
    let mut end: u32 = 0;
    let mut placed = Vec::new();
    for member in members(effects) {
        let (align, size) = match member.kind {
            MemberKind::Vector => (TEXEL, 12),
            MemberKind::Scalar | MemberKind::Word => (4, 4),
        };
        let offset = end.next_multiple_of(align);
        placed.push((member, offset));
        end = offset + size;
    }
    (placed, end.next_multiple_of(TEXEL))
}

/// The function that reads a record.
fn material_in(effects: &Effects) -> String {
    let (members, size) = record_of(effects);
    let texels = size / TEXEL;
    let mut text = format!(
        "fn material_in(record: u32) -> Material {{\nvar own: Material;\nlet first = {texels}u * record;\n"
    );
    for (member, offset) in members {
        let (texel, within) = (offset / TEXEL, (offset % TEXEL) as usize / 4);
        // Writing to a String cannot fail.
        if within == 0 {
            let _ = writeln!(text, "let t{texel} = material_texel(first + {texel}u);");
        }
        let component = &"xyzw"[within..=within];
        let value = match member.kind {
            MemberKind::Vector => format!("bitcast<vec3f>(t{texel}.xyz)"),
            MemberKind::Scalar => format!("bitcast<f32>(t{texel}.{component})"),
            MemberKind::Word => format!("t{texel}.{component}"),
        };
        let _ = writeln!(text, "own.{} = {value};", member.name);
    }
    text + "return own;\n}\n"
}

/// The module's text.
pub(super) fn module(effects: &Effects) -> String {
    let forms: Vec<(u32, &Form)> = effects.forms().collect();
    let mut text =
        String::from("import package::materials::contract::{Surface, BsdfSample, BsdfValue};\n");
    let lecture = effects.has(Effect::Lecture);
    let mixed = forms.iter().find(|(_, form)| mix::is_mix(form));
    let deltas = effects.mixes_deltas();
    for (name, drawn) in [
        ("sample_uniform", Drawn::Uniform),
        ("sample_beside", Drawn::Beside),
    ] {
        if forms
            .iter()
            .any(|(_, form)| match mix::is_mix(form) && !deltas {
                true => lecture && drawn == Drawn::Uniform,
                false => Drawn::of(form, lecture) == drawn,
            })
        {
            let _ = writeln!(text, "import package::materials::uniform::{name};");
        }
    }
    if let Some((_, form)) = mixed {
        text += &mixes::imports(form, lecture, deltas);
    }
    for (_, form) in forms.iter().filter(|(_, form)| !mix::is_mix(form)) {
        let (name, module) = (form.name, form.material.replace('-', "_"));
        // Writing to a String cannot fail.
        let drawn = Drawn::of(form, lecture);
        if drawn != Drawn::Uniform {
            let _ = writeln!(text, "import package::materials::{module}::sample_{name};");
        }
        if drawn == Drawn::Beside || deltas && form.part_delta {
            let _ = writeln!(text, "import package::materials::{module}::share_{name};");
        }
        if !form.delta {
            let _ = writeln!(
                text,
                "import package::materials::{module}::evaluate_{name};"
            );
        }
        if form.offset {
            let _ = writeln!(text, "import package::materials::{module}::find_{name};");
        }
    }
    if effects.has_textures() {
        text += &textures::imports(effects);
    }
    if effects.keeps_spheres() {
        text += "import package::scene::data::material_texel;\n";
    }
    text += "struct Material {\n";
    for member in members(effects) {
        let ty = match member.kind {
            MemberKind::Vector => "vec3f",
            MemberKind::Scalar => "f32",
            MemberKind::Word => "u32",
        };
        let _ = writeln!(text, "{}: {ty},", member.name);
    }
    text += "}\n";
    if effects.keeps_spheres() {
        text += &material_in(effects);
    }
    let plain = || forms.iter().filter(|(_, form)| !mix::is_mix(form));
    let samples: Vec<(u32, String)> = plain()
        .map(|(code, form)| (*code, sampled(form, lecture)))
        .collect();
    let evaluated: Vec<(u32, String)> = plain()
        // Of a mix, delta lobes are asked as well.
        .filter(|(_, form)| !form.delta || mixed.is_some())
        .map(|(code, form)| (*code, evaluated(form)))
        .collect();
    // Of a mix, both are of its parts.
    let part = if mixed.is_some() { "_part" } else { "" };
    let _ = writeln!(
        text,
        "fn sample{part}(surface: Surface, wo: vec3f, u: vec4f) -> BsdfSample {{"
    );
    text += &dispatch("surface.material", samples, NO_SAMPLE);
    let _ = writeln!(
        text,
        "}}\nfn evaluate{part}(surface: Surface, wo: vec3f, wi: vec3f) -> BsdfValue {{"
    );
    text += &dispatch("surface.material", evaluated, NO_VALUE);
    text += "}\n";
    if effects.has(Effect::LampImages) {
        // A dispatch of its own: drivers run what they do not choose, and that of all has the loops of mixes in it.
        let imaging = forms.iter().filter(|(_, form)| form.imaging.is_some());
        let imaging = imaging.map(|(code, form)| (*code, sampled(form, lecture)));
        let imaging = dispatch("surface.material", imaging.collect(), NO_SAMPLE);
        let _ = writeln!(
            text,
            "fn sample_imaging(surface: Surface, wo: vec3f, u: vec4f) -> BsdfSample {{\n{imaging}}}"
        );
    }
    if effects.looks_at_offset() {
        let found = forms.iter().map(|(code, form)| (*code, found(form)));
        let found = dispatch("surface.material", found.collect(), FOUND_NOTHING);
        let _ = writeln!(text, "fn find(surface: Surface) -> vec3f {{\n{found}}}");
    }
    if let Some((_, form)) = mixed {
        text += &mixes::functions(form, &forms, lecture, deltas);
        text += &predicate("is_mix", &forms, mix::is_mix);
    }
    if effects.has_textures() {
        text += &textures::with_textures(effects);
    }
    text += &predicate("is_delta", &forms, |form| form.delta);
    text += &predicate("transmits", &forms, |form| form.transmits);
    text += &predicate("is_translucent", &forms, Form::is_translucent);
    text
}

/// What `sample` says where there is no material.
const NO_SAMPLE: &str = "return BsdfSample(surface.normal, vec3f(0.0), 0.0, 0u, 1.0);";

/// What `evaluate` says of what has no value.
const NO_VALUE: &str = "return BsdfValue(vec3f(0.0), 0.0, 0u);";

/// What `evaluate` does for a form.
fn evaluated(form: &Form) -> String {
    match form.delta {
        true => NO_VALUE.into(),
        false => format!("return evaluate_{}(surface, wo, wi);", form.name),
    }
}

/// What `find` says of what looks for nothing.
const FOUND_NOTHING: &str = "return vec3f(0.0);";

/// What `find` does for a form.
fn found(form: &Form) -> String {
    match form.offset {
        true => format!("return find_{}(surface);", form.name),
        false => FOUND_NOTHING.into(),
    }
}

/// How directions are drawn from a form.
#[derive(Clone, Copy, PartialEq)]
enum Drawn {
    /// By its own `sample`.
    Own,
    /// Uniformly from the hemisphere, for the lecture.
    Uniform,
    /// So where its delta lobe, which it draws itself, is not chosen.
    Beside,
}

impl Drawn {
    fn of(form: &Form, lecture: bool) -> Self {
        match lecture && form.is_hemispherical() {
            false => Self::Own,
            true if form.part_delta => Self::Beside,
            true => Self::Uniform,
        }
    }
}

/// What `sample` does for a form.
fn sampled(form: &Form, lecture: bool) -> String {
    let name = form.name;
    let own = format!("return sample_{name}(surface, wo, u);");
    match Drawn::of(form, lecture) {
        Drawn::Own => own,
        Drawn::Uniform => "return sample_uniform(surface, wo, u);".into(),
        Drawn::Beside => format!(
            "let share = share_{name}(surface, wo);\nif u.z < share {{ {own} }}\n\
             return sample_beside(surface, wo, u, share);"
        ),
    }
}

/// A function that says whether a material's form is such a one.
fn predicate(name: &str, forms: &[(u32, &Form)], holds: impl Fn(&Form) -> bool) -> String {
    let such = forms.iter().filter(|(_, form)| holds(form));
    let such: Vec<String> = such
        .map(|(code, _)| format!("material.kind == {code}u"))
        .collect();
    let condition = match such.len() {
        0 => "false".to_owned(),
        all if all == forms.len() => "true".to_owned(),
        _ => such.join(" || "),
    };
    format!("fn {name}(material: Material) -> bool {{\nreturn {condition};\n}}\n")
}
