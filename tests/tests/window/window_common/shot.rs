//! Pictures of windows, and how they differ.

use std::path::Path;

/// Pictures of the same scene differ by no more: root mean square, 0..=255.
pub const SAME: f64 = 0.5;

/// Pictures that look different differ by more.
pub const DIFFERENT: f64 = 4.0;

/// A picture from the screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<u8>,
}

impl Shot {
    pub(super) fn from_ppm(bytes: &[u8]) -> Shot {
        let mut words = Vec::new();
        let mut at = 0;
        while words.len() < 4 {
            let start = at;
            while !bytes[at].is_ascii_whitespace() {
                at += 1;
            }
            words.push(String::from_utf8_lossy(&bytes[start..at]).into_owned());
            at += 1;
        }
        assert_eq!((&words[0][..], &words[3][..]), ("P6", "255"));
        let number = |ix: usize| words[ix].parse().expect("a number");
        let shot = Shot {
            width: number(1),
            height: number(2),
            rgb: bytes[at..].to_vec(),
        };
        assert_eq!(shot.rgb.len(), 3 * shot.width * shot.height);
        shot
    }

    /// A part of it.
    pub fn part(&self, at: [usize; 2], size: [usize; 2]) -> Shot {
        self.cut(at, size)
    }

    pub(super) fn cut(&self, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Shot {
        let row = |y: usize| &self.rgb[3 * (y * self.width + left)..][..3 * width];
        Shot {
            width,
            height,
            rgb: (top..top + height)
                .flat_map(|y| row(y).iter().copied())
                .collect(),
        }
    }

    pub fn assert_same(&self, other: &Shot) {
        let difference = self.difference(other);
        assert!(difference < SAME, "pictures differ by {difference}");
    }

    pub fn assert_different(&self, other: &Shot) {
        let difference = self.difference(other);
        assert!(
            difference > DIFFERENT,
            "pictures differ by {difference} only"
        );
    }

    /// Root mean square difference of all channels, 0..=255.
    pub fn difference(&self, other: &Shot) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height));
        let squares = self.rgb.iter().zip(&other.rgb).map(|(&a, &b)| {
            let difference = f64::from(a) - f64::from(b);
            difference * difference
        });
        (squares.sum::<f64>() / self.rgb.len() as f64).sqrt()
    }

    /// Root mean square of the deviation from the mean: 0 where there is nothing to see.
    pub fn contrast(&self) -> f64 {
        let n = self.rgb.len() as f64;
        let mean = self.rgb.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
        let squares = self.rgb.iter().map(|&x| (f64::from(x) - mean).powi(2));
        (squares.sum::<f64>() / n).sqrt()
    }
}

/// Copies a screenshot to a folder that keeps it, under the next number.
pub(super) fn keep(folder: &Path, shot: &Path) {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let name = format!("{}-{number:03}.ppm", std::process::id());
    std::fs::copy(shot, folder.join(name)).expect("the folder is there");
}
