//! Whatever a user's bytes reach, fed with damaged input: no panic, no hang, no flood of memory,
//! and errors that say where they are.
//!
//! The inputs are numbered, and a number always gives the same input. `GPU_TRACE_FUZZ=1000000` in the
//! environment sets how many there are of each kind, `GPU_TRACE_FUZZ_FIRST` with which they begin.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fmt::Debug;
use std::io::{Cursor, Read as _};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes,
    LineOrder, Vec2, WritableImage as _, f16,
};
use clap::Parser;
use glam::DVec3;
use gpu_trace::cli::{Cli, RenderArgs};
use gpu_trace::effects::Effects;
use gpu_trace::error::Error;
use gpu_trace::film::{AovSums, Estimate, Film, PixelSums, Tally, Window};
use gpu_trace::film_file::{
    self, About, Choices, Command, FORMAT, FilmFile, Goal, SceneRecord, encode,
};
use gpu_trace::image::Picture;
use gpu_trace::input::{decode, read, texels};
use gpu_trace::output::{Layer, Metadata, Target, exr, npy, png};
use gpu_trace::particles::{self, Format, Mistake, Place};
use gpu_trace::placement::media::MAX_LEVELS;
use gpu_trace::placement::{PlacedCamera, Placement};
use gpu_trace::scene::load::{Loaded, load_file, load_str};
use gpu_trace::scene::{Scene, summary};
use gpu_trace::settings::Settings;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// No input takes longer.
const PATIENCE: Duration = Duration::from_secs(5);
/// The longest input, in bytes.
const LONGEST: usize = 1 << 16;
/// Memory that any input may take ...
const MEMORY: usize = 64 << 20;
/// ... and more for each of its bytes.
const MEMORY_PER_BYTE: usize = 1 << 10;

// ---- Memory ----

/// The system's allocator, with an account of what each thread holds.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

fn account(bytes: isize) {
    let held = HELD.get() + bytes;
    HELD.set(held);
    PEAK.set(PEAK.get().max(held));
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[expect(unsafe_code, reason = "an allocator is unsafe; this one only counts")]
// SAFETY: all is left to the system's allocator. The account needs no allocation itself.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        account(layout.size() as isize);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        account(-(layout.size() as isize));
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// The most memory that `work` holds at once beyond what was held before, in bytes.
fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.get();
    PEAK.set(before);
    let result = work();
    (result, (PEAK.get() - before).max(0) as usize)
}

#[test]
fn memory_is_counted() {
    let (_, none) = peak_of(|| 1 + 1);
    let (_, much) = peak_of(|| drop(std::hint::black_box(vec![1_u8; 3 << 20])));
    assert!(none < 1 << 10, "{none}");
    assert!((3 << 20..4 << 20).contains(&much), "{much}");
}

// ---- Inputs ----

/// SplitMix64: any number gives a stream of its own.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`; 0 if there is none.
    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    fn of<'a, T: ?Sized>(&mut self, choices: &[&'a T]) -> &'a T {
        choices[self.below(choices.len())]
    }

    /// A number that is mostly small.
    fn length(&mut self, most: usize) -> usize {
        let most = most >> self.below(usize::BITS as usize - most.leading_zeros() as usize + 1);
        self.below(most + 1)
    }

    /// A piece of `length`, mostly short.
    fn piece(&mut self, length: usize) -> Range<usize> {
        let start = self.below(length + 1);
        start..start + self.length(length - start)
    }
}

/// What numbers are replaced by.
const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "1e400",
    "-1e400",
    "1e308",
    "1e20",
    "1.0000001e20",
    "-1e20",
    "1e-20",
    "1e-45",
    "1e-160",
    "1e-300",
    "5e-324",
    "1e-400",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "+inf",
    "65535",
    "65536",
    "65537",
    "2147483647",
    "2147483648",
    "-2147483648",
    "-2147483649",
    "4294967295",
    "4294967296",
    "281474976710656",
    "281474976710657",
    "9223372036854775807",
    "9223372036854775808",
    "-9223372036854775808",
    "99999999999999999999999999999999999999",
    "0x7fffffffffffffff",
    "0xff",
    "0o17",
    "0b1",
    "1_000",
    "1__0",
    "_1",
    "1.",
    ".5",
    "1e",
    "1e+",
    "+1",
    "01",
    "180",
    "179.99999999999997",
    "1979-05-27T07:32:00Z",
    "07:32:00",
    "true",
    "\"1\"",
    "[]",
    "{}",
    "''",
];

