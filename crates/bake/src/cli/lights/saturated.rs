//! Pixels of a map that are bright in one channel alone.

use strandlight_images::Map;

/// Names of the channels.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// The channel is more than so many times each of the others.
const RATIO: f32 = 100.0;

/// The pixel has at least this share of its channel's light.
const LEAST_SHARE: f64 = 0.01;

/// More pixels than this are a lamp, or a map of one colour.
const MOST: usize = 8;

/// A pixel with much of a channel's light and next to none of the others'.
#[derive(Clone, Copy)]
struct Saturated {
    at: [usize; 2],
    channel: usize,
    radiance: f32,
    share: f64,
}

/// Says of pixels that hold much of one channel's light and next to none of the others' where they are. Lossy
/// compression leaves such where a sun was, and a light set has a sun of that colour then.
pub fn remark(map: &Map) -> Option<String> {
    let (energy, grid) = (map.energy(), map.grid());
    let found = (0..grid.height).flat_map(|j| {
        let solid_angle = grid.solid_angle(j);
        let pixels = map.row(j).iter().enumerate();
        pixels.filter_map(move |(i, rgb)| {
            let is_alone = |channel: &usize| {
                let others = [1, 2].map(|step: usize| rgb[(channel + step) % 3]);
                others.iter().all(|other| rgb[*channel] > RATIO * other)
            };
            let channel = (0..3).find(is_alone)?;
            let radiance = rgb[channel];
            let share = f64::from(radiance) * solid_angle / energy[channel];
            let at = [i, j];
            (share >= LEAST_SHARE).then_some(Saturated {
                at,
                channel,
                radiance,
                share,
            })
        })
    });
    let mut found: Vec<Saturated> = found.collect();
    let brightest = *found
        .iter()
        .max_by(|a, b| a.radiance.total_cmp(&b.radiance))?;
    found.retain(|pixel| pixel.channel == brightest.channel);
    if found.len() > MOST {
        return None;
    }
    let Saturated {
        at: [x, y],
        channel,
        radiance,
        ..
    } = brightest;
    let share: f64 = found.iter().map(|pixel| pixel.share).sum();
    let percent = 100.0 * share;
    let pixels = match found.len() {
        1 => format!("pixel {x}, {y} has"),
        n => format!("{n} pixels, the brightest at {x}, {y}, have"),
    };
    let name = CHANNELS[channel];
    Some(format!(
        "{pixels} {percent:.0} % of the map's {name} and next to nothing else (up to {radiance}): \
         if the file is damaged there, the lights are too {name}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even map of 16 x 8 pixels with `spots` in it.
    fn remark_of(spots: &[([usize; 2], [f32; 3])]) -> Option<String> {
        let mut pixels = vec![[1.0; 3]; 16 * 8];
        for ([x, y], rgb) in spots {
            pixels[x + 16 * y] = *rgb;
        }
        remark(&Map::new(16, 8, pixels).expect("a map"))
    }

    #[test]
    fn bright_pixels_of_one_channel_alone_are_told() {
        let spots = [([3, 4], [0.0, 0.0, 60.0]), ([4, 4], [0.1, 0.2, 90.0])];
        let said = remark_of(&spots).expect("two spots");
        for part in [
            "2 pixels, the brightest at 4, 4, have",
            "% of the map's blue",
            "up to 90",
        ] {
            assert!(said.contains(part), "{said}");
        }
        let one = remark_of(&[([0, 0], [1e4, 0.0, 0.0])]).expect("a spot");
        assert!(one.starts_with("pixel 0, 0 has 9"), "{one}");
    }

    #[test]
    fn suns_coloured_lamps_and_dark_maps_are_not() {
        assert_eq!(remark_of(&[]), None);
        // A sun, and a lamp that has a hundredth of its light in the other channels.
        assert_eq!(remark_of(&[([3, 4], [9e3, 1e4, 8e3])]), None);
        assert_eq!(remark_of(&[([3, 4], [100.0, 1.0, 1.0])]), None);
        // Little of the light of its channel.
        assert_eq!(remark_of(&[([3, 4], [0.0, 0.0, 0.5])]), None);
        // A map of one colour.
        let red = Map::new(16, 8, vec![[1.0, 0.0, 0.0]; 128]).expect("a map");
        assert_eq!(remark(&red), None);
        let black = Map::new(16, 8, vec![[0.0; 3]; 128]).expect("a map");
        assert_eq!(remark(&black), None);
    }
}
