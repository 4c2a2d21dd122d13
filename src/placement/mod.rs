//! Where everything is, prepared in f64 so that f32 can stand it.
//!
//! Points are kept as an offset from an *anchor*: the centre of a sphere, or its *pole* if the
//! sphere is much larger than what is near it. All anchors are relative to one origin close to the
//! camera's view, and in units of a power of two that brings the scene to size one. So a scene that
//! is moved or scaled by a power of two gives the same numbers, and a wall of radius 1e8 keeps all
//! its digits where the picture is.

mod camera;
pub mod cells;
pub mod containment;
pub mod images;
pub mod lights;
pub mod media;
mod pole;
pub mod sky;
mod sphere;
mod tree;
mod unit;

pub use camera::PlacedCamera;
pub use lights::{Light, Lights};
pub use media::{Media, Medium};
pub use sky::SkyTable;
pub use sphere::{PlacedSphere, Side};

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::bvh::{Ball, Options, Tree};
use crate::scene::{Scene, Sky};
use crate::settings::Offset;
use camera::approach;
use cells::{Cells, Chart};
use containment::{containers, reachable};
use images::LampImage;
use pole::{pole_normals, pole_point};

/// A scene's spheres and camera as the renderers use them.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Kernel units per scene unit, a power of two.
    pub scale: f64,
    /// Kernel radiance per radiance, a power of two that brings the brightest light to 2^32: sums of
    /// squares in f32 then hold light of 1e20, and beside it light a 1e-26 of that.
    pub radiance_scale: f64,
    /// The spheres that paths can reach, those with a pole frame first, else in scene order.
    pub spheres: Vec<PlacedSphere>,
    /// How many of `spheres` have a pole frame.
    pub poles: usize,
    /// Which dielectrics take precedence where they share points.
    pub media: Media,
    /// The dielectrics that the camera is in, `sphere` being an index into `spheres`.
    pub within: Vec<Medium>,
    /// Whether an opaque sphere is all around the camera: no path leaves it.
    pub enclosed: bool,
    /// Spheres of the scene that equal an earlier one, with that one: they are not there.
    pub coincident: Vec<[usize; 2]>,
    /// The camera.
    pub camera: PlacedCamera,
    /// How paths leave surfaces, distances in kernel units.
    pub offset: Offset,
    /// What light sampling chooses from.
    pub lights: Lights,
    /// Images of these that smooth spheres make; `None` if they are too many.
    pub images: Option<Vec<LampImage>>,
    /// The most parts of a sphere's mix, and the most weights of one that are textures.
    pub mixed: [usize; 2],
    /// Made when it is first asked for, and so is the next.
    tree: OnceLock<Tree>,
    sky: OnceLock<Arc<SkyTable>>,
    /// Where a render asks for them.
    cells: Option<Arc<Cells>>,
}

/// See [`Placement::mixed`].
fn mixed(scene: &Scene, spheres: &[PlacedSphere]) -> [usize; 2] {
    let mut most = [0; 2];
    for sphere in spheres {
        let parts = scene.materials[sphere.material].kind.parts();
        let weights = parts.iter().map(|part| part.texture_weights().count());
        most = [most[0].max(parts.len()), most[1].max(weights.sum())];
    }
    most
}

impl Placement {
    /// Prepares `scene` for an image of `width` x `height` pixels.
    #[must_use]
    pub fn new(scene: &Scene, width: u32, height: u32) -> Self {
        Self::with_offset(scene, width, height, Offset::Exact)
    }

