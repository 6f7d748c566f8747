//! What a small wrong change in the core would break unseen: each part against an oracle that is not the core.

#[path = "../common/mod.rs"]
mod common;

mod bias;
mod conditioning;
mod counts;
mod eviction;
mod kept_pass;
mod map;
mod prior;
mod queries;
mod readings;
mod rectangles;
mod settings;
mod space;
mod uncertain_pose;
