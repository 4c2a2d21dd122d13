//! The struct of a material, which the forms in the kernel make.

use glam::DVec3;
use gpu_trace::effects::Effects;
use gpu_trace::materials::dielectric::Index;
use gpu_trace::materials::{ALL, Form, Material, Member, MemberKind, MemberValue, forms};
use gpu_trace::records::material::MaterialRecord;
use gpu_trace::shader::{Stage, material_members, material_record};

use super::{Layout, device, kernel};

/// Offsets and size of a struct of these members by WGSL's rules.
fn by_the_rules(members: &[Member]) -> Layout {
    let mut end: u32 = 0;
    let mut layout = Vec::new();
    for member in members {
        let (align, size) = match member.kind {
            MemberKind::Vector => (16, 12),
            MemberKind::Scalar | MemberKind::Word => (4, 4),
        };
        let offset = end.next_multiple_of(align);
        layout.push((member.name.to_owned(), offset));
        end = offset + size;
    }
    (layout, end.next_multiple_of(16))
}

/// Sets of forms of materials: each alone, each two, and all.
fn sets_of_forms() -> Vec<Vec<u32>> {
    let codes = 0..forms().len() as u32;
    let mut sets: Vec<Vec<u32>> = codes.clone().map(|code| vec![code]).collect();
    let pairs = codes.clone().flat_map(|a| (0..a).map(move |b| vec![b, a]));
    sets.extend(pairs);
    sets.push(codes.collect());
    sets
}

/// The bytes of a value.
fn bytes_of(value: &MemberValue) -> Vec<u8> {
    match value {
        MemberValue::Vector(v) => bytemuck::cast_slice(&v[..]).to_vec(),
        MemberValue::Scalar(x) => x.to_ne_bytes().to_vec(),
        MemberValue::Word(x) => x.to_ne_bytes().to_vec(),
    }
}

/// What is wrong with the record of `material` in the kernel of `members`, if anything is.
fn wrong_record(material: &Material, members: &[Member], code: u32) -> Option<String> {
    let (offsets, size) = by_the_rules(members);
    let pairs: Vec<(Member, u32)> = std::iter::zip(members, &offsets)
        .map(|(member, (_, offset))| (*member, *offset))
        .collect();
    let bytes = MaterialRecord::new(material, 2.0, 4.0).bytes(&pairs, size);
    let form = material.kind.form();
    let mut values: Vec<(&str, MemberValue)> = vec![
        ("color", material.kind.color().into()),
        ("kind", MemberValue::Word(code)),
        ("emission", (2.0 * material.emission).into()),
        ("absorption", (0.25 * material.kind.absorption()).into()),
    ];
    match material.kind.dispersion() {
        Some(Index::Cauchy(terms)) => values.push(("cauchy", terms.y.into())),
        Some(Index::Sellmeier(terms)) => {
            values.push(("sellmeier_b", terms.b.into()));
            values.push(("sellmeier_c", terms.c.into()));
        }
        _ => {}
    }
    let own = form.members.iter().map(|member| member.name);
    values.extend(own.zip(material.kind.members()));
    pairs.iter().find_map(|(member, offset)| {
        // What other materials have is 0, or 1 for an index.
        let neutral = match member.kind {
            MemberKind::Vector => MemberValue::Vector([0.0; 3]),
            MemberKind::Scalar => MemberValue::Scalar(if member.name == "ior" { 1.0 } else { 0.0 }),
            MemberKind::Word => MemberValue::Word(0),
        };
        let own = values.iter().find(|(name, _)| *name == member.name);
        let expected = bytes_of(own.map_or(&neutral, |(_, value)| value));
        let found = &bytes[*offset as usize..][..expected.len()];
        (found != expected).then(|| format!("{}: {found:?} for {expected:?}", member.name))
    })
}

#[test]
fn material_agrees_for_all_forms() {
    for codes in sets_of_forms() {
        for emission in [false, true] {
            let chosen: Vec<&Form> = codes.iter().map(|code| forms()[*code as usize]).collect();
            let mut names = vec!["list"];
            names.extend(chosen.iter().map(|form| form.name));
            names.extend(emission.then_some("emission"));
            let transmits = chosen.iter().any(|form| form.transmits);
            names.extend(transmits.then_some("interior"));
            let absorbs = emission && transmits;
            names.extend(absorbs.then_some("absorption"));
            names.extend(absorbs.then_some("dispersion"));
            let members = material_members(&Effects::named(&names));
            // Those of the forms, each once, and what all have.
            let mut wanted: Vec<Member> = vec![Member::vector("color"), Member::word("kind")];
            wanted.extend(emission.then_some(Member::vector("emission")));
            wanted.extend(absorbs.then_some(Member::vector("absorption")));
            if absorbs {
                wanted.extend(["sellmeier_b", "sellmeier_c"].map(Member::vector));
                wanted.push(Member::scalar("cauchy"));
            }
            for member in chosen.iter().flat_map(|form| form.members) {
                if !wanted.contains(member) {
                    wanted.push(*member);
                }
            }
            assert_eq!(members.len(), wanted.len(), "{names:?}: {members:?}");
            assert!(wanted.iter().all(|m| members.contains(m)), "{members:?}");
            let kernel = kernel(Stage::Path, &names);
            assert_eq!(
                device(&kernel, "Material"),
                by_the_rules(&members),
                "{names:?}"
            );
            // Records of the texture are as long, and have each in the same place.
            let (placed, size) = material_record(&Effects::named(&names));
            let placed = placed.into_iter().map(|(m, at)| (m.name.to_owned(), at));
            assert_eq!(
                (placed.collect(), size),
                by_the_rules(&members),
                "{names:?}"
            );

            // Every value lies where the rules say.
            for kind in ALL.iter().flat_map(|material| (material.cases)()) {
                let code = forms().iter().position(|form| *form == kind.form());
                let code = code.expect("a form of the list") as u32;
                let material = Material {
                    emission: DVec3::new(7.0, 7.125, 7.25),
                    ..Material::new("m", kind)
                };
                assert_eq!(wrong_record(&material, &members, code), None, "{names:?}");
                // Companion: another code.
                assert!(wrong_record(&material, &members, code + 1).is_some());
            }
        }
    }
}
