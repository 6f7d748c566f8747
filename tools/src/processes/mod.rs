//! Processes that work together: their domain of shared memory, what they say to each other, and a group of three under one parent.
//!
//! Each process is this binary with another subcommand. Scans and posteriors cross shared memory; what a process says
//! about itself are the JSON lines on its standard output ([`json_lines`]), which the parent reads like anybody could.

mod child;
mod deadline;
mod domain_options;
mod firmware;
mod firmware_log;
mod group;
pub(crate) mod json_lines;
mod mapping_run;
mod report;
mod sending;

pub(crate) use self::{
    deadline::Deadline,
    domain_options::DomainOptions,
    mapping_run::{MappingRun, MappingRunOptions},
    sending::{Part, Sending},
};
