//! See `../../targets.rs`.
#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| manifactor_fuzz::record(data));
