//! Cases 29 to 39: the integrator, its sums and its samples.

use super::Case;

pub(super) const CASES: &[Case] = &[];
