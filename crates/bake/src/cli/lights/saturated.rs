//! Pixels of a map that are bright in one channel alone.

use std::f64::consts::PI;

use serde_json::{Value, json};
use strandlight_images::Map;

/// Names of the channels.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// The channel is more than so many times each of the others,
const RATIO: f32 = 100.0;

/// and so many times its mean over the map.
const BRIGHT: f64 = 30.0;

/// All such pixels have at least this share of the channel's light,
const LEAST_SHARE: f64 = 0.01;

/// and cover this share of the sphere at most, some three degrees about one of them: else they are a lamp.
const MOST_AREA: f64 = 7e-4;

/// Pixels with light of one channel and next to none of the others'.
#[derive(Clone, Copy, Default)]
pub struct Saturated {
    channel: usize,
    count: usize,
    /// Share of the channel's light.
    share: f64,
    /// Share of the sphere.
    area: f64,
    /// Radiance of the brightest, and where it is.
    most: f32,
    at: [usize; 2],
}

/// By channel, the few pixels that hold much of its light and next to none of the others'. Lossy
/// compression leaves such where a sun was, and a light set has a sun of that colour then.
pub fn saturated(map: &Map) -> Vec<Saturated> {
    let (energy, grid) = (map.energy(), map.grid());
    let mut found = [0, 1, 2].map(|channel| Saturated {
        channel,
        ..Saturated::default()
    });
    for j in 0..grid.height {
        let solid_angle = grid.solid_angle(j);
        for (i, rgb) in map.row(j).iter().enumerate() {
            for (channel, found) in found.iter_mut().enumerate() {
                let others = [1, 2].map(|step: usize| rgb[(channel + step) % 3]);
                let is_alone = others.iter().all(|other| rgb[channel] > RATIO * other);
                let radiance = f64::from(rgb[channel]);
                if !is_alone || radiance < BRIGHT * energy[channel] / (4.0 * PI) {
                    continue;
                }
                found.count += 1;
                found.share += radiance * solid_angle / energy[channel];
                found.area += solid_angle / (4.0 * PI);
                if rgb[channel] > found.most {
                    (found.most, found.at) = (rgb[channel], [i, j]);
                }
            }
        }
    }
    let is_few = |found: &Saturated| found.share >= LEAST_SHARE && found.area <= MOST_AREA;
    found.into_iter().filter(is_few).collect()
}

/// Says of [`saturated`] pixels where they are.
pub fn remark(map: &Map) -> Option<String> {
    let texts: Vec<String> = saturated(map).iter().map(Saturated::text).collect();
    (!texts.is_empty()).then(|| texts.join("; "))
}

impl Saturated {
    fn text(&self) -> String {
        let ([x, y], name) = (self.at, CHANNELS[self.channel]);
        let pixels = match self.count {
            1 => format!("pixel {x}, {y} has"),
            n => format!("{n} pixels, the brightest at {x}, {y}, have"),
        };
        let (percent, most) = (100.0 * self.share, self.most);
        format!(
            "{pixels} {percent:.0} % of the map's {name} and next to nothing else (up to {most}): if the file is \
             damaged there, the lights are too {name}"
        )
    }

    /// The same as an entry of a report.
    pub fn to_json(self) -> Value {
        json!({
            "channel": CHANNELS[self.channel],
            "count": self.count,
            "share": self.share,
            "brightest": self.at,
            "radiance": self.most,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even map of 256 x 128 pixels with `spots` in it, each pixel cut into `finer` times as many across and down.
    fn map_of(spots: &[([usize; 2], [f32; 3])], finer: usize) -> Map {
        let mut pixels = vec![[1.0; 3]; 256 * 128];
        for ([x, y], rgb) in spots {
            pixels[x + 256 * y] = *rgb;
        }
        let map = Map::new(256, 128, pixels).expect("a map");
        map.subdivided(256 * finer).into_owned()
    }

    fn remark_of(spots: &[([usize; 2], [f32; 3])], finer: usize) -> Option<String> {
        remark(&map_of(spots, finer))
    }

    #[test]
    fn bright_pixels_of_one_channel_alone_are_told() {
        let spots = [([30, 64], [0.0, 0.0, 600.0]), ([31, 64], [0.1, 0.2, 900.0])];
        let said = remark_of(&spots, 1).expect("two spots");
        for part in [
            "2 pixels, the brightest at 31, 64, have",
            "7 % of the map's blue",
            "up to 900",
        ] {
            assert!(said.contains(part), "{said}");
        }
        // As much of the same map in more pixels.
        let said = remark_of(&spots, 4).expect("two spots");
        assert!(
            said.contains("32 pixels") && said.contains("7 % of"),
            "{said}"
        );
        let entry = saturated(&map_of(&spots, 1))[0].to_json();
        assert_eq!(entry["channel"], "blue");
        assert_eq!(
            (&entry["count"], &entry["radiance"]),
            (&json!(2), &json!(900.0))
        );
        assert_eq!(entry["brightest"], json!([31, 64]));
        assert!(
            entry["share"]
                .as_f64()
                .is_some_and(|share| (0.065..0.075).contains(&share))
        );
        // Two channels.
        let spots = [spots[0], ([90, 20], [5e3, 0.0, 0.0])];
        let said = remark_of(&spots, 1).expect("two spots");
        assert!(said.contains("too red; pixel 30, 64 has 3 %"), "{said}");
    }

    #[test]
    fn suns_coloured_lamps_and_dark_maps_are_not() {
        let is_said = |rgb: [f32; 3]| remark_of(&[([30, 64], rgb)], 1).is_some();
        assert!(remark_of(&[], 1).is_none());
        // A sun, and a lamp that has a hundredth of its light in the other channels.
        assert!(!is_said([9e3, 1e4, 8e3]) && !is_said([1e3, 10.0, 10.0]));
        // Little of the light of its channel.
        assert!(!is_said([0.0, 0.0, 200.0]) && is_said([0.0, 0.0, 900.0]));
        // A lamp, and maps of one colour and of none.
        let lamp: Vec<_> = (20..60).map(|x| ([x, 64], [0.0, 0.0, 900.0])).collect();
        assert!(remark_of(&lamp, 1).is_none());
        for rgb in [[1.0, 0.0, 0.0], [0.0; 3]] {
            let map = Map::new(16, 8, vec![rgb; 128]).expect("a map");
            assert_eq!(remark(&map), None);
        }
    }
}
