//! A file or a name for one, chosen in the window: a path that is typed, and a list of the folder it
//! leads to. Needs nothing of the system but its files.

use std::path::{Path, PathBuf, is_separator};

use egui::{Key, RichText, Ui};

use super::field::Changes;
use super::theme;

/// Height of a row of the list, points.
const ROW: f32 = 20.0;

/// What a file is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// It is opened.
    Open,
    /// It is written.
    Save,
}

/// A file of a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    name: String,
    is_folder: bool,
    bytes: u64,
}

/// The path as it is typed, and the folder it leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picker {
    /// As it is typed.
    pub path: String,
    purpose: Purpose,
    /// The folder that a name alone is in: the last one that was gone to.
    base: PathBuf,
    /// Endings of the files that are listed.
    extensions: Vec<String>,
    /// The one of a name to save that has none.
    ending: String,
    is_all: bool,
    /// The folder that was listed, and what is in it.
    listed: Option<PathBuf>,
    entries: Vec<Entry>,
    /// Why nothing is listed.
    trouble: Option<String>,
    /// The typed name was chosen from the list: it does not narrow that.
    is_chosen: bool,
    /// The field is typed in from the next frame on, at its end.
    is_moved: bool,
    /// The field of the path, once it was shown.
    field: Option<egui::Id>,
}

/// What became of a frame of the picker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Picked {
    /// Nothing yet.
    No,
    /// This path was entered.
    Path(String),
}

impl Picker {
    /// Begins at `path`, a folder if it ends in a separator.
    pub fn new(purpose: Purpose, path: String, extensions: Vec<String>) -> Self {
        // A page's paths start nowhere, and are all from there.
        let (path, base) = match std::path::absolute(Picker::target(&path)) {
            Ok(whole) => {
                let path = whole.display().to_string();
                let cut = path.rfind(is_separator).map_or(0, |at| at + 1);
                let base = PathBuf::from(&path[..cut]);
                (path, base)
            }
            Err(_) => (path, PathBuf::new()),
        };
        Picker {
            path,
            base,
            purpose,
            ending: extensions.first().cloned().unwrap_or_default(),
            extensions,
            is_all: false,
            listed: None,
            entries: Vec::new(),
            trouble: None,
            is_chosen: purpose == Purpose::Save,
            is_moved: true,
            field: None,
        }
    }

    /// Begins in the folder of `path`.
    pub fn in_folder_of(purpose: Purpose, path: &Path, extensions: Vec<String>) -> Self {
        let folder = path.parent().unwrap_or(Path::new(""));
        Picker::new(purpose, folder_text(folder), extensions)
    }

    /// The file that is meant, with an ending if it is to be written.
    pub fn file(&self) -> PathBuf {
        let file = self.whole(&self.path);
        let is_other = self.purpose == Purpose::Open
            || self.path.ends_with(is_separator)
            || self.ending.is_empty()
            || file.is_dir();
        match self.extension().filter(|extension| !extension.is_empty()) {
            _ if is_other => file,
            None => file.with_extension(&self.ending),
            // The 2 of `look.v2` is no ending. A file that is there is meant as it is typed.
            Some(extension)
                if self.extensions.len() == 1 && extension != self.ending && !file.exists() =>
            {
                let mut name = file.into_os_string();
                name.push(".");
                name.push(&self.ending);
                name.into()
            }
            Some(_) => file,
        }
    }

    /// The ending that is typed.
    fn extension(&self) -> Option<String> {
        let extension = Path::new(&self.path).extension()?;
        Some(extension.to_string_lossy().to_lowercase())
    }

    /// A typed path from the root: without a folder it is in the one that is shown.
    fn whole(&self, path: &str) -> PathBuf {
        self.base.join(Picker::target(path))
    }

    /// `~` is the home folder.
    fn target(path: &str) -> PathBuf {
        let home = || super::settings::home_folder();
        let below = path
            .strip_prefix('~')
            .map(|rest| (rest, rest.chars().next()));
        match below {
            Some((rest, first)) if first.is_none_or(is_separator) => {
                let rest = rest.trim_start_matches(is_separator);
                home().map_or_else(|| PathBuf::from(path), |home| home.join(rest))
            }
            _ => PathBuf::from(path),
        }
    }

