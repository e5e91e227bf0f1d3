//! Things beside the hair that stand in the light and in the view.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Most of them in a scene.
pub const MAX_PROXIES: usize = 8;

/// One `[[proxy]]`: opaque, matte, and lit by the lights with the hair's shadow on it. Ranges are
/// those of [`params::ELLIPSOID`](crate::params::ELLIPSOID), [`params::GROUND`](crate::params::GROUND)
/// and [`params::MESH`](crate::params::MESH).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ProxySection {
    /// A head, about.
    Ellipsoid {
        /// Its centre, cm.
        centre: [f64; 3],
        /// Half axes along x, y and z, cm.
        radii: [f64; 3],
        /// Turns it about the x axis through its centre; above 0 its top leans towards +Z.
        #[serde(default)]
        tilt_deg: f64,
        /// Share of light that it sends back, linear RGB.
        #[serde(default = "default_albedo")]
        albedo: [f64; 3],
    },
    /// A plane that goes on for ever, lit from above.
    Ground {
        /// Its height y, cm.
        height: f64,
        /// Share of light that it sends back, linear RGB.
        #[serde(default = "default_albedo")]
        albedo: [f64; 3],
    },
    /// A head as modelled.
    Mesh {
        /// A `.mesh` file.
        mesh: PathBuf,
        /// How far it is moved, cm.
        #[serde(default)]
        offset: [f64; 3],
        /// Share of light that it sends back, linear RGB.
        #[serde(default = "default_albedo")]
        albedo: [f64; 3],
    },
}

impl ProxySection {
    /// A head about `centre`, with the defaults of the rest.
    pub fn ellipsoid(centre: [f64; 3], radii: [f64; 3]) -> Self {
        ProxySection::Ellipsoid {
            centre,
            radii,
            tilt_deg: 0.0,
            albedo: default_albedo(),
        }
    }

    /// A ground at `height`, with the defaults of the rest.
    pub fn ground(height: f64) -> Self {
        ProxySection::Ground {
            height,
            albedo: default_albedo(),
        }
    }

    /// The mesh of a file, with the defaults of the rest.
    pub fn mesh(file: impl Into<PathBuf>) -> Self {
        ProxySection::Mesh {
            mesh: file.into(),
            offset: [0.0; 3],
            albedo: default_albedo(),
        }
    }
}

/// Between skin and grey card.
const fn default_albedo() -> [f64; 3] {
    [0.35, 0.27, 0.22]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, Scene};

    #[test]
    fn proxies_are_read_and_written_as_they_are() {
        let scene = Scene::from_lines(
            "[[proxy]]\nkind = 'ellipsoid'\ncentre = [0, 1, 2]\nradii = [7.5, 11.5, 9.5]\n\
             [[proxy]]\nkind = 'ground'\nheight = -30\nalbedo = [0.1, 0.2, 0.3]\n\
             [[proxy]]\nkind = 'mesh'\nmesh = 'a/head.mesh'\n",
        )
        .unwrap();
        let expected = [
            ProxySection::Ellipsoid {
                centre: [0.0, 1.0, 2.0],
                radii: [7.5, 11.5, 9.5],
                tilt_deg: 0.0,
                albedo: default_albedo(),
            },
            ProxySection::Ground {
                height: -30.0,
                albedo: [0.1, 0.2, 0.3],
            },
            ProxySection::mesh("a/head.mesh"),
        ];
        assert_eq!(scene.proxies, expected);
        assert_eq!(scene.mesh_paths(), [(2, "a/head.mesh".into())]);
        let text = scene.to_toml_string().unwrap();
        assert_eq!(Scene::from_toml(&text).unwrap(), scene);
        // Scenes without any say nothing of them.
        assert!(
            !Scene::new("a", "b")
                .to_toml_string()
                .unwrap()
                .contains("proxy")
        );
    }

    #[test]
    fn values_out_of_range_are_named() {
        let ground = "[[proxy]]\nkind = 'ground'\nheight = 0\n";
        for (text, key) in [
            (
                "[[proxy]]\nkind = 'ground'\nheight = nan\n",
                "proxy[0].height",
            ),
            (
                "[[proxy]]\nkind = 'ground'\nheight = 0\nalbedo = [0, 0, 1.1]\n",
                "proxy[0].albedo",
            ),
            (
                "[[proxy]]\nkind = 'ellipsoid'\ncentre = [0, 0, 0]\nradii = [1, 0, 1]\n",
                "proxy[0].radii",
            ),
            (&ground.repeat(9), "proxy"),
            ("[[proxy]]\nkind = 'mesh'\nmesh = ''\n", "proxy[0].mesh"),
            (
                "[[proxy]]\nkind = 'mesh'\nmesh = 'a'\noffset = [0, 0, inf]\n",
                "proxy[0].offset",
            ),
        ] {
            let error = Scene::from_lines(text).unwrap_err().to_string();
            assert!(error.contains(key), "{text}: {error}");
        }
        for text in [
            "[[proxy]]\nkind = 'cube'\n",
            "[[proxy]]\nkind = 'ground'\n",
            "[[proxy]]\nkind = 'mesh'\n",
            "[[proxy]]\nkind = 'ground'\nheight = 0\nradii = [1, 1, 1]\n",
        ] {
            assert!(
                matches!(Scene::from_lines(text), Err(Error::Syntax { .. })),
                "{text}"
            );
        }
    }
}
