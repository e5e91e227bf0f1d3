//! What a frame might cost on a GPU that is not at hand: an estimate, from what the frame counted.
//!
//! A pass takes the longer of its instructions at the rate of the lanes, of which a third are busy,
//! and its bytes at the rate of the memory; passes follow one another. Instructions of a product are
//! those that callgrind counts for the closed form on one CPU core; the others are rough figures. Real
//! frames differ by what the model leaves out: caches, divergence, how full the device is. Nothing was
//! measured on the GPUs named.

use strandlight_scene::Stats;

/// A GPU by two rates of its data sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gpu {
    /// As it is called.
    pub name: &'static str,
    /// Instructions of single lanes, 1/s: multiprocessors x 128 lanes x boost clock.
    pub instructions: f64,
    /// Bytes of memory, 1/s.
    pub bytes: f64,
}

/// The GPUs that are known.
pub const GPUS: [Gpu; 2] = [
    Gpu {
        name: "H100",
        // 132 x 128 x 1.755 GHz; HBM3.
        instructions: 29.6e12,
        bytes: 3.35e12,
    },
    Gpu {
        name: "RTX-4090",
        // 128 x 128 x 2.52 GHz; GDDR6X.
        instructions: 41.3e12,
        bytes: 1.008e12,
    },
];

/// Share of the lanes' instructions that a shader with many registers and tables issues.
const BUSY: f64 = 0.35;

/// Seconds until a pass starts after the one before.
const LAUNCH: f64 = 5e-6;

/// Instructions of single scattering of one light at a point, all modes.
const PER_SINGLE: f64 = 5538.0;

/// The same of a look-up in tables of multiple scattering, for each visible point and light.
const PER_LOOK_UP: f64 = 250.0;

/// Instructions to find what a segment covers of a pixel within its reach, with those spent on pixels beyond it, sorting included.
const PER_TEST: f64 = 210.0;

/// Instructions of a step of the sweep through the volume: a voxel in one direction.
const PER_SWEPT: f64 = 60.0;

/// Instructions to share out a segment among voxels.
const PER_VOXELISED: f64 = 400.0;

/// Instructions to fill all tables of multiple scattering: some 0.1 s of a core.
const PER_TABLES: f64 = 5e8;

/// Bytes of an entry of the visibility list, and of the two radiances that it joins.
const ENTRY: f64 = 12.0;
const RADIANCES: f64 = 32.0;

/// Bytes of a texel that is read, compared and written.
const TEXEL: f64 = 8.0;

/// Bytes of a light's record and shares at a point.
const RECORD: f64 = 20.0;

/// Bytes of a pixel, written as sums and read for the display.
const PIXEL: f64 = 32.0;