    /// The folder that the text leads to, and the begin of a name after it.
    fn parts(&self) -> (PathBuf, String) {
        let cut = self.path.rfind(is_separator).map_or(0, |at| at + 1);
        let (folder, name) = self.path.split_at(cut);
        match (folder, name) {
            ("", "~") => (Picker::target("~"), String::new()),
            (folder, name) => (self.whole(folder), name.to_owned()),
        }
    }

    /// Reads the folder if another one is meant than is listed.
    fn list(&mut self) {
        let (folder, _) = self.parts();
        // What is typed from there on leaves it as it is.
        if Picker::target(&self.path).is_absolute() {
            self.base.clone_from(&folder);
        }
        let typed = self.extension();
        if let Some(typed) = typed.filter(|typed| self.extensions.contains(typed)) {
            self.ending = typed;
        }
        if self.listed.as_ref() == Some(&folder) {
            return;
        }
        self.entries.clear();
        self.trouble = None;
        match std::fs::read_dir(&folder) {
            Ok(found) => {
                for entry in found.flatten() {
                    // Links are what they lead to.
                    let Ok(data) = std::fs::metadata(entry.path()) else {
                        continue;
                    };
                    self.entries.push(Entry {
                        name: entry.file_name().to_string_lossy().into_owned(),
                        is_folder: data.is_dir(),
                        bytes: data.len(),
                    });
                }
                self.entries
                    .sort_by_cached_key(|entry| (!entry.is_folder, natural(&entry.name)));
            }
            Err(error) => {
                let folder = folder.display();
                self.trouble = Some(format!("{folder}: cannot be listed: {error}"));
            }
        }
        self.listed = Some(folder);
    }

    /// The entries that are shown: folders and files of the wanted kinds, whose names have the typed
    /// one in them.
    fn shown(&self) -> Vec<usize> {
        let (_, typed) = self.parts();
        let typed = typed.to_lowercase();
        let is_narrowed = !self.is_chosen && !typed.is_empty();
        let has_typed = |name: &str| match typed.starts_with('.') {
            true => name.starts_with(&typed),
            false => name.contains(&typed),
        };
        let is_wanted = |entry: &&Entry| {
            let name = entry.name.to_lowercase();
            let is_hidden = name.starts_with('.') && !typed.starts_with('.');
            let of_kind = || {
                let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
                self.extensions.iter().any(|wanted| wanted == extension)
            };
            !is_hidden
                && (entry.is_folder || self.is_all || of_kind())
                && (!is_narrowed || has_typed(&name))
        };
        let entries = self.entries.iter().enumerate();
        entries
            .filter(|(_, entry)| is_wanted(entry))
            .map(|(ix, _)| ix)
            .collect()
    }

    /// Goes to another folder; a name that is to be written stays.
    fn go_to(&mut self, folder: &Path) {
        let (_, name) = self.parts();
        self.path = folder_text(folder);
        if self.purpose == Purpose::Save {
            self.path += &name;
        } else {
            self.is_chosen = false;
        }
        self.is_moved = true;
    }

    fn choose(&mut self, entry: &Entry) {
        let (_, name) = self.parts();
        self.path.truncate(self.path.len() - name.len());
        self.path += &entry.name;
        self.is_chosen = true;
        self.is_moved = true;
    }

    /// What the button beside the list does.
    pub fn press(&mut self) -> Picked {
        self.list();
        self.enter()
    }

    /// What was entered: a folder is gone into, anything else is the answer.
    fn enter(&mut self) -> Picked {
        let target = self.file();
        let is_gone_into = self.purpose == Purpose::Open || self.path.ends_with(is_separator);
        if is_gone_into && !self.path.is_empty() && target.is_dir() {
            self.path = folder_text(&target);
            (self.is_chosen, self.is_moved) = (false, true);
            return Picked::No;
        }
        // Of one that is left in the list no more has to be typed.
        let (_, typed) = self.parts();
        if self.purpose == Purpose::Open && !target.exists() && !typed.is_empty() {
            let shown = self.shown();
            if let [only] = *shown {
                let entry = self.entries[only].clone();
                self.choose(&entry);
                return self.enter();
            }
        }
        Picked::Path(target.to_string_lossy().into_owned())
    }

    /// The entry beside the chosen one, by the arrow keys.
    fn step(&mut self, by: isize) {
        let shown = self.shown();
        let (_, typed) = self.parts();
        let at = (shown.iter()).position(|&ix| self.is_chosen && self.entries[ix].name == typed);
        let next = match at {
            Some(at) => at
                .saturating_add_signed(by)
                .min(shown.len().saturating_sub(1)),
            None => 0,
        };
        if let Some(&ix) = shown.get(next) {
            let entry = self.entries[ix].clone();
            self.choose(&entry);
        }
    }

