//! The text dumps of LAMMPS, of the styles `atom` and `custom`: blocks that begin with `ITEM:`, timestep after
//! timestep.
//!
//! Source: <https://docs.lammps.org/dump.html>; triclinic boxes:
//! <https://docs.lammps.org/Howto_triclinic.html>. Positions are `x y z`, else unwrapped (`xu yu zu`), else
//! scaled by the box (`xs ys zs`, `xsu ysu zsu`); in any case they become `x`, `y` and `z`. Of `diameter` a
//! column `radius` is made.

use glam::DVec3;

use super::Particles;
use super::lines::{Line, Lines, number};
use super::mistake::{Mistake, word as shown};
use super::table::{Kind, LARGEST, Table};

/// What a frame says before its particles.
struct Frame<'a> {
    /// The number of its particles.
    count: u64,
    /// The box, if it can scale.
    bounds: Option<Bounds>,
    /// The line that names the columns.
    columns: Line<'a>,
}

/// A box as LAMMPS has it: an origin and three edges.
#[derive(Clone, Copy)]
struct Bounds {
    origin: DVec3,
    edges: [DVec3; 3],
}

pub(super) fn parse(bytes: &[u8], frame: u64) -> Result<Particles, Mistake> {
    let mut lines = Lines::new(bytes);
    for index in 0.. {
        let Some(found) = begin(&mut lines, index)? else {
            return Err(Mistake::no_frame(index, frame));
        };
        if index == frame {
            return read(&mut lines, &found);
        }
        lines.skip(found.count, "particle")?;
    }
    Err(Mistake::no_frame(u64::MAX, frame))
}

pub(super) fn frames(bytes: &[u8]) -> Result<u64, Mistake> {
    let mut lines = Lines::new(bytes);
    let mut frames = 0;
    while let Some(found) = begin(&mut lines, frames)? {
        lines.skip(found.count, "particle")?;
        frames += 1;
    }
    Ok(frames)
}

/// What an `ITEM:` line says behind that.
fn item(line: Line<'_>) -> Option<&[u8]> {
    line.bytes
        .trim_ascii()
        .strip_prefix(b"ITEM:")
        .map(<[u8]>::trim_ascii)
}

/// Reads up to the particles of the next frame, if there is one.
fn begin<'a>(lines: &mut Lines<'a>, frame: u64) -> Result<Option<Frame<'a>>, Mistake> {
    let mut count = None;
    let mut bounds = None;
    let mut first = true;
    loop {
        let Some(line) = lines.take_filled()? else {
            return match first {
                true if frame > 0 => Ok(None),
                _ => Err(lines.ended("`ITEM: ATOMS`")),
            };
        };
        first = false;
        let Some(item) = item(line) else {
            return Err(line
                .mistake("wanted a line that begins with `ITEM:`")
                .help(match frame {
                    0 => "a dump of the style atom or custom begins with `ITEM: TIMESTEP`",
                    _ => "is the number of atoms of the frame before too small?",
                }));
        };
        if item.starts_with(b"NUMBER OF ATOMS") {
            let line = lines.want(|| "the number of atoms".into())?;
            count = Some(line.count("the number of atoms")?);
        } else if let Some(kind) = item.strip_prefix(b"BOX BOUNDS") {
            bounds = read_box(lines, kind)?;
        } else if item == b"ATOMS" || item.starts_with(b"ATOMS ") {
            let count = count
                .ok_or_else(|| line.mistake("wanted `ITEM: NUMBER OF ATOMS` before the atoms"))?;
            return Ok(Some(Frame {
                count,
                bounds,
                columns: line,
            }));
        } else if [&b"TIMESTEP"[..], b"UNITS", b"TIME"].contains(&item) {
            lines.want(|| "a value".into())?;
        } else {
            return Err(line
                .mistake(format!("the item `{}` is not known", shown(item)))
                .help("wanted a dump of the style atom or custom"));
        }
    }
}

