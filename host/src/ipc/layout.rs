//! How every message begins: what says which message it is, and in which layout.

/// What a message begins with in the layout that this program reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// What people call the message.
    pub(super) what: &'static str,
    pub(super) magic: u64,
    pub(super) version: u32,
    /// Every flag that the layout defines.
    pub(super) flags: u32,
}

/// A message that is another one, or has another layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// The message does not begin as this kind does.
    #[error("not a {what}: begins with {found:#018x}")]
    Magic {
        /// The kind of message that was expected.
        what: &'static str,
        /// What the message begins with.
        found: u64,
    },
    /// The message has another layout.
    #[error("{what} in layout version {found}, only {understood} is understood")]
    Version {
        /// The kind of message.
        what: &'static str,
        /// The message's layout version.
        found: u32,
        /// The layout version that this program reads.
        understood: u32,
    },
    /// The message has flags that this layout does not define, or a reserved word is not zero.
    #[error("{what} with unknown flags {found:#x}")]
    Flags {
        /// The kind of message.
        what: &'static str,
        /// The message's flags.
        found: u32,
    },
}

impl Layout {
    /// Whether a message that begins like this is one of this layout.
    pub(super) fn check(&self, magic: u64, version: u32, flags: u32) -> Result<(), LayoutError> {
        let what = self.what;
        if magic != self.magic {
            return Err(LayoutError::Magic { what, found: magic });
        }
        if version != self.version {
            return Err(LayoutError::Version { what, found: version, understood: self.version });
        }
        if flags & !self.flags != 0 {
            return Err(LayoutError::Flags { what, found: flags });
        }
        Ok(())
    }
}
