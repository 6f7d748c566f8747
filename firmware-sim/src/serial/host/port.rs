//! A line to a device through the operating system: a serial device, a Unix socket, a TCP port.

use std::{
    borrow::ToOwned,
    collections::VecDeque,
    fmt, format,
    fs::{File, OpenOptions},
    io::{self, ErrorKind, Read, Write},
    net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream},
    os::{
        fd::{AsFd, OwnedFd},
        unix::{fs::OpenOptionsExt, net::UnixStream},
    },
    path::PathBuf,
    str::FromStr,
    string::String,
    time::{Duration, Instant},
};

use embedded_io::ErrorType;
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    fs::OFlags,
    termios::{OptionalActions, isatty, tcgetattr, tcsetattr},
};

/// A line to a device, as a bridge needs it: the traits of `embedded-io`, and what they lack.
///
/// Writing may take a while; what comes meanwhile is kept to be read, so that two ends that both write never wait for each
/// other.
pub trait BridgePort: embedded_io::Read<Error = io::Error> + embedded_io::Write {
    /// Waits at most as long as said until reading answers at once, and says whether it does: bytes came, or the line is gone.
    ///
    /// # Errors
    /// If the line is gone.
    fn wait(&mut self, patience: Duration) -> io::Result<bool>;

    /// Opens the line anew, after it was gone.
    ///
    /// # Errors
    /// If that is not possible, perhaps only not yet.
    fn reopen(&mut self) -> io::Result<()>;
}

/// How long a line may take nothing before it counts as gone.
const STUCK: Duration = Duration::from_secs(30);

/// Most bytes that are taken from the system at once.
const GULP: usize = 16_384;

/// How often a line that is not there yet is looked for.
const AGAIN: Duration = Duration::from_millis(50);

/// Where a device is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortAddress {
    /// A Unix socket that the device, or its emulator, listens on.
    Unix(PathBuf),
    /// A TCP port of this computer.
    Tcp(SocketAddr),
    /// A serial device or a pseudo-terminal.
    Terminal(PathBuf),
}

impl FromStr for PortAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(path) = text.strip_prefix("unix:") {
            return if path.is_empty() { Err("unix: without a path".to_owned()) } else { Ok(Self::Unix(path.into())) };
        }
        let Some(place) = text.strip_prefix("tcp:") else {
            return if text.is_empty() {
                Err("an empty port: expected a path, unix:PATH or tcp:ADDRESS:PORT".to_owned())
            } else {
                Ok(Self::Terminal(text.into()))
            };
        };
        let unclear = || format!("expected tcp:ADDRESS:PORT, for instance tcp:127.0.0.1:5555, not '{text}'");
        let (host, port) = place.rsplit_once(':').ok_or_else(unclear)?;
        let port = port.parse().map_err(|_| unclear())?;
        let host = host.trim_start_matches('[').trim_end_matches(']');
        let host: IpAddr =
            if host == "localhost" { Ipv4Addr::LOCALHOST.into() } else { host.parse().map_err(|_| unclear())? };
        // What a line carries is neither secret nor signed: it does not leave the computer.
        if !host.is_loopback() {
            return Err(format!("{host} is another computer; a line by TCP stays on this one (127.0.0.1)"));
        }
        Ok(Self::Tcp(SocketAddr::new(host, port)))
    }
}

impl fmt::Display for PortAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Tcp(at) => write!(f, "tcp:{at}"),
            Self::Terminal(path) => path.display().fmt(f),
        }
    }
}

impl PortAddress {
    fn open(&self, baud: Option<u32>) -> io::Result<File> {
        let line: OwnedFd = match self {
            Self::Unix(path) => {
                let socket = UnixStream::connect(path)?;
                socket.set_nonblocking(true)?;
                socket.into()
            }
            Self::Tcp(at) => {
                let socket = TcpStream::connect(at)?;
                socket.set_nodelay(true)?;
                socket.set_nonblocking(true)?;
                socket.into()
            }
            Self::Terminal(path) => {
                let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits() as i32;
                let terminal = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)?;
                if !isatty(&terminal) {
                    return Err(io::Error::new(
                        ErrorKind::InvalidInput,
                        "neither a serial device nor a pseudo-terminal",
                    ));
                }
                let mut settings = tcgetattr(&terminal)?;
                // Bytes as they are: no echo, no lines, no signals.
                settings.make_raw();
                if let Some(baud) = baud {
                    settings.set_speed(baud)?;
                }
                tcsetattr(&terminal, OptionalActions::Now, &settings)?;
                terminal.into()
            }
        };
        Ok(line.into())
    }
}

/// An open line to a device.
#[derive(Debug)]
pub struct HostPort {
    address: PortAddress,
    baud: Option<u32>,
    line: File,
    /// What came while something was written.
    came: VecDeque<u8>,
}