/// What is put anywhere.
const TOKENS: &[&str] = &[
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ",",
    ".",
    "#",
    "\"",
    "'",
    "\"\"\"",
    "'''",
    "\n",
    "\r\n",
    "\r",
    "\t",
    " ",
    "\0",
    "\u{feff}",
    "\u{1b}[2J",
    "\u{202e}",
    "\u{85}",
    "é",
    "部",
    "🦀",
    "\\",
    "\\u0000",
    "\\U0010ffff",
    "\\ud800",
    "[camera]",
    "[image]",
    "[render]",
    "[environment]",
    "[[sphere]]",
    "[sphere]",
    "[material]",
    "[material.a]",
    "[[material.a]]",
    "camera",
    "image",
    "width",
    "height",
    "spp",
    "max_bounces",
    "radiance",
    "gradient",
    "zenith",
    "scale",
    "rotation",
    "linear",
    "true",
    "position",
    "look_at",
    "up",
    "fov",
    "handedness",
    "\"left\"",
    "aperture_radius",
    "focus_distance",
    "shutter",
    "velocity",
    "type",
    "\"diffuse\"",
    "\"mirror\"",
    "\"dielectric\"",
    "\"reflective\"",
    "albedo",
    "reflectance",
    "ior",
    "specular",
    "epsilon",
    "mu",
    "emission",
    "center",
    "radius",
    "material",
    "priority",
    "= 1\n",
    "= [0, 0, 0]",
    "= {}\n",
    "a.b.c = 1\n",
    "priority = 1\n",
    "aperture_radius = 0.1\n",
    "focus_distance = 1\n",
    "shutter = [0, 1]\n",
    "velocity = [1, 2, 3]\n",
];

const OPTIONS: &[&str] = &[
    "--output",
    "-o",
    "--stats",
    "--exposure",
    "--dump-wgsl",
    "--progress",
    "--quiet",
    "--verbose",
    "--spp",
    "--error",
    "--time",
    "--sample-range",
    "--size",
    "--crop",
    "--seed",
    "--integrator",
    "--sampler",
    "--max-bounces",
    "--radiance-cache",
    "--roulette",
    "--termination",
    "--backend",
    "--device",
    "--geometry",
    "--threads",
    "--allow-non-finite",
    "--inject-fault",
    "--",
    "-",
    "--help",
    "=",
];

const VALUES: &[&str] = &[
    "a.png",
    "a.exr",
    "a",
    "/",
    "",
    "1%",
    "0.5 %",
    "30s",
    "1h 30m",
    "1y 1month 1w 1d",
    "16..48",
    "0..281474976710656",
    "18446744073709551615..18446744073709551615",
    "640x480",
    "1,2,3x4",
    "0,0,65536x65536",
    "4294967295,4294967295,1x1",
    "lecture",
    "bsdf",
    "on",
    "off",
    "auto",
    "list",
    "baked",
    "cpu",
    "json",
    "device-lost@2",
    "non-finite@18446744073709551615",
    "99999999999999999999y",
    "1e308",
    "0.1e-400s",
];

/// The bounds of a random number or word in `text`.
fn word(random: &mut Random, text: &[u8], is_part: impl Fn(u8) -> bool) -> Range<usize> {
    let from = random.below(text.len() + 1);
    let start = (from..text.len())
        .find(|i| is_part(text[*i]))
        .unwrap_or(text.len());
    let length = text[start..]
        .iter()
        .take_while(|byte| is_part(**byte))
        .count();
    start..start + length
}

fn is_number(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+')
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.')
}

/// The bounds of a random line, with its end.
fn line(random: &mut Random, text: &[u8]) -> Range<usize> {
    let at = random.below(text.len() + 1);
    let start = text[..at]
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |i| i + 1);
    let length = text[start..].iter().position(|byte| *byte == b'\n');
    start..length.map_or(text.len(), |length| start + length + 1)
}

/// A random change of one of 20 kinds.
fn mutate(kind: usize, random: &mut Random, text: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let length = text.len();
    match kind {
        // Numbers most of all: they get past the parser.
        0..=4 => {
            let range = word(random, text, is_number);
            text.splice(range, random.of(NUMBERS).bytes());
        }
        5 => {
            let (range, power) = (word(random, text, is_number), random.below(700));
            let digits = random.below(1000);
            let number = format!("{digits}e{}", power as i32 - 350);
            text.splice(range, number.bytes());
        }
        6 => {
            let range = word(random, text, is_word);
            text.splice(range, random.of(TOKENS).bytes());
        }
        7 => {
            let at = random.below(length + 1);
            text.splice(at..at, random.of(TOKENS).bytes());
        }
        8 => {
            let range = line(random, text);
            text.drain(range);
        }
        9 | 10 => {
            // A line again, once or up to the longest input, here or there.
            let copy = text[line(random, text)].to_vec();
            let most = LONGEST.saturating_sub(length) / copy.len().max(1);
            let times = if random.chance(40) {
                random.below(most + 1)
            } else {
                1
            };
            let at = line(random, text).start;
            text.splice(at..at, copy.repeat(times));
        }
        11 => {
            // A line moves.
            let range = line(random, text);
            let moved: Vec<u8> = text.drain(range).collect();
            let at = line(random, text).start;
            text.splice(at..at, moved);
        }
        12 => {
            let range = random.piece(length);
            text.drain(range);
        }
        13 => {
            let range = random.piece(length);
            let copy = text[range].to_vec();
            let at = random.below(length + 1);
            text.splice(at..at, copy);
        }
        14 => {
            for _ in 0..random.length(8) {
                if let Some(byte) = text.get_mut(random.below(length)) {
                    *byte ^= 1 << random.below(8);
                }
            }
        }
        15 => {
            let at = random.below(length + 1);
            let bytes: Vec<u8> = (0..random.length(16))
                .map(|_| random.next() as u8)
                .collect();
            text.splice(at..at, bytes);
        }
        16 => {
            let other = &seeds[random.below(seeds.len())];
            let (from, at) = (random.below(other.len()), random.below(length + 1));
            text.truncate(at);
            text.extend_from_slice(&other[from..]);
        }
        17 => {
            let other = &seeds[random.below(seeds.len())];
            let copy = other[line(random, other)].to_vec();
            let at = line(random, text).start;
            text.splice(at..at, copy);
        }
        18 => {
            let length = if random.chance(10) {
                random.below(LONGEST)
            } else {
                random.length(200)
            };
            let nested = nested(random, length);
            let range = if random.chance(2) {
                word(random, text, is_number)
            } else {
                let at = line(random, text).start;
                at..at
            };
            text.splice(range, nested);
        }
        _ if random.chance(4) => {
            let text_of = String::from_utf8_lossy(text).replace('\n', "\r\n");
            *text = text_of.into_bytes();
        }
        _ => text.truncate(random.below(length + 1)),
    }
}

