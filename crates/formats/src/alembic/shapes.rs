//! Kinds of curves: basis and wrap.

use super::archive::Archive;
use super::notes::Notes;
use super::tree::CurvesObject;
use crate::curves::Wrap;
use crate::error::{Error, Result};
use crate::groom_format::{CurveBasis, NoteKind};

/// Kind of the curves of an object.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    pub basis: CurveBasis,
    pub wrap: Wrap,
}

/// Basis of each curve, or of all.
pub(super) fn shapes<'a>(
    archive: &Archive<'a>,
    object: &CurvesObject<'a>,
    lengths: &[u32],
    time: f64,
    notes: &mut Notes,
) -> Result<Vec<Shape>> {
    let path = &*object.path;
    let byte = |name: &str| match object.geom.get(name) {
        Some(property) => {
            let values = archive.values_at(property, time, path)?;
            Ok(values.doubles().map(|x| x as u8).collect())
        }
        None => Ok::<Vec<u8>, Error>(Vec::new()),
    };
    let kind = byte("curveBasisAndType")?;
    let (kind, wrap, code) = match kind[..] {
        [kind, wrap, code, ..] => (kind, wrap, code),
        _ => {
            let text = "its kind of curves is not stated: taken for linear";
            notes.add(NoteKind::Assumed, path, text);
            (1, 0, 0)
        }
    };
    let wrap = match wrap {
        0 => Wrap::Open,
        1 => Wrap::Periodic,
        _ => return Err(refuse(path, "wrap of curves", wrap, "0 or 1")),
    };
    let cubic = match code {
        1 => Some(CurveBasis::Bezier),
        2 => Some(CurveBasis::BSpline),
        3 => Some(CurveBasis::CatmullRom),
        _ => None,
    };
    let cubic = || {
        cubic.ok_or_else(|| {
            let name = match code {
                0 => "none",
                4 => "Hermite",
                5 => "power",
                _ => "unknown",
            };
            let range = "Bezier, B-spline or Catmull-Rom";
            refuse(path, "basis of cubic curves", name, range)
        })
    };
    let orders = byte("orders")?.into_iter().chain(byte(".orders")?);
    let orders: Vec<u8> = orders.collect();
    let of_order = |order: u8| match order {
        2 => Ok(CurveBasis::Linear),
        4 => cubic(),
        _ => Err(refuse(path, "order of curves", order, "2 or 4")),
    };
    let weights = object.geom.get("w");
    if let Some(weights) = weights {
        let weights = archive.values_at(weights, time, path)?;
        if weights.doubles().any(|weight| weight != 1.0) && kind != 1 {
            let key = "weights of rational curves";
            return Err(refuse(path, key, "not all 1", "1"));
        }
    }
    match kind {
        0 if orders.iter().all(|&order| order == 4) => Ok(vec![Shape {
            basis: cubic()?,
            wrap,
        }]),
        0 => {
            let order = orders.into_iter().find(|&order| order != 4).unwrap_or(0);
            Err(refuse(path, "order of cubic curves", order, "4"))
        }
        1 => Ok(vec![Shape {
            basis: CurveBasis::Linear,
            wrap,
        }]),
        2 if orders.len() == lengths.len() => orders
            .into_iter()
            .map(|order| {
                let basis = of_order(order)?;
                Ok(Shape { basis, wrap })
            })
            .collect(),
        2 => {
            let (n, curves) = (orders.len(), lengths.len());
            let key = "number of orders of curves";
            Err(refuse(path, key, n, &curves.to_string()))
        }
        _ => Err(refuse(path, "type of curves", kind, "0, 1 or 2")),
    }
}

/// What `key` of the object called `path` must be.
pub(super) fn refuse(path: &str, key: &str, value: impl std::fmt::Display, range: &str) -> Error {
    Error::value(format!("{path}: {key}"), value, range)
}

/// `linear`, or `bspline, periodic`.
pub(super) fn describe(object: &CurvesObject<'_>, shapes: &[Shape]) -> String {
    let Some(Shape { basis, wrap }) = shapes.first() else {
        return String::new();
    };
    let same = shapes.iter().all(|other| other.basis == *basis);
    let mut text = if same { basis.name() } else { "mixed" }.to_owned();
    if *wrap == Wrap::Periodic {
        text += ", periodic";
    }
    let knots = object.geom.get(".knots");
    if *basis != CurveBasis::Linear && knots.is_some_and(|knots| knots.n_samples > 0) {
        text += ", knots";
    }
    text
}

/// Do periodic curves repeat the points that they start with, as Maya writes them? Then their
/// segments close them without any wrap.
pub(super) fn is_closed_already(
    shapes: &[Shape],
    lengths: &[u32],
    position: impl Fn(usize) -> [f64; 3],
) -> bool {
    if shapes.is_empty() || shapes.iter().any(|shape| shape.wrap != Wrap::Periodic) {
        return false;
    }
    let mut first = 0;
    (0..lengths.len()).all(|curve| {
        let (start, n) = (first, lengths[curve] as usize);
        first += n;
        let repeated = match shapes[if shapes.len() == 1 { 0 } else { curve }].basis {
            CurveBasis::Linear | CurveBasis::Bezier => 1,
            CurveBasis::BSpline | CurveBasis::CatmullRom => 3,
        };
        if n < 2 * repeated + 1 {
            return false;
        }
        let from = |ix: usize| (start..start + n).map(position_axis(&position, ix));
        let extent = (0..3).map(|axis| {
            let least = from(axis).fold(f64::INFINITY, f64::min);
            from(axis).fold(f64::NEG_INFINITY, f64::max) - least
        });
        let near = 1e-5 * extent.fold(0.0, f64::max);
        (0..repeated).all(|ix| {
            let [a, b] = [start + ix, start + n - repeated + ix].map(&position);
            (0..3).all(|axis| (a[axis] - b[axis]).abs() <= near)
        })
    })
}

/// Coordinate `axis` of points.
fn position_axis(position: &impl Fn(usize) -> [f64; 3], axis: usize) -> impl Fn(usize) -> f64 {
    move |cv| position(cv)[axis]
}