    /// Shows path and list; `places` are folders to go to, by name. `focused` had the keys before anything
    /// of this frame was shown: a number lets go of them when it is entered.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        focused: Option<egui::Id>,
        places: &[(&str, PathBuf)],
        height: f32,
        changes: &mut Changes,
    ) -> Picked {
        let mut picked = Picked::No;
        self.list();
        // Taken before the field can have them, unless a number beside it is typed.
        let is_mine = focused.is_none() || focused == self.field;
        let pressed = |ui: &Ui, key| {
            is_mine && ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key))
        };
        if pressed(ui, Key::ArrowDown) {
            self.step(1);
        }
        if pressed(ui, Key::ArrowUp) {
            self.step(-1);
        }
        let is_entered = pressed(ui, Key::Enter);
        ui.horizontal_wrapped(|ui| {
            let parent = self.listed.as_deref().and_then(parent_of);
            let up = ui.add_enabled(parent.is_some(), egui::Button::new("Up"));
            changes.place("Parent folder button", &up);
            if let (true, Some(parent)) = (up.on_hover_text("The folder above").clicked(), parent) {
                self.go_to(&parent);
            }
            for (name, folder) in places {
                let button = ui.button(*name).on_hover_text(folder.display().to_string());
                if button.clicked() {
                    self.go_to(folder);
                }
            }
            if !self.extensions.is_empty() {
                ui.checkbox(&mut self.is_all, "All files");
            }
        });
        let field = egui::TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY);
        let field = ui.add(field);
        changes.place("Path", &field);
        self.field = Some(field.id);
        if std::mem::take(&mut self.is_moved) {
            field.request_focus();
            cursor_to_end(ui, &field, &self.path);
        }
        if field.changed() {
            self.is_chosen = false;
            if let Some(at) = restart(&self.path) {
                self.path.drain(..at);
                self.is_moved = true;
            }
        }
        if let Some(entry) = self.rows(ui, height, changes, &mut picked) {
            self.choose(&entry);
            if entry.is_folder {
                let folder = self.whole(&self.path);
                self.path = folder_text(&folder);
                self.is_chosen = self.purpose == Purpose::Save;
            }
        }
        if picked != Picked::No || is_entered {
            return self.enter();
        }
        Picked::No
    }

    /// The list; answers the entry that was clicked, and sets `picked` where twice.
    fn rows(
        &self,
        ui: &mut Ui,
        height: f32,
        changes: &mut Changes,
        picked: &mut Picked,
    ) -> Option<Entry> {
        let mut clicked = None;
        let shown = self.shown();
        let (_, typed) = self.parts();
        let mut list = |ui: &mut Ui, rows: std::ops::Range<usize>| {
            for &ix in &shown[rows] {
                let entry = &self.entries[ix];
                let is_chosen = self.is_chosen && entry.name == typed;
                let (response, paint) = row_of(ui, is_chosen);
                paint(ui, entry);
                changes.place(format!("File {}", entry.name), &response);
                if response.clicked() {
                    clicked = Some(entry.clone());
                }
                if response.double_clicked() && !entry.is_folder {
                    *picked = Picked::Path(String::new());
                }
            }
        };
        egui::Frame::new()
            .fill(ui.visuals().extreme_bg_color)
            .inner_margin(4)
            .show(ui, |ui| {
                ui.set_min_height(height);
                if let Some(trouble) = &self.trouble {
                    ui.label(RichText::new(trouble).color(theme::WARNING));
                } else if shown.is_empty() {
                    ui.label(RichText::new("No such files here").color(theme::WEAK));
                }
                egui::ScrollArea::vertical()
                    .max_height(height)
                    .auto_shrink([false, false])
                    .show_rows(ui, ROW - 4.0, shown.len(), &mut list);
            });
        clicked
    }
}

