//! The binary as people and scripts meet it: exit codes, messages, results, files, and its processes together.
//!
//! Here and not in the member `tests`, since Cargo builds and names the binary only for tests of its own package.

mod bad_input;
mod budget;
mod contest;
mod experiments;
mod figures;
mod maps;
mod processes;
mod support;
mod supports;
mod tune;
mod usage;
