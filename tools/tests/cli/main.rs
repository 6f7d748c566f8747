//! The binary as people and scripts meet it: exit codes, messages, results, files.

mod bad_input;
mod maps;
mod support;
mod usage;
