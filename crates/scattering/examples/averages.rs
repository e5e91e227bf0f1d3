//! Dual scattering's averages: the time an edit takes, and errors against the full integral.
//!
//! ```sh
//! cargo run -p strandlight-scattering --example averages -- 24 12
//! ```
//!
//! takes 24 fibres and 12 inclinations each. An error is the largest difference of a fibre, of its
//! largest value (shifts of one event: of the largest shift of its modes), where at least 1e-3 of
//! the largest attenuation is left: the median and the largest of all fibres are printed. In turn: the table at its own inclinations, between them, Xu's separated
//! Eq 33, Zinke's orders and fits against all orders, and mean and width of S itself against the
//! averages over modes.

use std::f64::consts::PI;
use std::process::ExitCode;
use std::time::Instant;

use strandlight_scattering::dual_scattering::{
    Average, AverageTable, Backscatter, Event, N_INCLINATIONS, all_orders, event, event_separated,
    mixture, published, truncated,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, PerLobe};

const FRESNEL: Fresnel = Fresnel::Dielectric;

fn main() -> ExitCode {
    let counts: Option<Vec<u32>> = std::env::args().skip(1).map(|it| it.parse().ok()).collect();
    let (n_fibres, n_inclinations) = match counts.as_deref() {
        Some([]) => (24, 12),
        Some(&[fibres, inclinations]) if fibres > 0 && inclinations > 0 => (fibres, inclinations),
        _ => {
            eprintln!("usage: averages [FIBRES INCLINATIONS]");
            return ExitCode::from(2);
        }
    };
    time();
    for (name, wild) in [("hair", false), ("any valid fibre", true)] {
        println!("{name}: {n_fibres} fibres, {n_inclinations} inclinations");
        errors(n_fibres, n_inclinations, wild);
    }
    ExitCode::SUCCESS
}

