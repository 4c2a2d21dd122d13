//! Whatever a user's bytes reach, fed with damaged input: no panic, no hang, no flood of memory,
//! and errors that say where they are.
//!
//! The inputs are numbered, and a number always gives the same input. `GPU_TRACE_FUZZ=1000000` in the
//! environment sets how many there are of each kind, `GPU_TRACE_FUZZ_FIRST` with which they begin.

mod command_line;
mod films;
mod images;
mod inputs;
mod memory;
mod particles;
mod scenes;
mod words;

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use self::inputs::input;
use self::memory::peak_of;
use self::scenes::place_of;

/// No input takes longer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Memory that any input may take ...
const MEMORY: usize = 64 << 20;
/// ... and more for each of its bytes.
const MEMORY_PER_BYTE: usize = 1 << 10;

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
