//! What the window is called.

use strandlight_scene::interactive::PictureProgress;

/// The window's title: the file, whether it must be saved, and how far the picture is.
pub fn title(name: &str, is_modified: bool, progress: &PictureProgress) -> String {
    let star = if is_modified { "*" } else { "" };
    let PictureProgress {
        samples,
        total_samples,
        is_shaded,
        is_done,
        ..
    } = progress;
    // Until an edit is shaded, the samples are those of the picture before it.
    let picture = match is_shaded {
        true if *total_samples > 0 => format!("{samples}/{total_samples}"),
        true if *is_done => "done".to_owned(),
        _ => "shading".to_owned(),
    };
    format!("strandview - {name}{star} - {picture}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_title_tells_of_no_samples_before_an_edit_is_shaded() {
        let mut progress = PictureProgress {
            samples: 20,
            total_samples: 20,
            is_shown: true,
            is_shaded: true,
            is_done: true,
            noise: None,
        };
        assert_eq!(
            title("a.toml", true, &progress),
            "strandview - a.toml* - 20/20"
        );
        (progress.is_shaded, progress.is_done) = (false, false);
        assert_eq!(
            title("a.toml", false, &progress),
            "strandview - a.toml - shading"
        );
        // A picture without samples.
        (progress.samples, progress.total_samples) = (0, 0);
        for (is_done, wanted) in [(false, "shading"), (true, "done")] {
            (progress.is_shaded, progress.is_done) = (true, is_done);
            let title = title("a.toml", false, &progress);
            assert_eq!(title, format!("strandview - a.toml - {wanted}"));
        }
    }
}
