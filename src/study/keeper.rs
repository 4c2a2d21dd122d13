//! What happens beside a render of a study: progress, and images that are kept.

use super::pictures::sample_image;
use super::plan::Study;
use super::run::Observer;
use super::store::Store;
use super::timetable::Timetable;
use crate::error::Result;
use crate::film::Film;

/// What a run shows to the timetable and keeps in the store.
pub(super) struct Keeper<'a, 'b> {
    pub(super) timetable: &'a mut Timetable<'b>,
    pub(super) store: &'a Store,
    /// Index of the series and seed of a run; other renders keep nothing.
    pub(super) run: Option<(&'a Study, usize, u64)>,
}

impl Observer for Keeper<'_, '_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.timetable.report(paths);
        !self.timetable.host.interrupted()
    }

    fn point(&mut self, spp: u64, film: &Film) -> Result<()> {
        if let Some((study, index, seed)) = self.run
            && study.keeps(index, seed, spp)
        {
            let name = sample_image(&study.subjects[index].series, seed, spp);
            self.store.keep_image(&name, film)?;
        }
        Ok(())
    }
}
