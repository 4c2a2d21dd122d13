//! The file itself: a zip of arrays (`.npy`) and two texts (`film.json`, `scene.toml`), nothing compressed, as
//! NumPy's `load` opens it.

use std::fmt::Display;
use std::io::{self, Read, Seek, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::About;
use crate::error::invalid;
use crate::film::{AovSums, Counts, Film, Record};
use crate::image::Format;
use crate::numpy::Header;
use crate::output::npy::header;
use crate::settings::Rect;

/// The name of what the file says.
const TEXT: &str = "film.json";
/// The name of the scene file's text.
const SCENE: &str = "scene.toml";
/// The type of sums.
const FLOAT: &str = "<f8";
/// The type of steps.
const BYTE: &str = "|u1";
/// From this size on an entry needs the wider fields of zip64.
const WIDE: u64 = u32::MAX as u64;
/// The longest `film.json` that is read, in bytes: ours take a few thousand, and one that goes on must not
/// decide how much memory is taken.
const LONGEST_TEXT: u64 = 16 << 20;
/// Bytes that are converted at once.
const CHUNK: usize = 1 << 15;

/// Writes a film and what there is to say about it.
pub(super) fn write(to: impl Write + Seek, about: &About, film: &Film) -> io::Result<()> {
    let mut zip = ZipWriter::new(to);
    let text = serde_json::to_vec_pretty(about)?;
    for (name, text) in [(TEXT, &text[..]), (SCENE, about.scene.text.as_bytes())] {
        start(&mut zip, name, text.len() as u64)?;
        zip.write_all(text)?;
    }

    let rect = film.rect();
    let [width, height] = [rect.width, rect.height];
    let [across, down] = Record::tiles(rect);
    start_array(&mut zip, "steps", BYTE, &[down, across])?;
    zip.write_all(film.tile_steps())?;
    for (name, halves) in ["sum", "variance"].into_iter().zip(film.half_sums()) {
        start_array(&mut zip, name, FLOAT, &[2, height, width, 3])?;
        for half in halves {
            write_values(&mut zip, half.as_flattened().iter().copied())?;
        }
    }
    let aovs = film.aov_sums();
    if !aovs.is_empty() {
        let shape = [height, width, AovSums::NUMBERS as u32];
        start_array(&mut zip, "layers", FLOAT, &shape)?;
        write_values(&mut zip, aovs.iter().flat_map(AovSums::to_numbers))?;
    }
    zip.finish()?.flush()
}

fn start(zip: &mut ZipWriter<impl Write + Seek>, name: &str, size: u64) -> io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(size >= WIDE);
    Ok(zip.start_file(name, options)?)
}

/// Begins an array: its values have to follow.
fn start_array(
    zip: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    descr: &str,
    shape: &[u32],
) -> io::Result<()> {
    let header = header(descr, shape);
    let size = value_bytes(descr, shape).saturating_add(header.len() as u64);
    start(zip, &format!("{name}.npy"), size)?;
    zip.write_all(&header)
}

/// The bytes of an array's values; those beyond any file saturate.
fn value_bytes(descr: &str, shape: &[u32]) -> u64 {
    let value = if descr == FLOAT { 8 } else { 1 };
    let sizes = shape.iter().map(|n| u64::from(*n));
    sizes.fold(value, u64::saturating_mul)
}

fn write_values(to: &mut impl Write, values: impl Iterator<Item = f64>) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(CHUNK);
    for value in values {
        bytes.extend_from_slice(&value.to_le_bytes());
        if bytes.len() == CHUNK {
            to.write_all(&bytes)?;
            bytes.clear();
        }
    }
    to.write_all(&bytes)
}

/// A film file that is being read.
pub(super) struct Reader<R> {
    zip: ZipArchive<R>,
}

impl<R: Read + Seek> Reader<R> {
    /// Opens it. No entry is larger than the file says that it is, nor all of them than the file itself.
    pub(super) fn open(mut from: R) -> io::Result<Self> {
        let length = from.seek(io::SeekFrom::End(0))?;
        from.rewind()?;
        let mut zip = ZipArchive::new(from).map_err(|error| damaged(error, length))?;
        let mut all: u64 = 0;
        for index in 0..zip.len() {
            let entry = zip
                .by_index_raw(index)
                .map_err(|error| damaged(error, length))?;
            if entry.compression() != CompressionMethod::Stored || entry.encrypted() {
                return Err(invalid("an entry is compressed, which film files are not"));
            }
            if entry.size() != entry.compressed_size() {
                return Err(invalid("the sizes of an entry contradict each other"));
            }
            all = all.saturating_add(entry.size());
        }
        if all > length {
            return Err(invalid(format!(
                "its entries take more than its {length} bytes: is it cut?"
            )));
        }
        Ok(Self { zip })
    }

    /// What the file says, and the scene's text.
    pub(super) fn texts(&mut self) -> io::Result<[Vec<u8>; 2]> {
        Ok([self.text(TEXT, LONGEST_TEXT)?, self.text(SCENE, u64::MAX)?])
    }

