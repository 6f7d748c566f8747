//! Drives of a robot: one through the simulated building, always, and the recorded ones that there are.

use bhm_core::geometry::Pose;
use bhm_host::{
    ScanRecord,
    dataset::{self, ReadOptions},
    sim::{Scene, Simulation, Trajectory},
};
use bhm_oracle::recorded;

type Position = [f32; 2];

/// The scans that a robot took on its way.
pub struct Drive {
    pub name: &'static str,
    pub scans: Vec<ScanRecord>,
    /// Where it spends many of them between walls, metres.
    pub busy_m: Position,
    /// Whether it is a log rather than a simulation.
    pub recorded: bool,
}

impl Drive {
    /// So many scans in a row from a place where it is busy, the robot standing or as good as.
    pub fn standing(&self, count: usize) -> Vec<ScanRecord> {
        if !self.recorded {
            return fixed(self.busy_m, count);
        }
        // The recorded ones that lie closest together, of those that begin near the place.
        const NEAR_M: f32 = 3.0;
        let position = |scan: &ScanRecord| <Position>::from(scan.header.map_from_sensor.position());
        let apart_m = |a: Position, b: Position| (a[0] - b[0]).hypot(a[1] - b[1]);
        let furthest_m = |window: &&[ScanRecord]| {
            window.iter().map(|scan| apart_m(position(scan), position(&window[0]))).fold(0.0, f32::max)
        };
        let near = self.scans.windows(count).filter(|window| apart_m(position(&window[0]), self.busy_m) < NEAR_M);
        near.min_by(|a, b| furthest_m(a).total_cmp(&furthest_m(b))).expect("a drive passes where it is busy").to_vec()
    }
}

/// A sensor that takes `count` scans of the simulated building from one pose.
fn fixed(at_m: Position, count: usize) -> Vec<ScanRecord> {
    let scene = Scene::named("building").expect("the building is built in");
    let trajectory = Trajectory::new(vec![Pose::new(at_m[0], at_m[1], 0.3); count], 200_000_000);
    Simulation::new(scene.world(), scene.lidar, trajectory, 7).expect("a lidar").collect()
}

/// The simulated drive, and those in the directory that `BHM_DATA` names, or in `shared/data` beside the workspace.
///
/// What is absent is said on standard error; in CI (`CI` set) absence fails the test instead.
pub fn drives() -> Vec<Drive> {
    let scans = Scene::named("building").expect("the building is built in").simulate(7).collect();
    // The middle of the corridor, between the doors of the library and of an office.
    let mut drives = vec![Drive { name: "simulated", scans, busy_m: [-6.0, 0.0], recorded: false }];
    drives.extend(intel_scans().map(|scans| Drive { name: "Intel log", scans, busy_m: [1.5, 1.5], recorded: true }));
    drives
}

/// The scans of the Intel Research Lab log.
pub fn intel_scans() -> Option<Vec<ScanRecord>> {
    let path = recorded("intel-corrected.log.gz")?;
    Some(dataset::read_log(&path, &ReadOptions::default()).expect("a readable log").scans)
}