/// About `length` bytes of one thing again and again: nests, long names, long strings.
fn nested(random: &mut Random, length: usize) -> Vec<u8> {
    let (open, middle, close) = random.of::<(&str, &str, &str)>(&[
        &("[", "1", "]"),
        &("{a = ", "1", "}"),
        &("{a.b = ", "{}", "}"),
        &("[[", "1", "]]"),
        &("[{a = ", "1", "}]"),
        &("a.", "b = 1\n", ""),
        &("[a.", "b]\n", "]"),
        &("[[a.b]]\n", "", ""),
        &("[material.", "x]\n", ""),
        &("\"", "", "\""),
        &("x = \"", "é", "\"\n"),
        &("0", ".5", ""),
        &("9", "", ""),
        &("é", " = 1\n", ""),
        &("# ", "\n", ""),
        &("\n", "", ""),
        &("1, ", "", ""),
        &("\\\"", "", ""),
        &("\0", "", ""),
        &("[[sphere]]\n", "", ""),
        &(
            "sphere = [{ center = [0, 0, 0], radius = 1, material = \"a\" }, ",
            "]\n",
            "",
        ),
        &("a = 1\n", "", ""),
    ]);
    let times = length / (open.len() + close.len());
    let mut bytes = open.repeat(times);
    bytes += middle;
    // Now and then it is not closed.
    if !random.chance(4) {
        bytes += &close.repeat(times);
    }
    bytes.into_bytes()
}

/// Input `index`: a seed with some changes.
fn input(kind: &str, index: u64, seeds: &[Vec<u8>]) -> Vec<u8> {
    let kind = kind
        .bytes()
        .fold(0, |sum: u64, byte| sum * 31 + u64::from(byte));
    let mut random = Random(kind.wrapping_mul(0x1_0000_0000) ^ index);
    let mut text = seeds[random.below(seeds.len())].clone();
    // A third has only other numbers: it gets furthest.
    let kinds = if random.chance(3) { 6 } else { 20 };
    for _ in 0..1 + random.length(12) {
        let kind = random.below(kinds);
        mutate(kind, &mut random, &mut text, seeds);
        text.truncate(LONGEST);
    }
    text
}

#[test]
fn inputs_are_the_same_each_time_and_differ() {
    let seeds = scenes();
    let inputs: Vec<_> = (0..1000).map(|index| input("a", index, &seeds)).collect();
    let again: Vec<_> = (0..1000).map(|index| input("a", index, &seeds)).collect();
    assert!(inputs == again);
    let distinct: std::collections::BTreeSet<_> = inputs.iter().collect();
    assert!(distinct.len() > 950, "{}", distinct.len());
    assert!(inputs.iter().any(|input| input.len() > LONGEST / 2));
    assert!(inputs.iter().any(|input| str::from_utf8(input).is_err()));
}

// ---- The harness ----

/// What all inputs of a kind came to.
#[derive(Debug, Default)]
struct Tried {
    accepted: u64,
    refused: u64,
    slowest: (Duration, u64),
    largest: (usize, u64),
}

/// The numbers of the inputs: `count` of them, or as the environment says.
fn numbers(count: u64) -> Range<u64> {
    let number = |name: &str| {
        std::env::var(name)
            .ok()
            .map(|text| text.parse().expect(name))
    };
    let first = number("GPU_TRACE_FUZZ_FIRST").unwrap_or(0);
    first..first + number("GPU_TRACE_FUZZ").unwrap_or(count)
}