fn time() {
    for eccentricity in [1.0, 0.8] {
        let mut hair = HairParams {
            eccentricity,
            ..HairParams::default()
        };
        let mut best = f64::INFINITY;
        for run in 0..50 {
            hair.sigma_a[0] = 0.2 + 0.001 * f64::from(run);
            let start = Instant::now();
            std::hint::black_box(AverageTable::new(std::hint::black_box(&hair), FRESNEL));
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!("eccentricity {eccentricity}: table in {:.3} ms", 1e3 * best);
    }
}

/// Halton's sequence: the radical inverse of `i`.
fn halton(mut i: u32, base: u32) -> f64 {
    let (mut value, mut scale) = (0.0, 1.0);
    while i > 0 {
        scale /= f64::from(base);
        value += scale * f64::from(i % base);
        i /= base;
    }
    value
}

fn fibre(ix: u32, wild: bool) -> HairParams {
    let pick = |base, low: f64, high: f64| low + (high - low) * halton(ix + 1, base);
    let log = |base, low: f64, high: f64| low * (high / low).powf(halton(ix + 1, base));
    let sigma = log(2, 0.01, if wild { 50.0 } else { 2.0 });
    let sigma_a = [sigma, 1.6 * sigma, 3.0 * sigma].map(|sigma| sigma.min(50.0));
    if wild {
        return HairParams {
            eta: 1.0 + log(3, 1e-4, 2.0),
            sigma_a,
            shift: PerLobe {
                r: pick(5, -0.5, 0.5),
                tt: pick(7, -0.5, 0.5),
                trt: pick(11, -0.5, 0.5),
            },
            width: PerLobe {
                r: log(13, 0.001, 1.5),
                tt: log(17, 0.001, 1.5),
                trt: log(19, 0.001, 1.5),
            },
            caustic_width: log(23, 0.01, 1.5),
            eccentricity: if ix.is_multiple_of(2) {
                1.0
            } else {
                log(29, 0.5, 2.0)
            },
            ..HairParams::default()
        };
    }
    let shift = pick(3, -0.14, -0.03);
    let width = pick(5, 0.1, 0.3);
    HairParams {
        eta: 1.55,
        sigma_a,
        shift: PerLobe {
            r: shift,
            tt: -0.5 * shift,
            trt: -1.5 * shift,
        },
        width: PerLobe {
            r: width,
            tt: 0.5 * width,
            trt: 2.0 * width,
        },
        caustic_width: pick(7, 0.05, 0.3),
        ..HairParams::default()
    }
}

/// The widest shift of a mode in the full angle.
fn largest_shift(hair: &HairParams) -> f64 {
    let shifts = Lobe::ALL.map(|lobe| 2.0 * hair.shift.get(lobe).abs());
    shifts.into_iter().fold(1e-3, f64::max)
}

type Rgb = [f64; 3];

/// The attenuation that each average belongs to.
const ATTENUATION: [usize; 9] = [0, 1, 0, 1, 0, 1, 6, 6, 6];

fn values(event: &Event, backscatter: &Backscatter) -> [Rgb; 9] {
    Average::ALL.map(|average| average.of(event, backscatter))
}

fn errors(n_fibres: u32, n_inclinations: u32, wild: bool) {
    const KINDS: [&str; 6] = [
        "table at its rows",
        "table between",
        "Eq 33, one event",
        "A_1 + A_3, exact sums",
        "A_1 + A_3, Zinke's fits",
        "S itself: mean, width",
    ];
    let mut found = vec![vec![Vec::new(); 9]; KINDS.len()];
    for ix in 0..n_fibres {
        let hair = fibre(ix, wild);
        let table = AverageTable::new(&hair, FRESNEL);
        // Kind, average, value, exact value, and attenuation that it belongs to.
        let mut records: Vec<(usize, usize, Rgb, Rgb, Rgb)> = Vec::new();
        let mut peaks = [0.0f64; 9];
        for step in 0..n_inclinations {
            let last = (N_INCLINATIONS - 1) as f64;
            let row = ((f64::from(step) + 0.5) / f64::from(n_inclinations) * last).floor();
            for (kind, place) in [row / last, (row + 0.5) / last].into_iter().enumerate() {
                let theta = PI * (place - 0.5);
                let exact = event(theta, &hair, FRESNEL);
                let orders = all_orders(&exact);
                let values = values(&exact, &orders);
                for (peak, value) in peaks.iter_mut().zip(values) {
                    *peak = value.into_iter().map(f64::abs).fold(*peak, f64::max);
                }
                let mut add = |kind: usize, q: usize, value: Rgb| {
                    records.push((kind, q, value, values[q], values[ATTENUATION[q]]));
                };
                for (q, average) in Average::ALL.into_iter().enumerate() {
                    add(kind, q, table.get(average, theta as f32).map(f64::from));
                }
                if kind > 0 {
                    continue;
                }
                let separated = event_separated(theta, &hair, FRESNEL);
                let by_33 = self::values(&separated, &all_orders(&separated));
                let few = self::values(&exact, &truncated(&exact));
                let fits = self::values(&exact, &published(&exact));
                for q in 0..9 {
                    add(2, q, by_33[q]);
                    add(3, q, few[q]);
                    add(4, q, fits[q]);
                }
                let [f, b] = mixture(theta, &hair, FRESNEL);
                add(5, 2, f.mean);
                add(5, 3, b.mean);
                add(5, 4, f.width_2.map(f64::sqrt));
                add(5, 5, b.width_2.map(f64::sqrt));
            }
        }
        peaks[2] = largest_shift(&hair);
        peaks[3] = peaks[2];
        let mut worst = [[0.0f64; 9]; KINDS.len()];
        for (kind, q, value, exact, mass) in records {
            for c in 0..3 {
                if mass[c] > 1e-3 * peaks[ATTENUATION[q]] {
                    worst[kind][q] = worst[kind][q].max((value[c] - exact[c]).abs());
                }
            }
        }
        for kind in 0..KINDS.len() {
            for q in 0..9 {
                found[kind][q].push(worst[kind][q] / peaks[q]);
            }
        }
    }
    print!("{:24}", "median, largest");
    for average in Average::ALL {
        print!("{:>17}", average.name());
    }
    println!();
    for (kind, name) in KINDS.iter().enumerate() {
        print!("{name:24}");
        for errors in &mut found[kind] {
            errors.sort_by(f64::total_cmp);
            let (median, largest) = (errors[errors.len() / 2], errors[errors.len() - 1]);
            print!("  {median:7.1e} {largest:7.1e}");
        }
        println!();
    }
}
