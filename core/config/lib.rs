//! Documents in TOML, JSON and YAML, and errors that point at the line.