/// Feeds `check` with numbered inputs; it says whether an input was accepted, and panics at what
/// must not be.
fn fuzz(
    kind: &str,
    numbers: Range<u64>,
    seeds: &[Vec<u8>],
    check: impl Fn(u64, &[u8]) -> bool + Sync,
) -> Tried {
    let current: Mutex<(u64, Option<Instant>)> = Mutex::new((0, None));
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // Something that hangs can only be told from outside.
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                let (index, since) = *current.lock().expect("no panic while it is locked");
                if since.is_some_and(|since| since.elapsed() > 2 * PATIENCE) {
                    eprintln!(
                        "{kind} {index} hangs:\n{}",
                        shown(&input(kind, index, seeds))
                    );
                    std::process::abort();
                }
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        let tried = catch_unwind(AssertUnwindSafe(|| {
            let mut tried = Tried::default();
            for index in numbers.clone() {
                let bytes = input(kind, index, seeds);
                let begin = Instant::now();
                *current.lock().expect("no panic while it is locked") = (index, Some(begin));
                let run = || catch_unwind(AssertUnwindSafe(|| check(index, &bytes)));
                let (result, memory) = peak_of(run);
                let took = begin.elapsed();
                *current.lock().expect("no panic while it is locked") = (index, None);
                let place = || format!("{kind} {index}, {} bytes:\n{}", bytes.len(), shown(&bytes));
                match result {
                    Ok(true) => tried.accepted += 1,
                    Ok(false) => tried.refused += 1,
                    Err(_) => panic!("the panic above is of {}", place()),
                }
                assert!(took < PATIENCE, "{took:?} for {}", place());
                let most = MEMORY + MEMORY_PER_BYTE * bytes.len();
                assert!(memory < most, "{memory} bytes of memory for {}", place());
                tried.slowest = tried.slowest.max((took, index));
                tried.largest = tried.largest.max((memory, index));
            }
            tried
        }));
        done.store(true, Ordering::Relaxed);
        let tried = tried.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        eprintln!("{} of {kind}: {tried:?}", numbers.end - numbers.start);
        tried
    })
}

/// An input as a message can show it.
fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let (head, tail) = (
        text.chars().take(3000),
        text.chars().count().saturating_sub(3000),
    );
    let head: String = head.flat_map(char::escape_debug).collect();
    format!("{} ({tail} more)", head.replace("\\n", "\n"))
}

/// A harness that cannot fail proves nothing.
#[test]
fn the_harness_finds_what_it_looks_for() {
    let finds = |check: fn(u64, &[u8]) -> bool| {
        let seeds = [b"a = 1\n".to_vec()];
        catch_unwind(|| fuzz("faults", 0..200, &seeds, check)).is_err()
    };
    assert!(!finds(|_, bytes| bytes.len() > 5));
    assert!(finds(|_, bytes| bytes[..1].len() > 5));
    assert!(finds(|_, _| vec![1_u8; 200 << 20].len() > 5));
    assert!(catch_unwind(|| place_of("no place", "a.toml", "")).is_err());
    assert!(catch_unwind(|| place_of("error: x\n  ┌─ a.toml:9:1", "a.toml", "a\nb\n")).is_err());
    place_of("error: x\n  ┌─ a.toml:2:1", "a.toml", "a\nb\n");
}

// ---- Scenes ----

/// The scene files but the largest.
fn scenes() -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["scenes", "scenes/tests"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("the folder of scenes");
        let paths = entries.map(|entry| entry.expect("an entry of the folder").path());
        files.extend(paths.filter(|path| path.extension().is_some_and(|e| e == "toml")));
    }
    files.sort();
    let read = |path| std::fs::read(path).expect("a file");
    let seeds: Vec<_> = files
        .iter()
        .map(read)
        .filter(|text| text.len() < 10_000)
        .collect();
    assert!(seeds.len() >= 10);
    seeds
}

/// That an error of `file` is one that a user can work with: whole reports with a place that exists.
fn place_of(error: &str, file: &str, text: &str) {
    assert!(error.starts_with("error: "), "{error}");
    assert!(error.len() < 100_000, "{} bytes", error.len());
    let control = |c: char| c.is_control() && c != '\n' && c != '\t';
    assert!(!error.contains(control), "{error:?}");
    let place = error
        .split_once(&format!("─ {file}:"))
        .map(|(_, place)| place);
    let place = place.and_then(|place| place.lines().next());
    let place = place.and_then(|place| place.split_once(':'));
    let (line, column) = place.unwrap_or_else(|| panic!("no place: {error}"));
    let number = |text: &str| text.parse::<usize>().unwrap_or_else(|_| panic!("{error}"));
    let (line, column) = (number(line), number(column));
    let lines: Vec<&str> = text.split('\n').collect();
    assert!((1..=lines.len()).contains(&line), "line {line}: {error}");
    let most = lines[line - 1].chars().count() + 1;
    assert!((1..=most).contains(&column), "column {column}: {error}");
}

/// Everything that is done with a scene before a device is asked for.
fn use_scene(loaded: &Loaded) {
    let scene = &loaded.scene;
    let _ = summary(loaded);
    let placement = Placement::new(scene, scene.width, scene.height);
    assert_finite(&placement);
    if placement.media.levels <= MAX_LEVELS {
        let effects = Effects::derive(scene, &placement, &Settings::for_scene(scene));
        assert!(effects.names().count() < 100);
    }
}