/// The box; `None` if it is one that scales nothing.
fn read_box(lines: &mut Lines<'_>, kind: &[u8]) -> Result<Option<Bounds>, Mistake> {
    let triclinic = kind.trim_ascii().starts_with(b"xy xz yz");
    let general = kind.trim_ascii().starts_with(b"abc");
    let wanted = if triclinic { 3 } else { 2 };
    let mut rows = [[0.0; 3]; 3];
    for row in &mut rows {
        let line = lines.want(|| "the bounds of the box".into())?;
        if general {
            continue;
        }
        let mut words = line.words();
        for place in &mut row[..wanted] {
            *place = words
                .next()
                .and_then(number)
                .filter(|value| value.abs() <= LARGEST)
                .ok_or_else(|| {
                    line.mistake(format!("wanted {wanted} numbers, each {LARGEST:e} at most"))
                })?;
        }
    }
    if general {
        return Ok(None);
    }
    let [[x0, x1, xy], [y0, y1, xz], [z0, z1, yz]] = rows;
    // The bounds are those of the upright box around the tilted one.
    let low = |values: &[f64]| values.iter().copied().fold(0.0, f64::min);
    let high = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let across = [xy, xz, xy + xz];
    let origin = DVec3::new(x0 - low(&across), y0 - low(&[yz]), z0);
    let end = DVec3::new(x1 - high(&across), y1 - high(&[yz]), z1);
    let size = end - origin;
    Ok(Some(Bounds {
        origin,
        edges: [
            DVec3::new(size.x, 0.0, 0.0),
            DVec3::new(xy, size.y, 0.0),
            DVec3::new(xz, yz, size.z),
        ],
    }))
}

impl Bounds {
    fn unscaled(self, position: DVec3) -> DVec3 {
        let [a, b, c] = self.edges;
        self.origin + position.x * a + position.y * b + position.z * c
    }
}

fn read(lines: &mut Lines<'_>, frame: &Frame<'_>) -> Result<Particles, Mistake> {
    let line = frame.columns;
    let (columns, scaled) = columns(line)?;
    let bounds = match (scaled, frame.bounds) {
        (false, _) => None,
        (true, Some(bounds)) => Some(bounds),
        (true, None) => {
            return Err(line.mistake(
                "the coordinates are scaled by the box, and there is no `ITEM: BOX BOUNDS` that says its sides",
            ));
        }
    };
    let mut table = Table::new(columns).map_err(|fault| line.mistake(fault))?;
    let wanted = table.columns();
    for index in 0..frame.count {
        let line = lines.want(|| format!("atom {} of {}", index + 1, frame.count))?;
        let mut found = 0;
        for word in line.words() {
            if found < wanted {
                table
                    .push(found, word)
                    .map_err(|fault| line.mistake(fault))?;
            }
            found += 1;
        }
        if found != wanted {
            return Err(line.mistake(format!(
                "the atom has {found} values; `ITEM: ATOMS` names {wanted}"
            )));
        }
        if let Some(bounds) = bounds {
            table
                .place(|position| bounds.unscaled(position))
                .map_err(|fault| line.mistake(fault))?;
        }
    }
    match lines.peek_filled()? {
        Some(line) if item(line).is_none() => Err(line.mistake(format!(
            "the frame has more than the {} atoms it announces; wanted `ITEM:`",
            frame.count
        ))),
        _ => Ok(table.finish(true)),
    }
}

/// The columns, and whether the coordinates are scaled.
fn columns(line: Line<'_>) -> Result<(Vec<(String, Kind)>, bool), Mistake> {
    // `ITEM:` and `ATOMS` come first.
    let names: Vec<String> = (line.words().skip(2))
        .map(|name| String::from_utf8_lossy(name).into_owned())
        .collect();
    let sets = [
        (["x", "y", "z"], false),
        (["xu", "yu", "zu"], false),
        (["xs", "ys", "zs"], true),
        (["xsu", "ysu", "zsu"], true),
    ];
    let (axes, scaled) = sets
        .into_iter()
        .find(|(axes, _)| {
            axes.iter()
                .all(|axis| names.iter().any(|name| name == axis))
        })
        .ok_or_else(|| {
            line.mistake("the positions are missing")
                .help("wanted the columns x y z, or xu yu zu, xs ys zs, xsu ysu zsu")
        })?;
    let kind = |name: String| match axes.iter().position(|axis| *axis == name) {
        Some(axis) => (["x", "y", "z"][axis].to_owned(), Kind::Coordinate),
        None => {
            let kind = match Kind::of_name(&name) {
                // Another set has been chosen: one axis of this may be there.
                Kind::Coordinate => Kind::Skipped,
                kind => kind,
            };
            (name, kind)
        }
    };
    Ok((names.into_iter().map(kind).collect(), scaled))
}

#[cfg(test)]
mod tests;
