//! The kinds of particle files.

use std::path::Path;

/// A kind of particle file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// XYZ and extended XYZ.
    Xyz,
    /// The text dumps of LAMMPS.
    LammpsDump,
    /// The data files of LAMMPS, that `read_data` reads.
    LammpsData,
    /// The wwPDB format 3.3, with fixed columns.
    Pdb,
    /// The PDBx/mmCIF dictionary in CIF 1.1.
    Mmcif,
    /// Text with a line of names, and commas, semicolons or tabs between values.
    Csv,
    /// An array of NumPy.
    Npy,
    /// The Stanford polygon format.
    Ply,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Xyz,
        Self::LammpsDump,
        Self::LammpsData,
        Self::Pdb,
        Self::Mmcif,
        Self::Csv,
        Self::Npy,
        Self::Ply,
    ];

    /// Its name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xyz => "xyz",
            Self::LammpsDump => "lammps-dump",
            Self::LammpsData => "lammps-data",
            Self::Pdb => "pdb",
            Self::Mmcif => "mmcif",
            Self::Csv => "csv",
            Self::Npy => "npy",
            Self::Ply => "ply",
        }
    }

    /// Whether a file can have more than one frame.
    #[must_use]
    pub const fn has_frames(self) -> bool {
        matches!(self, Self::Xyz | Self::LammpsDump | Self::Pdb | Self::Mmcif)
    }

    /// The format of a file with such a name, by its ending; `.gz` behind it says nothing.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        match name.rsplit_once('.')?.1 {
            "xyz" | "extxyz" => Some(Self::Xyz),
            "dump" | "lammpstrj" => Some(Self::LammpsDump),
            "data" | "lmp" => Some(Self::LammpsData),
            "pdb" | "ent" => Some(Self::Pdb),
            "cif" | "mmcif" => Some(Self::Mmcif),
            "csv" => Some(Self::Csv),
            "npy" => Some(Self::Npy),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Format;

    #[test]
    fn endings_say_the_format() {
        for (name, format) in [
            ("a.xyz", Some(Format::Xyz)),
            ("a/b.c/A.EXTXYZ", Some(Format::Xyz)),
            ("a.lammpstrj.gz", Some(Format::LammpsDump)),
            ("all.dump", Some(Format::LammpsDump)),
            ("in.lmp", Some(Format::LammpsData)),
            ("1tii.data", Some(Format::LammpsData)),
            ("pdb1tii.ent.gz", Some(Format::Pdb)),
            ("1tii.pdb", Some(Format::Pdb)),
            ("1tii.cif.GZ", Some(Format::Mmcif)),
            ("1tii.mmcif", Some(Format::Mmcif)),
            ("a.b.csv", Some(Format::Csv)),
            ("a.npy", Some(Format::Npy)),
            ("a.ply", Some(Format::Ply)),
            ("a.xyz.zip", None),
            ("a.gz", None),
            ("xyz", None),
            ("", None),
        ] {
            assert_eq!(Format::of_path(Path::new(name)), format, "{name}");
        }
    }

    #[test]
    fn names_are_all_different() {
        let names = Format::ALL.map(Format::name);
        let unique: std::collections::BTreeSet<_> = names.into();
        assert_eq!(unique.len(), Format::ALL.len());
    }
}
