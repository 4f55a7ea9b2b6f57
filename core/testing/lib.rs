//! Strategies and laws that every manifold and factor is tested by.
