//! Paint as attributes of a groom.

use strandlight_formats::{
    Attribute, DYE, Domain, Error, Groom, MASK, PAINT_ATTRIBUTES, SHIFT_SCALE, WIDTH_SCALE,
};

use super::{Paint, PaintedPoint, PointMask};

impl Paint {
    /// The paint of `groom`, whose attributes may be of any domain; [`None`] if it has none.
    ///
    /// # Errors
    /// As [`Groom::validate`]: an attribute of another shape than it should have, or the first
    /// value outside its range.
    pub fn from_groom(groom: &Groom) -> Result<Option<Paint>, Error> {
        let has = |(name, _): &(&str, u32)| groom.attribute(name).is_some();
        if !PAINT_ATTRIBUTES.iter().any(has) {
            return Ok(None);
        }
        groom.validate()?;
        let mut paint = Paint::unpainted(groom.points.len());
        paint.read(groom, DYE, |point, dye| {
            if let [r, g, b, weight] = *dye {
                (point.sigma_a, point.weight) = ([r, g, b], weight);
            }
        });
        paint.read(groom, WIDTH_SCALE, |point, scale| {
            point.width_scale = scale[0];
        });
        paint.read(groom, SHIFT_SCALE, |point, scale| {
            point.shift_scale = scale[0];
        });
        Ok(Some(paint))
    }

    fn read(&mut self, groom: &Groom, name: &str, set: impl Fn(&mut PaintedPoint, &[f32])) {
        if let Some(attribute) = groom.attribute(name) {
            for_each_point(groom, attribute, &mut self.points, set);
        }
    }

    /// Writes the paint into the attributes of `groom`, in place of what paint it had. An
    /// attribute that would say nothing is left out, so a groom without paint is as it was.
    /// The paint must have an entry for each point of the groom, or it is not written.
    pub fn write_to(&self, groom: &mut Groom) {
        if self.points.len() != groom.points.len() {
            return;
        }
        let mut set = |name: &str, components: u32, is_needed: bool, data: Vec<f32>| {
            set_attribute(groom, name, components, is_needed.then_some(data));
        };
        let points = &self.points;
        let dyed = |point: &PaintedPoint| {
            let [r, g, b] = point.sigma_a;
            [r, g, b, point.weight]
        };
        let is_dyed = points.iter().any(|point| point.weight > 0.0);
        set(DYE, 4, is_dyed, points.iter().flat_map(dyed).collect());
        let widths: Vec<f32> = points.iter().map(|point| point.width_scale).collect();
        set(WIDTH_SCALE, 1, widths.iter().any(|&x| x != 1.0), widths);
        let shifts: Vec<f32> = points.iter().map(|point| point.shift_scale).collect();
        set(SHIFT_SCALE, 1, shifts.iter().any(|&x| x != 1.0), shifts);
    }
}

impl PointMask {
    /// The mask of `groom`, whose attribute may be of any domain; [`None`] if it has none. An attribute of that name
    /// with more components or with values outside 0..=1 is another program's, and no mask.
    pub fn from_groom(groom: &Groom) -> Option<PointMask> {
        let attribute = groom.attribute(MASK).filter(|mask| is_mask(mask))?;
        let mut mask = PointMask::none(groom.points.len());
        for_each_point(groom, attribute, &mut mask.points, |point, mask| {
            *point = mask[0];
        });
        Some(mask)
    }

    /// Writes the mask into the attribute of `groom` in place of what is called so there. A mask that protects nothing is
    /// left out, and only one like it is taken away. The mask must have an entry for each point of the groom, or it
    /// is not written.
    pub fn write_to(&self, groom: &mut Groom) {
        if self.points.len() != groom.points.len() {
            return;
        }
        if self.is_protecting() {
            set_attribute(groom, MASK, 1, Some(self.points.clone()));
        } else if groom.attribute(MASK).is_some_and(is_mask) {
            set_attribute(groom, MASK, 1, None);
        }
    }
}

/// The name is a common one, so its bearer need not be ours.
fn is_mask(attribute: &Attribute) -> bool {
    let is_share = |value: &f32| (0.0..=1.0).contains(value);
    attribute.components == 1 && attribute.data.iter().all(is_share)
}

/// Hands each of `points`, those of `groom`, its values of `attribute`.
fn for_each_point<T>(
    groom: &Groom,
    attribute: &Attribute,
    points: &mut [T],
    set: impl Fn(&mut T, &[f32]),
) {
    let values = attribute
        .data
        .chunks_exact(attribute.components.max(1) as usize);
    match attribute.domain {
        Domain::Point => {
            for (point, value) in points.iter_mut().zip(values) {
                set(point, value);
            }
        }
        Domain::Strand => {
            for (strand, value) in values.enumerate() {
                for point in &mut points[groom.strand(strand)] {
                    set(point, value);
                }
            }
        }
        Domain::Groom => {
            for value in values.take(1) {
                for point in &mut *points {
                    set(point, value);
                }
            }
        }
    }
}

