//! Paint as attributes of a groom.

use strandlight_formats::{
    Attribute, DYE, Domain, Error, Groom, PAINT_ATTRIBUTES, SHIFT_SCALE, WIDTH_SCALE,
};

use super::{Paint, PaintedPoint};

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

    /// Hands each point its values of the attribute called `name`, if there is one.
    fn read(&mut self, groom: &Groom, name: &str, set: impl Fn(&mut PaintedPoint, &[f32])) {
        let Some(attribute) = groom.attribute(name) else {
            return;
        };
        let values = attribute.data.chunks_exact(attribute.components as usize);
        match attribute.domain {
            Domain::Point => {
                for (point, value) in self.points.iter_mut().zip(values) {
                    set(point, value);
                }
            }
            Domain::Strand => {
                for (strand, value) in values.enumerate() {
                    for point in &mut self.points[groom.strand(strand)] {
                        set(point, value);
                    }
                }
            }
            Domain::Groom => {
                for value in values.take(1) {
                    for point in &mut self.points {
                        set(point, value);
                    }
                }
            }
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
            let place = groom.attributes.iter().position(|a| a.name == name);
            let attribute = Attribute {
                name: name.to_owned(),
                domain: Domain::Point,
                components,
                data,
            };
            match (place, is_needed) {
                (Some(ix), true) => groom.attributes[ix] = attribute,
                (Some(ix), false) => drop(groom.attributes.remove(ix)),
                (None, true) => groom.attributes.push(attribute),
                (None, false) => {}
            }
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

#[cfg(test)]
mod tests {
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
}
