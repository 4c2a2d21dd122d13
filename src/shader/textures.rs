//! The part of the module `bsdf` that puts the values of textures into a material.

use std::fmt::Write as _;

use crate::effects::Effects;
use crate::materials::texturable::{EMISSION, ROUGHNESS, key_member, smooth_kind, texture_member};
use crate::materials::{Form, Member, Texturable};

/// The form's keys that are textures of some material in the kernel.
fn textured(effects: &Effects, form: &Form) -> Vec<&'static Texturable> {
    let keys: Vec<&str> = effects.textured_keys().collect();
    form.texturable()
        .filter(|t| keys.contains(&t.key))
        .collect()
}

/// Whether what a surface's form is depends on a texture.
pub(super) fn may_be_smooth(effects: &Effects) -> bool {
    effects.textured_keys().any(|key| key == ROUGHNESS)
}

/// Members of `Material` that textures bring: which texture each key is, and the numbers of the scene file that others
/// are made of.
pub(super) fn members(effects: &Effects) -> Vec<Member> {
    let keys: Vec<&str> = effects.textured_keys().collect();
    let mut members: Vec<Member> = keys.iter().map(|key| texture_member(key)).collect();
    if may_be_smooth(effects) {
        members.push(smooth_kind());
    }
    for (_, form) in effects.forms() {
        for member in form.members_of_keys(|key| keys.contains(&key)) {
            if !members.contains(&member) {
                members.push(member);
            }
        }
    }
    members
}

/// What the function `with_textures` imports.
pub(super) fn imports(effects: &Effects) -> String {
    let mut text = String::from("import package::scene::texture::{TexturePoint, texture_value};\n");
    let forms = effects.forms().map(|(_, form)| form);
    for form in forms.filter(|form| form.derives.is_some()) {
        if !textured(effects, form).is_empty() {
            let (name, module) = (form.name, form.material.replace('-', "_"));
            // Writing to a String cannot fail.
            let _ = writeln!(text, "import package::materials::{module}::derive_{name};");
        }
    }
    text
}

/// The function `with_textures`: each texture is looked up once.
pub(super) fn with_textures(effects: &Effects) -> String {
    let mut text = String::from(
        "fn with_textures(material: Material, point: TexturePoint) -> Material {\n\
         var own = material;\n",
    );
    let keys: Vec<&str> = effects.textured_keys().collect();
    for key in &keys {
        let _ = writeln!(text, "var of_{key} = vec3f(0.0);");
    }
    text += &looked_up(&keys);
    if keys.contains(&EMISSION) {
        let number = texture_member(EMISSION).name;
        let _ = writeln!(
            text,
            "if own.{number} != 0u {{ own.emission = of_{EMISSION}; }}"
        );
    }
    let mut cases = String::new();
    for (code, form) in effects.forms() {
        let keys = textured(effects, form);
        if !keys.is_empty() {
            let _ = writeln!(cases, "case {code}u: {{\n{}}}", of_form(form, &keys));
        }
    }
    if !cases.is_empty() {
        let _ = writeln!(text, "switch material.kind {{\n{cases}default: {{}}\n}}");
    }
    text + "return own;\n}\n"
}

/// The values of the textures of `keys`. Several are looked up in a loop, so that a kernel has the lookup once: compilers
/// put functions in wherever they are called, and take more than twice as long for twice as much.
fn looked_up(keys: &[&str]) -> String {
    let number = |key| texture_member(key).name;
    if let [key] = keys {
        let number = number(key);
        return format!(
            "if own.{number} != 0u {{ of_{key} = texture_value(own.{number}, point); }}\n"
        );
    }
    let (mut numbers, mut values) = (String::new(), String::new());
    for (n, key) in keys.iter().enumerate() {
        let number = number(key);
        let _ = writeln!(numbers, "case {n}u: {{ number = own.{number}; }}");
        let _ = writeln!(values, "case {n}u: {{ of_{key} = value; }}");
    }
    format!(
        "for (var n = 0u; n < {}u; n++) {{\nvar number = 0u;\n\
         switch n {{\n{numbers}default: {{}}\n}}\n\
         if number != 0u {{\nlet value = texture_value(number, point);\n\
         switch n {{\n{values}default: {{}}\n}}\n}}\n}}\n",
        keys.len()
    )
}

/// What is done for a form of which these keys may be textures.
fn of_form(form: &Form, keys: &[&Texturable]) -> String {
    let mut text = String::new();
    for key in keys {
        let (name, number) = (key.key, texture_member(key.key).name);
        let member = form.textured_member(key).name;
        let channel = if key.number { ".x" } else { "" };
        let _ = writeln!(
            text,
            "if own.{number} != 0u {{ own.{member} = of_{name}{channel}; }}"
        );
    }
    if form.derives.is_some() {
        let numbers = keys
            .iter()
            .map(|key| format!("own.{}", texture_member(key.key).name));
        let any = numbers.collect::<Vec<_>>().join(" | ");
        let _ = writeln!(
            text,
            "if ({any}) != 0u {{ own = derive_{}(own); }}",
            form.name
        );
    }
    if keys.iter().any(|key| key.key == ROUGHNESS) {
        let (number, value) = (texture_member(ROUGHNESS).name, key_member(ROUGHNESS).name);
        let smooth = smooth_kind().name;
        let _ = writeln!(
            text,
            "if own.{number} != 0u && own.{value} == 0.0 {{ own.kind = own.{smooth}; }}"
        );
    }
    text
}
