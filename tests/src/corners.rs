//! Queries at the corners of every range, where arithmetic breaks first.

use std::f32::consts::{FRAC_PI_2, PI};

use strandlight_render::probe::{MODE_ALL, Query};
use strandlight_scattering::closed_form::{DirectionInFrame, Fibre};
use strandlight_scattering::{HairParams, Lobe, PerLobe};

/// Fibres at the ends of their ranges.
pub fn fibres() -> Vec<HairParams> {
    let mut fibres = Vec::new();
    for eta in [1.0001, 1.2, 1.55, 3.0] {
        for sigma_a in [[0.0, 0.3, 2.0], [50.0, 10.0, 5.0]] {
            for width in [0.001, 0.12, 1.5] {
                for caustic_width in [0.01, 0.15, 1.5] {
                    for eccentricity in [0.5, 1.0, 2.0] {
                        fibres.push(HairParams {
                            eta,
                            sigma_a,
                            shift: PerLobe {
                                r: -0.5,
                                tt: 0.05,
                                trt: 0.5,
                            },
                            width: PerLobe {
                                r: width,
                                tt: width,
                                trt: width,
                            },
                            caustic_width,
                            eccentricity,
                            ..HairParams::default()
                        });
                    }
                }
            }
        }
    }
    fibres
}

/// Single scattering and inner integrals at every corner, of the optics of [`fibres`] in order.
pub fn queries() -> Vec<Query> {
    let mut queries = Vec::new();
    let thetas = [-FRAC_PI_2, 0.0, 1.57, FRAC_PI_2];
    // Their values are inside the ranges.
    let fibres = fibres()
        .into_iter()
        .map(|hair| Fibre::new(&hair, &Lobe::ALL, 4));
    for (optics, fibre) in (0..).zip(fibres.flatten()) {
        for lambda in [0.001f32, 0.2, 10.0] {
            for (theta_j, theta_o) in thetas.iter().flat_map(|&a| thetas.map(|b| (a, b))) {
                for dphi in [0.0, PI] {
                    let light = DirectionInFrame::from_angles(theta_j, 0.0);
                    let view = DirectionInFrame::from_angles(theta_o, dphi);
                    let query = Query::single(MODE_ALL, light, lambda, view, fibre);
                    queries.push(query.with_optics(optics));
                }
            }
            for theta_d in [0.0, 0.8, 1.2, FRAC_PI_2] {
                for mode in 0..3 {
                    let query = Query::azimuthal(mode, lambda, 0.3, theta_d, fibre);
                    queries.push(query.with_optics(optics));
                }
            }
        }
    }
    queries
}
