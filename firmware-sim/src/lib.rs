//! bhm-firmware-sim
