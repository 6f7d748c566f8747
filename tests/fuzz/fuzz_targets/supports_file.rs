//! Files of learned supports.
#![no_main]

use bhm_fuzz::{learned_supports, sealed, within};
use bhm_host::supports::{decode, encode};

fn seeds() -> Vec<Vec<u8>> {
    vec![encode(&learned_supports())]
}

fn check(bytes: &[u8]) {
    for bytes in [bytes, &sealed(bytes)] {
        // A support takes 25 bytes at least in a file, and twice that here, where lists grow by doubling. A decoder of lists
        // takes up to 1 MiB for a list of any length.
        if let Ok(supports) = within((4 << 20) + 16 * bytes.len(), || decode(bytes)) {
            let written = encode(&supports);
            let again = decode(&written).expect("what was accepted is written so that it can be read");
            assert_eq!(again, supports);
            assert_eq!(encode(&again), written);
        }
    }
}

bhm_fuzz::target!(seeds, check);