/// A row to click on, and what paints its entry.
fn row_of(ui: &mut Ui, is_chosen: bool) -> (egui::Response, impl FnOnce(&Ui, &Entry) + use<>) {
    let size = egui::vec2(ui.available_width(), ROW - 4.0);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click());
    let is_hovered = response.hovered();
    let paint = move |ui: &Ui, entry: &Entry| {
        let fill = match (is_chosen, is_hovered) {
            (true, _) => theme::ACCENT,
            (false, true) => ui.visuals().widgets.hovered.weak_bg_fill,
            _ => egui::Color32::TRANSPARENT,
        };
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        painter.rect_filled(rect, 2.0, fill);
        let color = match is_chosen {
            true => egui::Color32::WHITE,
            false => ui.visuals().text_color(),
        };
        let font = egui::TextStyle::Body.resolve(ui.style());
        let left = rect.left_center() + egui::vec2(4.0, 0.0);
        let (name, size) = match entry.is_folder {
            true => (format!("{}/", entry.name), String::new()),
            false => (entry.name.clone(), size_text(entry.bytes)),
        };
        painter.text(left, egui::Align2::LEFT_CENTER, name, font.clone(), color);
        let right = rect.right_center() - egui::vec2(4.0, 0.0);
        let weak = if is_chosen { color } else { theme::WEAK };
        painter.text(right, egui::Align2::RIGHT_CENTER, size, font, weak);
    };
    (response, paint)
}

fn cursor_to_end(ui: &Ui, field: &egui::Response, text: &str) {
    use egui::text::{CCursor, CCursorRange};

    let mut state = egui::TextEdit::load_state(ui.ctx(), field.id).unwrap_or_default();
    let end = CCursor::new(text.chars().count());
    state.cursor.set_char_range(Some(CCursorRange::one(end)));
    state.store(ui.ctx(), field.id);
}

/// Where a path begins anew that was typed after another one: `/a/b//c` is `/c`, and `/a/~/c` is `~/c`.
fn restart(path: &str) -> Option<usize> {
    if std::path::MAIN_SEPARATOR != '/' {
        return None;
    }
    let root = path.rfind("//");
    let home = path.rfind("/~/").or_else(|| {
        let is_home = path.ends_with("/~");
        is_home.then(|| path.len() - 2)
    });
    root.max(home).map(|at| at + 1)
}

/// The folder above, of whatever spelling.
fn parent_of(folder: &Path) -> Option<PathBuf> {
    let whole = folder.canonicalize().ok()?;
    whole.parent().map(Path::to_owned)
}

/// A folder as it is typed: with a separator at its end.
fn folder_text(folder: &Path) -> String {
    let mut text = folder.display().to_string();
    if !text.is_empty() && !text.ends_with(is_separator) {
        text.push(std::path::MAIN_SEPARATOR);
    }
    text
}

/// Sorts `a2` before `a10`: numbers by value, all else by letter, capitals or not.
fn natural(name: &str) -> Vec<(u64, String)> {
    let mut parts: Vec<(u64, String)> = vec![(0, String::new())];
    for c in name.to_lowercase().chars() {
        match (c.to_digit(10), parts.last_mut()) {
            (Some(digit), Some((number, text))) if text.is_empty() => {
                *number = number.saturating_mul(10).saturating_add(digit.into());
            }
            (Some(digit), _) => parts.push((digit.into(), String::new())),
            (None, Some((_, text))) => text.push(c),
            (None, None) => {}
        }
    }
    parts
}

