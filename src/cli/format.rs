//! Numbers as people read them.

pub(super) use crate::numbers::{duration, percent, significant};
