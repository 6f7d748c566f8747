use bhm_core::{
    profile::{COMPACT, Profile},
    settings::Settings,
    shape::{self, ShapeVisitor},
    tile::Tile,
};
use bhm_firmware_sim::{
    budget::{Instructions, most_instructions, state_bytes},
    serial::{LinkBuffers, SentTile},
};
use bhm_host::map;
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::{
    options::MapOptions,
    output::{Output, headed, markdown, table},
};

/// Say what a map takes on a microcontroller: memory, instructions, scans per second
#[derive(Args, Debug)]
pub(crate) struct Budget {
    /// The processor's clock
    #[arg(long, value_name = "MHZ", default_value_t = 400.0)]
    clock_mhz: f64,
    /// Cycles that an instruction takes on average: what the memory makes of it
    #[arg(long, value_name = "CYCLES", default_value_t = 1.0)]
    cycles: f64,
    /// As a table in Markdown
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    #[command(flatten)]
    map: MapOptions,
}

/// What was measured of the firmware of the profile `compact`.
const MEASURED: &str = include_str!("../../../firmware-sim/cortex-m7/measured.toml");

/// What the linker of the firmware refuses to exceed.
const FLASH_BYTES: usize = 256 << 10;
const STACK_BYTES: usize = 16 << 10;

#[derive(Debug, Deserialize)]
struct Measured {
    flash_bytes: usize,
    data_bytes: usize,
    bss_bytes: usize,
    stack_bytes: usize,
    three_passes: Updates,
    one_pass: Updates,
}

/// Instructions of an update, measured.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
struct Updates {
    /// Of a recorded log.
    scans: usize,
    /// On average over the first scans of a recorded log.
    mean: u64,
    /// The worst of them.
    worst: u64,
    /// Of a scan that fills every capacity.
    full: u64,
}

#[derive(Debug, Serialize)]
struct Sheet {
    profile: &'static str,
    supports: usize,
    band: usize,
    passes: u32,
    bytes_per_tile: usize,
    tiles: usize,
    state_bytes: usize,
    link_bytes: usize,
    /// Limits that hold for every profile: the linker's.
    flash_limit_bytes: usize,
    stack_limit_bytes: usize,
    /// Of the firmware of the profile `compact`; null for other settings.
    firmware: Option<Firmware>,
    /// Null where nobody has measured what a feature costs.
    instructions: Option<Cost>,
}

#[derive(Debug, Serialize)]
struct Firmware {
    flash_bytes: usize,
    data_bytes: usize,
    bss_bytes: usize,
    stack_bytes: usize,
    updates: Updates,
}

#[derive(Debug, Serialize)]
struct Cost {
    per_tile_and_pass: u64,
    per_row_and_pass: u64,
    per_row: u64,
    most_per_scan: u64,
    /// At the clock, if every scan took the most.
    scans_per_second_at_least: f64,
    /// The same for the measured mean.
    scans_per_second_on_average: Option<f64>,
}

/// Bytes of a tile, and of the onboard program's state.
struct Bytes<'a>(&'a Profile);

impl ShapeVisitor for Bytes<'_> {
    type Output = (usize, usize);

    fn visit<const M: usize, const B: usize>(self) -> (usize, usize) {
        (size_of::<Tile<2, M, B>>(), state_bytes::<M, B>(self.0))
    }
}