/// 1.2 MB.
fn size_text(bytes: u64) -> String {
    let mut size = bytes as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        if size < 1000.0 || unit == "GB" {
            return match unit {
                "B" => format!("{size} B"),
                _ if size < 10.0 => format!("{size:.1} {unit}"),
                _ => format!("{size:.0} {unit}"),
            };
        }
        size /= 1000.0;
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for name in [
            "a10.toml",
            "a2.toml",
            "B.GROOM",
            "notes.txt",
            ".hidden.toml",
        ] {
            std::fs::write(folder.path().join(name), "x").expect("written");
        }
        std::fs::create_dir(folder.path().join("zoo")).expect("made");
        folder
    }

    fn open(folder: &Path) -> Picker {
        let kinds = ["toml", "groom"].map(str::to_owned).to_vec();
        let mut picker = Picker::new(Purpose::Open, folder_text(folder), kinds);
        picker.list();
        picker
    }

    fn names(picker: &Picker) -> Vec<&str> {
        let shown = picker.shown().into_iter();
        shown.map(|ix| picker.entries[ix].name.as_str()).collect()
    }

    #[test]
    fn a_folder_is_listed_as_people_sort_and_narrowed_by_typing() {
        let folder = folder();
        let mut picker = open(folder.path());
        assert_eq!(names(&picker), ["zoo", "a2.toml", "a10.toml", "B.GROOM"]);
        picker.is_all = true;
        assert_eq!(names(&picker).last(), Some(&"notes.txt"));
        picker.is_all = false;
        picker.path += "A1";
        assert_eq!(names(&picker), ["a10.toml"]);
        // The only one left is entered.
        let wanted = folder.path().join("a10.toml").display().to_string();
        assert_eq!(picker.enter(), Picked::Path(wanted));
        // What is chosen does not hide the others.
        picker.step(1);
        assert_eq!(names(&picker).len(), 4);
        assert!(picker.path.ends_with("B.GROOM"), "{}", picker.path);
        let mut picker = open(folder.path());
        picker.path += ".";
        assert_eq!(names(&picker), [".hidden.toml"]);
    }

    #[test]
    fn folders_are_gone_into_and_a_name_to_save_goes_along() {
        let folder = folder();
        let mut picker = open(folder.path());
        picker.path += "zoo";
        assert_eq!(picker.enter(), Picked::No);
        picker.list();
        assert!(names(&picker).is_empty() && picker.trouble.is_none());
        let text = folder.path().join("new.toml").display().to_string();
        let mut picker = Picker::new(Purpose::Save, text, vec!["toml".to_owned()]);
        picker.list();
        assert_eq!(names(&picker), ["zoo", "a2.toml", "a10.toml"]);
        picker.go_to(&folder.path().join("zoo"));
        let wanted = folder.path().join("zoo/new.toml");
        assert_eq!(picker.enter(), Picked::Path(wanted.display().to_string()));
        // One that is not there can be typed, and says so.
        picker.path = folder.path().join("nowhere/x.toml").display().to_string();
        picker.list();
        let trouble = picker.trouble.clone().expect("it is not there");
        assert!(trouble.contains("nowhere"), "{trouble}");
    }

    #[test]
    #[cfg(unix)]
    fn a_path_typed_after_another_begins_anew() {
        let typed = |path: &str| restart(path).map(|at| path[at..].to_owned());
        assert_eq!(typed("/a/b//").as_deref(), Some("/"));
        assert_eq!(typed("/a/b//c/d").as_deref(), Some("/c/d"));
        assert_eq!(typed("/a/~").as_deref(), Some("~"));
        assert_eq!(typed("/a//b/~/c").as_deref(), Some("~/c"));
        assert_eq!(typed("/a/b~c/d"), None);
    }

    #[test]
    fn a_name_alone_is_in_the_folder_that_is_shown_and_gets_an_ending() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        let text = at("scene.toml").display().to_string();
        let mut picker = Picker::new(Purpose::Save, text, vec!["toml".to_owned()]);
        let mut typed = |path: &str, wanted: &str| {
            picker.path = path.to_owned();
            let wanted = at(wanted).display().to_string();
            assert_eq!(picker.press(), Picked::Path(wanted), "{path}");
        };
        typed("bare.toml", "bare.toml");
        typed("zoo/bare", "zoo/bare.toml");
        // The folder shown is still the one that was begun in.
        typed("bare.v2", "bare.v2.toml");
        typed("bare.TOML", "bare.TOML");
        // It is there: what it is, is told when it is written.
        typed("B.GROOM", "B.GROOM");
        // It is a folder, and refused as that.
        typed("zoo", "zoo");
        picker.go_to(&at("zoo"));
        picker.list();
        picker.path = "bare".to_owned();
        picker.list();
        assert_eq!(picker.listed, Some(at("zoo/")));
        assert_eq!(picker.file(), at("zoo/bare.toml"));
        // What is opened has the ending that it has.
        let mut picker = open(folder.path());
        picker.path = "a2".to_owned();
        assert_eq!(picker.file(), at("a2"));
        // A path that starts nowhere starts where the program does.
        let picker = Picker::new(Purpose::Save, "x.toml".to_owned(), Vec::new());
        assert!(picker.file().is_absolute(), "{}", picker.path);
    }

    #[test]
    fn sizes_and_homes_are_written_as_people_do() {
        assert_eq!(size_text(999), "999 B");
        assert_eq!(size_text(1_234), "1.2 kB");
        assert_eq!(size_text(56_000_000), "56 MB");
        assert_eq!(Picker::target("~other"), PathBuf::from("~other"));
        if let Some(home) = crate::ui::settings::home_folder() {
            assert_eq!(Picker::target("~/a"), home.join("a"));
            assert_eq!(Picker::target("~"), home);
        }
    }
}