    /// The same for paths that leave surfaces by `offset`.
    #[must_use]
    pub fn with_offset(scene: &Scene, width: u32, height: u32, offset: Offset) -> Self {
        let eye = scene.camera.position;
        let forward = (scene.camera.look_at - eye).normalize();
        let approach = approach(scene, forward);
        let origin = eye + approach * forward;
        // In units of the origin from here on: the subtraction in f64 is the last place that sees
        // world coordinates.
        let centers: Vec<DVec3> = scene.spheres.iter().map(|s| s.center - origin).collect();
        let count = centers.len();
        let mut coincident = Vec::new();
        let (sides, reachable, containers) = if offset == Offset::Exact {
            let sides: Vec<Side> = (0..count).map(|i| Side::of(scene, i)).collect();
            let reachable = reachable(scene, &sides, &mut coincident);
            let containers = containers(scene, &sides, &reachable);
            (sides, reachable, containers)
        } else {
            (
                vec![Side::Sign; count],
                vec![true; count],
                vec![None; count],
            )
        };
        let media = Media::new(scene, &reachable);
        let mut order: Vec<usize> = (0..count).filter(|i| reachable[*i]).collect();
        let poles = pole_normals(scene, &centers, &order);
        let scale = unit::length(scene, &centers, &poles, &order);
        order.sort_by_key(|i| (poles[*i].is_none(), *i));
        let mut place = vec![None; count];
        for (at, source) in order.iter().enumerate() {
            place[*source] = Some(at);
        }
        let mut spheres: Vec<PlacedSphere> = order
            .iter()
            .map(|&i| {
                let sphere = &scene.spheres[i];
                let normal = poles[i];
                let anchor =
                    normal.map_or(centers[i], |n| pole_point(centers[i], sphere.radius, n));
                PlacedSphere {
                    source: i,
                    material: sphere.material,
                    anchor: anchor * scale,
                    motion: sphere.motion * scale,
                    radius: sphere.radius * scale,
                    pole: normal,
                    side: sides[i],
                    level: media.level[i],
                    container: containers[i].and_then(|c| place[c]),
                    cores: Vec::new(),
                }
            })
            .collect();
        for inner in 0..spheres.len() {
            if let Some(outer) = spheres[inner].container
                && spheres[inner].side == Side::Tracked
            {
                spheres[outer].cores.push(inner);
            }
        }
        let within = media.camera.iter().filter_map(|medium| {
            let sphere = place[medium.sphere]?;
            Some(Medium { sphere, ..*medium })
        });
        let within = within.collect();
        let enclosed = spheres.iter().any(|s| s.side == Side::Inside);
        let poles = spheres.iter().filter(|s| s.pole.is_some()).count();
        let camera = PlacedCamera::new(scene, forward, approach, scale, width, height);
        let offset = offset.scaled(scale);
        let lights = Lights::new(scene, &spheres, offset);
        Self {
            scale,
            radiance_scale: unit::radiance(scene, &order, enclosed),
            enclosed,
            coincident,
            images: images::of(scene, &spheres, &lights),
            lights,
            mixed: mixed(scene, &spheres),
            spheres,
            poles,
            media,
            within,
            camera,
            offset,
            tree: OnceLock::new(),
            sky: OnceLock::new(),
            cells: None,
        }
    }

    /// The tree over the spheres about their centres, as f32 has them.
    ///
    /// Those that paths are always in are beside it.
    #[must_use]
    pub fn tree(&self) -> &Tree {
        self.tree
            .get_or_init(|| Tree::with(&self.balls(), self.poles as u32, self.tree_options()))
    }

    /// What light sampling draws directions to the scene's image from.
    #[must_use]
    pub fn sky_table(&self, sky: &Sky) -> &SkyTable {
        self.sky.get_or_init(|| Arc::new(SkyTable::new(sky)))
    }

    /// The cells of the radiance cache, if there is one.
    #[must_use]
    pub fn cells(&self) -> Option<&Arc<Cells>> {
        self.cells.as_ref()
    }

    /// The same with a radiance cache of these cells.
    #[must_use]
    pub fn with_cells(self, cells: Cells) -> Self {
        Self {
            cells: Some(Arc::new(cells)),
            ..self
        }
    }

    /// The chart of a sphere.
    #[must_use]
    pub(crate) fn chart(&self, sphere: usize) -> Chart {
        let cells = self.cells.as_ref();
        cells.map_or(Chart::without_cells(false), |cells| cells.charts()[sphere])
    }

    /// The same with another table, for tests of one that is made wrongly.
    #[must_use]
    pub fn with_sky_table(mut self, table: SkyTable) -> Self {
        self.sky = OnceLock::from(Arc::new(table));
        self
    }

    /// The same with another tree, for tests of one that is made wrongly.
    #[must_use]
    pub fn with_tree(mut self, tree: Tree) -> Self {
        self.tree = OnceLock::from(tree);
        self
    }

    /// How that tree is made.
    #[must_use]
    pub fn tree_options(&self) -> Options {
        Options {
            moves: self.moves(),
            ..Options::default()
        }
    }

    /// Whether any sphere moves while the shutter is open.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.spheres.iter().any(|s| s.motion != DVec3::ZERO)
    }

    /// What is in the tree, or beside it.
    #[must_use]
    pub fn balls(&self) -> Vec<Ball> {
        let centered = &self.spheres[self.poles..];
        let ball = |sphere: &PlacedSphere| Ball {
            center: sphere.anchor.as_vec3(),
            motion: sphere.motion.as_vec3(),
            radius: sphere.radius as f32,
            apart: sphere.side == Side::Inside,
        };
        centered.iter().map(ball).collect()
    }
}
