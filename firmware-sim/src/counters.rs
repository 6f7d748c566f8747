use bhm_core::{mapper::IntegrateReport, scan::ScanRejected};

/// A struct of counts, each with its name.
macro_rules! counters {
    ($(#[$of:meta])* $counters:ident: $($(#[$doc:meta])* $name:ident,)*) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $counters {
            $($(#[$doc])* pub $name: u64,)*
        }

        impl $counters {
            /// All zero, for a `static`.
            pub const NONE: Self = Self { $($name: 0),* };

            /// Every counter and its name, in a fixed order.
            pub fn iter(&self) -> impl ExactSizeIterator<Item = (&'static str, u64)> + use<> {
                [$((stringify!($name), self.$name)),*].into_iter()
            }
        }
    };
}
pub(crate) use counters;

counters! {
    /// Everything that happened in the loop, by name. What is not counted here did not happen.
    Counters:
    /// Scans that came and could be read.
    received,
    /// Scans learned.
    integrated,
    /// Gaps in the source's count: scans that were sent and never came.
    lost,
    /// Scans that had been dealt with already.
    duplicates,
    /// Sources heard, each run of each counting as one.
    sources,
    /// Sources that said that they end.
    sources_ended,
    /// Messages that could not be read.
    unreadable,
    /// Messages meant for an earlier run of this program.
    for_another,
    /// Scans refused: too many beams.
    rejected_too_many_beams,
    /// Scans refused: the pose is not finite.
    rejected_pose_not_finite,
    /// Scans refused: the covariance of their pose is invalid.
    rejected_pose_covariance,
    /// Scans refused: the pose is further away than single precision resolves.
    rejected_pose_too_far,
    /// Scans refused: heading or bearings unusable.
    rejected_angles,
    /// Scans refused: the range limits contradict each other.
    rejected_range_limits,
    /// Scans refused: older than one that was learned.
    rejected_stamp_went_back,
    /// Scans refused for another reason.
    rejected_otherwise,
    /// Beams with a hit.
    beams_hit,
    /// Beams that hit beyond the longest range used.
    beams_beyond_range,
    /// Beams without a return.
    beams_no_return,
    /// Beams dropped: not a number.
    beams_not_a_number,
    /// Beams dropped: negative.
    beams_negative,
    /// Beams dropped: shorter than the sensor can measure.
    beams_too_near,
    /// Beams dropped: no room for their observations.
    beams_over_capacity,
    /// Observations learned from.
    observations_used,
    /// Observations dropped: cannot be placed.
    observations_unplaceable,
    /// Observations dropped: outside a bounded plane.
    observations_outside,
    /// Observations that at least one tile missed, for lack of room.
    observations_over_capacity,
    /// Observations learned as less uncertain than their pose: the stencil has no room for all of it.
    observations_narrowed,
    /// Rows learned.
    rows,
    /// Rows dropped for lack of room.
    rows_over_capacity,
    /// Rows the posterior refused.
    rows_refused,
    /// Tiles learned in.
    tiles_touched,
    /// Tiles that began.
    tiles_created,
    /// Tiles that came back from the archive.
    tiles_restored,
    /// Tiles that left the store.
    tiles_evicted,
    /// Evicted tiles that were not kept.
    tiles_lost,
    /// Tiles in which an update failed and changed nothing.
    tiles_failed,
    /// Passes over the rows of a tile.
    passes,
    /// Passes that the safeguard rejected.
    safeguards,
    /// Passes that `f32` could factor only with a little more on the diagonal.
    conditioned,
    /// Scans that took longer than the deadline from being received to being integrated or refused.
    deadlines_missed,
    /// Posteriors published.
    published,
    /// Posteriors that could not be published.
    publish_failed,
    /// Times the link failed to receive.
    receive_failed,
    /// Reports that could not be sent.
    report_failed,
}

impl Counters {
    /// Scans refused, for whatever reason.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.iter().filter(|(name, _)| name.starts_with("rejected_")).map(|(_, count)| count).sum()
    }

    /// Adds what became of a scan.
    pub fn count(&mut self, outcome: &Result<IntegrateReport, ScanRejected>) {
        match outcome {
            Ok(report) => self.count_integrated(report),
            Err(reason) => self.count_rejected(reason),
        }
    }

    /// Adds a scan that was learned.
    pub fn count_integrated(&mut self, report: &IntegrateReport) {
        self.integrated += 1;
        let IntegrateReport { beams, observations, .. } = report;
        for (counter, more) in [
            (&mut self.beams_hit, beams.hits),
            (&mut self.beams_beyond_range, beams.beyond_range),
            (&mut self.beams_no_return, beams.no_return),
            (&mut self.beams_not_a_number, beams.not_a_number),
            (&mut self.beams_negative, beams.negative),
            (&mut self.beams_too_near, beams.too_near),
            (&mut self.beams_over_capacity, beams.over_capacity),
            (&mut self.observations_used, observations.used),
            (&mut self.observations_unplaceable, observations.unplaceable),
            (&mut self.observations_outside, observations.outside),
            (&mut self.observations_over_capacity, observations.over_capacity),
            (&mut self.observations_narrowed, observations.narrowed),
            (&mut self.rows, report.rows),
            (&mut self.rows_over_capacity, report.rows_over_capacity),
            (&mut self.rows_refused, report.rows_refused),
            (&mut self.tiles_touched, report.tiles_touched),
            (&mut self.tiles_created, report.tiles_created),
            (&mut self.tiles_restored, report.tiles_restored),
            (&mut self.tiles_evicted, report.tiles_evicted),
            (&mut self.tiles_lost, report.tiles_lost),
            (&mut self.tiles_failed, report.tiles_failed),
            (&mut self.passes, report.passes),
            (&mut self.safeguards, report.safeguards),
            (&mut self.conditioned, report.conditioned),
        ] {
            *counter += u64::from(more);
        }
    }

    fn count_rejected(&mut self, reason: &ScanRejected) {
        *match reason {
            ScanRejected::TooManyBeams { .. } => &mut self.rejected_too_many_beams,
            ScanRejected::PoseNotFinite => &mut self.rejected_pose_not_finite,
            ScanRejected::PoseCovariance => &mut self.rejected_pose_covariance,
            ScanRejected::PoseTooFar { .. } => &mut self.rejected_pose_too_far,
            ScanRejected::Angles { .. } => &mut self.rejected_angles,
            ScanRejected::RangeLimits { .. } => &mut self.rejected_range_limits,
            ScanRejected::StampWentBack { .. } => &mut self.rejected_stamp_went_back,
            // A reason of prepared observations, which no scan has.
            ScanRejected::TooManyObservations { .. } => &mut self.rejected_otherwise,
        } += 1;
    }
}
