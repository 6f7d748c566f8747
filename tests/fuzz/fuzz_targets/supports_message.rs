//! Learned supports from shared memory.
#![no_main]

use bhm_core::support::SupportSettings;
use bhm_fuzz::{bytes_of, learned_supports, message, message_from, within};
use bhm_host::{
    ipc::{SupportMessage, SupportsHeader, SupportsRejected},
    supports::LearnedSupports,
};

fn name_of<const N: usize>(text: &str) -> [u8; N] {
    let mut name = [0; N];
    name[..text.len()].copy_from_slice(text.as_bytes());
    name
}

fn messages(supports: &LearnedSupports) -> Vec<SupportMessage> {
    let mut messages = vec![SupportMessage::default(); supports.supports().len()];
    for (message, support) in messages.iter_mut().zip(supports.supports()) {
        message.write(support);
    }
    messages
}

fn seeds() -> Vec<Vec<u8>> {
    let supports = learned_supports();
    let mut header = SupportsHeader {
        magic: SupportsHeader::MAGIC,
        version: SupportsHeader::VERSION,
        digest: supports.digest(),
        count: supports.supports().len() as u64,
        origin_m: supports.origin_m(),
        spacing_m: supports.spacing_m(),
        first: supports.window().first,
        width: supports.window().width.map(|width| width as u32),
        ..SupportsHeader::default()
    };
    for (to, kind) in header.kinds.iter_mut().zip(SupportSettings::ALL) {
        *to = name_of(kind.name());
    }
    let mut bytes = bytes_of(&header).to_vec();
    bytes.extend(messages(&supports).iter().flat_map(|message| bytes_of(message).to_vec()));
    assert!(read(&bytes).1.is_ok());
    vec![bytes]
}

/// The header, and what comes of it with a count and a digest that are right if anything is.
fn read(mut bytes: &[u8]) -> (SupportsHeader, Result<LearnedSupports, SupportsRejected>) {
    let mut header = *message_from::<SupportsHeader>(&mut bytes);
    let messages: Vec<SupportMessage> =
        bytes.chunks(size_of::<SupportMessage>()).map(|bytes| *message::<SupportMessage>(bytes)).collect();
    let check = |header: &SupportsHeader| within(4_096 + 4 * size_of_val(&*messages), || header.check(&messages));
    let mut result = check(&header);
    if let Err(SupportsRejected::Count { .. }) = result {
        header.count = messages.len() as u64;
        result = check(&header);
    }
    if let Err(SupportsRejected::Digest { found, .. }) = result {
        header.digest = found;
        result = check(&header);
        assert!(result.is_ok(), "all else had been found right");
    }
    (header, result)
}

fn check(bytes: &[u8]) {
    let (header, result) = read(bytes);
    let Ok(supports) = result else { return };
    // Kinds are written by their number here, whichever the sender had.
    let mut header = header;
    header.kinds = Default::default();
    for (to, kind) in header.kinds.iter_mut().zip(SupportSettings::ALL) {
        *to = name_of(kind.name());
    }
    assert_eq!(header.check(&messages(&supports)).as_ref(), Ok(&supports));
}

bhm_fuzz::target!(seeds, check);
