//! Particles of a file as spheres: which of them, where, how large and of which colour.

mod color;
pub mod look;
mod select;
mod table;

use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

pub use color::Coloring;
pub(super) use table::{add, colored, flickering, problem, request};

use crate::materials::schema::MAX_MAGNITUDE;
use crate::particles::{Element, Format, Particles, ReadError, frames, read};

/// What is asked of a particle file.
#[derive(Clone, Debug)]
pub struct Request {
    /// The file.
    pub file: PathBuf,
    /// Its format; `None`: by its ending.
    pub format: Option<Format>,
    /// The frame; 0 is the first.
    pub frame: u64,
    /// Whether the file may have no particles there, as one of several frames.
    pub may_be_empty: bool,
    /// The radius of each particle; `None`: a column `radius`, else van der Waals radii.
    pub radius: Option<RadiusBy>,
    /// The colour of each particle.
    pub coloring: Coloring,
    /// Which particles are kept, as `select` has it.
    pub select: Option<String>,
    /// From the file's coordinates to the scene's.
    pub transform: Similarity,
}

impl Request {
    /// The format that is asked for, or that the file's ending means.
    fn format(&self) -> Result<Format, Fault> {
        let format = self.format.or_else(|| Format::of_path(&self.file));
        format.ok_or_else(|| {
            let names = Format::ALL.map(Format::name).join(", ");
            let message = format!(
                "the ending of {} is none of a format that is known",
                self.file.display()
            );
            Fault::new("file", message).help(format!("`format` is one of {names}"))
        })
    }

    /// How many frames the file has.
    ///
    /// # Errors
    /// A [`Fault`] if the file cannot be read.
    pub fn frames(&self) -> Result<u64, Fault> {
        frames(&self.file, self.format()?).map_err(|error| unread(&self.file, error))
    }
}

/// Where the radii of particles come from.
#[derive(Clone, Debug, PartialEq)]
pub enum RadiusBy {
    /// All have this one.
    Constant(f64),
    /// A column.
    Column(String),
    /// The elements' van der Waals radii, in ångström.
    VanDerWaals,
    /// The elements' covalent radii, in ångström.
    Covalent,
}

impl RadiusBy {
    /// What the word means: `vdw`, `covalent` or a column.
    #[must_use]
    pub fn of_word(word: &str) -> Self {
        match word {
            "vdw" => Self::VanDerWaals,
            "covalent" => Self::Covalent,
            column => Self::Column(column.to_owned()),
        }
    }
}

/// x' = linear x + shift, where `linear` is a rotation or a reflection times `scale`: what keeps spheres
/// spheres.
#[derive(Clone, Copy, Debug)]
pub struct Similarity {
    linear: DMat3,
    shift: DVec3,
    scale: f64,
}

impl Similarity {
    /// x' = x.
    pub const IDENTITY: Self = Self {
        linear: DMat3::IDENTITY,
        shift: DVec3::ZERO,
        scale: 1.0,
    };

    /// Of a 4x4 matrix by rows, whose last is 0 0 0 1; `None` if it makes spheres something else.
    #[must_use]
    pub fn of_rows(rows: [[f64; 4]; 4]) -> Option<Self> {
        /// Lengths and angles may be off by what some digits of a file leave of them.
        const DIGITS: f64 = 1e-6;
        let row = |i: usize| DVec3::new(rows[i][0], rows[i][1], rows[i][2]);
        let linear = DMat3::from_cols(row(0), row(1), row(2)).transpose();
        let scale = linear.determinant().abs().cbrt();
        let product = linear.transpose() * linear;
        let wanted = DMat3::from_diagonal(DVec3::splat(scale * scale));
        let off = (product - wanted).to_cols_array().map(f64::abs);
        let square = off.iter().all(|x| *x <= DIGITS * scale * scale);
        let last = rows[3] == [0.0, 0.0, 0.0, 1.0];
        (square && last && scale > 0.0 && scale.is_finite()).then_some(Self {
            linear,
            shift: DVec3::new(rows[0][3], rows[1][3], rows[2][3]),
            scale,
        })
    }
}

/// What is wrong with a request.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The key that asks for it, as in a scene file.
    pub key: &'static str,
    /// Bytes of the key's text, where only a part of it is at fault.
    pub span: Option<Range<usize>>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Fault {
    fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self {
            key,
            span: None,
            message: message.into(),
            help: None,
        }
    }

    fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A particle as a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub center: DVec3,
    /// Its radius; positive.
    pub radius: f64,
    /// Index into [`Cloud::colors`]; 0 where nothing colours.
    pub color: usize,
}

/// The spheres of a request.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// In the file's order.
    pub balls: Vec<Ball>,
    /// Names and linear values of the colours; none where nothing colours.
    pub colors: Vec<(String, DVec3)>,
    /// Where a column colours, its values at the ends of the map.
    pub range: Option<[f64; 2]>,
}

