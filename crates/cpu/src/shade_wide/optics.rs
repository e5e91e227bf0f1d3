//! What shading reads of the fibre at a point: that of the scene, or that of a painted point.

use strandlight_scattering::closed_form::{
    AverageRow, Fibre, ForwardTable, HairLayers, NO_LAYERS, PaintedHair, PaintedPointAverages,
    PaintedViews, PointLobes, Shading, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE, painted_averages,
    painted_fibre, painted_layers, painted_shading, unpack_paint,
};
use strandlight_scattering::multiple_tables::{
    MultipleTables, PaintedPlaces, PaintedTables, SeenLights, painted_forward_table,
};
use strandlight_scattering::wide::{Simd, f32x8};
use strandlight_scene::PreparedScene;
use strandlight_scene::paint::PaintedPoint;

/// Multiple scattering of eight lights at a point, by channel.
type Rgb<S> = [f32x8<S>; 3];

/// A fibre at a point.
pub(super) trait PointOptics {
    /// For single scattering.
    fn shading(&self) -> &Shading<'_>;
    /// Of the hair between the lights and the point.
    fn forward(&self) -> &ForwardTable;
    /// Of the hair behind the point.
    fn layers(&self) -> &HairLayers;
    /// Global and local scattering of light of width `sigma_f`.
    fn at_lights<S: Simd>(&self, seen: &SeenLights<S>, sigma_f: f32x8<S>) -> (Rgb<S>, Rgb<S>);
    /// Direct local scattering of lights of width `lambda`.
    fn direct_at_lights<S: Simd>(&self, seen: &SeenLights<S>, lambda: f32x8<S>) -> Rgb<S>;
    /// Is it the scene's?
    fn is_plain(&self) -> bool;
}

/// The scene's fibre.
pub(super) struct PlainOptics<'a> {
    pub shading: Shading<'a>,
    pub forward: ForwardTable,
    pub layers: HairLayers,
    pub tables: &'a MultipleTables,
}

impl PointOptics for PlainOptics<'_> {
    #[inline(always)]
    fn shading(&self) -> &Shading<'_> {
        &self.shading
    }

    #[inline(always)]
    fn forward(&self) -> &ForwardTable {
        &self.forward
    }

    #[inline(always)]
    fn layers(&self) -> &HairLayers {
        &self.layers
    }

    #[inline(always)]
    fn at_lights<S: Simd>(&self, seen: &SeenLights<S>, sigma_f: f32x8<S>) -> (Rgb<S>, Rgb<S>) {
        self.tables.at_lights(seen, sigma_f)
    }

    #[inline(always)]
    fn direct_at_lights<S: Simd>(&self, seen: &SeenLights<S>, lambda: f32x8<S>) -> Rgb<S> {
        self.tables.direct_at_lights(seen, lambda)
    }

    #[inline(always)]
    fn is_plain(&self) -> bool {
        true
    }
}

/// What painted points have in common.
pub(super) struct Painted<'a> {
    scene: &'a PreparedScene,
    paint: &'a [PaintedPoint],
    hair: PaintedHair,
    tables: &'a PaintedTables,
}

/// What the last painted points had: the next is often like them.
#[derive(Default)]
pub(super) struct LastPainted {
    /// Absorption, and lobes of TT and TRT.
    lobes: Option<[f32; 3]>,
    tt: PointLobes,
    trt: PointLobes,
    /// Where averages of the hair around stood, and what is read of them.
    forward: Option<(AverageRow, Box<ForwardTable>, HairLayers)>,
}

/// A painted point: its fibre, and where its averages stand.
pub(super) struct PaintedPointFibre {
    fibre: Fibre,
    places: PaintedPlaces,
    row: AverageRow,
}

/// The fibre of a painted point.
pub(super) struct PaintedOptics<'a> {
    shading: Shading<'a>,
    forward: &'a ForwardTable,
    layers: HairLayers,
    tables: &'a PaintedTables,
    places: PaintedPlaces,
}

