//! Tables of measured materials as the kernel reads them: the entries of all, each table once.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::materials::MaterialKind;
use crate::materials::measured::BrdfTable;
use crate::placement::Placement;
use crate::scene::Scene;

/// Columns of the texture `measured_texels` of `shaders/materials/measured.wesl`.
pub const MEASURED_WIDTH: u32 = 4096;

/// The tables of a scene's spheres.
#[derive(Clone, Debug, Default)]
pub struct MeasuredTables {
    /// With the place of its first entry.
    tables: Vec<(Arc<BrdfTable>, u64)>,
    entries: u64,
}

impl MeasuredTables {
    /// Those of `scene` as it is placed.
    #[must_use]
    pub fn new(scene: &Scene, placement: &Placement) -> Self {
        let mut all = Self::default();
        let used: BTreeSet<usize> = placement.spheres.iter().map(|s| s.material).collect();
        let materials = scene.materials.iter().enumerate();
        for (_, material) in materials.filter(|(index, _)| used.contains(index)) {
            let kind = &material.kind;
            let parts = kind.parts().iter().map(|part| &part.material.kind);
            for table in std::iter::once(kind)
                .chain(parts)
                .filter_map(|kind| kind.table())
            {
                all.add(table);
            }
        }
        all
    }

    fn add(&mut self, table: &Arc<BrdfTable>) {
        if self.known(table).is_none() {
            self.tables.push((Arc::clone(table), self.entries));
            self.entries += table.entries().len() as u64;
        }
    }

    fn known(&self, table: &Arc<BrdfTable>) -> Option<u64> {
        let mut tables = self.tables.iter();
        let known = tables.find(|(known, _)| Arc::ptr_eq(known, table));
        known.map(|(_, start)| *start)
    }

    /// The place of the first entry of a material's table, of one that is used; 0 if it has none.
    #[must_use]
    pub fn start(&self, kind: &MaterialKind) -> u32 {
        let start = kind.table().and_then(|table| self.known(table));
        // A scene with more has been refused.
        start.unwrap_or_default() as u32
    }

    /// Rows of the texture of all entries, at least one.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.entries.div_ceil(MEASURED_WIDTH.into()).max(1)
    }

    /// The texels of that texture.
    #[must_use]
    pub fn texels(&self) -> Vec<[f32; 4]> {
        let all = self.tables.iter().flat_map(|(table, _)| table.entries());
        let mut texels: Vec<[f32; 4]> = all.map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        texels.resize((self.rows() * u64::from(MEASURED_WIDTH)) as usize, [0.0; 4]);
        texels
    }
}
