//! Cases 16 to 28: lights and materials.

use super::Case;

pub(super) const CASES: &[Case] = &[];
