//! bhm-tools
