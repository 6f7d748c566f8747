use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use bhm_core::geometry::Point;
use bhm_host::ipc::{AnyPosterior, AnyPosteriorSubscriber, IpcError, Participant, open_posterior_any};
use bhm_plot::map_picture::{MapPicture, Quantity, worth_drawing};
use clap::Args;
use tracing::{info, warn};

use crate::{
    output::{Output, Usage},
    processes::{
        DomainOptions,
        json_lines::{Seen, WatchLine, Watched},
    },
};

/// How long a consumer sleeps before it looks again for a mapper.
const NAP: Duration = Duration::from_millis(50);

/// Read the posterior in shared memory, ask it there, and say a line about each
#[derive(Args, Debug)]
pub(crate) struct Watch {
    #[command(flatten)]
    domain: DomainOptions,
    /// End with the posterior of a source's last scan
    #[arg(long)]
    until_end: bool,
    /// End with the first posterior
    #[arg(long)]
    once: bool,
    /// A point to ask each posterior about, metres; may be given several times
    #[arg(long, num_args = 2, value_names = ["X", "Y"], allow_negative_numbers = true)]
    query: Vec<f32>,
    /// PNG file for the probability of occupancy in the last posterior
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
    /// PNG file for the standard deviation of the log-odds in the last posterior
    #[arg(long, value_name = "PNG")]
    deviation: Option<PathBuf>,
}

/// What a consumer keeps of what it read.
#[derive(Default)]
struct Record {
    watched: Watched,
    /// The newest posterior, where it lies.
    newest: Option<Box<dyn AnyPosterior>>,
    path_m: Vec<[f32; 2]>,
}

impl Watch {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        if let Some(bad) = self.query.iter().find(|number| !number.is_finite()) {
            return Err(Usage(format!("a point at {bad} is nowhere, expected two numbers of metres")).into());
        }
        let (domain, stop) = self.domain.join()?;
        let participant = domain.join("bhm-watch")?;
        let reader = wait_for_a_mapper(&participant, &stop)?;
        let mut record = Record::default();
        if let Some(mut reader) = reader {
            self.read(&mut *reader, &mut record, &stop, output)?;
            self.draw(&record)?;
            if let Some(posterior) = record.newest.take() {
                record.watched.posterior = Some(posterior.digest().to_string());
                record.watched.tiles = posterior.tile_indices();
            }
        }
        let watched = record.watched;
        output.result(&WatchLine::Watched(watched.clone()), || text(&watched))
    }

    /// Reads posteriors until there is a reason to end.
    fn read(
        &self,
        reader: &mut dyn AnyPosteriorSubscriber,
        record: &mut Record,
        stop: &AtomicBool,
        output: &Output,
    ) -> anyhow::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            match reader.receive(Duration::MAX)? {
                None => {}
                Some(Err(rejected)) => {
                    record.watched.unusable += 1;
                    warn!("a posterior cannot be used: {rejected}");
                }
                Some(Ok(posterior)) => {
                    let seen = self.look(&*posterior);
                    output.result(&WatchLine::Posterior(seen.clone()), || self.line(&seen))?;
                    let ended = seen.ended;
                    record.add(seen, posterior);
                    if self.once || (self.until_end && ended) {
                        break;
                    }
                }
            }
        }
        Ok(())
    }

    /// Asks a posterior in shared memory.
    fn look(&self, posterior: &dyn AnyPosterior) -> Seen {
        let header = posterior.header();
        let ask = |point: &[f32]| posterior.occupancy(&Point::<2>::new(point[0], point[1])).probability;
        Seen {
            mapper: format!("{:016x}", header.mapper),
            sequence: header.sequence,
            scan_sequence: header.scan_sequence,
            scans: header.scans,
            tiles: header.resident,
            tiles_archived: header.archived,
            ended: header.ended(),
            probabilities: self.query.chunks_exact(2).map(ask).collect(),
        }
    }

    fn line(&self, seen: &Seen) -> String {
        let Seen { sequence, scans, tiles, tiles_archived, .. } = seen;
        let mut line = format!("posterior {sequence:6}  scans {scans:6}  tiles {tiles:4} (+{tiles_archived})");
        for (point, probability) in self.query.chunks_exact(2).zip(&seen.probabilities) {
            line += &format!("  p({}, {}) {probability:.3}", point[0], point[1]);
        }
        line + "\n"
    }

    /// Draws the newest posterior from shared memory.
    fn draw(&self, record: &Record) -> anyhow::Result<()> {
        let pictures = [(&self.picture, Quantity::Probability), (&self.deviation, Quantity::Deviation)];
        if pictures.iter().all(|(png, _)| png.is_none()) {
            return Ok(());
        }
        let worth = record.newest.as_deref().and_then(|posterior| Some((posterior, worth_drawing(posterior)?)));
        let Some((posterior, bounds_m)) = worth else {
            warn!("nothing was learned yet; there is nothing to draw");
            return Ok(());
        };
        let title = format!("posterior {}, {} scans", posterior.header().sequence, posterior.header().scans);
        for (png, quantity) in pictures {
            let Some(png) = png else { continue };
            let picture = MapPicture {
                map: posterior,
                quantity,
                bounds_m,
                pixels_per_metre: None,
                title: &title,
                path_m: &record.path_m,
            };
            picture.write(png)?;
            info!("{} drawn from shared memory", png.display());
        }
        Ok(())
    }
}

impl Record {
    fn add(&mut self, seen: Seen, posterior: Box<dyn AnyPosterior>) {
        let watched = &mut self.watched;
        watched.posteriors += 1;
        match &watched.last {
            Some(last) if last.mapper == seen.mapper => {
                watched.skipped += seen.sequence.saturating_sub(last.sequence + 1);
            }
            // What a mapper published before it was first heard was not skipped. Another mapper began another map.
            _ => {
                watched.mappers += 1;
                self.path_m.clear();
            }
        }
        if seen.scans > 0 {
            let map_from_sensor = posterior.header().map_from_sensor();
            self.path_m.push([map_from_sensor.x_m, map_from_sensor.y_m]);
        }
        watched.last = Some(seen);
        self.newest = Some(posterior);
    }
}

/// A reader, as soon as there is a mapper; `None` if `stop` was raised before.
fn wait_for_a_mapper(
    participant: &Participant,
    stop: &AtomicBool,
) -> anyhow::Result<Option<Box<dyn AnyPosteriorSubscriber>>> {
    let mut warned = false;
    while !stop.load(Ordering::Relaxed) {
        match open_posterior_any(participant) {
            Ok(reader) => return Ok(Some(reader)),
            Err(absent @ IpcError::Absent { .. }) => {
                if !warned {
                    info!("{absent}; waiting for one");
                }
                warned = true;
                thread::sleep(NAP);
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(None)
}

fn text(watched: &Watched) -> String {
    let Watched { posteriors, skipped, mappers, unusable, last, posterior, .. } = watched;
    let mut text =
        format!("read {posteriors} posteriors of {mappers} mappers, {skipped} skipped, {unusable} unusable\n");
    if let (Some(last), Some(digest)) = (last, posterior) {
        let note = match last.tiles_archived {
            0 => "every tile".to_owned(),
            archived => format!("the {} tiles in shared memory, without {archived} in the archive", last.tiles),
        };
        text += &format!("posterior  {digest}  ({note})\n");
    }
    text
}
