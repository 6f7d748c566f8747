//! Messages from bytes and back.

use std::{ptr, slice};

use bhm_host::ipc::{PosteriorHeader, ScanMessage, StatusMessage, SupportMessage, SupportsHeader};

/// A message of which every bit pattern is a value.
///
/// # Safety
/// The type must be made of integers, floating-point numbers and arrays of them only, and have no padding.
pub unsafe trait PlainNumbers: Sized {}

macro_rules! plain_numbers {
    ($($message:ty),*) => {
        $(
            // SAFETY: `host/src/ipc` says of its fields that they are such numbers; their sizes leave no gaps.
            unsafe impl PlainNumbers for $message {}
        )*
    };
}

plain_numbers!(ScanMessage, StatusMessage, PosteriorHeader, SupportsHeader, SupportMessage);

/// The message that begins with these bytes, zero where there are too few.
#[must_use]
pub fn message<T: PlainNumbers>(bytes: &[u8]) -> Box<T> {
    let mut message = Box::<T>::new_zeroed();
    let length = bytes.len().min(size_of::<T>());
    // SAFETY: both sides have that many bytes and do not overlap; the bytes are zero or copied, and any are a value of T.
    unsafe {
        ptr::copy_nonoverlapping(bytes.as_ptr(), message.as_mut_ptr().cast::<u8>(), length);
        message.assume_init()
    }
}

/// The same, and passes on to what follows.
pub fn message_from<T: PlainNumbers>(bytes: &mut &[u8]) -> Box<T> {
    let (first, rest) = bytes.split_at(bytes.len().min(size_of::<T>()));
    *bytes = rest;
    message(first)
}

/// The bytes of a message.
#[must_use]
pub fn bytes_of<T: PlainNumbers>(message: &T) -> &[u8] {
    // SAFETY: the message has no padding, so that every byte is a value; it is borrowed as long as they are.
    unsafe { slice::from_raw_parts(ptr::from_ref(message).cast::<u8>(), size_of::<T>()) }
}