impl HostPort {
    /// Opens the line, trying again for as long as `patience` where it is not there yet.
    ///
    /// # Errors
    /// What the operating system says about the last attempt.
    pub fn open(address: PortAddress, baud: Option<u32>, patience: Duration) -> io::Result<Self> {
        let asked = Instant::now();
        loop {
            match address.open(baud) {
                Ok(line) => return Ok(Self { address, baud, line, came: VecDeque::new() }),
                Err(error)
                    if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused)
                        && asked.elapsed() < patience =>
                {
                    std::thread::sleep(AGAIN);
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Waits for one of the events, at most as long as said, and says which are there.
    fn poll(&self, flags: PollFlags, patience: Duration) -> io::Result<PollFlags> {
        let timeout = Timespec { tv_sec: patience.as_secs() as _, tv_nsec: patience.subsec_nanos().into() };
        let fd = self.line.as_fd();
        let mut fds = [PollFd::new(&fd, flags)];
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) => Ok(fds[0].revents()),
            Err(rustix::io::Errno::INTR) => Ok(PollFlags::empty()),
            Err(error) => Err(error.into()),
        }
    }
}

impl ErrorType for HostPort {
    type Error = io::Error;
}

impl embedded_io::Read for HostPort {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if !self.came.is_empty() {
            return Read::read(&mut self.came, into);
        }
        loop {
            // Waited for first: of a terminal with nothing in it, reading may answer as if it were gone.
            if self.poll(PollFlags::IN, STUCK)?.is_empty() {
                continue;
            }
            match self.line.read(into) {
                Err(error) if is_passing(&error) => {}
                settled => return settled,
            }
        }
    }
}

impl embedded_io::Write for HostPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let begun = Instant::now();
        while begun.elapsed() <= STUCK {
            let ready = self.poll(PollFlags::IN | PollFlags::OUT, STUCK)?;
            if ready.contains(PollFlags::IN) {
                let mut gulp = [0; GULP];
                match self.line.read(&mut gulp) {
                    Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                    Ok(length) => self.came.extend(&gulp[..length]),
                    Err(error) if is_passing(&error) => {}
                    Err(error) => return Err(error),
                }
            }
            if ready.intersects(PollFlags::OUT | PollFlags::ERR | PollFlags::HUP) {
                match self.line.write(bytes) {
                    Ok(0) => return Err(ErrorKind::WriteZero.into()),
                    Err(error) if is_passing(&error) => {}
                    settled => return settled,
                }
            }
        }
        Err(io::Error::new(ErrorKind::TimedOut, "the line takes no more bytes"))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl BridgePort for HostPort {
    fn wait(&mut self, patience: Duration) -> io::Result<bool> {
        Ok(!self.came.is_empty() || !self.poll(PollFlags::IN, patience)?.is_empty())
    }

    fn reopen(&mut self) -> io::Result<()> {
        self.line = self.address.open(self.baud)?;
        self.came.clear();
        Ok(())
    }
}

/// Whether to try again is all that such an error asks for.
fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    #[test]
    fn an_address_stays_on_this_computer() {
        let parse = |text: &str| text.parse::<PortAddress>();
        assert_eq!(parse("unix:/run/x"), Ok(PortAddress::Unix("/run/x".into())));
        assert_eq!(parse("/dev/ttyACM0"), Ok(PortAddress::Terminal("/dev/ttyACM0".into())));
        for text in ["tcp:127.0.0.1:5555", "tcp:localhost:5555", "tcp:[::1]:5555"] {
            assert!(matches!(parse(text), Ok(PortAddress::Tcp(at)) if at.port() == 5555), "{text}");
        }
        for (text, says) in [
            ("tcp:192.168.0.7:5555", "192.168.0.7 is another computer"),
            ("tcp:127.0.0.1", "expected tcp:ADDRESS:PORT"),
            ("tcp:127.0.0.1:x", "expected tcp:ADDRESS:PORT"),
            ("tcp:robot:5555", "expected tcp:ADDRESS:PORT"),
            ("unix:", "without a path"),
            ("", "an empty port"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn a_pseudo_terminal_carries_every_byte_both_ways() {
        use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
        let device = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&device).unwrap();
        unlockpt(&device).unwrap();
        let name = ptsname(&device, Vec::new()).unwrap().into_string().unwrap();
        let mut port = HostPort::open(name.parse().unwrap(), Some(115_200), Duration::ZERO).unwrap();
        let mut device = File::from(device);
        let bytes: Vec<u8> = (0..=255).collect();
        embedded_io::Write::write_all(&mut port, &bytes).unwrap();
        let mut got = [0; 256];
        device.read_exact(&mut got).unwrap();
        assert_eq!(got[..], bytes);
        device.write_all(&bytes).unwrap();
        let mut back: Vec<u8> = Vec::new();
        while back.len() < 256 {
            assert!(port.wait(Duration::from_secs(10)).unwrap());
            let length = embedded_io::Read::read(&mut port, &mut got).unwrap();
            back.extend(&got[..length]);
        }
        assert_eq!(back, bytes);
        assert!(!port.wait(Duration::ZERO).unwrap());
        drop(device);
        assert!(port.wait(Duration::from_secs(10)).unwrap());
        let gone = embedded_io::Read::read(&mut port, &mut got);
        assert!(gone.map_or(true, |length| length == 0), "the other end is gone");
    }
}
