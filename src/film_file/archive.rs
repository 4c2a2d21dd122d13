//! The file itself: a zip of arrays (`.npy`) and one text (`film.json`), nothing compressed, as NumPy's
//! `load` opens it.

use std::fmt::Display;
use std::io::{self, Read, Seek, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::film::{AovSums, Counts, Film, Record};
use crate::input::npy::Header;
use crate::output::npy::header;
use crate::settings::Rect;

/// The name of the text.
const TEXT: &str = "film.json";
/// From this size on an entry needs the wider fields of zip64.
const WIDE: u64 = u32::MAX as u64;
/// Values that are converted at once.
const CHUNK: usize = 1 << 12;

/// Writes a film and the text about it.
pub(super) fn write(to: impl Write + Seek, text: &[u8], film: &Film) -> io::Result<()> {
    let mut zip = ZipWriter::new(to);
    start(&mut zip, TEXT, text.len() as u64)?;
    zip.write_all(text)?;

    let rect = film.rect();
    let [width, height] = [rect.width, rect.height];
    let [across, down] = Record::tiles(rect);
    array_header(&mut zip, "steps", "|u1", &[down, across])?;
    zip.write_all(film.tile_steps())?;
    let arrays = ["sum", "variance"].into_iter().zip(film.half_sums());
    for (name, halves) in arrays {
        array_header(&mut zip, name, "<f8", &[2, height, width, 3])?;
        for half in halves {
            write_values(&mut zip, half.as_flattened().iter().copied())?;
        }
    }
    let aovs = film.aov_sums();
    if !aovs.is_empty() {
        let shape = [height, width, AovSums::NUMBERS as u32];
        array_header(&mut zip, "layers", "<f8", &shape)?;
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
fn array_header(
    zip: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    descr: &str,
    shape: &[u32],
) -> io::Result<()> {
    let header = header(descr, shape);
    start(
        zip,
        &format!("{name}.npy"),
        array_bytes(header.len(), descr, shape),
    )?;
    zip.write_all(&header)
}

/// The bytes of an array with its header; those beyond any file saturate.
fn array_bytes(header: usize, descr: &str, shape: &[u32]) -> u64 {
    let value = if descr == "<f8" { 8 } else { 1 };
    let sizes = shape.iter().map(|n| u64::from(*n));
    sizes
        .fold(value, u64::saturating_mul)
        .saturating_add(header as u64)
}

fn write_values(to: &mut impl Write, values: impl Iterator<Item = f64>) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(8 * CHUNK);
    for value in values {
        bytes.extend_from_slice(&value.to_le_bytes());
        if bytes.len() == 8 * CHUNK {
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
        let mut zip = ZipArchive::new(from).map_err(damaged)?;
        let mut all: u64 = 0;
        for index in 0..zip.len() {
            let entry = zip.by_index_raw(index).map_err(damaged)?;
            if entry.compression() != CompressionMethod::Stored || entry.encrypted() {
                return Err(invalid("an entry is compressed, which film files are not"));
            }
            if entry.size() != entry.compressed_size() {
                return Err(invalid("the sizes of an entry contradict each other"));
            }
            all = all.saturating_add(entry.size());
        }
        if all > length {
            return Err(invalid("its entries are larger than the file: is it cut?"));
        }
        Ok(Self { zip })
    }

    /// The text.
    pub(super) fn text(&mut self) -> io::Result<Vec<u8>> {
        let mut entry = self.zip.by_name(TEXT).map_err(|e| missing(TEXT, e))?;
        let mut text = Vec::new();
        // To its end, where the checksum is compared.
        entry.read_to_end(&mut text).map_err(|e| within(TEXT, &e))?;
        Ok(text)
    }

    /// The film of the pixels of `rect`.
    pub(super) fn film(&mut self, rect: Rect, counts: Counts, layers: bool) -> io::Result<Film> {
        let [width, height] = [rect.width, rect.height];
        let [across, down] = Record::tiles(rect);
        let steps = self.array("steps", "|u1", &[down, across], |from, count| {
            let mut steps = vec![0; count];
            from.read_exact(&mut steps).map(|()| steps)
        })?;
        let halves = [2, height, width, 3];
        let mut pairs = |name| {
            self.array(name, "<f8", &halves, |from, count| {
                let half = |from: &mut dyn Read| read_values::<3>(from, count / 6);
                Ok([half(from)?, half(from)?])
            })
        };
        let (sum, variance) = (pairs("sum")?, pairs("variance")?);
        let mut aovs = Vec::new();
        if layers {
            let shape = [height, width, AovSums::NUMBERS as u32];
            aovs = self.array("layers", "<f8", &shape, |from, count| {
                let numbers = read_values(from, count / AovSums::NUMBERS)?;
                Ok(numbers.iter().map(AovSums::of_numbers).collect())
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
        let name = &format!("{name}.npy");
        let mut entry = self.zip.by_name(name).map_err(|e| missing(name, e))?;
        let size = entry.size();
        let fault = |error: io::Error| within(name, &error);
        let mut magic = [0; 6];
        entry.read_exact(&mut magic).map_err(fault)?;
        if magic != *crate::image::Format::Npy.magic() {
            return Err(within(name, &"it is no array"));
        }
        let found = Header::read(&mut entry).map_err(fault)?;
        let expected = header(descr, shape);
        if found.descr() != Some(descr) || found.fortran_order || found.sizes() != shape {
            let wanted = String::from_utf8_lossy(&expected[10..]);
            return Err(within(name, &format!("wanted {}", wanted.trim_end())));
        }
        // Programs pad the header as they like, but not by less than nothing.
        let least = array_bytes(0, descr, shape);
        if size < least {
            return Err(within(name, &"the data ends early"));
        }
        let value = if descr == "<f8" { 8 } else { 1 };
        let values = read(&mut entry, (least / value) as usize).map_err(fault)?;
        match entry.read(&mut [0]).map_err(fault)? {
            0 => Ok(values),
            _ => Err(within(name, &"the data goes on")),
        }
    }
}

/// `count` times `N` numbers.
fn read_values<const N: usize>(from: &mut dyn Read, count: usize) -> io::Result<Vec<[f64; N]>> {
    let mut values = vec![[0.0; N]; count];
    let mut bytes = [0; 8 * CHUNK];
    for chunk in values.as_flattened_mut().chunks_mut(CHUNK) {
        let bytes = &mut bytes[..8 * chunk.len()];
        from.read_exact(bytes)?;
        for (value, bytes) in chunk.iter_mut().zip(bytes.as_chunks().0) {
            *value = f64::from_le_bytes(*bytes);
        }
    }
    Ok(values)
}

fn invalid(text: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, text.into())
}

fn within(name: &str, fault: &impl Display) -> io::Error {
    invalid(format!("{name}: {fault}"))
}

fn damaged(error: ZipError) -> io::Error {
    match error {
        ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => error,
        error => invalid(format!("it is no film file, or a damaged one: {error}")),
    }
}

fn missing(name: &str, error: ZipError) -> io::Error {
    match error {
        ZipError::FileNotFound => invalid(format!("it is no film file: it has no {name}")),
        error => damaged(error),
    }
}
