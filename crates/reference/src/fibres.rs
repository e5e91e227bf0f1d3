//! What scatters: fibres that are all alike, or painted ones, each its own.

use strandlight_scattering::closed_form::{
    AverageRow, PaintedAveragesView, average_row, sample_painted_averages, sample_painted_forward,
};
use strandlight_scattering::dual_scattering::{Average, AverageTable};
use strandlight_scattering::exact::{Bcsdf, BcsdfView, PaintedBcsdf};
use strandlight_scattering::{HairParams, Model};
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::strands::Strands;

use crate::rays::Crossing;

/// How the fibres of a groom scatter.
#[derive(Clone, Copy, Debug)]
pub enum Fibres<'a> {
    /// All alike.
    Alike(&'a Bcsdf),
    /// Painted.
    Painted(Painted<'a>, &'a PaintedBcsdf),
}

/// Paint on hair.
#[derive(Clone, Copy, Debug)]
pub struct Painted<'a> {
    /// The hair without it.
    pub hair: &'a HairParams,
    /// Of every one of [`Strands::points`].
    pub points: &'a [PaintedPoint],
}

impl Painted<'_> {
    /// The paint at a crossing, between the ends of its segment.
    fn at(&self, strands: &Strands, crossing: &Crossing) -> PaintedPoint {
        let first = strands.segments[crossing.segment as usize] as usize;
        let [a, b] = [first, first + 1].map(|ix| self.points[ix]);
        a.mix(&b, crossing.along)
    }
}

impl<'a> From<&'a Bcsdf> for Fibres<'a> {
    fn from(bcsdf: &'a Bcsdf) -> Self {
        Fibres::Alike(bcsdf)
    }
}

impl<'a> Fibres<'a> {
    /// The fibre at `crossing` of `strands` seen from the unit vector `omega_o` in its frame.
    pub fn view(&self, strands: &Strands, crossing: &Crossing, omega_o: [f64; 3]) -> BcsdfView<'a> {
        match self {
            Fibres::Alike(bcsdf) => bcsdf.view(omega_o),
            Fibres::Painted(painted, bcsdf) => {
                let fibre = painted.at(strands, crossing).on(painted.hair);
                bcsdf.view(&fibre, omega_o)
            }
        }
    }
}

/// What fibres do on average.
#[derive(Clone, Copy, Debug)]
pub enum Averages<'a> {
    /// All alike.
    Alike(&'a AverageTable),
    /// Painted.
    Painted(Painted<'a>, PaintedAveragesView<'a>),
}

/// What the fibre at one crossing does on average.
#[derive(Clone, Copy, Debug)]
pub enum AveragesAt<'a> {
    /// As all others.
    Alike(&'a AverageTable),
    /// Painted: those of the fibre itself, and of the hair around it.
    Painted(PaintedAveragesView<'a>, [AverageRow; 2]),
}

impl<'a> From<&'a AverageTable> for Averages<'a> {
    fn from(table: &'a AverageTable) -> Self {
        Averages::Alike(table)
    }
}

impl<'a> Averages<'a> {
    /// Of the fibre at `crossing` of `strands`.
    pub fn at(&self, strands: &Strands, crossing: &Crossing) -> AveragesAt<'a> {
        match self {
            Averages::Alike(table) => AveragesAt::Alike(table),
            Averages::Painted(painted, view) => {
                let paint = painted.at(strands, crossing);
                let sigma_a = paint.on(painted.hair).sigma_a.map(|x| x as f32);
                let (width, shift) = (paint.width_scale, paint.shift_scale);
                let row = |sigma_a| average_row(view.decode, sigma_a, width, shift);
                let around = paint.around.unwrap_or(sigma_a);
                AveragesAt::Painted(*view, [row(sigma_a), row(around)])
            }
        }
    }
}

impl AveragesAt<'_> {
    /// a_f and beta_f^2 at the inclination `theta`.
    pub fn forward(&self, theta: f32) -> [[f32; 3]; 2] {
        match self {
            AveragesAt::Alike(table) => {
                let averages = table.sample(theta);
                [Average::AF, Average::BetaF].map(|average| averages[average as usize])
            }
            AveragesAt::Painted(view, [row, _]) => {
                let (a_f, beta_f_2) = sample_painted_forward(view, row, theta.sin().abs());
                [a_f, beta_f_2]
            }
        }
    }

    /// The model, which says the form of the lobes that these are shifts and widths of.
    pub fn model(&self) -> Model {
        match self {
            AveragesAt::Alike(table) => table.model,
            AveragesAt::Painted(..) => Model::Marschner,
        }
    }

    /// A_b, Delta_b and sigma_b at the inclination `theta`, of the hair around the fibre.
    pub fn backward(&self, theta: f32) -> [[f32; 3]; 3] {
        match self {
            AveragesAt::Alike(table) => {
                let averages = table.sample(theta);
                [Average::Ab, Average::DeltaB, Average::SigmaB]
                    .map(|average| averages[average as usize])
            }
            AveragesAt::Painted(view, [_, row]) => {
                let averages = sample_painted_averages(view, row, theta);
                let width = averages.width_b_2.map(|square| square.max(0.0).sqrt());
                [averages.attenuation_b, averages.shift_b, width]
            }
        }
    }
}
