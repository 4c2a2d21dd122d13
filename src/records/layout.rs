//! The structs that host and kernel share, in the kernel's layout.
//!
//! Structs of fixed layout are `bytemuck` structs; a test compares their offsets with naga's.
//! `Material` loses the members that no effect in use needs, and its records with it ([`material`](super::material)).

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::effects::{Effect, Effects};
use crate::film::{TILE, Tiles};
use crate::placement::cells::Chart;
use crate::placement::sky::{Band, Entry};
use crate::placement::{Light, PlacedCamera, PlacedSphere, Placement, SkyTable};
use crate::settings::Rect;

/// A record of `sphere_of` in `shaders/scene/data.wesl`: a sphere about its centre. Where nothing moves it ends before
/// the way.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct SphereRecord {
    /// Relative to the placement's origin.
    pub center: [f32; 3],
    /// Positive.
    pub radius: f32,
    /// While the shutter is open.
    pub motion: [f32; 3],
    /// Padding.
    pub unused: f32,
}

impl SphereRecord {
    /// The record of a sphere without a pole frame.
    #[must_use]
    pub fn new(sphere: &PlacedSphere) -> Self {
        Self {
            center: sphere.anchor.as_vec3().to_array(),
            radius: sphere.radius as f32,
            motion: sphere.motion.as_vec3().to_array(),
            unused: 0.0,
        }
    }
}

/// A record of `pole_of` in `shaders/scene/data.wesl`: a sphere about its pole. Where nothing moves it ends before the
/// way.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct PoleRecord {
    /// The pole, relative to the placement's origin.
    pub point: [f32; 3],
    /// One over the radius.
    pub curvature: f32,
    /// Outward unit normal at the pole.
    pub normal: [f32; 3],
    /// Padding.
    pub unused: f32,
    /// While the shutter is open.
    pub motion: [f32; 3],
    /// Padding.
    pub unused1: f32,
}

impl PoleRecord {
    /// The record of a sphere whose pole has the outward unit normal `normal`.
    #[must_use]
    pub fn new(sphere: &PlacedSphere, normal: DVec3) -> Self {
        Self {
            point: sphere.anchor.as_vec3().to_array(),
            curvature: (1.0 / sphere.radius) as f32,
            normal: normal.as_vec3().to_array(),
            unused: 0.0,
            motion: sphere.motion.as_vec3().to_array(),
            unused1: 0.0,
        }
    }
}

/// What the kernel weighs the placement's sphere `index` by as a light, in its unit; 0 for one that is
/// not sampled.
pub(crate) fn light_weight(index: usize, placement: &Placement, effects: &Effects) -> f64 {
    placement
        .lights
        .of_sphere(index)
        .map_or(0.0, |light| match effects.has(Effect::Table) {
            true => light.probability,
            false => light.luminance * placement.radiance_scale,
        })
}

/// A record of `lamp_of` in `shaders/scene/data.wesl`. Where nothing moves it ends before the way, and without pole
/// frames before what is for them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct LightRecord {
    pub anchor: [f32; 3],
    pub radius: f32,
    pub weight: f32,
    pub threshold: f32,
    pub other: u32,
    pub sphere: u32,
    pub pole: [f32; 3],
    pub curvature: f32,
    pub motion: [f32; 3],
    pub unused: f32,
}

impl LightRecord {
    /// The record of a light.
    #[must_use]
    pub fn new(light: &Light, placement: &Placement, effects: &Effects) -> Self {
        let sphere = &placement.spheres[light.sphere];
        Self {
            anchor: sphere.anchor.as_vec3().to_array(),
            radius: match sphere.pole {
                Some(_) => 0.0,
                None => sphere.radius as f32,
            },
            weight: light_weight(light.sphere, placement, effects) as f32,
            threshold: light.threshold as f32,
            other: light.alias as u32,
            sphere: light.sphere as u32,
            pole: sphere.pole.unwrap_or_default().as_vec3().to_array(),
            curvature: (1.0 / sphere.radius) as f32,
            motion: sphere.motion.as_vec3().to_array(),
            unused: 0.0,
        }
    }
}

/// Columns of the texture `sky_table` of `shaders/light/skylight.wesl`.
pub const SKY_TABLE_WIDTH: u32 = 4096;

/// Columns of the texture `attribute_texels` of `shaders/scene/data.wesl`.
pub const ATTRIBUTES_WIDTH: u32 = 4096;

/// Columns of the texture `sphere_texels` of `shaders/scene/data.wesl`.
pub const SPHERES_WIDTH: u32 = 1024;

/// The texels of that texture, whole rows of them.
#[must_use]
pub fn sky_table(table: &SkyTable) -> Vec<[u32; 4]> {
    let word = |entry: &Entry| u32::from(entry.threshold) | u32::from(entry.other) << 16;
    let rows = table.rows().len() as u32;
    let of_row = |(row, entry): (u32, &Entry)| {
        let Band { near, step, .. } = Band::of(row, rows);
        [
            word(entry),
            (near as f32).to_bits(),
            (step as f32).to_bits(),
            0,
        ]
    };
    let of_texels = table.columns().chunks(4).map(|entries| {
        let mut words = [0; 4];
        for (to, entry) in words.iter_mut().zip(entries) {
            *to = word(entry);
        }
        words
    });
    let mut texels: Vec<[u32; 4]> = (0..)
        .zip(table.rows())
        .map(of_row)
        .chain(of_texels)
        .collect();
    let whole = texels.len().next_multiple_of(SKY_TABLE_WIDTH as usize);
    texels.resize(whole, [0; 4]);
    texels
}

