//! The command line of Manifactor, as a library that an outside plugin can make its own binary with.
