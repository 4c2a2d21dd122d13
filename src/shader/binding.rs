//! What a kernel binds: numbered where it is linked, and found by name.
//!
//! The sources declare buffers and textures without numbers. Whoever binds them knows the names of
//! the sources, and asks what numbers they got.

use wesl::syntax::{
    AddressSpace, Attribute, Declaration, DeclarationKind, Expression, ExpressionNode,
    GlobalDeclaration, LiteralExpression, TranslationUnit,
};
use wesl::{EscapeMangler, Mangler as _};

/// A buffer or texture that an entry point uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// As in the sources, without the linker's additions.
    pub name: String,
    /// Within group 0.
    pub number: u32,
    /// Whether it counts against the device's limit on storage buffers.
    pub storage_buffer: bool,
}

/// Numbers all that the linked sources bind, in the order of the names: the linker's own varies.
pub(super) fn number(unit: &mut TranslationUnit) {
    let mut bound: Vec<&mut Declaration> = unit
        .global_declarations
        .iter_mut()
        .filter_map(|node| match node.node_mut() {
            GlobalDeclaration::Declaration(declaration) if is_bound(declaration) => {
                Some(declaration)
            }
            _ => None,
        })
        .collect();
    bound.sort_by_key(|declaration| declaration.ident.name().clone());
    for (number, declaration) in (0..).zip(bound) {
        let literal = |value| {
            ExpressionNode::from(Expression::Literal(LiteralExpression::AbstractInt(value)))
        };
        let attributes = [
            Attribute::Group(literal(0)),
            Attribute::Binding(literal(number)),
        ];
        declaration.attributes.extend(attributes.map(Into::into));
    }
}

fn is_bound(declaration: &Declaration) -> bool {
    match &declaration.kind {
        // Textures are in no address space that could be named.
        DeclarationKind::Var(None) => true,
        DeclarationKind::Var(Some((space, _))) => {
            matches!(space, AddressSpace::Uniform | AddressSpace::Storage)
        }
        _ => false,
    }
}

/// The bindings that the entry point `entry` uses; none if there is no such entry point.
pub(super) fn of(
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    entry: &str,
) -> Vec<Binding> {
    let Some(index) = module.entry_points.iter().position(|e| e.name == entry) else {
        return Vec::new();
    };
    let uses = info.get_entry_point(index);
    let used = module
        .global_variables
        .iter()
        .filter(|(handle, _)| !uses[*handle].is_empty());
    used.filter_map(|(_, variable)| {
        Some(Binding {
            name: source_name(variable.name.as_deref()?),
            number: variable.binding?.binding,
            storage_buffer: matches!(variable.space, naga::AddressSpace::Storage { .. }),
        })
    })
    .collect()
}

/// The name in the sources of what the linker calls `name`: it leaves those of the root module.
pub(super) fn source_name(name: &str) -> String {
    if !name.starts_with("package_") {
        return name.to_owned();
    }
    EscapeMangler
        .unmangle(name)
        .map_or_else(|| name.to_owned(), |(_, item)| item)
}
