//! Charts of diffuse spheres; twin of `shaders/cache/chart.wesl`.

use glam::{DVec2, DVec3, Vec2Swizzles as _};

use crate::placement::PlacedSphere;

/// Cells a side of an octahedral map.
pub const BALL_SIDE: u32 = 24;
/// Cells a side of a grid.
pub const GRID_SIDE: u32 = 48;
/// Share of a grid's coordinates that is even.
pub const EVEN: f64 = 0.75;

/// How the surface of a sphere is laid out in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chart {
    /// Its first cell among those of all charts.
    pub first: u32,
    /// Cells a side; 0: it has none.
    pub side: u32,
    /// Whether all that the sphere does is to reflect by Lambert's law.
    pub diffuse: bool,
    /// Half the side of the even part of a grid, in kernel units; `None` on an octahedral map.
    pub width: Option<f64>,
    /// Unit vectors along the grid.
    pub axes: [DVec3; 2],
}

/// A point of a chart on its sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartPoint {
    /// From the sphere's anchor, in kernel units.
    pub offset: DVec3,
    /// Outward, of unit length.
    pub normal: DVec3,
}

impl Chart {
    /// That of a sphere without cells.
    #[must_use]
    pub fn without_cells(diffuse: bool) -> Self {
        Self {
            first: 0,
            side: 0,
            diffuse,
            width: None,
            axes: [DVec3::ZERO; 2],
        }
    }

    /// That of a diffuse sphere: a grid about its pole if it has one, even within `width` kernel units, else an
    /// octahedral map.
    #[must_use]
    pub fn of(sphere: &PlacedSphere, width: f64) -> Self {
        match sphere.pole {
            None => Self {
                side: BALL_SIDE,
                ..Self::without_cells(true)
            },
            Some(pole) => Self {
                side: GRID_SIDE,
                width: Some(width),
                axes: pole.any_orthonormal_pair().into(),
                ..Self::without_cells(true)
            },
        }
    }

    /// Where on the chart, from -1 to 1 on either axis, the point of `sphere` at `offset` from its anchor is.
    #[must_use]
    pub fn place(&self, offset: DVec3) -> DVec2 {
        if let Some(width) = self.width {
            let [x, y] = self.axes.map(|axis| axis.dot(offset));
            return DVec2::new(x, y).map(|x| grid_place(x, width));
        }
        let n = offset / offset.abs().element_sum();
        match n.z >= 0.0 {
            true => n.truncate(),
            false => fold(n.truncate()),
        }
    }

    /// The point of `sphere` at a place of the chart.
    #[must_use]
    pub fn point(&self, sphere: &PlacedSphere, place: DVec2) -> ChartPoint {
        if let (Some(width), Some(pole)) = (self.width, sphere.pole) {
            let x = place.map(|x| grid_distance(x, width));
            // How far the sphere has bent away from the plane there.
            let bent = x.length_squared() / sphere.radius;
            let depth = bent / (1.0 + (1.0 - bent / sphere.radius).sqrt());
            let offset = x.x * self.axes[0] + x.y * self.axes[1] - depth * pole;
            let normal = (pole + offset / sphere.radius).normalize();
            return ChartPoint { offset, normal };
        }
        let normal = octahedron(place).normalize();
        ChartPoint {
            offset: sphere.radius * normal,
            normal,
        }
    }

    /// The area of `sphere` over that of the chart, at a place.
    #[must_use]
    pub fn area(&self, sphere: &PlacedSphere, place: DVec2) -> f64 {
        if let Some(width) = self.width {
            let stretch = place.map(|x| grid_stretch(x, width));
            let x = place.map(|x| grid_distance(x, width)) / sphere.radius;
            return stretch.element_product() / (1.0 - x.length_squared()).sqrt();
        }
        // Of a plane of the octahedron, seen from the centre.
        (sphere.radius * sphere.radius) / octahedron(place).length().powi(3)
    }

    /// The length of a cell's side there, about.
    #[must_use]
    pub fn cell_size(&self, sphere: &PlacedSphere, place: DVec2) -> f64 {
        self.scale() * self.area(sphere, place).sqrt()
    }

    /// The column and row of the cell at a place.
    #[must_use]
    pub fn cell(&self, place: DVec2) -> [u8; 2] {
        let most = f64::from(self.side) - 1.0;
        let at = (place + 1.0) / self.scale();
        at.to_array().map(|x| x.clamp(0.0, most) as u8)
    }

    /// The place in a cell at `u`, from 0 to 1 on either axis.
    #[must_use]
    pub fn place_in(&self, [column, row]: [u8; 2], u: DVec2) -> DVec2 {
        let corner = DVec2::new(column.into(), row.into());
        (corner + u) * self.scale() - 1.0
    }

    /// The side of a cell.
    fn scale(&self) -> f64 {
        2.0 / f64::from(self.side)
    }
}

/// The point of the octahedron |x| + |y| + |z| = 1 at a place of its map.
fn octahedron(place: DVec2) -> DVec3 {
    let z = 1.0 - place.x.abs() - place.y.abs();
    let xy = if z >= 0.0 { place } else { fold(place) };
    xy.extend(z)
}

/// The other half of an octahedron, folded over.
fn fold(x: DVec2) -> DVec2 {
    let signs = x.map(|x| if x >= 0.0 { 1.0 } else { -1.0 });
    (1.0 - x.yx().abs()) * signs
}

fn grid_place(x: f64, width: f64) -> f64 {
    let a = x.abs() / width;
    let place = match a <= 1.0 {
        true => EVEN * a,
        false => 1.0 - (1.0 - EVEN).powi(2) / ((1.0 - EVEN) + EVEN * (a - 1.0)),
    };
    place.copysign(x)
}

fn grid_distance(place: f64, width: f64) -> f64 {
    let a = place.abs();
    let distance = match a <= EVEN {
        true => a / EVEN,
        false => 1.0 + ((1.0 - EVEN).powi(2) / (1.0 - a) - (1.0 - EVEN)) / EVEN,
    };
    (width * distance).copysign(place)
}

/// How much distance changes with the place.
fn grid_stretch(place: f64, width: f64) -> f64 {
    let rest = (1.0 - EVEN) / (1.0 - place.abs().max(EVEN));
    width / EVEN * rest * rest
}
