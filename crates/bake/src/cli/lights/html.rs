//! The report as a page: one HTML file that needs no network and no script. It is well-formed XML too,
//! so that other programs can take it apart.

mod curve;
mod sphere;
mod text;

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use strandlight_bake::lights::exchange::{FRAME, sharpness};
use strandlight_bake::lights::{Metric, Pictures};
use strandlight_bake::markup::escaped;
use strandlight_formats::{SrbfLight, counted};
use strandlight_images::Map;
use strandlight_scattering::spherical_gaussian::solid_angle;

use super::results::{BudgetResult, Results};
use text::{degrees, number, percent};

/// Lights whose table is not folded away.
const FEW_LIGHTS: usize = 12;

/// What a page is made of.
pub struct Page<'a> {
    pub results: &'a Results,
    pub map: &'a Map,
    /// The map's path as given.
    pub map_name: &'a str,
    /// The command that makes the same again.
    pub command: &'a str,
    pub pictures: &'a Pictures,
    /// A remark for each thing that is not exactly as in the map's file.
    pub remarks: &'a [String],
}

impl Page<'_> {
    /// The whole file.
    pub fn html(&self) -> String {
        let name = escaped(self.map_name.rsplit(['/', '\\']).next().unwrap_or_default());
        let sections = [
            self.summary(),
            self.pictures(),
            self.curve(),
            self.energy(),
            self.lights(),
            self.input(),
            self.repeat(),
        ];
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n\
             <meta charset=\"utf-8\" />\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n\
             <meta name=\"color-scheme\" content=\"light dark\" />\n\
             <title>{name}: light set</title>\n<style>\n{}</style>\n</head>\n<body>\n\
             <h1>Light set of {name}</h1>\n{}</body>\n</html>\n",
            include_str!("html/page.css"),
            sections.concat()
        )
    }

    fn summary(&self) -> String {
        let results = self.results;
        let set = &results.set;
        let mut out = String::new();
        if let Some(budget) = &results.budget {
            out += &self.verdict(budget);
        }
        let mut rows = vec![(
            "Lights".to_owned(),
            set.lights.len().to_string(),
            match (results.compact_lights, &results.residual) {
                (_, Some(_)) => {
                    "the compact sources of the map; what is left of it is the residual map, and \
                     the errors are those of both together"
                        .to_owned()
                }
                (0, None) => {
                    "spherical Gaussians; no compact source such as a sun was found".to_owned()
                }
                (1, None) => {
                    "spherical Gaussians, one of them a compact source such as a sun".to_owned()
                }
                (n, None) => {
                    format!(
                        "spherical Gaussians, {n} of them compact sources such as a sun or lamps"
                    )
                }
            },
        )];
        if let Some(report) = results.report {
            let row = |name: &str, value: f64, what: &str| {
                (name.to_owned(), percent(value), what.to_owned())
            };
            rows.push(row(
                "Fibre error",
                report.fibre_error,
                "of the light that hair fibres scatter, relative RMSE over fibres and views: what a viewer would see",
            ));
            if let Some(hair) = &results.hair {
                let what = format!("the same for the hair {}", escaped(&hair.name));
                rows.push((
                    "Fibre error of the hair".to_owned(),
                    percent(hair.fibre_error),
                    what,
                ));
            }
            rows.push(row(
                "Irradiance error",
                report.irradiance_error,
                "of the irradiance, relative RMSE over directions: what matt surfaces would see",
            ));
            rows.push(row(
                "Radiance difference",
                report.rel_l2,
                "L2 norm over the sphere; large wherever the map has detail that hair cannot resolve",
            ));
        }
        out += "<table>\n";
        for (name, value, what) in rows {
            let _ = writeln!(
                out,
                "<tr><th>{name}</th><td class=\"n\">{value}</td><td class=\"dim\">{what}</td></tr>"
            );
        }
        out + "</table>\n"
    }

    fn verdict(&self, budget: &BudgetResult) -> String {
        let hair = self.results.hair.as_ref();
        let hair = hair.filter(|_| budget.metric == Metric::Fibre);
        let of_hair = hair.map_or(String::new(), |hair| {
            format!(" for the hair {}", escaped(&hair.name))
        });
        let limit = format!(
            "a {} error of at most {}{of_hair}",
            budget.metric.name(),
            text::limit(budget.max_error)
        );
        let error = percent(budget.error);
        let n = self.results.set.lights.len();
        if !budget.is_met() {
            return format!(
                "<p class=\"verdict bad\">No set of up to {} has {limit}. The best of those \
                 fitted, shown here, has {error} with {}. No light set was written.</p>\n",
                lights(budget.max_count),
                lights(n)
            );
        }
        let count = self.results.set.info.requested_count as usize;
        let curve = self.results.curve.iter().flatten();
        let below = curve.rev().find(|point| point.count < count);
        let below = below.map_or(String::new(), |point| {
            let error = percent(budget.metric.of(point));
            format!(
                ", {} {} {error}",
                lights(point.count),
                if point.count == 1 { "has" } else { "have" }
            )
        });
        format!(
            "<p class=\"verdict good\">Smallest set found with {limit}: {} with {error}{below}.</p>\n",
            lights(n)
        )
    }

    fn pictures(&self) -> String {
        let [width, height] = self.pictures.size;
        let image = |png: &[u8], id: &str| {
            let data = BASE64.encode(png);
            format!(
                "<image id=\"{id}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{data}\" />"
            )
        };
        let figure = |title: &str, caption: &str, content: &str| {
            format!(
                "<figure>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\">{content}</svg>\n\
                 <figcaption><b>{title}.</b> {caption}</figcaption>\n</figure>\n"
            )
        };
        let grid = strandlight_images::LatLong { width, height };
        let axes = sphere::axes(grid);
        let discs = sphere::discs(&self.results.set.lights, &self.shares(), grid);
        let dimmed = format!(
            "<rect width=\"{width}\" height=\"{height}\" fill=\"#000\" /><use href=\"#map\" opacity=\"0.35\" />"
        );
        let caption = format!("Axes: {}.", escaped(FRAME));
        let (rebuilt, of_what) = match self.pictures.residual {
            None => ("Light set", "The map that the lights add up to."),
            Some(_) => ("Lights and residual", "The map that both add up to."),
        };
        let residual = self.pictures.residual.as_ref().map(|png| {
            let caption = "The map without its compact sources, which the lights replace.";
            figure("Residual", caption, &image(png, "residual"))
        });
        [
            "<h2>Pictures</h2>\n<p class=\"dim\">All at one exposure; the whole sphere, its top at the top.</p>\n<div class=\"grid\">\n".to_owned(),
            figure("Map", &caption, &(image(&self.pictures.map, "map") + &axes)),
            residual.unwrap_or_default(),
            figure(rebuilt, of_what, &image(&self.pictures.lights, "lights")),
            figure(
                "Difference",
                "Red: the set is brighter. Blue: the map is. Grey: equal. Fine detail is not meant to be kept.",
                &image(&self.pictures.difference, "difference"),
            ),
            figure(
                "Lights",
                "A dot for each light, its area the share of the map's energy; around it the circle where its \
                 radiance has fallen to 1/e. Hold the pointer over a dot for its numbers.",
                &(dimmed + &discs),
            ),
            "</div>\n".to_owned(),
        ]
        .concat()
    }

    fn curve(&self) -> String {
        let results = self.results;
        if results.residual.is_some() {
            return String::new();
        }
        let Some(points) = &results.curve else {
            return "<h2>Error against number of lights</h2>\n<p class=\"dim\">Not measured: <code>--curve</code> \
                    fits other numbers of lights too, <code>--max-error</code> finds the smallest that suffices.</p>\n"
                .to_owned();
        };
        let count = results.set.info.requested_count as usize;
        let limit = results.budget.as_ref();
        let limit = limit.map(|budget| (budget.max_error, budget.metric.name()));
        let hair = results.hair.as_ref().map_or(String::new(), |hair| {
            format!(
                " Fibre errors are those of the hair {}.",
                escaped(&hair.name)
            )
        });
        let mut rows = String::new();
        for point in points {
            let class = if point.count == count {
                " class=\"chosen\""
            } else {
                ""
            };
            let _ = writeln!(
                rows,
                "<tr{class}><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
                point.count,
                point.compact_lights,
                percent(point.fibre_error),
                percent(point.irradiance_error)
            );
        }
        format!(
            "<h2>Error against number of lights</h2>\n<figure class=\"wide\">\n{}\n<figcaption>Every number of lights \
             that was fitted; the ring is the set of this report.{hair}</figcaption>\n</figure>\n<details>\n\
             <summary>The numbers</summary>\n<table>\n<tr><th>Lights</th><th>Compact</th><th>Fibre error</th>\
             <th>Irradiance error</th></tr>\n{rows}</table>\n</details>\n",
            curve::svg(points, count, limit)
        )
    }

    fn energy(&self) -> String {
        let energy = self.map.energy();
        let residual = self.results.residual.as_ref();
        let mut rows = String::new();
        for (c, name) in ["Red", "Green", "Blue"].into_iter().enumerate() {
            let lights = self.results.set.lights.iter();
            let of_set: f64 = lights.map(|light| energies(light)[c]).sum();
            let rest = residual.map_or(0.0, |residual| residual.energy_share[c] * energy[c]);
            let ratio = match energy[c] > 0.0 {
                true => format!("{:.5}", (of_set + rest) / energy[c]),
                false => "none in the map".to_owned(),
            };
            let other = match residual {
                Some(_) => number(rest),
                None => format!("{:.4}", self.results.energy_scale[c]),
            };
            let _ = writeln!(
                rows,
                "<tr><th>{name}</th><td class=\"n\">{}</td><td class=\"n\">{}</td>\
                 <td class=\"n\">{other}</td><td class=\"n\">{ratio}</td></tr>",
                number(energy[c]),
                number(of_set),
            );
        }
        let (other, ratio, what) = match residual {
            Some(_) => ("Residual", "Both / map", ""),
            None => (
                "Factor",
                "Lights / map",
                " Factor: what the lights that are not compact were multiplied with after the fit, \
                 to match the map.",
            ),
        };
        format!(
            "<h2>Energy</h2>\n<table>\n<tr><th>Channel</th><th>Map</th><th>Lights</th>\
             <th>{other}</th><th>{ratio}</th></tr>\n{rows}</table>\n\
             <p class=\"dim\">Radiance times solid angle, over the sphere; linear Rec.709.{what}</p>\n"
        )
    }

    /// Shares of the map's energy, all channels.
    fn shares(&self) -> Vec<f64> {
        let total: f64 = self.map.energy().iter().sum();
        let share = |light: &SrbfLight| energies(light).iter().sum::<f64>() / total;
        self.results.set.lights.iter().map(share).collect()
    }

    fn lights(&self) -> String {
        let set = &self.results.set;
        let mut rows = String::new();
        for (ix, (light, share)) in set.lights.iter().zip(self.shares()).enumerate() {
            let [x, y, z] = light.direction.map(f64::from);
            let [r, g, b] = light.rgb.map(|x| number(f64::from(x)));
            let width = match sphere::radius(light.lambda) {
                Some(radius) => degrees(radius),
                None => "everywhere".to_owned(),
            };
            let _ = writeln!(
                rows,
                "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{x:.4} {y:.4} {z:.4}</td>\
                 <td class=\"n\">{width}</td><td class=\"n\">{}</td><td class=\"n\">{r} {g} {b}</td></tr>",
                ix + 1,
                percent(share),
                degrees(y.clamp(-1.0, 1.0).asin()),
                number(sharpness(light.lambda)),
            );
        }
        let open = if set.lights.len() <= FEW_LIGHTS {
            " open=\"open\""
        } else {
            ""
        };
        format!(
            "<h2>Lights</h2>\n<details{open}>\n<summary>All {}</summary>\n<div class=\"scroll\">\n<table>\n<tr><th>#</th><th>Share</th>\
             <th>Elevation</th><th>Direction x y z</th><th>Radius at 1/e</th><th>Sharpness</th><th>Radiance r g b</th></tr>\n\
             {rows}</table>\n</div>\n</details>\n",
            lights(set.lights.len())
        )
    }

    fn input(&self) -> String {
        let source = self.map.source();
        let faults = self.map.faults();
        let mut rows = vec![
            ("File", escaped(self.map_name)),
            ("Format", escaped(&source.format)),
            (
                "Size",
                format!("{} x {} pixels", self.map.width(), self.map.height()),
            ),
            ("Hash", escaped(&source.hash)),
        ];
        if faults.is_clean() {
            rows.push((
                "Clamped",
                "nothing: every sample is finite and not negative".to_owned(),
            ));
        }
        for remark in self.remarks {
            rows.push(("Note", escaped(remark)));
        }
        let mut out = "<h2>Map</h2>\n<table>\n".to_owned();
        for (name, value) in rows {
            let _ = writeln!(out, "<tr><th>{name}</th><td>{value}</td></tr>");
        }
        out + "</table>\n"
    }

    fn repeat(&self) -> String {
        format!(
            "<h2>Repeat</h2>\n<pre>{}</pre>\n<p class=\"dim\">{}. The same map and command give the same files, on any \
             number of threads.</p>\n",
            escaped(self.command),
            escaped(&self.results.set.info.tool_version)
        )
    }
}

fn lights(n: usize) -> String {
    counted(n, "light", "lights")
}

/// Energy of a light over the sphere, by channel.
fn energies(light: &SrbfLight) -> [f64; 3] {
    let solid_angle = solid_angle(f64::from(light.lambda));
    light.rgb.map(|x| f64::from(x) * solid_angle)
}
