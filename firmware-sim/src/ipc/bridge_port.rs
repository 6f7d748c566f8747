use std::io;
use std::time::Duration;

/// A line to a device, as a bridge needs it.
pub trait BridgePort {
    /// Takes bytes that came, waiting for them at most as long as said; 0 if none came.
    ///
    /// # Errors
    /// If the line is gone: [`io::ErrorKind::UnexpectedEof`] where the other end closed it.
    fn read(&mut self, into: &mut [u8], patience: Duration) -> io::Result<usize>;

    /// Sends all of the bytes. It may take a while; what comes meanwhile is kept for [`read`](Self::read), so that two ends
    /// that both write never wait for each other.
    ///
    /// # Errors
    /// If the line is gone, or takes nothing for long.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Opens the line anew, after it was gone.
    ///
    /// # Errors
    /// If that is not possible, perhaps only not yet.
    fn reopen(&mut self) -> io::Result<()>;
}
