//! Objects as constrained dual quadrics, and the factors that see and orient them.