fn assert_finite(placement: &Placement) {
    let number = |name: &str, x: f64| assert!(x.is_finite(), "{name} is {x}");
    let vector = |name: &str, x: DVec3| assert!(x.is_finite(), "{name} is {x}");
    number("scale", placement.scale);
    assert!(placement.scale > 0.0, "scale is {}", placement.scale);
    number("light", placement.radiance_scale);
    assert!(
        placement.radiance_scale > 0.0,
        "light is {}",
        placement.radiance_scale
    );
    for sphere in &placement.spheres {
        vector("anchor", sphere.anchor);
        vector("motion", sphere.motion);
        number("radius", sphere.radius);
        vector("pole", sphere.pole.unwrap_or_default());
    }
    let PlacedCamera {
        anchor,
        approach,
        corner,
        across,
        down,
        forward,
        lens_across,
        lens_down,
        focus,
        lens_share,
    } = placement.camera;
    vector("camera.anchor", anchor);
    number("camera.approach", approach);
    vector("camera.corner", corner);
    vector("camera.across", across);
    vector("camera.down", down);
    vector("camera.forward", forward);
    vector("camera.lens_across", lens_across);
    vector("camera.lens_down", lens_down);
    number("camera.focus", focus);
    number("camera.lens_share", lens_share);
}

fn is_scene<T: Debug>(loaded: Result<T, Error>, text: &str) -> Option<T> {
    match loaded {
        Ok(loaded) => Some(loaded),
        Err(Error::Scene(error)) => {
            place_of(&error, "fuzz.toml", text);
            None
        }
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn no_bytes_upset_the_scene_loader() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz.toml");
    let tried = fuzz("scenes", numbers(20_000), &scenes(), |_, bytes| {
        let Ok(text) = str::from_utf8(bytes) else {
            std::fs::write(&path, bytes).expect("it can be written");
            return match load_file(&path) {
                Err(Error::Scene(text)) => {
                    assert!(
                        text.starts_with("error: ") && text.contains("fuzz.toml"),
                        "{text}"
                    );
                    false
                }
                other => panic!("{other:?}"),
            };
        };
        let loaded = is_scene(load_str("fuzz.toml", text), text);
        if let Some(loaded) = &loaded {
            for warning in &loaded.warnings {
                place_of(
                    &warning.replacen("warning: ", "error: ", 1),
                    "fuzz.toml",
                    text,
                );
            }
            use_scene(loaded);
        }
        loaded.is_some()
    });
    // Some damage is harmless, most is not.
    assert!(tried.accepted > tried.refused / 50, "{tried:?}");
    assert!(tried.refused > tried.accepted / 50, "{tried:?}");
}

// ---- NPY ----

#[test]
fn no_bytes_upset_the_npy_reader() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz.npy");
    let mut seeds: Vec<Vec<u8>> = [(1, 1), (2, 1), (3, 5), (64, 64)]
        .map(|(width, height)| {
            Picture::new(width, height, vec![[0.5; 3]; (width * height) as usize])
        })
        .iter()
        .map(npy::encode)
        .collect();
    for (version, header) in [
        (
            2,
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 3)}\n",
        ),
        (
            3,
            "{\"shape\":(2,1,3,),\"descr\":\"<f4\",\"fortran_order\":False,}\n",
        ),
        (
            1,
            "{'descr': '<f4', 'fortran_order': True, 'shape': (4294967295, 4294967295, 3)}\n",
        ),
    ] {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        let length = header.len() as u32;
        let length = length.to_le_bytes();
        bytes.extend(&length[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.bytes());
        bytes.extend([0; 24]);
        seeds.push(bytes);
    }
    let tried = fuzz("npy", numbers(20_000), &seeds, |index, bytes| {
        let result = decode(bytes).map(|input| input.picture);
        if index % 64 == 0 {
            std::fs::write(&path, bytes).expect("it can be written");
            let read = read(&path);
            assert_eq!(read.is_ok(), result.is_ok());
        }
        match result {
            Ok(picture) => {
                let Picture {
                    width,
                    height,
                    pixels,
                } = &picture;
                assert_eq!(pixels.len() as u64, u64::from(*width) * u64::from(*height));
                assert!(2 * pixels.len() < bytes.len());
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 1000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        }
    });
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

// ---- Images ----

/// Small files of every kind, as other programs write them.
fn images() -> Vec<Vec<u8>> {
    let picture = Picture::new(5, 3, vec![[0.5, 0.25, 2.0]; 15]);
    let metadata = Metadata::new().with("scene", "a").with("scene_hash", "0");
    let values = [0.5; 45];
    let stderr = [Layer {
        name: "stderr",
        channels: &["R", "G", "B"],
        values: &values,
    }];
    let mut files = vec![
        npy::encode(&picture),
        png::encode(&picture, 0.0, &metadata).expect("a PNG file"),
        exr::encode(&picture, &stderr, &metadata).expect("an EXR file"),
    ];
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::ZIP1,
        Compression::DWAA(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(2, 2))] {
            let channel = |name| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; 15]));
            let layer = ::exr::prelude::Layer::new(
                Vec2(5, 3),
                LayerAttributes::named("a"),
                Encoding {
                    compression,
                    blocks,
                    line_order: LineOrder::Increasing,
                },
                AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect()),
            );
            let mut bytes = Cursor::new(Vec::new());
            let image = Image::from_layer(layer);
            image.write().to_buffered(&mut bytes).expect("an EXR file");
            files.push(bytes.into_inner());
        }
    }
    files
}

