//! Input of a run: sequences of frames, their sources, and the classes of objects.
pub mod class;
pub mod fusion;
pub mod journal;
pub mod measurement;
pub mod prior_map;
pub mod recording;
pub mod sequence;
pub mod simulator;
pub mod source;
pub mod stream;
