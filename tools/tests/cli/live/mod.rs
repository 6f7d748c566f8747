//! Several real processes in a domain: end to end, and with one of them gone.

mod bridge;
mod crew;
mod deaths;
mod end_to_end;
pub(crate) mod process;
