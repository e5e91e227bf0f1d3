//! Outputs that would replace what is read.

use std::collections::HashMap;
use std::path::Path;

use crate::input::STANDARD_STREAM;
use crate::write::{OutputTarget, target_of};

/// Files that an output must not be, and what each of them is.
#[derive(Clone, Debug, Default)]
pub struct TakenFiles {
    kinds: HashMap<OutputTarget, &'static str>,
}

impl TakenFiles {
    /// Adds those of `files` that are there, each of which is `kind`, such as "an input"; `-` is standard input. What was
    /// added first says what it is.
    pub fn add<P: AsRef<Path>>(
        &mut self,
        files: impl IntoIterator<Item = P>,
        kind: &'static str,
    ) -> &mut TakenFiles {
        for file in files {
            let file = match file.as_ref() {
                file if file == Path::new(STANDARD_STREAM) => Path::new("/dev/stdin"),
                file => file,
            };
            // A descriptor leads to the file that it is open for.
            if let Ok(target) = file.canonicalize().and_then(|file| target_of(&file)) {
                self.kinds.entry(target).or_insert(kind);
            }
        }
        self
    }

    /// Adds `files` that may be still to come.
    pub fn add_names<P: AsRef<Path>>(
        &mut self,
        files: impl IntoIterator<Item = P>,
        kind: &'static str,
    ) -> &mut TakenFiles {
        for target in files.into_iter().flat_map(|file| target_of(file.as_ref())) {
            self.kinds.entry(target).or_insert(kind);
        }
        self
    }

    /// Why `output` is refused, if it is one of them.
    pub fn refusal(&self, output: &OutputTarget) -> Option<String> {
        let kind = self.kinds.get(output)?;
        Some(format!("is {kind}; name another output"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::write::output_target;

    #[test]
    fn files_are_known_by_whatever_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.toml"), "").expect("written");
        std::fs::create_dir(at("below")).expect("made");
        let mut taken = TakenFiles::default();
        taken
            .add([at("a.toml"), at("none.toml")], "an input")
            .add_names([at("./a.toml"), at("to come.lights")], "an output");
        let refusal = |path: &Path| taken.refusal(&output_target(path).expect("a target"));
        let refused = |kind: &str| Some(format!("is {kind}; name another output"));
        assert_eq!(refusal(&at("below/../a.toml")), refused("an input"));
        assert_eq!(refusal(&at("to come.lights")), refused("an output"));
        assert_eq!(refusal(&at("none.toml")), None);
        assert_eq!(refusal(Path::new("-")), None);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../a.toml", at("below/link.toml")).expect("made");
            assert_eq!(refusal(&at("below/link.toml")), refused("an input"));
        }
    }
}
