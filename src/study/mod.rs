//! Studies: what accuracy costs in time, for any set of ways to render.
//!
//! 1. [`series`]: what is compared. [`presets`]: the built-in studies. [`run`]: one series with one seed.
//!    [`measure`]: its error against the reference.
//! 2. [`identity`]: which study. [`store`]: the directory with all that is finished, so that it can go on.
//! 3. [`plan`]: all that decides a study. [`host`]: what it needs from outside. [`conduct`](mod@conduct): the
//!    reference, the runs in turns, images at equal time.
//! 4. [`summary`]: what the runs of a series say, by [`fit`] and [`bootstrap`]; [`equal`]: at equal time and
//!    error; [`analysis`]: all of it.
//! 5. [`tables`] (each a [`table`]), [`plot`], [`pictures`], [`export`] and [`report`]: how it is shown; [`files`] writes it.

pub mod analysis;
pub mod bootstrap;
pub mod conduct;
pub mod equal;
pub mod export;
pub mod files;
pub mod fit;
mod galleries;
pub mod host;
pub mod identity;
mod keeper;
pub mod measure;
pub mod pictures;
pub mod plan;
pub mod plot;
pub mod presets;
mod reference;
pub mod report;
pub mod run;
pub mod series;
pub mod store;
pub mod summary;
pub mod table;
pub mod tables;

mod timetable;
