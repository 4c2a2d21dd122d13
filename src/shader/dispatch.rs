//! Choices by the kind of a material, in the module `bsdf`.

use std::fmt::Write as _;

/// A switch over the kind of `material`. There is no other kind in the kernel than those of `cases`, so
/// that the last may be the default; without any, it is what `none` says.
pub(super) fn dispatch(material: &str, mut cases: Vec<(u32, String)>, none: &str) -> String {
    // Alike ones together.
    let Some((_, last)) = cases.pop() else {
        return format!("{none}\n");
    };
    cases.retain(|(_, case)| *case != last);
    if cases.is_empty() {
        return format!("{last}\n");
    }
    let mut text = format!("switch {material}.kind {{\n");
    for (code, case) in cases {
        let _ = writeln!(text, "case {code}u: {{ {case} }}");
    }
    let _ = writeln!(text, "default: {{ {last} }}\n}}");
    text
}
