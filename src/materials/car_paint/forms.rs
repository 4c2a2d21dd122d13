//! What the kernel is told of a car paint: with a coat and flakes, either or neither.

use super::NAME;
use crate::materials::flakes::{FLAKE_ANCHOR, FLAKE_MEMBERS};
use crate::materials::{Form, Member};

/// 1 of the index: a coat; 2: flakes.
pub(in crate::materials) const FORMS: &[Form] = &[
    Form {
        name: "car_paint",
        what: "car paint: Lambert and three Cook-Torrance lobes",
        derives: Some(&[]),
        members: &[
            Member::vector("diffuse"),
            Member::vector("specular1"),
            Member::vector("specular2"),
            Member::vector("specular3"),
            Member::vector("f0"),
            Member::vector("m"),
        ],
        ..Form::of(NAME)
    },
    Form {
        name: "car_paint_coated",
        what: "the same with a clear coat in the place of the third lobe",
        part_delta: true,
        relative: true,
        derives: Some(&[]),
        members: &[
            Member::vector("diffuse"),
            Member::vector("specular1"),
            Member::vector("specular2"),
            Member::vector("f0"),
            Member::vector("m"),
            Member::scalar("coat_ior"),
        ],
        ..Form::of(NAME)
    },
    Form {
        name: "car_paint_flakes",
        what: "car paint with flakes",
        offset: true,
        anchored: &FLAKE_ANCHOR,
        derives: Some(&[]),
        members: &[
            Member::vector("diffuse"),
            Member::vector("specular1"),
            Member::vector("specular2"),
            Member::vector("specular3"),
            Member::vector("f0"),
            Member::vector("m"),
            FLAKE_MEMBERS[0],
            FLAKE_MEMBERS[1],
            FLAKE_MEMBERS[2],
            FLAKE_MEMBERS[3],
            FLAKE_MEMBERS[4],
        ],
        ..Form::of(NAME)
    },
    Form {
        name: "car_paint_coated_flakes",
        what: "car paint with flakes under a clear coat",
        part_delta: true,
        relative: true,
        offset: true,
        anchored: &FLAKE_ANCHOR,
        derives: Some(&[]),
        members: &[
            Member::vector("diffuse"),
            Member::vector("specular1"),
            Member::vector("specular2"),
            Member::vector("f0"),
            Member::vector("m"),
            Member::scalar("coat_ior"),
            FLAKE_MEMBERS[0],
            FLAKE_MEMBERS[1],
            FLAKE_MEMBERS[2],
            FLAKE_MEMBERS[3],
            FLAKE_MEMBERS[4],
        ],
        ..Form::of(NAME)
    },
];
