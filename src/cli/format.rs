//! Numbers as people read them.

pub(super) use crate::output::numbers::{duration, percent, significant};