impl Budget {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let profile = options.profile;
        let (supports, band) = map::shape(&profile)?;
        let (bytes_per_tile, state_bytes) = shape::visit((supports, band), Bytes(&profile))?;
        let passes = profile.settings.passes;
        // The firmware is compiled in two variants.
        let compact = Settings { passes, ..COMPACT.settings };
        let measured: Measured = toml::from_str(MEASURED)?;
        let updates = match passes {
            1 => Some(measured.one_pass),
            3 => Some(measured.three_passes),
            _ => None,
        };
        let updates = updates.filter(|_| profile.settings == compact && profile.capacities == COMPACT.capacities);
        let per_second = |instructions: u64| self.clock_mhz * 1e6 / (self.cycles * instructions as f64);
        let instructions =
            Instructions::of(&profile.settings).zip(most_instructions(&profile)).map(|(unit, most)| Cost {
                per_tile_and_pass: unit.pass,
                per_row_and_pass: unit.row_pass,
                per_row: unit.row,
                most_per_scan: most,
                scans_per_second_at_least: per_second(most),
                scans_per_second_on_average: updates.map(|updates| per_second(updates.mean)),
            });
        let Measured { flash_bytes, data_bytes, bss_bytes, stack_bytes, .. } = measured;
        let sheet = Sheet {
            profile: profile.name,
            supports,
            band,
            passes,
            bytes_per_tile,
            tiles: profile.capacities.tiles,
            state_bytes,
            link_bytes: size_of::<LinkBuffers>() + profile.capacities.tiles * size_of::<SentTile>(),
            flash_limit_bytes: FLASH_BYTES,
            stack_limit_bytes: STACK_BYTES,
            firmware: updates.map(|updates| Firmware { flash_bytes, data_bytes, bss_bytes, stack_bytes, updates }),
            instructions,
        };
        output.result(&sheet, || {
            let rows = sheet.rows(self);
            if !self.markdown {
                return table(&rows);
            }
            let mut lines = headed(["what", "figure"]);
            lines.extend(rows.into_iter().map(|(name, figure)| vec![name.to_owned(), figure]));
            markdown(&lines)
        })
    }
}

impl Sheet {
    fn rows(&self, asked: &Budget) -> Vec<(&'static str, String)> {
        let measured = |of: fn(&Firmware) -> usize| self.firmware.as_ref().map(|firmware| grouped(of(firmware) as u64));
        let limit = |bytes: usize, of: fn(&Firmware) -> usize| match measured(of) {
            Some(measured) => format!("{measured} bytes, at most {}", grouped(bytes as u64)),
            None => format!("at most {} bytes", grouped(bytes as u64)),
        };
        let mut rows = vec![
            ("profile", format!("{}, passes over a scan: {}", self.profile, self.passes)),
            ("flash", limit(self.flash_limit_bytes, |firmware| firmware.flash_bytes)),
            ("stack", limit(self.stack_limit_bytes, |firmware| firmware.stack_bytes)),
            (
                "a tile",
                format!(
                    "{} bytes ({} supports, band {})",
                    grouped(self.bytes_per_tile as u64),
                    self.supports,
                    self.band
                ),
            ),
            ("the map's state", format!("{} bytes, {} tiles", grouped(self.state_bytes as u64), self.tiles)),
            ("the link's buffers", format!("{} bytes, and the receive queue", grouped(self.link_bytes as u64))),
        ];
        rows.extend(self.firmware.as_ref().map(|firmware| {
            let text =
                format!("{} bytes of .data, {} of .bss", firmware.data_bytes, grouped(firmware.bss_bytes as u64));
            ("static memory", text)
        }));
        let Some(cost) = &self.instructions else {
            rows.push(("instructions", "not known: measured for the cubic B-spline at points only".to_owned()));
            return rows;
        };
        rows.extend([
            ("a tile and pass", format!("{} instructions at most", grouped(cost.per_tile_and_pass))),
            ("a row and pass", format!("{} instructions at most", grouped(cost.per_row_and_pass))),
            ("a row", format!("{} instructions at most, once", grouped(cost.per_row))),
            ("a scan", format!("{} instructions at most, if its pose is certain", grouped(cost.most_per_scan))),
        ]);
        let at = format!("at {} MHz and {} cycles an instruction", asked.clock_mhz, asked.cycles);
        if let Some(Firmware { updates, .. }) = &self.firmware {
            let Updates { scans, mean, worst, full } = *updates;
            rows.push((
                "measured",
                format!("{} on average over {scans} recorded scans, {} the worst", grouped(mean), grouped(worst)),
            ));
            rows.push(("", format!("{} for a scan that fills every capacity", grouped(full))));
        }
        let average = cost.scans_per_second_on_average;
        rows.extend(average.map(|rate| ("scans a second", format!("{rate:.1} on average, {at}"))));
        let least = format!("{:.2} if each filled every capacity, {at}", cost.scans_per_second_at_least);
        rows.push((if average.is_some() { "" } else { "scans a second" }, least));
        rows
    }
}

/// With a space between thousands.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<_> = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
    groups.join(" ")
}