/// Puts an attribute of points into `groom`, in place of one of that name, or takes that away.
fn set_attribute(groom: &mut Groom, name: &str, components: u32, data: Option<Vec<f32>>) {
    let place = groom.attributes.iter().position(|a| a.name == name);
    let attribute = data.map(|data| Attribute {
        name: name.to_owned(),
        domain: Domain::Point,
        components,
        data,
    });
    match (place, attribute) {
        (Some(ix), Some(attribute)) => groom.attributes[ix] = attribute,
        (Some(ix), None) => drop(groom.attributes.remove(ix)),
        (None, Some(attribute)) => groom.attributes.push(attribute),
        (None, None) => {}
    }
}

#[cfg(test)]
mod tests {
    use strandlight_formats::BakedFile;

    use super::*;

    fn groom() -> Groom {
        Groom {
            points: (0..5).map(|ix| [0.0, ix as f32, 0.0]).collect(),
            strand_offsets: vec![0, 3, 5],
            ..Groom::default()
        }
    }

    #[test]
    fn paint_comes_back_and_goes() {
        let mut painted = groom();
        assert_eq!(Paint::from_groom(&painted).unwrap(), None);
        let mut paint = Paint::unpainted(5);
        paint.points[3] = PaintedPoint {
            sigma_a: [0.1, 0.2, 0.3],
            weight: 0.5,
            width_scale: 2.0,
            shift_scale: 1.0,
            ..PaintedPoint::NONE
        };
        paint.write_to(&mut painted);
        let names: Vec<_> = painted.attributes.iter().map(|a| &a.name[..]).collect();
        assert_eq!(names, [DYE, WIDTH_SCALE]);
        assert_eq!(Paint::from_groom(&painted).unwrap(), Some(paint));
        Paint::unpainted(5).write_to(&mut painted);
        assert_eq!(painted, groom());
    }

    #[test]
    fn any_domain_is_read_and_wrong_shapes_are_named() {
        let mut painted = groom();
        let attribute = |name: &str, domain, components, data: &[f32]| Attribute {
            name: name.to_owned(),
            domain,
            components,
            data: data.to_vec(),
        };
        painted.attributes = vec![
            attribute(DYE, Domain::Groom, 4, &[1.0, 2.0, 3.0, 0.5]),
            attribute(WIDTH_SCALE, Domain::Strand, 1, &[2.0, 3.0]),
        ];
        let paint = Paint::from_groom(&painted).unwrap().unwrap();
        assert!(paint.points.iter().all(|point| point.weight == 0.5));
        let widths: Vec<f32> = paint.points.iter().map(|point| point.width_scale).collect();
        assert_eq!(widths, [2.0, 2.0, 2.0, 3.0, 3.0]);
        painted.attributes[0] = attribute(DYE, Domain::Groom, 3, &[1.0, 2.0, 3.0]);
        let error = Paint::from_groom(&painted).unwrap_err();
        assert!(error.to_string().contains("dye"), "{error}");
    }

    #[test]
    fn masks_come_back_and_are_no_paint() {
        let mut masked = groom();
        assert_eq!(PointMask::from_groom(&masked), None);
        let mut mask = PointMask::none(5);
        mask.points[2] = 0.25;
        mask.points[4] = 1.0;
        mask.write_to(&mut masked);
        masked.validate().unwrap();
        let bytes = masked.to_bytes().unwrap();
        let again = Groom::from_bytes(&bytes).unwrap();
        assert_eq!(PointMask::from_groom(&again), Some(mask.clone()));
        assert_eq!(
            Paint::from_groom(&again).unwrap(),
            None,
            "hair that is masked alone is shaded as bare hair"
        );
        // Paint goes its own way.
        Paint::unpainted(5).write_to(&mut masked);
        assert_eq!(PointMask::from_groom(&masked), Some(mask));
        PointMask::none(5).write_to(&mut masked);
        assert_eq!(masked, groom());
        PointMask::none(4).write_to(&mut masked);
        assert_eq!(masked, groom());
    }

    #[test]
    fn masks_of_others_are_left_alone() {
        let attribute = |components, data: &[f32]| Attribute {
            name: MASK.to_owned(),
            domain: Domain::Strand,
            components,
            data: data.to_vec(),
        };
        let with = |attribute| Groom {
            attributes: vec![attribute],
            ..groom()
        };
        let by_strand = with(attribute(1, &[0.0, 1.0]));
        let found = PointMask::from_groom(&by_strand).unwrap();
        assert_eq!(found.points, [0.0, 0.0, 0.0, 1.0, 1.0]);
        for other in [attribute(2, &[0.0; 4]), attribute(1, &[0.5, 7.0])] {
            let mut groom = with(other);
            groom.validate().unwrap();
            assert_eq!(PointMask::from_groom(&groom), None);
            PointMask::none(5).write_to(&mut groom);
            assert_eq!(groom.attributes.len(), 1);
            found.write_to(&mut groom);
            assert_eq!(PointMask::from_groom(&groom).as_ref(), Some(&found));
        }
    }
}