/// Reads the file and does what is asked.
///
/// # Errors
/// A [`Fault`] with the key at fault.
pub fn gather(request: &Request) -> Result<Cloud, Fault> {
    let shown = request.file.display();
    let format = request.format()?;
    let particles =
        read(&request.file, format, request.frame).map_err(|error| unread(&request.file, error))?;
    let selection = request.select.as_deref().map(|text| {
        select::Selection::parse(text, &particles).map_err(|mistake| Fault {
            span: Some(mistake.span),
            ..Fault::new("select", mistake.message)
        })
    });
    let selection = selection.transpose()?;
    let kept = |index: &usize| {
        selection
            .as_ref()
            .is_none_or(|s| s.keeps(&particles, *index))
    };
    let kept: Vec<usize> = (0..particles.positions.len()).filter(kept).collect();
    if kept.is_empty() && !request.may_be_empty {
        return Err(match request.select {
            Some(_) => Fault::new(
                "select",
                format!(
                    "it keeps none of the {} particles of {shown}",
                    particles.positions.len()
                ),
            ),
            None => Fault::new("file", format!("{shown} has no particles")),
        });
    }
    let radius_of = radii(&particles, request.radius.as_ref())?;
    let painted = color::paint(&particles, &request.coloring, &kept)?;
    let Similarity {
        linear,
        shift,
        scale,
    } = request.transform;
    let mut balls = Vec::with_capacity(kept.len());
    for (place, &index) in kept.iter().enumerate() {
        let radius = radius_of(index)? * scale;
        let center = linear * particles.positions[index] + shift;
        if !(radius > 0.0 && radius <= MAX_MAGNITUDE) {
            let message = format!(
                "the radius of particle {} is {radius}; it must be positive, and at most {MAX_MAGNITUDE:e}",
                index + 1
            );
            return Err(Fault::new("radius", message)
                .help("in a scene file `select = \"radius > 0\"` leaves such particles out"));
        }
        // Also what is no number.
        let inside = center.is_finite() && center.abs().max_element() <= MAX_MAGNITUDE;
        if !inside {
            let message = format!(
                "particle {} is at {center}, beyond {MAX_MAGNITUDE:e}",
                index + 1
            );
            return Err(Fault::new("transform", message));
        }
        balls.push(Ball {
            // Without negative zeros: the two zeros are equal and must hash alike.
            center: center + 0.0,
            radius,
            color: painted.of_kept.get(place).map_or(0, |c| usize::from(*c)),
        });
    }
    Ok(Cloud {
        balls,
        colors: painted.colors,
        range: painted.range,
    })
}

fn unread(file: &Path, error: ReadError) -> Fault {
    let shown = file.display();
    match error {
        ReadError::Io(error) => Fault::new("file", format!("cannot read {shown}: {error}")),
        ReadError::Mistake(mistake) => Fault {
            help: mistake.help.clone(),
            ..Fault::new("file", format!("{shown}: {mistake}"))
        },
    }
}

/// The column `name`.
fn column<'p>(particles: &'p Particles, key: &'static str, name: &str) -> Result<&'p [f64], Fault> {
    let columns = &particles.columns;
    match columns.iter().find(|column| column.name == name) {
        Some(column) => Ok(&column.values),
        None => {
            let names: Vec<_> = columns.iter().map(|c| c.name.as_str()).collect();
            let message = format!("the file has no column `{}`", name.escape_debug());
            Err(Fault::new(key, message).help(format!("its columns are {}", names.join(", "))))
        }
    }
}

/// The radius of each particle, by its index.
type Radii<'p> = Box<dyn Fn(usize) -> Result<f64, Fault> + 'p>;

fn radii<'p>(particles: &'p Particles, by: Option<&RadiusBy>) -> Result<Radii<'p>, Fault> {
    let has_column = particles
        .columns
        .iter()
        .any(|column| column.name == "radius");
    let by = match by {
        Some(by) => by.clone(),
        None if has_column => RadiusBy::Column("radius".to_owned()),
        None if particles.elements.is_some() => RadiusBy::VanDerWaals,
        None => {
            let message = "the file says neither radii nor elements, so a radius is needed";
            let help = "a radius is a number, or the name of a column";
            return Err(Fault::new("radius", message).help(help));
        }
    };
    let of_element =
        |what: &'static str, of: fn(Element) -> Option<f64>| -> Result<Radii<'p>, Fault> {
            let Some(elements) = &particles.elements else {
                return Err(Fault::new(
                    "radius",
                    format!("the file says no elements, which have {what} radii"),
                ));
            };
            Ok(Box::new(move |index| {
                let element = elements[index];
                element.and_then(of).ok_or_else(|| {
                    let name = element.map_or("unknown", Element::symbol);
                    let message = format!(
                        "no {what} radius is known for particle {}, whose element is {name}",
                        index + 1
                    );
                    Fault::new("radius", message).help("a radius may also be a number or a column")
                })
            }))
        };
    match by {
        RadiusBy::Constant(radius) => Ok(Box::new(move |_| Ok(radius))),
        RadiusBy::Column(name) => {
            let values = column(particles, "radius", &name)?;
            Ok(Box::new(move |index| Ok(values[index])))
        }
        RadiusBy::VanDerWaals => of_element("van der Waals", Element::van_der_waals),
        RadiusBy::Covalent => of_element("covalent", Element::covalent),
    }
}

#[cfg(test)]
mod tests;
