//! The fuzz targets, on their corpora and on quick random changes of them.
//!
//! Fuzzers that search for new paths need a nightly compiler (`README.md`).
#![allow(unreachable_pub)]
mod targets;

use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::ops::Range;
use std::path::Path;
use targets::TARGETS;

/// Words that may be inserted anywhere.
const WORDS: [&[u8]; 16] = [
    b"nan",
    b"inf",
    b"-1",
    b"0",
    b"1e999",
    b"1e-320",
    b"99999999999999999999",
    b" ",
    b"\n",
    b"\0",
    b"\xff",
    b"[",
    b"\"",
    b"{}",
    b"null",
    b"\xc3\xa9",
];

/// Numbers that may replace a number.
const NUMBERS: [&str; 16] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "7",
    "0.5",
    "1e-320",
    "1e-9",
    "1e9",
    "1e154",
    "1e308",
    "-1e308",
    "nan",
    "4294967295",
    "18446744073709551615",
];

/// Runs all targets. `MANIFACTOR_FUZZ` is the number of changed inputs for each target,
/// `MANIFACTOR_FUZZ_TARGET` the name of a single target.
#[test]
fn no_target_panics() {
    let asked = std::env::var("MANIFACTOR_FUZZ").map(|n| n.parse().unwrap()).ok();
    let only = std::env::var("MANIFACTOR_FUZZ_TARGET").ok();
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    for (name, target, changes) in TARGETS {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let files = std::fs::read_dir(corpus.join(name)).unwrap();
        let mut inputs: Vec<_> = files.map(|file| std::fs::read(file.unwrap().path()).unwrap()).collect();
        inputs.sort();
        assert!(!inputs.is_empty(), "no corpus of {name}");
        inputs.iter().for_each(|input| run(name, target, input));
        let mut rng = StdRng::seed_from_u64(7);
        for _ in 0..asked.unwrap_or(changes) {
            let [input, other] = [0, 1].map(|_| &inputs[rng.random_range(0..inputs.len())]);
            run(name, target, &changed(input, other, &mut rng));
        }
    }
}

/// Runs a target; if it panics, the message has the input.
fn run(name: &str, target: fn(&[u8]), input: &[u8]) {
    let ran = std::panic::catch_unwind(|| target(input));
    assert!(ran.is_ok(), "{name} panics at:\n{}", String::from_utf8_lossy(input));
}

/// Changes, drops, or doubles a few bytes, takes some from `other`, or replaces a number.
fn changed(input: &[u8], other: &[u8], rng: &mut StdRng) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..rng.random_range(1..4) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..20)).min(bytes.len());
        match rng.random_range(0..8) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => drop(bytes.splice(at..end, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
            3 => bytes[at..end].iter_mut().for_each(|b| *b ^= 1 << rng.random_range(0..8)),
            6 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            4 | 5 => {
                let number = number(&bytes, at);
                drop(bytes.splice(number, NUMBERS[rng.random_range(0..NUMBERS.len())].bytes()));
            }
            _ => {
                let from = rng.random_range(0..=other.len());
                drop(bytes.splice(at..end, other[from..(from + 40).min(other.len())].iter().copied()));
            }
        }
    }
    bytes
}

/// Returns the range of the next number, or an empty range at the end if there is none.
fn number(bytes: &[u8], from: usize) -> Range<usize> {
    let is_part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
    let start = bytes[from..].iter().position(u8::is_ascii_digit).map_or(bytes.len(), |place| from + place);
    let end = bytes[start..].iter().position(|b| !is_part(b)).map_or(bytes.len(), |place| start + place);
    start..end
}
