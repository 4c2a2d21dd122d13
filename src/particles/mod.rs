//! Particles of files that other programs write: molecules, simulations, point clouds.
//!
//! Every reader is a function of bytes. A file that is damaged, ends early or does not hold what it
//! announces is a [`Mistake`] with its place; what a file merely leaves open is NaN in a column, never in a
//! position. Nothing is allocated because a header says so: memory grows with what was read.

mod cif;
mod csv;
mod element;
mod element_table;
mod format;
mod lammps_data;
mod lammps_dump;
mod lines;
mod mistake;
mod mmcif;
mod npy;
mod pdb;
mod ply;
mod ply_header;
#[cfg(test)]
mod properties;
mod source;
mod table;
mod xyz;
mod xyz_properties;

pub use element::Element;
pub use format::Format;
pub use mistake::{Mistake, Place, ReadError};

use std::path::Path;

use glam::DVec3;

/// The particles of one frame of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Positions, in the file's unit of length; each finite, and at most 1e20 in magnitude.
    pub positions: Vec<DVec3>,
    /// The element of each, where the file says it; `None` if it says it of none.
    pub elements: Option<Vec<Option<Element>>>,
    /// The numbers of each by name, in the file's order; `x`, `y` and `z` are among them. Columns that hold
    /// words are left out.
    pub columns: Vec<Column>,
}

/// One number of each particle.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// As the file has it, or as the reader's documentation says.
    pub name: String,
    /// One value for each particle, in the file's unit; NaN where the file has none, and infinite or NaN where
    /// it says so.
    pub values: Vec<f64>,
}

impl Particles {
    /// The values of a column.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let column = self.columns.iter().find(|column| column.name == name)?;
        Some(&column.values)
    }
}

/// Reads one frame of a file; 0 is the first. Gzip is found by its first bytes.
///
/// # Errors
/// What the system says, or what is wrong with the file.
pub fn read(path: &Path, format: Format, frame: u64) -> Result<Particles, ReadError> {
    Ok(parse(&source::load(path)?, format, frame)?)
}

/// How many frames a file has; 1 for formats that have no frames, whose file is not looked at.
///
/// # Errors
/// As [`read`]; of what lies within the frames, only what separates them is looked at.
pub fn frames(path: &Path, format: Format) -> Result<u64, ReadError> {
    match format.has_frames() {
        true => Ok(count_frames(&source::load(path)?, format)?),
        false => Ok(1),
    }
}

/// As [`read`], from the bytes of a file.
///
/// # Errors
/// What is wrong with them, and where. What lies behind the frame is not looked at.
pub fn parse(bytes: &[u8], format: Format, frame: u64) -> Result<Particles, Mistake> {
    let bytes = &*filled(bytes)?;
    match format {
        Format::Xyz => xyz::parse(bytes, frame),
        Format::LammpsDump => lammps_dump::parse(bytes, frame),
        Format::Pdb => pdb::parse(bytes, frame),
        Format::Mmcif => mmcif::parse(bytes, frame),
        _ if frame > 0 => Err(Mistake::no_frame(1, frame)),
        Format::LammpsData => lammps_data::parse(bytes),
        Format::Csv => csv::parse(bytes),
        Format::Npy => npy::parse(bytes),
        Format::Ply => ply::parse(bytes),
    }
}

/// As [`frames`], from the bytes of a file.
///
/// # Errors
/// What is wrong with them, and where.
pub fn count_frames(bytes: &[u8], format: Format) -> Result<u64, Mistake> {
    let bytes = &*filled(bytes)?;
    match format {
        Format::Xyz => xyz::frames(bytes),
        Format::LammpsDump => lammps_dump::frames(bytes),
        Format::Pdb => pdb::frames(bytes),
        Format::Mmcif => mmcif::frames(bytes),
        Format::LammpsData | Format::Csv | Format::Npy | Format::Ply => Ok(1),
    }
}

/// The bytes without gzip, if there are any.
fn filled(bytes: &[u8]) -> Result<std::borrow::Cow<'_, [u8]>, Mistake> {
    let bytes = source::decompressed(bytes)?;
    if bytes.is_empty() {
        return Err(Mistake::of_file("the file is empty"));
    }
    Ok(bytes)
}
