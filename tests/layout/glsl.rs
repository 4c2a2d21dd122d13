//! GLSL lays structs out as WGSL does.

use std::collections::BTreeSet;

use gpu_trace::effects::{Effect, completed};
use gpu_trace::shader::{Folder, Stage};

use super::{FULL, kernel};

/// Structs that GLSL would lay out otherwise, and why. naga writes their members without offsets
/// (gfx-rs/wgpu issue 4374), so that std430 places them by type alone, which is also what WGSL does
/// where no `@align` or `@size` says otherwise; std140, of uniforms, is the same for scalars and
/// vectors.
fn other_in_glsl(module: &naga::Module) -> Vec<String> {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).expect("a valid module");
    let mut faults = Vec::new();
    for (_, ty) in module.types.iter() {
        let naga::TypeInner::Struct { members, span } = &ty.inner else {
            continue;
        };
        let (mut end, mut align) = (0, naga::proc::Alignment::ONE);
        for member in members {
            let layout = layouter[member.ty];
            let offset = layout.alignment.round_up(end);
            if offset != member.offset {
                faults.push(format!("{member:?} of {:?} is at {offset}", ty.name));
            }
            end = offset + layout.size;
            align = align.max(layout.alignment);
        }
        if align.round_up(end) != *span {
            faults.push(format!("{:?} has another size than {span}", ty.name));
        }
    }
    for (_, variable) in module.global_variables.iter() {
        if variable.space != naga::AddressSpace::Uniform {
            continue;
        }
        let simple = |ty: naga::Handle<naga::Type>| {
            matches!(
                module.types[ty].inner,
                naga::TypeInner::Scalar(_) | naga::TypeInner::Vector { .. }
            )
        };
        let fits = match &module.types[variable.ty].inner {
            naga::TypeInner::Struct { members, .. } => members.iter().all(|m| simple(m.ty)),
            _ => simple(variable.ty),
        };
        if !fits {
            faults.push(format!(
                "{:?} holds more than scalars and vectors",
                variable.name
            ));
        }
    }
    faults
}

#[test]
fn glsl_has_the_same_layouts() {
    let optional = [
        "pole",
        "interior",
        "lens",
        "motion",
        "emission",
        "reflective",
        "dielectric",
        "priority",
        "sobol",
    ];
    let named = |name: &str| Effect::named(name).expect("an effect");
    let chosen = |set: u32| (0..optional.len()).filter(move |i| set >> i & 1 == 1);
    // Many sets are the same once they have what their effects need.
    let sets: BTreeSet<_> = (0..1 << optional.len())
        .filter_map(|set| {
            let names = chosen(set).map(|i| optional[i]);
            completed(names.chain(["list", "diffuse"]).map(named))
        })
        .collect();
    assert!(sets.len() > 100, "{}", sets.len());
    for set in sets {
        let names: Vec<&str> = set.iter().map(|effect| effect.name()).collect();
        for stage in Folder::ALL
            .map(Stage::Probe)
            .into_iter()
            .chain([Stage::Path])
        {
            let faults = other_in_glsl(&kernel(stage, &names).module);
            assert_eq!(faults, [""; 0], "{stage:?} of {names:?}");
        }
    }
    // With lights in the scene's data, and with a tree.
    let tree = FULL.map(|name| if name == "list" { "bvh" } else { name });
    for names in [FULL, tree] {
        assert_eq!(other_in_glsl(&kernel(Stage::Path, &names).module), [""; 0]);
    }
}

#[test]
fn companion_what_glsl_would_move_is_found() {
    for (members, space) in [
        ("a: vec3f, @align(16) b: f32", "storage, read"),
        ("@size(8) a: f32, b: f32", "storage, read"),
        ("@align(16) a: f32", "storage, read"),
        ("a: array<vec4f, 2>", "uniform"),
        (
            "a: array<f32, 3>, @align(16) b: array<u32, 2>",
            "storage, read",
        ),
    ] {
        let faults = |members: &str| {
            let wgsl =
                format!("struct S {{ {members} }}\n@group(0) @binding(0) var<{space}> s: S;");
            other_in_glsl(&naga::front::wgsl::parse_str(&wgsl).expect("valid WGSL"))
        };
        assert_ne!(faults(members), [""; 0], "{members}");
        assert_eq!(faults("a: vec3f, b: f32, c: vec2f"), [""; 0]);
    }
}
