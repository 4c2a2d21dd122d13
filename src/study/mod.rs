//! Studies: what accuracy costs in time, for any set of ways to render.
//!
//! 1. [`series`]: what is compared. [`presets`]: the built-in studies.
//! 2. [`conduct`](mod@conduct): the [`reference`](mod@reference), the runs in turns, images at equal
//!    time. [`run`]: one series with one seed. [`measure`]: its error against the reference.
//! 3. [`store`]: the directory with all that is finished, so that a study can go on; [`identity`]: which study.
//! 4. [`analysis`]: what the runs say, by [`fit`] and [`bootstrap`]; [`equal`]: at equal time and error.
//! 5. [`tables`], [`plot`], [`pictures`], [`export`] and [`report`]: how it is shown; [`files`] writes it.

pub mod analysis;
pub mod bootstrap;
pub mod conduct;
pub mod equal;
pub mod export;
pub mod files;
pub mod fit;
pub mod identity;
pub mod measure;
pub mod pictures;
pub mod plot;
pub mod presets;
pub mod reference;
pub mod report;
pub mod run;
pub mod series;
pub mod store;
pub mod tables;
mod ticks;
mod timetable;
