//! A render that is kept while it is under way, and goes on later.

use std::time::Duration;

use crate::film::Film;

/// What ended a render: whichever came first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StoppedBy {
    /// All samples were taken.
    Spp,
    /// The error fell to what was asked for.
    Error,
    /// The time was up.
    Time,
    /// The user or the system said so.
    Interrupt,
    /// The renderer failed.
    Failure,
}

/// A render that has been under way before.
#[derive(Clone, Debug)]
pub struct Begun {
    /// The sums so far.
    pub film: Film,
    /// Samples a pixel of the pilot, which are not in the film.
    pub pilot: u64,
    /// The number of samples at which the error is looked at next.
    pub look: u64,
    /// Time that it has taken.
    pub elapsed: Duration,
    /// What has ended it, if nothing is to be added.
    pub finished: Option<StoppedBy>,
}

/// Where a render is.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// The sums so far. While the render goes on it is at the end of a window, and all steps of the allocation
    /// are as far.
    pub film: &'a Film,
    /// As [`Begun::pilot`].
    pub pilot: u64,
    /// As [`Begun::look`].
    pub look: u64,
    /// As [`Begun::elapsed`].
    pub elapsed: Duration,
    /// What ended the render; `None` while it goes on.
    pub stopped_by: Option<StoppedBy>,
}

/// Keeps a render, so that it can go on from there: it is asked to between windows, and at the end. A pilot
/// is no image yet: it is not kept.
pub trait Keep {
    /// Keeps it, if it is time to. A failure does not end the render.
    fn keep(&mut self, state: &State<'_>);
}
