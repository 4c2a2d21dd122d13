//! Vectors of a file.

use glam::DVec3;

/// The vector, without negative zeros: the two zeros are equal and must hash alike.
pub(super) fn vector(values: [f64; 3]) -> DVec3 {
    DVec3::from_array(values) + 0.0
}
