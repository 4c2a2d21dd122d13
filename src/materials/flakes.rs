//! Flakes of metal in a paint; twin of `shaders/materials/flakes.wesl`, the integers bit for bit.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::beckmann::beckmann_slope2;
use super::ggx::Frame;
use super::lattice::{LatticePoint, anchor_members};
use super::schema;
use super::{Form, Member, MemberValue, Surface, Value};
use crate::sampling::directions::circle_point;
use crate::sampling::random::{mix_bits, unit_float};

const FLAKE_KEY: u32 = 0x464c_414b;

/// The most cells a scene unit: offsets in cells are numbers of f32.
const MAX_SCALE: f64 = 1.0e18;

/// What flakes add to a form.
pub(super) const FLAKE_MEMBERS: [Member; 5] = [
    Member::vector("flake_color"),
    Member::scalar("flake_density"),
    Member::scalar("flake_scale"),
    Member::scalar("flake_spread"),
    Member::scalar("flake_jitter"),
];

/// Whether a form has them.
pub(crate) fn are_in(form: &Form) -> bool {
    FLAKE_MEMBERS
        .iter()
        .all(|member| form.members.contains(member))
}

/// And where poles are in their lattice.
pub(super) const FLAKE_ANCHOR: [Member; 4] = anchor_members(
    ["flake_cell_x", "flake_cell_y", "flake_cell_z"],
    "flake_place",
);

/// Flakes: in a cubic lattice about the sphere's centre, at most one in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flakes {
    /// The probability that a cell holds one.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub density: f64,
    /// Cells a scene unit; flakes are as large as a cell.
    #[schemars(range(max = MAX_SCALE), extend("exclusiveMinimum" = 0.0))]
    pub scale: f64,
    /// Root mean square slope of flakes against the surface.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub spread: f64,
    /// How far a flake may be from its cell's centre, in cells along each axis.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub jitter: f64,
    /// Colour of the third lobe on a flake, which reflects about four times that.
    #[schemars(schema_with = "schema::plain_share")]
    pub color: DVec3,
}

impl Flakes {
    /// The normal of the flake at `surface`, if there is one.
    #[must_use]
    pub fn normal_at(&self, surface: &Surface) -> Option<DVec3> {
        let frame = Frame::around(surface.normal);
        Some(frame.to_world(self.normal_within(surface, &frame)?))
    }

    /// The same in the surface's frame.
    pub(super) fn normal_within(&self, surface: &Surface, frame: &Frame) -> Option<DVec3> {
        let point = LatticePoint::of(surface.offset, self.scale);
        let cell = flake_at(&point, self.density, self.jitter)?;
        Some(flake_normal(cell, self.spread, frame))
    }

    /// The values of [`FLAKE_MEMBERS`].
    pub(super) fn members(&self) -> [MemberValue; 5] {
        [
            self.color.into(),
            self.density.into(),
            self.scale.into(),
            self.spread.into(),
            self.jitter.into(),
        ]
    }

    /// Those of [`FLAKE_ANCHOR`].
    pub(super) fn anchored(&self, anchor: DVec3) -> Vec<MemberValue> {
        LatticePoint::of(anchor, self.scale).members()
    }

    /// Its keys.
    pub(super) fn value(&self) -> Value {
        Value::Table(vec![
            ("density", Value::Number(self.density)),
            ("scale", Value::Number(self.scale)),
            ("spread", Value::Number(self.spread)),
            ("jitter", Value::Number(self.jitter)),
            ("color", Value::Vector(self.color)),
        ])
    }
}

/// Random words of a cell, four at a time.
#[must_use]
pub fn flake_words(cell: [u32; 3], which: u32) -> [u32; 4] {
    let [x, y, z] = cell;
    let key = mix_bits(mix_bits(x, y), z);
    [0, 1, 2, 3].map(|i| {
        let counter = (4 * which + i).wrapping_mul(0x9e37_79b9);
        mix_bits(key.wrapping_add(counter), FLAKE_KEY)
    })
}

/// The cell of the flake that owns a point, if one does.
#[must_use]
pub fn flake_at(point: &LatticePoint, density: f64, jitter: f64) -> Option<[u32; 3]> {
    let first = (point.place - (1.0 + jitter)).floor() + 1.0;
    let last = (point.place + jitter).ceil() - 1.0;
    let span = (last - first + 1.0).max(DVec3::ZERO).as_uvec3();
    let mut nearest = 0.25;
    let mut found = None;
    for i in 0..span.element_product() {
        let step = glam::UVec3::new(i % span.x, i / span.x % span.y, i / (span.x * span.y));
        let step = first + step.as_dvec3();
        let shift = step.as_ivec3().to_array();
        let cell = std::array::from_fn(|k| point.cell[k].wrapping_add_signed(shift[k]));
        let [present, x, y, z] = unit_float(flake_words(cell, 0));
        let centre = step + 0.5 + jitter * (2.0 * DVec3::new(x, y, z) - 1.0);
        let square = centre.distance_squared(point.place);
        if present < density && square < nearest {
            nearest = square;
            found = Some(cell);
        }
    }
    found
}

/// The normal of the flake of a cell, in the surface's frame.
#[must_use]
pub fn flake_normal(cell: [u32; 3], spread: f64, frame: &Frame) -> DVec3 {
    let [a, b, c, d] = unit_float(flake_words(cell, 1));
    let across: DVec2 = beckmann_slope2(a).sqrt() * circle_point(b);
    let tilt = spread * across.extend(beckmann_slope2(c).sqrt() * circle_point(d).x);
    frame.to_local(tilt).with_z(1.0).normalize()
}