    fn text(&mut self, name: &str, longest: u64) -> io::Result<Vec<u8>> {
        self.entry(name, |entry, size| {
            if size > longest {
                return Err(invalid(format!("{size} bytes are too many")));
            }
            let mut text = Vec::new();
            // To its end, where the checksum is compared.
            entry.read_to_end(&mut text).map(|_| text)
        })
    }

    /// What `read` makes of an entry and its size, in bytes; faults say which entry it is, and where.
    fn entry<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut dyn Read, u64) -> io::Result<T>,
    ) -> io::Result<T> {
        let mut entry = self.zip.by_name(name).map_err(|error| match error {
            ZipError::FileNotFound => invalid(format!("it is no film file: it has no {name}")),
            error => within(name, &error),
        })?;
        let size = entry.size();
        let place = match entry.data_start() {
            Some(start) => format!("{name}, from byte {start} on"),
            None => name.to_owned(),
        };
        read(&mut entry, size).map_err(|error| match error.kind() {
            io::ErrorKind::OutOfMemory => error,
            _ => within(&place, &error),
        })
    }

    /// The film of the pixels of `rect`.
    pub(super) fn film(&mut self, rect: Rect, counts: Counts, layers: bool) -> io::Result<Film> {
        let [width, height] = [rect.width, rect.height];
        let [across, down] = Record::tiles(rect);
        let steps = self.array("steps", BYTE, &[down, across], |from, count| {
            let mut steps = room(count)?;
            steps.resize(count, 0);
            from.read_exact(&mut steps).map(|()| steps)
        })?;
        let halves = [2, height, width, 3];
        let mut pairs = |name| {
            self.array(name, FLOAT, &halves, |from, count| {
                let mut half = || read_values(from, count / 6, |values: &[f64; 3]| *values);
                Ok([half()?, half()?])
            })
        };
        let (sum, variance) = (pairs("sum")?, pairs("variance")?);
        let mut aovs = Vec::new();
        if layers {
            let shape = [height, width, AovSums::NUMBERS as u32];
            aovs = self.array("layers", FLOAT, &shape, |from, count| {
                read_values(from, count / AovSums::NUMBERS, AovSums::of_numbers)
            })?;
        }
        let record = Record {
            steps,
            counts,
            sum,
            variance,
            aovs,
        };
        Film::of_record(rect, record).map_err(invalid)
    }

    /// An array of this type and shape and no other, whose values `read` takes: memory is asked for only once
    /// the entry has been found to be as long as they are.
    fn array<T>(
        &mut self,
        name: &str,
        descr: &str,
        shape: &[u32],
        read: impl FnOnce(&mut dyn Read, usize) -> io::Result<T>,
    ) -> io::Result<T> {
        self.entry(&format!("{name}.npy"), |mut entry, size| {
            let mut magic = [0; 6];
            entry.read_exact(&mut magic)?;
            if magic != *Format::Npy.magic() {
                return Err(invalid("it is no array"));
            }
            let found = Header::read(&mut entry)?;
            if found.descr() != Some(descr) || found.fortran_order || found.sizes() != shape {
                let wanted = shape.iter().map(u32::to_string).collect::<Vec<_>>();
                return Err(invalid(format!(
                    "wanted an array of {descr} in C order of the shape ({})",
                    wanted.join(", ")
                )));
            }
            let bytes = value_bytes(descr, shape);
            // Programs pad the header as they like, but not by less than nothing.
            if size < bytes {
                return Err(invalid("the data ends early"));
            }
            let value = value_bytes(descr, &[]);
            let values = read(entry, (bytes / value) as usize)?;
            // At the end, where the checksum is compared.
            match entry.read(&mut [0])? {
                0 => Ok(values),
                _ => Err(invalid("the data goes on")),
            }
        })
    }
}

/// What `of` makes of each of `count` times `N` numbers.
fn read_values<const N: usize, T>(
    from: &mut dyn Read,
    count: usize,
    of: impl Fn(&[f64; N]) -> T,
) -> io::Result<Vec<T>> {
    let mut all = room(count)?;
    let mut bytes = vec![0; CHUNK / (8 * N) * 8 * N];
    while all.len() < count {
        let part = (8 * N * (count - all.len())).min(bytes.len());
        from.read_exact(&mut bytes[..part])?;
        let (values, _) = bytes[..part].as_chunks::<8>();
        for group in values.chunks_exact(N) {
            all.push(of(&std::array::from_fn(|i| f64::from_le_bytes(group[i]))));
        }
    }
    Ok(all)
}

/// Room for so many values.
fn room<T>(count: usize) -> io::Result<Vec<T>> {
    let mut room = Vec::new();
    room.try_reserve_exact(count)
        .map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    Ok(room)
}

fn within(place: &str, fault: &impl Display) -> io::Error {
    invalid(format!("{place}: {fault}"))
}

fn damaged(error: ZipError, length: u64) -> io::Error {
    match error {
        ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => error,
        error => invalid(format!(
            "it is no film file, or a damaged or cut one, of {length} bytes: {error}"
        )),
    }
}
