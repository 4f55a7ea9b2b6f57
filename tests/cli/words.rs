//! Printed text: examples of the book, messages, logs, on any terminal.
mod book;
mod help;
mod kinds;
mod log;
mod mistakes;
mod slam_systems;
mod terminal;
mod tutorial;