/// `Camera` of `shaders/scene/camera.wesl`; see [`PlacedCamera`]. Without a lens the kernel's struct
/// ends before the lens's members.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of PlacedCamera")]
pub struct CameraRecord {
    pub anchor: [f32; 3],
    pub approach: f32,
    pub corner: [f32; 3],
    pub unused0: f32,
    pub across: [f32; 3],
    pub unused1: f32,
    pub down: [f32; 3],
    pub unused2: f32,
    pub forward: [f32; 3],
    pub unused3: f32,
    pub lens_across: [f32; 3],
    pub focus: f32,
    pub lens_down: [f32; 3],
    pub lens_share: f32,
}

impl CameraRecord {
    /// The camera rounded to f32.
    #[must_use]
    pub fn new(camera: &PlacedCamera) -> Self {
        let vector = |v: DVec3| v.as_vec3().to_array();
        Self {
            anchor: vector(camera.anchor),
            approach: camera.approach as f32,
            corner: vector(camera.corner),
            focus: camera.focus as f32,
            across: vector(camera.across),
            lens_share: camera.lens_share as f32,
            down: vector(camera.down),
            forward: vector(camera.forward),
            lens_across: vector(camera.lens_across),
            lens_down: vector(camera.lens_down),
            ..Self::zeroed()
        }
    }
}

/// `Dispatch` of `shaders/path.wesl`: what one dispatch does.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct DispatchRecord {
    /// Image pixel at the region's top left corner.
    pub region_origin: [u32; 2],
    /// Size of the region, in pixels.
    pub region_size: [u32; 2],
    /// First tile of the dispatch; tiles of a region are numbered by rows.
    pub first_tile: u32,
    /// One past the last tile.
    pub end_tile: u32,
    /// Low word of the first sample index of the window.
    pub window_start: u32,
    /// Low word of the sample index to stop at.
    pub end_sample: u32,
    /// See [`crate::settings::stream_words`].
    pub stream: [u32; 2],
    /// 1 where the window begins: there is nothing to continue.
    pub fresh: u32,
    /// Loop iterations after which an invocation starts no further path.
    pub step_limit: u32,
    /// Always 0, which no shader compiler knows.
    pub zero: u32,
    /// Samples of a batch minus 1, see [`crate::sampler::Sampler::batch`].
    pub last_of_batch: u32,
    /// Loop iterations after which the driver may have ended a loop in silence.
    pub step_most: u32,
    /// Padding.
    pub unused: u32,
}

/// Columns of the texture `cell_values` of `shaders/cache/cells.wesl`.
pub const CELLS_WIDTH: u32 = 1024;

/// A record of `chart_record` in `shaders/scene/data.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct ChartRecord {
    pub first: u32,
    pub cells: u32,
    pub diffuse: u32,
    pub width: f32,
    pub across: [f32; 3],
    pub unused0: u32,
    pub down: [f32; 3],
    pub unused1: u32,
}

impl ChartRecord {
    /// The record of a chart.
    #[must_use]
    pub fn new(chart: &Chart) -> Self {
        let [across, down] = chart.axes.map(|axis| axis.as_vec3().to_array());
        Self {
            first: chart.first,
            cells: chart.side,
            diffuse: u32::from(chart.diffuse),
            width: chart.width.unwrap_or(0.0) as f32,
            across,
            down,
            ..Self::zeroed()
        }
    }
}

/// `PilotWork` of `shaders/cache/pilot.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct PilotRecord {
    pub stream: [u32; 2],
    pub batch: u32,
    pub begin: u32,
    pub end: u32,
    pub first_value: u32,
    pub samples: u32,
    pub first_sample: u32,
    pub end_sample: u32,
    pub unused: u32,
}

/// `adaptive_tiles` of `shaders/path.wesl`: a bit for every tile of a region.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ChosenTiles {
    bits: [[u32; 4]; 128],
}

impl ChosenTiles {
    /// Every tile.
    #[must_use]
    pub fn all() -> Self {
        Self {
            bits: [[u32::MAX; 4]; 128],
        }
    }

    /// The chosen ones of `tiles` in `region`, whose top left pixel is at `corner` among those of `tiles`.
    #[must_use]
    pub fn of(tiles: &Tiles, corner: [u32; 2], region: Rect) -> Self {
        let mut bits = Self::zeroed();
        let across = region.width.div_ceil(TILE);
        for row in 0..region.height.div_ceil(TILE) {
            for column in 0..across {
                if tiles.has(corner[0] / TILE + column, corner[1] / TILE + row) {
                    let tile = row * across + column;
                    bits.bits[tile as usize / 128][tile as usize / 32 % 4] |= 1 << (tile % 32);
                }
            }
        }
        bits
    }

    /// Whether a tile of the region is chosen.
    #[must_use]
    pub fn has(&self, tile: u32) -> bool {
        self.bits[tile as usize / 128][tile as usize / 32 % 4] >> (tile % 32) & 1 == 1
    }
}

/// `Counters` of `shaders/film/pixel.wesl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct CountersRecord {
    /// Samples that were no finite number.
    pub non_finite: u32,
    /// `u32::MAX` minus the lowest pixel number in the region that had one; 0: none.
    pub first_pixel: u32,
    /// Low word of a sample index there.
    pub sample_low: u32,
    /// Bounce at which it was seen.
    pub bounce: u32,
    /// Pixels of the last dispatch that did not reach its end.
    pub unfinished: u32,
    /// Samples that the last dispatch finished.
    pub advanced: u32,
    /// Always 0, which no shader compiler knows.
    pub zero: u32,
}
