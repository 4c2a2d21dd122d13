//! Cubic lattices on the offset from a sphere's centre; twin of `shaders/materials/lattice.wesl`.

use glam::DVec3;

use super::{Member, MemberValue};

/// A cell, each coordinate modulo 2^32, and a place in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticePoint {
    /// floor(offset/size) modulo 2^32.
    pub cell: [u32; 3],
    /// In [0, 1).
    pub place: DVec3,
}

impl LatticePoint {
    /// Where an offset from the centre is, in scene units; `cells` a scene unit.
    ///
    /// In f64 a place is known to 1e-16 of the cells between it and the centre.
    #[must_use]
    pub fn of(offset: DVec3, cells: f64) -> Self {
        let x = cells * offset;
        let whole = x.floor();
        Self {
            cell: whole.to_array().map(|x| x.rem_euclid(2f64.powi(32)) as u32),
            place: x - whole,
        }
    }

    /// The corner of cells that is nearest to an offset, and the offset from there, in [-1/2, 1/2]: a plane between
    /// cells next to it is known to the digits of the distance from it.
    #[must_use]
    pub fn by_corner(offset: DVec3, cells: f64) -> Self {
        let x = cells * offset;
        let whole = x.round();
        Self {
            cell: whole.to_array().map(|x| x.rem_euclid(2f64.powi(32)) as u32),
            place: x - whole,
        }
    }

    /// The values of [`anchor_members`].
    #[must_use]
    pub fn members(&self) -> Vec<MemberValue> {
        let words = self.cell.into_iter().map(MemberValue::Word);
        words.chain([self.place.into()]).collect()
    }
}

/// Members of a form that looks up a lattice: where a sphere's pole is in it.
pub const fn anchor_members(cell: [&'static str; 3], place: &'static str) -> [Member; 4] {
    let [x, y, z] = cell;
    [
        Member::word(x),
        Member::word(y),
        Member::word(z),
        Member::vector(place),
    ]
}
