//! Status messages from shared memory.
#![no_main]

use bhm_fuzz::{bytes_of, message, within};
use bhm_host::ipc::{Progress, StatusMessage};

fn seeds() -> Vec<Vec<u8>> {
    let status = |progress, counters: &[(&str, u64)]| {
        let mut written = message::<StatusMessage>(&[]);
        written.write(3, &progress, counters.iter().copied());
        bytes_of(&*written)[..48 + 40 * counters.len()].to_vec()
    };
    vec![
        status(Progress::default(), &[]),
        status(Progress { handled: Some((1, 2)), ended: true }, &[("received", 7), ("größte", u64::MAX)]),
    ]
}

fn check(bytes: &[u8]) {
    let received = message::<StatusMessage>(bytes);
    // Even of one that cannot be read: a consumer may print what it refuses.
    let (progress, counted) = (received.progress(), received.counters().count());
    if within(0, || received.check()).is_err() {
        return;
    }
    assert_eq!(counted, received.counters_len as usize);
    let mut written = message::<StatusMessage>(&[]);
    written.write(received.mapper, &progress, received.counters());
    assert_eq!(written.check(), Ok(()));
    assert_eq!(written.progress(), progress);
    assert!(written.counters().eq(received.counters()));
}

bhm_fuzz::target!(seeds, check);
