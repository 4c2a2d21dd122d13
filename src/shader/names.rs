//! What is declared in a kernel.

use std::collections::BTreeSet;

use naga::{Module, TypeInner};
use wesl::{EscapeMangler, Mangler as _};

/// Names of everything that a kernel declares: entry points, functions, their arguments and locals, types and
/// members, resources and variables, constants and overrides; as the sources call them, with the modules that
/// the linker has put before those of a module, `materials::diffuse::sample_diffuse`, and members with their
/// types, `path::state::Path::ray`.
#[must_use]
pub fn declared_names(module: &Module) -> BTreeSet<String> {
    let mut names: Vec<&str> = Vec::new();
    let mut of_types: Vec<String> = Vec::new();
    for function in module.functions.iter().map(|(_, function)| function) {
        names.extend(function.name.as_deref());
        names_in(function, &mut names);
    }
    for entry in &module.entry_points {
        names.push(&entry.name);
        names_in(&entry.function, &mut names);
    }
    for (_, ty) in module.types.iter() {
        names.extend(ty.name.as_deref());
        if let (Some(of), TypeInner::Struct { members, .. }) = (&ty.name, &ty.inner) {
            let members = members.iter().filter_map(|member| member.name.as_deref());
            of_types.extend(members.map(|member| format!("{}::{member}", own_name(of))));
        }
    }
    let variables = module.global_variables.iter();
    names.extend(variables.filter_map(|(_, variable)| variable.name.as_deref()));
    let constants = module.constants.iter();
    names.extend(constants.filter_map(|(_, constant)| constant.name.as_deref()));
    let overrides = module.overrides.iter();
    names.extend(overrides.filter_map(|(_, value)| value.name.as_deref()));
    names.into_iter().map(own_name).chain(of_types).collect()
}

fn names_in<'a>(function: &'a naga::Function, names: &mut Vec<&'a str>) {
    let arguments = function.arguments.iter();
    names.extend(arguments.filter_map(|argument| argument.name.as_deref()));
    let locals = function.local_variables.iter();
    names.extend(locals.filter_map(|(_, local)| local.name.as_deref()));
    names.extend(function.named_expressions.values().map(String::as_str));
}

/// A name as in the sources.
fn own_name(linked: &str) -> String {
    let parts = linked
        .starts_with("package_")
        .then(|| EscapeMangler.unmangle(linked))
        .flatten();
    parts.map_or_else(
        || linked.to_owned(),
        |(path, name)| format!("{}::{name}", path.components.join("::")),
    )
}
