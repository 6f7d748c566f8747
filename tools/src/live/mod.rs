//! Processes that work together: where they meet, what they say to each other, and a crew of three under one parent.
//!
//! Each process is this binary with another subcommand. Scans and posteriors cross shared memory; what a process says
//! about itself are the JSON lines on its standard output ([`said`]), which the parent reads like anybody could.

mod child;
mod crew;
mod deadline;
mod exhibition;
mod firmware;
mod firmware_log;
mod meeting;
mod report;
pub(crate) mod said;
mod sending;

pub(crate) use self::{
    deadline::Deadline,
    exhibition::{Exhibition, Exhibits, Finished},
    meeting::Meeting,
    sending::{Part, Sending},
};
