//! Numbered inputs: seeds with random changes.

use std::ops::Range;

use super::scenes::scene_files;
use super::words::{NUMBERS, TOKENS};

/// The longest input, in bytes.
const LONGEST: usize = 1 << 16;

/// SplitMix64: any number gives a stream of its own.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`; 0 if there is none.
    pub(super) fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    pub(super) fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    pub(super) fn of<'a, T: ?Sized>(&mut self, choices: &[&'a T]) -> &'a T {
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
pub(super) fn input(kind: &str, index: u64, seeds: &[Vec<u8>]) -> Vec<u8> {
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
    let seeds = scene_files();
    let inputs: Vec<_> = (0..1000).map(|index| input("a", index, &seeds)).collect();
    let again: Vec<_> = (0..1000).map(|index| input("a", index, &seeds)).collect();
    assert!(inputs == again);
    let distinct: std::collections::BTreeSet<_> = inputs.iter().collect();
    assert!(distinct.len() > 950, "{}", distinct.len());
    assert!(inputs.iter().any(|input| input.len() > LONGEST / 2));
    assert!(inputs.iter().any(|input| str::from_utf8(input).is_err()));
}
