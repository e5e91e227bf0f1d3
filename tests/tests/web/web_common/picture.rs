//! Pictures of pages, and what in them is the viewer's picture.

/// 8-bit colours, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[u8; 3]>,
}

impl Pixels {
    /// Decodes a PNG.
    pub fn from_png(bytes: &[u8]) -> Pixels {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .expect("a PNG");
        let mut buffer = vec![0; reader.output_buffer_size().expect("a small picture")];
        let info = reader.next_frame(&mut buffer).expect("a PNG");
        let channels = info.color_type.samples();
        Pixels {
            width: info.width as usize,
            height: info.height as usize,
            rgb: buffer[..info.buffer_size()]
                .chunks_exact(channels)
                .map(|texel| [texel[0], texel[1], texel[2]])
                .collect(),
        }
    }

    /// The smallest rectangle with all pixels of about `color`: x, y, width, height.
    pub fn extent(&self, color: [u8; 3]) -> Option<[usize; 4]> {
        let near = |texel: &[u8; 3]| (0..3).all(|c| texel[c].abs_diff(color[c]) <= 1);
        let found = (0..self.rgb.len()).filter(|&ix| near(&self.rgb[ix]));
        let mut extent: Option<[usize; 4]> = None;
        for ix in found {
            let (x, y) = (ix % self.width, ix / self.width);
            let [left, top, right, bottom] = extent.unwrap_or([x, y, x, y]);
            extent = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
        extent.map(|[left, top, right, bottom]| [left, top, right - left + 1, bottom - top + 1])
    }

    /// A rectangle of it.
    pub fn part(&self, [x, y, width, height]: [usize; 4]) -> Pixels {
        let rows = (y..y + height).map(|y| &self.rgb[y * self.width + x..][..width]);
        Pixels {
            width,
            height,
            rgb: rows.flatten().copied().collect(),
        }
    }

    /// Share of pixels further than 8 levels from `color` in a channel.
    pub fn share_unlike(&self, color: [u8; 3]) -> f64 {
        let unlike = |texel: &&[u8; 3]| (0..3).any(|c| texel[c].abs_diff(color[c]) > 8);
        self.rgb.iter().filter(unlike).count() as f64 / self.rgb.len() as f64
    }

    /// Mean absolute difference in levels of 255.
    pub fn difference(&self, other: &Pixels) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height));
        let pairs = self.rgb.iter().flatten().zip(other.rgb.iter().flatten());
        let sum: f64 = pairs.map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
        sum / (3 * self.rgb.len()) as f64
    }
}
