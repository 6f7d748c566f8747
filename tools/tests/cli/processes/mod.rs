//! Several real processes in a domain: end to end, and with one of them gone.

mod bridge;
mod deaths;
mod end_to_end;
mod group;
pub(crate) mod process;
