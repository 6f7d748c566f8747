use bhm_core::{
    beam::BeamLimits,
    kernel::Averaging,
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    settings::Settings,
};
use crc32fast::Hasher;

/// CRC-32 over every name and number of the settings: two programs whose settings have the same learn the same from a scan.
///
/// Numbers count bit by bit, and widths as 64 bits, so that it does not depend on the machine.
#[must_use]
pub fn settings_fingerprint(settings: &Settings) -> u32 {
    // Taken apart whole, so that a new setting cannot be forgotten here.
    let Settings {
        origin_m,
        spacing_m,
        kernel,
        kernel_shape,
        support,
        support_size,
        support_averaging,
        stencil,
        tile_width,
        tile_stride,
        tile_count,
        prior_precision,
        bias,
        bias_precision,
        limits: BeamLimits { range_max_m, no_return_free_m },
        beam,
        free_spacing_m,
        segment_length,
        segment_averaging,
        gap_m,
        rule,
        passes,
        forgetting,
    } = settings;
    let mut print = Print(Hasher::new());
    print.floats(origin_m);
    print.floats(&[*spacing_m, *kernel_shape, *support_size, *prior_precision, *bias_precision]);
    print.floats(&[*range_max_m, *no_return_free_m, *free_spacing_m, *segment_length, *gap_m, *forgetting]);
    print.averaging(support_averaging);
    print.averaging(segment_averaging);
    print.counts(&[*stencil as u64, u64::from(*bias), u64::from(*passes)]);
    print.counts(&tile_width.map(|width| width as u64));
    print.counts(&tile_stride.map(|stride| stride as u64));
    print.counts(&[u64::from(tile_count.is_some())]);
    print.counts(&tile_count.unwrap_or_default().map(|count| count as u64));
    for name in [kernel.name(), support.name(), beam.name(), rule.name()] {
        print.text(name);
    }
    match rule {
        AnyRule::GaussianVariational(GaussianVariational { xi_cap }) => print.floats(&[*xi_cap]),
        AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::Constant(xi) }) => {
            print.text("constant");
            print.floats(&[*xi]);
        }
        AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::PredictedUpTo(xi) }) => {
            print.text("predicted");
            print.floats(&[*xi]);
        }
    }
    print.0.finalize()
}

struct Print(Hasher);

impl Print {
    fn floats(&mut self, floats: &[f32]) {
        floats.iter().for_each(|float| self.0.update(&float.to_le_bytes()));
    }

    fn counts(&mut self, counts: &[u64]) {
        counts.iter().for_each(|count| self.0.update(&count.to_le_bytes()));
    }

    /// The length goes along, so that two names cannot lend each other letters.
    fn text(&mut self, text: &str) {
        self.counts(&[text.len() as u64]);
        self.0.update(text.as_bytes());
    }

    fn averaging(&mut self, averaging: &Averaging) {
        match averaging {
            Averaging::Exact => self.counts(&[0]),
            Averaging::Samples(samples) => self.counts(&[1, u64::from(*samples)]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile;

    #[test]
    fn every_setting_counts() {
        let settings = profile::COMPACT.settings;
        let same = settings_fingerprint(&settings);
        assert_eq!(settings_fingerprint(&settings.clone()), same);
        type Change = fn(&mut Settings);
        let changes: [Change; 24] = [
            |s| s.origin_m[1] = -0.0,
            |s| s.spacing_m = 0.25,
            |s| s.kernel = bhm_core::kernel::KernelChoice::SquaredExponential,
            |s| s.kernel_shape += 1e-7,
            |s| s.support = bhm_core::support::SupportChoice::GaussianSupport,
            |s| s.support_size = 2.0,
            |s| s.support_averaging = Averaging::Samples(3),
            |s| s.stencil = 6,
            |s| s.tile_width = [12, 13],
            |s| s.tile_stride = [8, 7],
            |s| s.tile_count = Some([0, 0]),
            |s| s.prior_precision = 2e-4,
            |s| s.bias = !s.bias,
            |s| s.bias_precision = 2.0,
            |s| s.limits.range_max_m = 41.0,
            |s| s.limits.no_return_free_m = 1.0,
            |s| s.beam = bhm_core::beam::BeamChoice::ALL[1],
            |s| s.free_spacing_m = 2.0,
            |s| s.segment_length = 5.0,
            |s| s.segment_averaging = Averaging::Samples(1),
            |s| s.gap_m = 0.2,
            |s| s.rule = AnyRule::GaussianVariational(GaussianVariational { xi_cap: 5.0 }),
            |s| s.passes = 2,
            |s| s.forgetting = 0.5,
        ];
        let mut prints = std::vec::Vec::from([same]);
        for change in changes {
            let mut settings = settings;
            change(&mut settings);
            prints.push(settings_fingerprint(&settings));
        }
        for start in [XiStart::Constant(1.0), XiStart::PredictedUpTo(1.0)] {
            let rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start });
            prints.push(settings_fingerprint(&Settings { rule, ..settings }));
        }
        let all = prints.len();
        prints.sort_unstable();
        prints.dedup();
        assert_eq!(prints.len(), all);
    }
}
