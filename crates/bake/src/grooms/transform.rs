//! Moving, turning and scaling a groom.

use glam::{DMat3, DVec3};
use strandlight_formats::{Groom, UpAxis};

use super::edit::{EditError, edited, scale_widths};
use super::roots::turn_strands;

/// What is done to every point, in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    /// Factor on positions and widths, 1e-6..=1e6.
    pub scale: f64,
    /// Turns about axes through the origin, one after another, by angles in degrees; counterclockwise
    /// seen from where the axis points to.
    pub rotations_deg: Vec<(UpAxis, f64)>,
    /// Added at last, cm.
    pub translation: [f64; 3],
    /// Strands run the other way: the first point becomes the tip.
    pub flip_root: bool,
}

impl Default for Transform {
    fn default() -> Self {
        Transform {
            scale: 1.0,
            rotations_deg: Vec::new(),
            translation: [0.0; 3],
            flip_root: false,
        }
    }
}

impl Transform {
    /// The groom so moved; widths are scaled with it, other attributes stay.
    ///
    /// # Errors
    /// Numbers out of range; points that leave the range of a groom, a kilometre.
    pub fn apply(&self, groom: &Groom) -> Result<Groom, EditError> {
        if !(1e-6..=1e6).contains(&self.scale) {
            return Err(EditError::range("scale", self.scale, "in 1e-6..=1e6"));
        }
        let mut turn = DMat3::IDENTITY;
        for &(axis, degrees) in &self.rotations_deg {
            if !(-36_000.0..=36_000.0).contains(&degrees) {
                return Err(EditError::range("angle", degrees, "in -36000..=36000"));
            }
            turn = rotation(axis, degrees) * turn;
        }
        let mut moved = groom.clone();
        for point in &mut moved.points {
            let at = DVec3::from_array(point.map(f64::from)) * self.scale;
            let at = turn * at + DVec3::from_array(self.translation);
            *point = at.as_vec3().to_array();
        }
        if self.scale != 1.0 {
            scale_widths(&mut moved, self.scale);
        }
        if self.flip_root {
            let all: Vec<usize> = (0..moved.n_strands()).collect();
            turn_strands(&mut moved, &all)?;
        }
        moved.source = edited(&groom.source, self.text());
        moved.validate()?;
        Ok(moved)
    }

    /// As the command line has it.
    fn text(&self) -> String {
        let mut text = "transform".to_owned();
        if self.scale != 1.0 {
            text += &format!(" --scale {}", self.scale);
        }
        for (axis, degrees) in &self.rotations_deg {
            text += &format!(" --rotate {} {degrees}", axis.name());
        }
        if self.translation != [0.0; 3] {
            let [x, y, z] = self.translation;
            text += &format!(" --translate {x},{y},{z}");
        }
        if self.flip_root {
            text += " --flip-root";
        }
        text
    }
}

/// A rotation; of a multiple of 90 degrees without rounding.
fn rotation(axis: UpAxis, degrees: f64) -> DMat3 {
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    };
    let columns = match axis {
        UpAxis::X => [[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]],
        UpAxis::Y => [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]],
        UpAxis::Z => [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]],
    };
    DMat3::from_cols_array_2d(&columns)
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head};
    use super::*;
    use strandlight_formats::Domain;

    fn groom() -> Groom {
        Groom {
            points: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
            strand_offsets: vec![0, 2],
            attributes: vec![attribute("diameter", Domain::Point, 1, vec![0.01, 0.02])],
            ..Groom::default()
        }
    }

    #[test]
    fn points_go_where_they_should() {
        let turned = |rotations_deg: &[(UpAxis, f64)]| {
            let transform = Transform {
                rotations_deg: rotations_deg.to_vec(),
                ..Transform::default()
            };
            transform.apply(&groom()).unwrap().points[0]
        };
        assert_eq!(turned(&[(UpAxis::X, 90.0)]), [1.0, -3.0, 2.0]);
        assert_eq!(turned(&[(UpAxis::Y, 90.0)]), [3.0, 2.0, -1.0]);
        assert_eq!(turned(&[(UpAxis::Z, -270.0)]), [-2.0, 1.0, 3.0]);
        // One after another.
        let both = turned(&[(UpAxis::X, 90.0), (UpAxis::Z, 180.0)]);
        assert_eq!(both, [-1.0, 3.0, 2.0]);
        let slight = turned(&[(UpAxis::Y, 30.0)]);
        let (sin, cos) = 30f32.to_radians().sin_cos();
        assert!((slight[0] - (cos + 3.0 * sin)).abs() < 1e-6);

        let moved = Transform {
            scale: 2.0,
            translation: [0.5, 0.0, -1.0],
            flip_root: true,
            ..Transform::default()
        };
        let moved = moved.apply(&groom()).unwrap();
        assert_eq!(moved.points, [[8.5, 10.0, 11.0], [2.5, 4.0, 5.0]]);
        assert_eq!(moved.attributes[0].data, [0.04, 0.02]);
        let (name, edit) = moved.source.parameters.last().unwrap();
        assert_eq!(name, "edit");
        assert_eq!(edit, "transform --scale 2 --translate 0.5,0,-1 --flip-root");
    }

    #[test]
    fn there_and_back_is_where_it_was() {
        let groom = head(50);
        let there = Transform {
            scale: 4.0,
            rotations_deg: vec![(UpAxis::X, 90.0)],
            ..Transform::default()
        };
        let back = Transform {
            scale: 0.25,
            rotations_deg: vec![(UpAxis::X, -90.0)],
            ..Transform::default()
        };
        let found = back.apply(&there.apply(&groom).unwrap()).unwrap();
        assert_eq!(found.points, groom.points);
    }

    #[test]
    fn what_leaves_the_range_is_refused() {
        let bad = |transform: Transform| transform.apply(&groom()).unwrap_err().to_string();
        for scale in [0.0, -1.0, f64::NAN, 1e7] {
            let error = bad(Transform {
                scale,
                ..Transform::default()
            });
            assert!(error.contains("scale"), "{error}");
        }
        let far = Transform {
            translation: [1e6, 0.0, 0.0],
            ..Transform::default()
        };
        assert!(bad(far).contains("strand 0"));
        let nan = Transform {
            rotations_deg: vec![(UpAxis::X, f64::NAN)],
            ..Transform::default()
        };
        assert!(bad(nan).contains("angle"));
    }
}