#[test]
fn no_bytes_upset_the_image_readers() {
    let seeds = images();
    assert!(seeds.iter().all(|bytes| decode(bytes).is_ok()));
    let tried = fuzz("images", numbers(20_000), &seeds, |_, bytes| {
        match decode(bytes) {
            Ok(input) => {
                let size = input.picture.width as usize * input.picture.height as usize;
                assert_eq!(input.picture.pixels.len(), size);
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 2000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        }
    });
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

/// Files that a scene may name as images.
fn texel_files() -> Vec<Vec<u8>> {
    let data: Vec<u8> = (0..3 * 17 * 9).map(|i| (i * 5) as u8).collect();
    let jpeg = |color: image::ExtendedColorType, channels: usize| {
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut bytes)
            .encode(&data[..channels * 17 * 9], 17, 9, color)
            .expect("a JPEG file");
        bytes
    };
    let mut files = images();
    files.push(jpeg(image::ExtendedColorType::Rgb8, 3));
    files.push(jpeg(image::ExtendedColorType::L8, 1));
    files
}

#[test]
fn no_bytes_upset_the_readers_of_texels() {
    let seeds = texel_files();
    let tried = fuzz(
        "texels",
        numbers(20_000),
        &seeds,
        |index, bytes| match texels(bytes, index % 2 == 0, 1 << 20) {
            Ok(image) => {
                let size = image.width as usize * image.height as usize;
                assert_eq!(image.pixels.len(), size);
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 2000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        },
    );
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

// ---- Particles ----

/// Small files of a format, with what programs write besides.
fn particle_files(format: Format) -> Vec<Vec<u8>> {
    let texts: &[&str] = match format {
        Format::Xyz => &[
            "2\na\nC 0 1 2\nO 0.5 -1e-3 2 7 8\n1\n\nH 1 2 3\n",
            "2\nLattice=\"1 0 0 0 1 0 0 0 1\" Properties=species:S:1:pos:R:3:radius:R:1:v:R:2:ok:L:1 a='b c'\n\
             Si 0 1 2 0.5 1 2 T\nX 3 4 5 1 6 7 F\n",
        ],
        Format::LammpsDump => &[
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 2\n0 3\n\
             ITEM: ATOMS id element xs ys zs diameter name\n1 C 0 0.5 1 1 a\n2 O 0.1 0.2 0.3 2 b\n",
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS xy xz yz pp pp pp\n0 1 0.5\n\
             0 2 -1\n0 3 0\nITEM: ATOMS xsu ysu zsu\n1 2 3\nITEM: TIMESTEP\n1\nITEM: NUMBER OF ATOMS\n1\n\
             ITEM: ATOMS id x y z\n1 2 3 4\n",
        ],
        Format::LammpsData => &[
            "title\n\n2 atoms\n1 atom types\n\n0 1 xlo xhi\n\nMasses\n\n1 1.0\n\nAtoms # sphere\n\n\
             1 1 0.5 1 1 2 3\n2 1 0.25 1 4 5 6\n\nVelocities\n\n1 0 0 0\n2 0 0 0\n",
            "title\n1 atoms\n\nAtoms\n\n1 1 1 2 3 0 -1 0\n",
        ],
        Format::Pdb => &[
            "MODEL        1\nATOM      1  N   GLU A   4      69.319  39.142  47.221  1.00 64.20           N\n\
             ATOM      2  CA AGLU A   4      68.071  38.402  47.431  0.50  1.50           C1+\nTER\nENDMDL\n\
             MODEL        2\nHETATM    3 ZN    ZN B   1       1.000   2.000   3.000\nENDMDL\nEND\n",
        ],
        Format::Mmcif => &[
            "data_a\n_struct.title\n;text\n;\nloop_\n_atom_site.id\n_atom_site.type_symbol\n\
             _atom_site.label_alt_id\n_atom_site.auth_asym_id\n_atom_site.Cartn_x\n_atom_site.Cartn_y\n\
             _atom_site.Cartn_z\n_atom_site.B_iso_or_equiv\n_atom_site.pdbx_PDB_model_num\n\
             1 N . A 1.5 2.5 -3 ? 1\n2 'C' A \"B'\" 1(2) 2 3 4 1 # b\n3 O B C 0 0 0 . 2\nloop_\n_b.c 1 2\n",
            "_atom_site.Cartn_x 1 _atom_site.Cartn_y 2 _atom_site.Cartn_z 3\n",
        ],
        Format::Csv => &[
            "# from a script\n# x,y,z,element,name,radius\n1,2,3,C,\"a, b\",0.5\n4,5,6,8,,1\n",
            "X;Y;Z;E\r\n1;2;3;\r\n;;;\r\n4;5;6;7\r\n",
        ],
        Format::Ply => &[
            "ply\nformat ascii 1.0\nelement a 1\nproperty list uchar int b\nelement vertex 2\nproperty float x\n\
             property double y\nproperty int z\nproperty list int8 float t\nend_header\n2 1 2\n1 2 3 0\n\
             4 5 6 1 7\n",
            "ply\nformat binary_big_endian 1.0\nelement a 1\nproperty list uchar uchar b\nelement vertex 1\n\
             property uchar x\nproperty uchar y\nproperty uchar z\nelement face 0\nend_header\n\u{1}ABCD",
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nproperty list uchar int t\nend_header\n000011112222\0",
        ],
        Format::Npy => &[],
    };
    let mut files: Vec<Vec<u8>> = texts.iter().map(|text| text.as_bytes().into()).collect();
    if format == Format::Npy {
        for (descr, order, shape, data) in [
            ("<f8", "False", "(2, 4)", 64),
            (">f4", "True", "(3, 3)", 36),
            ("<i4", "False", "(1, 3)", 12),
        ] {
            let header =
                format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((header.len() as u16).to_le_bytes());
            bytes.extend(header.bytes());
            bytes.extend(vec![0; data]);
            files.push(bytes);
        }
    }
    files
}

/// That a mistake of these bytes is one that a user can work with.
fn is_mistake(mistake: &Mistake, plain: Option<&[u8]>) {
    let text = mistake.to_string();
    assert!(!text.is_empty() && text.len() < 3000, "{text}");
    assert!(!text.contains(char::is_control), "{text:?}");
    let Some(bytes) = plain else {
        return;
    };
    match &mistake.place {
        Place::Line { number, .. } => {
            let lines = bytes.split(|byte| *byte == b'\n').count() as u64;
            assert!((1..=lines).contains(number), "{text}");
        }
        Place::Byte(byte) => assert!(*byte <= bytes.len() as u64, "{text}"),
        Place::File => {}
    }
}

/// Whether a reader accepts these bytes.
fn reads_particles(format: Format, bytes: &[u8]) -> bool {
    let plain = (!bytes.starts_with(&[0x1f, 0x8b])).then_some(bytes);
    for frame in [1, u64::MAX] {
        if let Err(mistake) = particles::parse(bytes, format, frame) {
            is_mistake(&mistake, plain);
        }
    }
    match particles::count_frames(bytes, format) {
        Ok(frames) => assert!((1..=bytes.len().max(1) as u64).contains(&frames) || plain.is_none()),
        Err(mistake) => is_mistake(&mistake, plain),
    }
    match particles::parse(bytes, format, 0) {
        Ok(particles) => {
            let count = particles.positions.len();
            let allowed = |p: &DVec3| p.abs().max_element() <= 1e20;
            assert!(particles.positions.iter().all(allowed));
            assert!(particles.elements.is_none_or(|e| e.len() == count));
            assert!(particles.columns.iter().all(|c| c.values.len() == count));
            true
        }
        Err(mistake) => {
            is_mistake(&mistake, plain);
            false
        }
    }
}

#[test]
fn no_bytes_upset_the_particle_readers() {
    for format in Format::ALL {
        let mut seeds = particle_files(format);
        for seed in &seeds {
            if let Err(mistake) = particles::parse(seed, format, 0) {
                panic!("{format:?}: {mistake}");
            }
        }
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut gzip, &seeds[0]).expect("memory takes all");
        seeds.push(gzip.finish().expect("memory takes all"));
        let tried = fuzz(format.name(), numbers(4000), &seeds, |_, bytes| {
            reads_particles(format, bytes)
        });
        assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
    }
}

// ---- Film files ----

/// Films of a few pixels, without and with layers.
fn films() -> Vec<Vec<u8>> {
    let ball = ball();
    [false, true]
        .map(|classes| {
            let mut settings = Settings::for_scene(&ball);
            (settings.crop.width, settings.crop.height) = (3, 2);
            (settings.samples, settings.classes) = (0..16, classes);
            let rect = settings.crop;
            let mut film = Film::new(rect);
            film.add(&Window {
                image: Vec::new(),
                rect,
                samples: 0..16,
                batch: 4,
                pixels: vec![PixelSums::default(); 6],
                aovs: vec![AovSums::default(); if classes { 6 } else { 0 }],
                tally: Tally::default(),
            });
            let about = About {
                format: FORMAT,
                makers: Vec::new(),
                scene: SceneRecord {
                    name: "a".into(),
                    hash: "b".into(),
                    folder: None,
                    files: Vec::new(),
                    look: None,
                    text: "c".into(),
                },
                settings: Choices::of(&settings),
                goal: Goal::of(&settings),
                ranges: vec![[0, 16]],
                samples: vec![16],
                counts: film.counts(),
                pilot: 0,
                look: 64,
                seconds: 1.5,
                stopped_by: None,
                command: Command::default(),
            };
            encode(&about, &film).expect("memory takes it")
        })
        .to_vec()
}

/// Whether it is read; if so, all of it can be asked.
fn reads_film(bytes: &[u8]) -> bool {
    match film_file::decode(Cursor::new(bytes)) {
        Ok(FilmFile { film, .. }) => {
            assert_eq!(film.pixels().len(), film.rect().pixels());
            let _ = (film.mean_samples(), film.freedom(), Estimate::of(&film));
            true
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && text.len() < 1000, "{text}");
            false
        }
    }
}

#[test]
fn no_bytes_upset_the_film_reader() {
    let seeds = films();
    assert!(seeds.iter().all(|bytes| reads_film(bytes)));
    let tried = fuzz("films", numbers(10_000), &seeds, |_, bytes| {
        reads_film(bytes)
    });
    assert!(tried.refused > 0, "{tried:?}");
}

/// What checksums do not keep out: entries of a film file that are damaged before it is written.
#[test]
fn no_entry_upsets_the_film_reader() {
    let open = |bytes| ZipArchive::new(Cursor::new(bytes)).expect("a zip");
    let film = films().pop().expect("one with layers");
    let names = [
        "film.json",
        "scene.toml",
        "steps.npy",
        "sum.npy",
        "variance.npy",
        "layers.npy",
    ];
    assert_eq!(open(film.clone()).len(), names.len());
    for name in names {
        let entry = |name: &str| {
            let mut bytes = Vec::new();
            let mut archive = open(film.clone());
            let mut entry = archive.by_name(name).expect("it is there");
            entry.read_to_end(&mut bytes).expect("it is whole");
            bytes
        };
        let rest: Vec<_> = names.into_iter().filter(|other| *other != name).collect();
        let rest: Vec<_> = rest.into_iter().map(|name| (name, entry(name))).collect();
        let with = |bytes: &[u8]| {
            let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
            let all = rest.iter().map(|(name, bytes)| (*name, &bytes[..]));
            for (name, bytes) in all.chain([(name, bytes)]) {
                zip.start_file(name, stored).expect("a new name");
                std::io::Write::write_all(&mut zip, bytes).expect("memory takes all");
            }
            zip.finish().expect("memory takes all").into_inner()
        };
        let seeds = [entry(name)];
        assert!(reads_film(&with(&seeds[0])), "{name}");
        let tried = fuzz(name, numbers(2_000), &seeds, |_, bytes| {
            reads_film(&with(bytes))
        });
        assert!(
            tried.accepted > 0 && (tried.refused > 0 || name == "scene.toml"),
            "{name}: {tried:?}"
        );
    }
}

// ---- The command line ----

/// The options of `render` alone.
#[derive(Debug, Parser)]
struct Render {
    #[command(flatten)]
    render: RenderArgs,
}

/// A scene with members that options meet, and without lamps: for each set of words a pilot would choose the estimator.
fn ball() -> Scene {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/white-furnace-diffuse.toml");
    load_file(&path).expect("a scene").scene
}

#[test]
fn no_words_upset_the_command_line() {
    let scene = ball();
    let mut seeds: Vec<Vec<u8>> = VALUES
        .iter()
        .chain(NUMBERS)
        .map(|v| v.as_bytes().into())
        .collect();
    seeds.push(VALUES.join(" ").into_bytes());
    let tried = fuzz("words", numbers(5000), &seeds, |index, bytes| {
        // Damaged values, each after an option.
        let mut random = Random(index);
        let text = String::from_utf8_lossy(bytes);
        let mut arguments = vec!["gpu-trace".to_owned()];
        for _ in 0..1 + random.below(3) {
            let option = random.of(OPTIONS);
            let value = if random.chance(2) {
                text.as_ref()
            } else {
                random.of(VALUES)
            };
            let value: String = value.chars().filter(|c| *c != '\0').collect();
            match random.below(4) {
                0 => arguments.push(format!("{option}={value}")),
                1 => arguments.push(value),
                _ => arguments.extend([(*option).to_owned(), value]),
            }
        }
        if let Err(error) = Cli::try_parse_from(&arguments) {
            assert!(!error.to_string().is_empty());
        }
        let _ = Target::parse(arguments.last().expect("the program's name"));
        let Ok(parsed) = Render::try_parse_from(&arguments) else {
            return false;
        };
        match parsed.render.settings(&scene) {
            Ok(settings) => {
                assert!(!settings.samples.is_empty(), "{settings:?}");
                assert!(settings.crop.pixels() > 0, "{settings:?}");
                assert_finite(&Placement::new(&scene, settings.width, settings.height));
                true
            }
            Err(Error::Usage(text)) => {
                assert!(!text.is_empty());
                false
            }
            Err(other) => panic!("{other}"),
        }
    });
    assert!(tried.accepted > tried.refused / 50, "{tried:?}");
    assert!(tried.refused > tried.accepted / 50, "{tried:?}");
}
