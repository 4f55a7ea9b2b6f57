//! The fuzz targets, on what is kept of their corpora and on quick random changes of it.
//!
//! Fuzzers that look for new paths need a nightly compiler: `README.md` says how to run them.
#![allow(unreachable_pub)]
mod targets;

use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::path::Path;
use targets::{TARGETS, Target};

/// Changed inputs for each target; `MANIFACTOR_FUZZ` asks for more.
const CHANGES: usize = 2000;
/// What may be put in anywhere.
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

#[test]
fn no_target_panics() {
    let asked = std::env::var("MANIFACTOR_FUZZ").map(|n| n.parse().unwrap());
    let changes = asked.unwrap_or(CHANGES);
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    for (name, target) in TARGETS {
        let files = std::fs::read_dir(corpus.join(name)).unwrap();
        let mut inputs: Vec<_> = files.map(|file| std::fs::read(file.unwrap().path()).unwrap()).collect();
        inputs.sort();
        assert!(!inputs.is_empty(), "no corpus of {name}");
        inputs.iter().for_each(|input| run((name, target), input));
        let mut rng = StdRng::seed_from_u64(7);
        for _ in 0..changes {
            let [input, other] = [0, 1].map(|_| &inputs[rng.random_range(0..inputs.len())]);
            run((name, target), &changed(input, other, &mut rng));
        }
    }
}

/// With the input in the message, should it panic.
fn run((name, target): Target, input: &[u8]) {
    let ran = std::panic::catch_unwind(|| target(input));
    assert!(ran.is_ok(), "{name} panics at:\n{}", String::from_utf8_lossy(input));
}

/// A few bytes changed, lost, doubled, or taken from another input.
fn changed(input: &[u8], other: &[u8], rng: &mut StdRng) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..rng.random_range(1..4) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..20)).min(bytes.len());
        match rng.random_range(0..6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => drop(bytes.splice(at..end, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
            3 => bytes[at..end].iter_mut().for_each(|b| *b ^= 1 << rng.random_range(0..8)),
            4 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            _ => {
                let from = rng.random_range(0..=other.len());
                drop(bytes.splice(at..end, other[from..(from + 40).min(other.len())].iter().copied()));
            }
        }
    }
    bytes
}
