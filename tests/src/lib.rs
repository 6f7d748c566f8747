//! bhm-tests
