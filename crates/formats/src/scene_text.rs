//! Writing a changed scene over the text that it was read from, so that comments and layout stay.

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::Result;
use crate::scene::Scene;
use crate::scene_edit::changed_text;

impl Scene {
    /// The text of a scene file, made of `text` by changing those keys that differ:
    /// comments, order and blanks stay, and tables that are added have no keys at their defaults.
    /// Where that is not possible, as in [`Scene::to_toml_string`].
    ///
    /// # Errors
    /// As there.
    pub fn to_toml_over(&self, text: &str) -> Result<String> {
        let plain = self.to_toml_string()?;
        // Lines are added behind whole ones.
        let end = if text.ends_with('\n') { "" } else { "\n" };
        let text = &format!("{text}{end}");
        let kept = Scene::from_toml(text).ok().and_then(|old| {
            let changed = changed_text(text, &old.to_toml_string().ok()?, self, &plain)?;
            let mut again = Scene::from_toml(&changed).ok()?;
            again.folder.clone_from(&self.folder);
            (again == *self).then_some(changed)
        });
        Ok(kept.unwrap_or(plain))
    }
}

/// A value as scene files have it after `=`, of one line.
pub fn inline_value<T: DeserializeOwned>(text: &str) -> Option<T> {
    #[derive(Deserialize)]
    struct Line<T> {
        value: T,
    }
    if text.contains(['\n', '\r']) {
        return None;
    }
    let line: Line<T> = toml::from_str(&format!("value = {text}")).ok()?;
    Some(line.value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AddedLight, MotionSection, ProxySection, WindSection};

    const TEXT: &str = "\
# A head of hair.
version = 1

[groom]
file = 'a#b.groom'  # not a comment in the name

[lights]
file = \"b.lights\"
intensity = 1.0                    # factor

[hair]
preset = \"blond\"
eta = 1.5   # index
shift_deg = { r = -5.0, tt = 2.5, trt = 7.5 }
# The end.
";

    fn over(change: impl FnOnce(&mut Scene)) -> (Scene, String) {
        let mut scene = Scene::from_toml(TEXT).expect("valid");
        change(&mut scene);
        let text = scene.to_toml_over(TEXT).expect("valid");
        assert_eq!(Scene::from_toml(&text).expect("valid"), scene, "{text}");
        (scene, text)
    }

    #[test]
    fn only_lines_of_changed_keys_change() {
        assert_eq!(over(|_| ()).1, TEXT);
        let (_, text) = over(|scene| {
            scene.hair.eta = 1.625;
            scene.lights.intensity = 2.0;
        });
        let expected = TEXT
            .replace("eta = 1.5   # index", "eta = 1.625 # index")
            .replace("intensity = 1.0 ", "intensity = 2.0 ");
        assert_eq!(text, expected);
    }

    #[test]
    fn keys_come_and_go() {
        let (_, text) = over(|scene| {
            scene.lights.rotate_deg = 30.0;
            scene.render.exposure = 1.0;
            scene.hair.reflectance = Some([0.5, 0.4, 0.3]);
            scene.groom.file = "c.groom".into();
        });
        for line in [
            "# A head of hair.",
            "rotate_deg = 30.0",
            "[render]\nexposure = 1.0",
            "reflectance = [0.5, 0.4, 0.3]",
            "# not a comment in the name",
            "# The end.",
        ] {
            assert!(text.contains(line), "{line}: {text}");
        }
        assert!(
            !text.contains("width_deg"),
            "what did not change is not written: {text}"
        );
        let mut scene = Scene::from_toml(&text).expect("valid");
        scene.hair.reflectance = None;
        scene.hair.sigma_a = [1.0, 2.0, 3.0];
        let again = scene.to_toml_over(&text).expect("valid");
        assert!(
            !again.contains("reflectance") && again.contains("# The end."),
            "{again}"
        );
    }

    #[test]
    fn what_cannot_be_kept_is_written_anew() {
        for text in [
            "",
            "lights.file = 'b'\nversion = 1\nhair.sigma_a = [1, 2, 3]\n[groom]\nfile = 'a'",
        ] {
            let mut scene = Scene::new("a", "b");
            scene.hair.sigma_a = [3.0, 2.0, 1.0];
            scene.lights.muted = vec![1];
            let over = scene.to_toml_over(text).expect("valid");
            assert_eq!(over, scene.to_toml_string().expect("valid"));
        }
    }

    /// Tables and lists in every way of writing them, and comments everywhere.
    const RICH: &str = "\
# A head of hair.
version = 1

[groom] # the shape
file = \"a.groom\"

[lights]
# from a map
file = \"b.lights\"
muted = [3, 7] # too bright
# solo = [2]
# [[lights.adjust]]

# one light alone
[[lights.adjust]] # the window
light = 3
tint = [1, 0.5, 0.25]   # warm
# after it

[hair]
sigma_a = [
    0.1, # red
    0.2, # green
    0.3,
]
shift_deg = { r = -5.0, tt = 2.5, trt = 7.5 } # tilt
width_deg.r = 6
width_deg.tt = 3
width_deg.trt = 12

[[proxy]]   # the head
kind = \"mesh\"
mesh = \"bust.mesh\"

# over the wind
[motion.wind]
speed = 5   # m/s
# The end.
";

    /// What `change` writes: the lines that go, each with what comes in its place.
    fn rich(change: impl FnOnce(&mut Scene), lines: &[(&str, &str)]) {
        let mut scene = Scene::from_toml(RICH).expect("valid");
        change(&mut scene);
        let text = scene.to_toml_over(RICH).expect("valid");
        let mut expected = RICH.to_owned();
        for (old, new) in lines {
            assert!(expected.contains(old), "{old}");
            expected = expected.replacen(old, new, 1);
        }
        assert_eq!(text, expected);
        assert_eq!(Scene::from_toml(&text).expect("valid"), scene, "{text}");
        // Line ends of another system stay too.
        let crlf = scene.to_toml_over(&RICH.replace('\n', "\r\n"));
        assert_eq!(crlf.expect("valid"), expected.replace('\n', "\r\n"));
    }

    #[test]
    fn keys_of_tables_under_headers_and_in_braces_change() {
        rich(
            |scene| {
                let wind = scene
                    .motion
                    .as_mut()
                    .and_then(|motion| motion.wind.as_mut());
                let wind = wind.expect("it blows");
                (wind.speed, wind.gust) = (17.25, 0.75);
                scene.hair.shift_deg.tt = 2.0;
                scene.hair.width_deg.r = 7.0;
                scene.hair.sigma_a = [0.1, 0.25, 0.3];
                scene.lights.muted = vec![7];
            },
            &[
                ("speed = 5   # m/s\n", "speed = 17.25 # m/s\ngust = 0.75\n"),
                ("tt = 2.5,", "tt = 2.0,"),
                ("width_deg.r = 6\n", "width_deg.r = 7.0\n"),
                ("0.2, # green", "0.25, # green"),
                ("[3, 7] # too", "[7]    # too"),
            ],
        );
    }

    #[test]
    fn entries_of_lists_of_tables_come_change_and_go() {
        rich(
            |scene| {
                scene.lights.adjust_mut(3).intensity = 2.0;
                scene.lights.adjust_mut(5).intensity = 0.5;
                scene.lights.added = vec![AddedLight::default(); 2];
                scene.lights.added[1].width_deg = 3.0;
                scene.proxies.push(ProxySection::ground(-4.0));
                scene.render.exposure = 1.5;
            },
            &[
                (
                    "# warm\n# after it\n",
                    "# warm\nintensity = 2.0\n# after it\n\n\
                     [[lights.adjust]]\nlight = 5\nintensity = 0.5\n\n\
                     [[lights.added]]\nazimuth_deg = -45.0\nelevation_deg = 35.0\nwidth_deg = 8.0\n\
                     intensity = 1.0\ncolor = [1.0, 1.0, 1.0]\n\n[[lights.added]]\nwidth_deg = 3.0\n",
                ),
                (
                    "bust.mesh\"\n",
                    "bust.mesh\"\n\n[[proxy]]\nkind = \"ground\"\nheight = -4.0\n",
                ),
                ("# The end.\n", "# The end.\n\n[render]\nexposure = 1.5\n"),
            ],
        );
        rich(
            |scene| {
                scene.lights.adjust.clear();
                scene.motion = None;
                scene.proxies.insert(0, ProxySection::ground(0.0));
            },
            &[
                (
                    "[[lights.adjust]] # the window\nlight = 3\ntint = [1, 0.5, 0.25]   # warm\n",
                    "",
                ),
                ("[motion.wind]\nspeed = 5   # m/s\n", ""),
                (
                    "[[proxy]]   # the head",
                    "[[proxy]]\nkind = \"ground\"\nheight = 0.0\n\n[[proxy]]   # the head",
                ),
            ],
        );
    }

    #[test]
    fn what_is_added_is_written_without_its_defaults() {
        let (_, text) = over(|scene| {
            scene.lights.adjust_mut(1).intensity = 2.0;
            scene.motion = Some(MotionSection {
                wind: Some(WindSection {
                    speed: 4.0,
                    ..WindSection::default()
                }),
                ..MotionSection::default()
            });
            scene.variation.grey = 0.25;
        });
        let adjusted = "# factor\n\n[[lights.adjust]]\nlight = 1\nintensity = 2.0\n\n[hair]";
        let expected = TEXT.replace("# factor\n\n[hair]", adjusted)
            + "\n[motion.wind]\nspeed = 4.0\n\n[variation]\ngrey = 0.25\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn edits_of_the_sample_keep_every_other_line() {
        let text = strandlight_data::SAMPLE_SCENE;
        let edits: [fn(&mut Scene); 6] = [
            |scene| scene.lights.added.push(AddedLight::default()),
            |scene| scene.lights.adjust_mut(2).intensity = 0.5,
            |scene| scene.lights.solo = vec![1],
            |scene| scene.motion = Some(MotionSection::default()),
            |scene| scene.proxies.push(ProxySection::ground(-40.0)),
            |scene| scene.variation.frizz = 0.5,
        ];
        for (ix, edit) in edits.iter().enumerate() {
            let mut scene = Scene::from_toml(text).expect("valid");
            edit(&mut scene);
            if let Some(motion) = &mut scene.motion {
                motion.wind = Some(WindSection::default());
            }
            let changed = scene.to_toml_over(text).expect("valid");
            let mut lines = changed.lines();
            let lost = text.lines().find(|line| !lines.any(|kept| kept == *line));
            assert_eq!(lost, None, "edit {ix}: {changed}");
            assert!(changed.len() < text.len() + 200, "edit {ix}: {changed}");
        }
    }
}
