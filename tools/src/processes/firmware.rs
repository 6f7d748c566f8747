//! The firmware in an emulator: where it is, and how it is started.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail};
use bhm_firmware_sim::serial::PortAddress;
use tracing::warn;

use super::{child::Child, firmware_log};

/// Where `firmware-sim/cortex-m7/run build` puts it, seen from the workspace's root.
pub(crate) const DEFAULT_ELF: &str = "firmware-sim/cortex-m7/target/thumbv7em-none-eabihf/release/bhm-cortex-m7";

const QEMU: &str = "qemu-system-arm";

/// Ends a program when its parent dies, however it dies.
const SETPRIV: &str = "setpriv";

/// The firmware, and where what it leaves is put.
#[derive(Clone, Debug)]
pub(super) struct Firmware {
    elf: PathBuf,
    /// What it logs, in defmt's encoding.
    log: PathBuf,
}

impl Firmware {
    /// Looks whether everything is there that it needs.
    ///
    /// # Errors
    /// What is missing, and where to get it.
    pub(super) fn find(elf: &Path, folder: &Path) -> anyhow::Result<Self> {
        if !elf.is_file() {
            bail!("there is no firmware at {}; build it with: firmware-sim/cortex-m7/run build", elf.display());
        }
        for (program, package) in [(QEMU, QEMU), (SETPRIV, "util-linux")] {
            let found =
                env::split_paths(&env::var_os("PATH").unwrap_or_default()).any(|path| path.join(program).is_file());
            if !found {
                bail!("{program} is not installed; on Debian: apt-get install {package}");
            }
        }
        Ok(Self { elf: elf.to_owned(), log: folder.join("firmware.defmt") })
    }

    /// Starts it; its data port is a socket that it listens on.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(super) fn start(&self, socket: &Path) -> anyhow::Result<Child> {
        let mut command = Command::new(SETPRIV);
        command.args(["--pdeathsig", "KILL", QEMU, "-M", "mps2-an500", "-nographic", "-monitor", "none"]);
        command.args(["-serial", &format!("unix:{},server=on,wait=on", text(socket)?)]);
        command.args(["-serial", &format!("file:{}", text(&self.log)?)]);
        command.args(["-semihosting-config", "enable=on,target=native", "-icount", "shift=7,sleep=off"]);
        command.args(["-kernel", text(&self.elf)?]);
        Child::spawn("firmware", command)
    }

    pub(super) fn elf(&self) -> &Path {
        &self.elf
    }

    /// Prints what it logged. That it cannot be read is no reason to fail: it is said.
    pub(super) fn show_log(&self) {
        if let Err(error) = firmware_log::show(&self.elf, &self.log) {
            warn!("what the firmware logged ({}) cannot be shown: {error:#}", self.log.display());
        }
    }
}

/// The port of a device that listens there.
pub(super) fn address(socket: &Path) -> PortAddress {
    PortAddress::Unix(socket.to_owned())
}

fn text(path: &Path) -> anyhow::Result<&str> {
    // A comma begins another of QEMU's options.
    let text = path.to_str().with_context(|| format!("{} is not Unicode", path.display()))?;
    if text.contains(',') {
        bail!("{text}: QEMU takes no comma in a path");
    }
    Ok(text)
}
