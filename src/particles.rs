//! stub
#![allow(missing_docs, clippy::all)]
use glam::DVec3;
use std::path::Path;
pub struct Particles {
    pub positions: Vec<DVec3>,
    pub elements: Option<Vec<Option<Element>>>,
    pub columns: Vec<Column>,
}
pub struct Column {
    pub name: String,
    pub values: Vec<f64>,
}
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Element(u8);
impl Element {
    pub fn of_symbol(s: &str) -> Option<Self> {
        ["H", "C", "Fe"]
            .iter()
            .position(|x| *x == s)
            .map(|i| Self(i as u8))
    }
    pub fn symbol(self) -> &'static str {
        "C"
    }
    pub fn name(self) -> &'static str {
        "carbon"
    }
    pub fn color(self) -> [u8; 3] {
        [1, 2, 3]
    }
    pub fn van_der_waals(self) -> Option<f64> {
        Some(1.7)
    }
    pub fn covalent(self) -> Option<f64> {
        None
    }
}
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Xyz,
    LammpsDump,
    LammpsData,
    Pdb,
    Mmcif,
    Csv,
    Npy,
    Ply,
}
impl Format {
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
    pub fn name(self) -> &'static str {
        "xyz"
    }
    pub fn of_path(_: &Path) -> Option<Self> {
        Some(Self::Xyz)
    }
}
pub struct Mistake {
    pub message: String,
    pub help: Option<String>,
}
impl std::fmt::Display for Mistake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}
pub enum ReadError {
    Io(std::io::Error),
    Mistake(Mistake),
}
pub fn read(_: &Path, _: Format, _: u64) -> Result<Particles, ReadError> {
    Err(ReadError::Mistake(Mistake {
        message: "x".into(),
        help: None,
    }))
}
