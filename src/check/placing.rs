//! Cases 2, 5 and 10 to 15: where things are. Whole renders, whose truth is another render that must
//! be the same, the reference, or a number.

use super::Case;

pub(super) const CASES: &[Case] = &[];