/// Estimated milliseconds of a pass.
pub type Pass = (&'static str, f64);

impl Gpu {
    /// The GPU called `name`, or `None`.
    pub fn from_name(name: &str) -> Option<Gpu> {
        GPUS.into_iter().find(|gpu| gpu.name == name)
    }

    /// Milliseconds of the passes of a frame of `size`, width and height, that counted `stats` on the
    /// CPU: those of its stages that stand for a pass.
    pub fn passes(&self, stats: &Stats, size: [u32; 2]) -> Vec<Pass> {
        let pass = |name| Some((name, self.milliseconds(work(name, stats, size)?)));
        let names = stats.stages.iter().map(|stage| stage.name);
        names.filter_map(pass).collect()
    }

    fn milliseconds(&self, [instructions, bytes]: [f64; 2]) -> f64 {
        let computed = instructions / (BUSY * self.instructions);
        1e3 * (LAUNCH + computed.max(bytes / self.bytes))
    }
}

/// Instructions and bytes of a stage of the CPU's frame, as a pass.
fn work(stage: &str, stats: &Stats, size: [u32; 2]) -> Option<[f64; 2]> {
    let [points, entries] = [stats.visible_points, stats.list_entries].map(|n| n as f64);
    let products = |name: &str| {
        let terms = stats.terms.iter().filter(|term| term.name == name);
        terms.map(|term| term.products as f64).sum::<f64>()
    };
    let pairs = points * stats.lights as f64;
    let single = products("single");
    let is_multiple = stats.terms.iter().any(|term| term.name != "single");
    let look_ups = if is_multiple { pairs } else { 0.0 };
    let pixels = f64::from(size[0]) * f64::from(size[1]);
    let swept = stats.voxels as f64 * stats.sweeps as f64;
    Some(match stage {
        "voxelise" => [
            PER_VOXELISED * stats.segments as f64,
            32.0 * stats.voxels as f64,
        ],
        "transmittance" => [PER_SWEPT * swept, ENTRY * swept],
        "list" => [PER_TEST * stats.pixels_visited as f64, ENTRY * entries],
        // Both count in one number, of which the second pass has none of its own.
        "shadow maps" => [0.0, TEXEL * stats.texels_visited as f64],
        "through maps" if !has(stats, "shadow maps") => [0.0, TEXEL * stats.texels_visited as f64],
        "through maps" => [0.0, 0.0],
        "tables" => [PER_TABLES, 0.0],
        "shade" => [PER_SINGLE * single + PER_LOOK_UP * look_ups, RECORD * pairs],
        "composite" => [0.0, (ENTRY + RADIANCES) * entries + PIXEL * pixels],
        _ => return None,
    })
}

fn has(stats: &Stats, stage: &str) -> bool {
    stats.stages.iter().any(|done| done.name == stage)
}

#[cfg(test)]
mod tests {
    use strandlight_scene::stats::{Stage, Term};

    use super::*;

    fn stats(stages: &[&'static str]) -> Stats {
        let stage = |&name: &&'static str| Stage {
            name,
            milliseconds: 1.0,
            bytes: 0,
            runs: 1,
            gpu_milliseconds: None,
        };
        let term = |name, products| Term {
            name,
            products,
            skipped: 0,
        };
        Stats {
            stages: stages.iter().map(stage).collect(),
            lights: 40,
            visible_points: 154_000,
            list_entries: 2_000_000,
            pixels_visited: 17_500_000,
            texels_visited: 69_000_000,
            terms: vec![term("single", 2_772_000), term("global", 1_000)],
            ..Stats::default()
        }
    }

    /// The demo's counts, against the same sums by hand.
    #[test]
    fn estimates_are_sums_by_hand() {
        let gpu = Gpu::from_name("H100").expect("known");
        let passes = gpu.passes(&stats(&["edit", "shade", "composite"]), [720, 480]);
        let [("shade", shade), ("composite", composite)] = passes[..] else {
            panic!("{passes:?}");
        };
        // 154,000 x 40 x (5538 x 0.45 + 250) instructions at 35 % of 29.6 T/s.
        let expected = 154_000.0 * 40.0 * (5538.0 * 0.45 + 250.0) / (0.35 * 29.6e9);
        assert!(
            (shade - 0.005 - expected).abs() < 1e-6,
            "{shade} {expected}"
        );
        let expected = (44.0 * 2e6 + 32.0 * 720.0 * 480.0) / 3.35e9;
        assert!((composite - 0.005 - expected).abs() < 1e-6, "{composite}");
    }

    #[test]
    fn texels_count_once_and_more_work_takes_longer() {
        let sum = |gpu: &Gpu, stats: &Stats| -> f64 {
            let passes = gpu.passes(stats, [720, 480]);
            passes.iter().map(|pass| pass.1).sum()
        };
        for gpu in &GPUS {
            let both = sum(gpu, &stats(&["shadow maps", "through maps"]));
            let through = sum(gpu, &stats(&["through maps"]));
            assert!((both - through - 5e-3).abs() < 1e-9, "{both} {through}");
            let mut more = stats(&["list", "shade"]);
            let before = sum(gpu, &more);
            more.pixels_visited *= 2;
            let tested = sum(gpu, &more);
            more.terms[0].products *= 2;
            assert!(before < tested && tested < sum(gpu, &more));
            assert_eq!(Gpu::from_name(gpu.name), Some(*gpu));
        }
        assert_eq!(Gpu::from_name("abacus"), None);
    }
}
