//! Names in the kernel that several effects bring, whichever of them is in use, and that are none's own.

use super::Effects;
use super::row::is_marked;

/// Such names.
pub struct Shared {
    /// What brings them, in a few words.
    pub what: &'static str,
    /// Whether a kernel with these effects has some of them; else it has none.
    pub is_used: fn(&Effects) -> bool,
    /// The names, as in a [row's](super::Row::marks).
    marks: &'static [&'static str],
}

impl Shared {
    /// All of them.
    pub const ALL: [Self; 3] = [
        Self {
            what: "records of textures, mixes, lamps and spheres",
            is_used: Effects::reads_records,
            marks: &["data::record_texel", "data::record_texels"],
        },
        Self {
            what: "paths that cross surfaces",
            is_used: Effects::transmits,
            marks: &[
                "media",
                "level_of",
                "runs_within",
                "TRACKED",
                "eta_scale",
                "INITIAL_WITHIN",
            ],
        },
        Self {
            what: "light sampling, of lamps or of an image",
            is_used: Effects::samples_light,
            marks: &[
                "light::direct",
                "light::light",
                "share_of_hit",
                "share_of_light",
                "receive_direct",
                "departure",
                "lamp_hit",
                "lighting",
                "is_delta",
            ],
        },
    ];

    /// Whether a name that a kernel declares is one of them.
    #[must_use]
    pub fn is_marked(&self, name: &str) -> bool {
        self.marks.iter().any(|mark| is_marked(name, mark))
    }
}
