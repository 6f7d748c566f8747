use bhm_core::{geometry::Point, profile, rule::*};
use bhm_host::{dataset::PointLog, map};
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut p = *profile::named(&a[1]).unwrap();
    let spacing: f32 = a[2].parse().unwrap();
    p.settings.spacing_m = spacing;
    p.settings.passes = a[3].parse().unwrap();
    if a[4] == "jj" {
        p.settings.rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::PredictedUpTo(4.0) });
    }
    if let Some(x) = a.get(5) {
        p.settings.prior_precision = x.parse().unwrap();
    }
    let max: usize = a.get(6).map_or(usize::MAX, |v| v.parse().unwrap());
    let d = std::env::var("BHM_DATA").unwrap();
    let train = PointLog::read(Path::new(&format!("{d}/intel-beams-train.csv.gz"))).unwrap();
    let mut m = map::open(&p).unwrap();
    let t = std::time::Instant::now();
    let (mut tiles, mut rows, mut safe, mut fail, mut passes) = (0u64, 0u64, 0u64, 0u64, 0u64);
    for s in train.scans.iter().take(max) {
        let pts: Vec<Point<2>> = s.points_m.iter().map(|p| Point::from(*p)).collect();
        let r = m.integrate_points(&pts, &s.occupied).unwrap();
        tiles += r.tiles_touched as u64;
        rows += r.rows as u64;
        safe += r.safeguards as u64;
        fail += r.tiles_failed as u64;
        passes += r.passes as u64;
    }
    let n = train.scans.len().min(max) as f64;
    println!(
        "scans {n} time/scan {:.3} ms tiles/scan {:.2} rows/scan {:.0} safeguards {safe} of {passes} fails {fail} tiles {:?}",
        t.elapsed().as_secs_f64() * 1e3 / n,
        tiles as f64 / n,
        rows as f64 / n,
        m.tile_counts()
    );
    if max < 900 {
        return;
    }
    let test = PointLog::read(Path::new(&format!("{d}/intel-beams-test.csv.gz"))).unwrap();
    let (mut z, mut l) = (vec![], vec![]);
    for s in &test.scans {
        for (p, o) in s.points_m.iter().zip(&s.occupied) {
            z.push(m.occupancy(&Point::from(*p)).logit());
            l.push(*o);
        }
    }
    println!("{:?}", bhm_tools::metrics::Scores::of(&z, &l).unwrap());
}