/// Where there is no multiple scattering.
const NO_FORWARD: ForwardTable = [[0.0; 4]; size_of::<ForwardTable>() / 16];

impl<'a> Painted<'a> {
    /// Of the paint of `scene`, if there is any.
    pub fn new(scene: &'a PreparedScene, tables: &'a PaintedTables) -> Option<Painted<'a>> {
        Some(Painted {
            paint: scene.paint()?,
            hair: scene.hair.optics().painted_hair(),
            tables,
            scene,
        })
    }

    /// What all of them read.
    pub fn views(&self) -> PaintedViews<'_> {
        let optics = self.scene.hair.optics();
        optics.painted_views(&self.hair, self.scene.tables.view())
    }

    /// The fibre of a point, if it has one of its own.
    #[inline(always)]
    pub fn at(&self, views: &PaintedViews, point: usize) -> Option<PaintedPointFibre> {
        let paint = &self.paint[point];
        if !paint.is_painted() {
            return None;
        }
        let paint = unpack_paint(&paint.texel());
        let fibre = painted_fibre(&self.hair.fibre, &paint);
        Some(PaintedPointFibre {
            places: self.tables.places(&fibre, &paint),
            row: painted_averages(views.averages, &fibre, &paint).row,
            fibre,
        })
    }

    /// What shading reads there.
    #[inline(always)]
    pub fn optics<'b>(
        &'b self,
        views: &PaintedViews<'b>,
        of: &'b PaintedPointFibre,
        last: &'b mut LastPainted,
    ) -> PaintedOptics<'b> {
        let terms = self.scene.terms();
        let has_forward = terms & (TERM_GLOBAL | TERM_LOCAL) == 0
            || (last.forward.as_ref()).is_some_and(|(row, ..)| *row == of.row);
        if !has_forward {
            let table = painted_forward_table(&views.averages, &of.row);
            let layers = painted_layers(&PaintedPointAverages {
                view: views.averages,
                row: of.row,
            });
            last.forward = Some((of.row, Box::new(table), layers));
        }
        let sigma_a = of.fibre.sigma_a;
        if terms & TERM_SINGLE != 0 && last.lobes != Some(sigma_a) {
            let shading = painted_shading(views, &of.fibre);
            last.tt.take(&shading.tt);
            last.trt.take(&shading.trt);
            last.lobes = Some(sigma_a);
        }
        PaintedOptics {
            shading: Shading {
                fibre: &of.fibre,
                tables: views.tables,
                reflectance: &views.hair.reflectance,
                tt: last.tt.view(),
                trt: last.trt.view(),
            },
            forward: (last.forward.as_ref()).map_or(&NO_FORWARD, |(_, table, _)| table),
            layers: (last.forward.as_ref()).map_or(NO_LAYERS, |(.., layers)| *layers),
            tables: self.tables,
            places: of.places,
        }
    }
}

impl PointOptics for PaintedOptics<'_> {
    #[inline(always)]
    fn shading(&self) -> &Shading<'_> {
        &self.shading
    }

    #[inline(always)]
    fn forward(&self) -> &ForwardTable {
        self.forward
    }

    #[inline(always)]
    fn layers(&self) -> &HairLayers {
        &self.layers
    }

    #[inline(always)]
    fn at_lights<S: Simd>(&self, seen: &SeenLights<S>, sigma_f: f32x8<S>) -> (Rgb<S>, Rgb<S>) {
        self.tables.at_lights(&self.places, seen, sigma_f)
    }

    #[inline(always)]
    fn direct_at_lights<S: Simd>(&self, seen: &SeenLights<S>, lambda: f32x8<S>) -> Rgb<S> {
        self.tables.direct_at_lights(&self.places, seen, lambda)
    }

    #[inline(always)]
    fn is_plain(&self) -> bool {
        false
    }
}
