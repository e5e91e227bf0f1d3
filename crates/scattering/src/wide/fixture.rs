//! Fibres, lights and views for tests.

use crate::axis::Axis;
use crate::c_integrals::BernsteinRule;
use crate::closed_form::{
    DirectionInFrame, Fibre, LobeView, PackedShares, Reflectance, Shading, TableAxes, Tables,
    pack_shares,
};
use crate::fresnel::Fresnel;
use crate::lobes::{
    DEFAULT_LOBE_TEXELS, DEFAULT_PAINTED_TEXELS, LOBE_ALPHA, LOBE_ETA, LobeAxes, LobeTable,
    LobeTexture, PaintedTexture, slice, slice_painted,
};
use crate::random::SplitMix64;
use crate::table_layout::{C_COLUMNS, C_ROWS};
use crate::{HairParams, Lobe, PerLobe};

use super::Place;

/// Tables: C as baked, lobes at few indices.
pub struct Fixture {
    c: Vec<PackedShares>,
    axes: TableAxes,
    lobes: [LobeTable; 2],
}

/// What shading reads of a fibre.
pub struct Hair {
    pub fibre: Fibre,
    reflectance: Reflectance,
    textures: [LobeTexture; 2],
}

impl Fixture {
    pub fn new() -> Fixture {
        let rule = BernsteinRule::default();
        let values = |axis: &'static Axis| (0..axis.count).map(|ix| axis.value_at(ix));
        let shares = |kappa, cos_half| {
            let [_, shares @ ..] = rule.shares(kappa, cos_half);
            pack_shares(&shares.map(|share| share as f32))
        };
        let rows = values(&C_ROWS);
        let c = rows.flat_map(|kappa| values(&C_COLUMNS).map(move |c| shares(kappa, c)));
        let axes = LobeAxes {
            eta: Axis {
                count: 8,
                max: 2.5,
                ..LOBE_ETA
            },
            alpha: Axis {
                count: 32,
                ..LOBE_ALPHA
            },
            ..LobeAxes::default()
        };
        Fixture {
            c: c.collect(),
            axes: TableAxes {
                c_rows: C_ROWS.into(),
                c_columns: C_COLUMNS.into(),
                ..bytemuck::Zeroable::zeroed()
            },
            lobes: [Lobe::Tt, Lobe::Trt]
                .map(|lobe| LobeTable::fit(lobe, Fresnel::Dielectric, axes, 2)),
        }
    }

    /// A fibre with these parameters.
    pub fn hair_of(&self, hair: &HairParams) -> Hair {
        let [tt, trt] = &self.lobes;
        Hair {
            fibre: Fibre::new(hair, &Lobe::ALL, 4).expect("parameters are in range"),
            reflectance: Reflectance::new(Fresnel::Dielectric, hair.eta),
            textures: slice([tt, trt], hair, DEFAULT_LOBE_TEXELS),
        }
    }

    /// Lobes of TT and TRT for painting this hair.
    pub fn painted(&self, hair: &Hair) -> [PaintedTexture; 2] {
        let Fibre {
            eta, caustic_width, ..
        } = hair.fibre;
        let of = |ix: usize| {
            let (eta, caustic_width) = (f64::from(eta), f64::from(caustic_width));
            slice_painted(&self.lobes[ix], eta, caustic_width, DEFAULT_PAINTED_TEXELS)
        };
        [of(0), of(1)]
    }

    /// Any fibre.
    pub fn hair(&self, random: &mut SplitMix64, elliptic: bool) -> Hair {
        self.hair_of(&params(random, elliptic))
    }
}

/// Any parameters.
pub fn params(random: &mut SplitMix64, elliptic: bool) -> HairParams {
    let degree = std::f64::consts::PI / 180.0;
    let shift = random.uniform(-10.0, 10.0) * degree;
    let width = random.log_uniform(2.0, 25.0) * degree;
    HairParams {
        eta: random.uniform(1.3, 1.8),
        sigma_a: [(); 3].map(|()| random.log_uniform(0.01, 3.0)),
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
        caustic_width: random.log_uniform(0.05, 0.5),
        eccentricity: match elliptic {
            true => random.log_uniform(0.75, 1.33),
            false => 1.0,
        },
        ..HairParams::default()
    }
}

impl Hair {
    pub fn shading<'a>(&'a self, fixture: &'a Fixture) -> Shading<'a, LobeView<'a>> {
        Shading {
            fibre: &self.fibre,
            tables: Tables {
                c: &fixture.c,
                h_tt: &[],
                h_trt: &[],
                axes: fixture.axes,
            },
            reflectance: &self.reflectance,
            tt: self.textures[0].view(),
            trt: self.textures[1].view(),
        }
    }
}

/// A unit vector, any one as likely.
fn direction(random: &mut SplitMix64) -> [f32; 3] {
    let z = random.uniform(-1.0, 1.0);
    let (sin, cos) = random.uniform(0.0, std::f64::consts::TAU).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    [radius * cos, radius * sin, z].map(|x| x as f32)
}

/// Directions and bandwidths of `n` lights, among them some along the axes and some of extreme width.
pub fn lights(random: &mut SplitMix64, n: usize) -> (Vec<[f32; 3]>, Vec<f32>) {
    let mut directions: Vec<_> = (0..n).map(|_| direction(random)).collect();
    let mut lambdas: Vec<_> = directions
        .iter()
        .map(|_| random.log_uniform(0.01, 1.2) as f32)
        .collect();
    for (ix, axis) in [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
    ]
    .into_iter()
    .enumerate()
    {
        directions[ix] = axis;
    }
    lambdas[4] = 0.001;
    lambdas[5] = 10.0;
    (directions, lambdas)
}

/// Place `ix` of a set: the first ones in the frame of the world, seen along the axes and at grazing
/// angles.
pub fn place(random: &mut SplitMix64, ix: u32) -> Place {
    let eye = match ix {
        0 => [1.0, 0.0, 0.0],
        1 => [0.0, -1.0, 0.0],
        2 => [-0.9999, 0.01, 0.0],
        3 => [0.999, 0.0, -0.04],
        _ => direction(random),
    };
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let frame = match ix {
        0..4 => identity,
        _ => {
            let u = normalized(direction(random));
            let v = normalized(cross(u, direction(random)));
            [u, v, cross(u, v)]
        }
    };
    let along = |axis: [f32; 3]| axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2];
    Place {
        frame,
        view: DirectionInFrame::from_vector(frame.map(along)),
    }
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalized(a: [f32; 3]) -> [f32; 3] {
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    a.map(|x| x / length)
}
