//! Lists of scattered supports.
#![no_main]

use bhm_fuzz::{sealed, within};
use bhm_host::supports::{Cluster, Clusters, decode_scattered, encode_scattered};

fn seeds() -> Vec<Vec<u8>> {
    let cluster = |i: u8| Cluster {
        centre_m: [f32::from(i), -0.5],
        covariance_m2: [0.2, 0.1, 0.1 * f32::from(i + 1)],
        weight: f64::from(i),
    };
    let clusters = |count| Clusters { source: "a seed".to_owned(), clusters: (0..count).map(cluster).collect() };
    vec![encode_scattered(&clusters(1)), encode_scattered(&clusters(9))]
}

fn check(bytes: &[u8]) {
    for bytes in [bytes, &sealed(bytes)] {
        // A decoder of lists takes up to 1 MiB for a list of any length.
        if let Ok(clusters) = within((4 << 20) + 16 * bytes.len(), || decode_scattered(bytes)) {
            let written = encode_scattered(&clusters);
            let again = decode_scattered(&written).expect("what was accepted is written so that it can be read");
            assert_eq!(again, clusters);
            assert_eq!(encode_scattered(&again), written);
            for cluster in &clusters.clusters {
                assert!(cluster.gaussian().is_some(), "an accepted cluster has a support");
            }
        }
    }
}

bhm_fuzz::target!(seeds, check);
