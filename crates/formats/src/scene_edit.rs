//! Changing the keys of a TOML text that differ between two states of it.

use toml::de::{DeArray, DeTable, DeValue};
use toml::{Spanned, Table, Value};

use crate::scene::Scene;
use crate::text_patches::{Patches, Span};

/// `text`, which is a scene that is written in full as `old`, changed to `scene`, in full `new`. Comments, order and
/// blanks stay. `None` where that cannot be done.
pub(crate) fn changed_text(text: &str, old: &str, scene: &Scene, new: &str) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let full = DeTable::parse(new).ok()?;
    let (old, new): (Table, Table) = (old.parse().ok()?, new.parse().ok()?);
    let mut edit = Edit {
        text,
        scene,
        new: &new,
        full: full.get_ref(),
        headers: Vec::new(),
        values: Vec::new(),
        patches: Patches::default(),
    };
    edit.find(&[], root.get_ref());
    edit.headers.sort_by_key(|header| header.span.start);
    edit.table(&[], &Form::Root, root.get_ref(), &old, &new)?;
    edit.patches.apply(text)
}

/// How a table is written.
enum Form {
    /// The file itself.
    Root,
    /// Under a header in brackets, which is here.
    Header(Span),
    /// In braces, which are here.
    Inline(Span),
    /// By the names of keys and headers alone.
    Implied,
}

/// `[name]` or `[[name]]`.
struct Header {
    name: String,
    span: Span,
}

struct Edit<'a> {
    text: &'a str,
    /// As it shall be, and the same in full.
    scene: &'a Scene,
    new: &'a Table,
    /// That once more, in the order in which people read it.
    full: &'a DeTable<'a>,
    headers: Vec<Header>,
    /// All that stands behind an equals sign.
    values: Vec<Span>,
    patches: Patches,
}

impl Edit<'_> {
    /// Takes note of what is written where.
    fn find(&mut self, path: &[String], table: &DeTable<'_>) {
        for (key, value) in table {
            let path = below(path, key.get_ref());
            match value.get_ref() {
                DeValue::Array(list) if self.is_of_blocks(list) => {
                    for item in list {
                        self.find_table(&path, item);
                    }
                }
                DeValue::Table(_) => self.find_table(&path, value),
                _ => self.values.push(value.span()),
            }
        }
    }

    fn find_table(&mut self, path: &[String], value: &Spanned<DeValue<'_>>) {
        match self.form_of(value) {
            Form::Inline(span) => return self.values.push(span),
            Form::Header(span) => self.headers.push(Header {
                name: name_of(path),
                span,
            }),
            Form::Root | Form::Implied => {}
        }
        if let DeValue::Table(table) = value.get_ref() {
            self.find(path, table);
        }
    }

    fn form_of(&self, table: &Spanned<DeValue<'_>>) -> Form {
        let span = table.span();
        match self.text.as_bytes().get(span.start) {
            Some(b'[') => Form::Header(span),
            Some(b'{') => Form::Inline(span),
            _ => Form::Implied,
        }
    }

    /// Is every entry under a header of its own?
    fn is_of_blocks(&self, list: &DeArray<'_>) -> bool {
        let first = list.iter().next().filter(|item| item.get_ref().is_table());
        first.is_some_and(|item| matches!(self.form_of(item), Form::Header(_)))
    }

    fn table(
        &mut self,
        path: &[String],
        form: &Form,
        written: &DeTable<'_>,
        old: &Table,
        new: &Table,
    ) -> Option<()> {
        let gone = old.keys().filter(|key| !new.contains_key(*key));
        let gone: Vec<_> = gone.filter_map(|key| entry(written, key)).collect();
        let changed = || {
            new.iter()
                .filter(|(key, value)| old.get(*key) != Some(*value))
        };
        if let (Form::Inline(span), false) = (form, gone.is_empty()) {
            let stays = |key: &str| entry(written, key).is_some() || old.get(key) != new.get(key);
            let kept = new.iter().filter(|(key, _)| stays(key));
            let kept: Table = kept
                .map(|(key, value)| (key.clone(), value.clone()))
                .collect();
            self.patches
                .replace(span.clone(), Value::Table(kept).to_string());
            return Some(());
        }
        for (key_span, value) in gone {
            self.remove(key_span, value)?;
        }
        let mut added = Vec::new();
        for (key, value) in changed() {
            match entry(written, key) {
                Some((_, written)) => {
                    self.value(&below(path, key), written, old.get(key), value)?
                }
                None => added.push((key, value)),
            }
        }
        // A key behind the header of another table would be that table's.
        added.sort_by_key(|(_, value)| is_list_of_tables(value));
        for (key, value) in added {
            let old = old.get(key);
            match form {
                Form::Root => self.add_section(key, old, value)?,
                Form::Header(_) if is_list_of_tables(value) => {
                    let at = self.end_of_group(&name_of(path))?;
                    self.add_blocks(at, &below(path, key), value)?;
                }
                Form::Header(span) => {
                    let at = self.end_of_entries(span);
                    let line = format!("{key} = {value}");
                    self.add_lines(at, &[line]);
                }
                Form::Inline(span) => self.add_inline(span, written, key, value),
                Form::Implied => return None,
            }
        }
        Some(())
    }

    fn value(
        &mut self,
        path: &[String],
        written: &Spanned<DeValue<'_>>,
        old: Option<&Value>,
        new: &Value,
    ) -> Option<()> {
        match (written.get_ref(), new) {
            (DeValue::Table(table), Value::Table(new)) => {
                let none = Table::new();
                let old = old.and_then(Value::as_table).unwrap_or(&none);
                return self.table(path, &self.form_of(written), table, old, new);
            }
            (DeValue::Table(_), _) if !matches!(self.form_of(written), Form::Inline(_)) => {
                return None;
            }
            (DeValue::Array(list), Value::Array(new)) => {
                let old = old.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
                let is_in_step = list.len() == old.len();
                match (self.is_of_blocks(list), is_in_step) {
                    (true, true) => return self.blocks(path, list, old, new),
                    (true, false) => return None,
                    (false, true) if old.len() == new.len() => {
                        for (ix, (item, (old, new))) in
                            list.iter().zip(old.iter().zip(new)).enumerate()
                        {
                            if old != new {
                                self.value(&below(path, &ix.to_string()), item, Some(old), new)?;
                            }
                        }
                        return Some(());
                    }
                    (false, _) => {}
                }
            }
            (DeValue::Array(list), _) if self.is_of_blocks(list) => return None,
            _ => {}
        }
        self.patches.replace(written.span(), new.to_string());
        Some(())
    }

    /// A list of tables, each under its header. What is the same at both ends stays.
    fn blocks(
        &mut self,
        path: &[String],
        list: &DeArray<'_>,
        old: &[Value],
        new: &[Value],
    ) -> Option<()> {
        let same = |pairs: &mut dyn Iterator<Item = (&Value, &Value)>| {
            pairs.take_while(|(old, new)| old == new).count()
        };
        let before = same(&mut old.iter().zip(new));
        let behind = same(&mut old[before..].iter().rev().zip(new[before..].iter().rev()));
        let (old_end, new_end) = (old.len() - behind, new.len() - behind);
        let paired = old_end.min(new_end);
        for ix in before..paired {
            let path = below(path, &ix.to_string());
            self.value(&path, list.get(ix)?, Some(&old[ix]), &new[ix])?;
        }
        for ix in paired..old_end {
            self.remove_block(&list.get(ix)?.span());
        }
        if paired < new_end {
            let at = match paired.checked_sub(1) {
                Some(last) => self.end_of_paragraph(&list.get(last)?.span()),
                None => self.line_start(list.first()?.span().start),
            };
            self.add_blocks_of(at, path, new, paired..new_end)?;
        }
        Some(())
    }

    /// A table or a list of tables of the file that it has not got yet.
    fn add_section(&mut self, key: &str, old: Option<&Value>, new: &Value) -> Option<()> {
        let (path, end) = (below(&[], key), self.text.len());
        if is_list_of_tables(new) {
            return self.add_blocks(end, &path, new);
        }
        let new = new.as_table()?;
        if new.values().any(is_list_of_tables) {
            return None;
        }
        if let Some(old) = old.and_then(Value::as_table) {
            let changed = new
                .iter()
                .filter(|(key, value)| old.get(*key) != Some(*value));
            let lines = changed.map(|(key, value)| format!("{key} = {value}"));
            let lines: Vec<String> = [format!("[{key}]")].into_iter().chain(lines).collect();
            self.add_block(end, &lines);
            return Some(());
        }
        let has_tables_alone = !new.is_empty() && new.values().all(Value::is_table);
        if !has_tables_alone {
            let lines = self.lines_of(&path, "[", "]", new)?;
            self.add_block(end, &lines);
            return Some(());
        }
        for (key, table) in new {
            let lines = self.lines_of(&below(&path, key), "[", "]", table.as_table()?)?;
            self.add_block(end, &lines);
        }
        Some(())
    }

    fn add_blocks(&mut self, at: usize, path: &[String], list: &Value) -> Option<()> {
        let list = list.as_array()?;
        self.add_blocks_of(at, path, list, 0..list.len())
    }

    fn add_blocks_of(
        &mut self,
        at: usize,
        path: &[String],
        list: &[Value],
        which: Span,
    ) -> Option<()> {
        for ix in which {
            let table = list.get(ix)?.as_table()?;
            let lines = self.lines_of(&below(path, &ix.to_string()), "[[", "]]", table)?;
            self.add_block(at, &lines);
        }
        Some(())
    }

    /// A header and the keys of `table` that are not at their defaults, or all if all are.
    fn lines_of(
        &self,
        path: &[String],
        open: &str,
        close: &str,
        table: &Table,
    ) -> Option<Vec<String>> {
        let mut whole = self.new.clone();
        let is_same = |whole: &Table| {
            Scene::from_toml(&whole.to_string()).is_ok_and(|mut read| {
                read.folder.clone_from(&self.scene.folder);
                read == *self.scene
            })
        };
        let mut kept = Vec::new();
        for (key, value) in table {
            table_at(&mut whole, path)?.remove(key);
            if !is_same(&whole) {
                table_at(&mut whole, path)?.insert(key.clone(), value.clone());
                kept.push((key, value));
            }
        }
        if kept.is_empty() {
            kept = table.iter().collect();
        }
        let full = written_at(self.full, path)?;
        kept.sort_by_key(|(key, _)| entry(full, key).map(|(span, _)| span.start));
        let header = format!("{open}{}{close}", name_of(path));
        let keys = kept
            .into_iter()
            .map(|(key, value)| format!("{key} = {value}"));
        Some([header].into_iter().chain(keys).collect())
    }

    /// Lines with a blank one before them, and one behind them where something else follows.
    fn add_block(&mut self, at: usize, lines: &[String]) {
        let (before, behind) = self.text.split_at(at);
        let is_open = before.is_empty() || before.ends_with("\n\n") || before.ends_with("\n\r\n");
        let is_followed = behind
            .lines()
            .next()
            .is_some_and(|line| !line.trim().is_empty());
        let blank = |is_wanted: bool| is_wanted.then(String::new);
        let lines = lines.iter().cloned();
        let lines = blank(!is_open)
            .into_iter()
            .chain(lines)
            .chain(blank(is_followed));
        self.add_lines(at, &lines.collect::<Vec<_>>());
    }

    fn add_lines(&mut self, at: usize, lines: &[String]) {
        let end = if self.text.contains("\r\n") {
            "\r\n"
        } else {
            "\n"
        };
        let lines = lines.iter().flat_map(|line| [line.as_str(), end]);
        self.patches.insert(at, lines.collect());
    }

    fn add_inline(&mut self, braces: &Span, written: &DeTable<'_>, key: &str, value: &Value) {
        let last = written.iter().map(|(_, value)| value.span().end).max();
        match last {
            Some(last) => self.patches.insert(last, format!(", {key} = {value}")),
            None => {
                // Behind the opening brace.
                let at = braces.start + 1;
                self.patches.insert(at, format!(" {key} = {value} "));
            }
        }
    }

    /// Takes away a key with its value, or all tables of that name.
    fn remove(&mut self, key: Span, value: &Spanned<DeValue<'_>>) -> Option<()> {
        let tables: Vec<_> = match value.get_ref() {
            DeValue::Array(list) if self.is_of_blocks(list) => list.iter().collect(),
            DeValue::Table(_) if !matches!(self.form_of(value), Form::Inline(_)) => vec![value],
            _ => {
                let lines = self.line_start(key.start)..self.line_end(value.span().end);
                self.patches.remove(lines);
                return Some(());
            }
        };
        for table in tables {
            let is_block = matches!(self.form_of(table), Form::Header(_));
            if is_block {
                self.remove_block(&table.span());
            }
            for (key, value) in table.get_ref().as_table()? {
                // What stands under the header is gone with it.
                if !is_block || self.has_headers(value) {
                    self.remove(key.span(), value)?;
                }
            }
        }
        Some(())
    }

    /// Does a value have headers of its own?
    fn has_headers(&self, value: &Spanned<DeValue<'_>>) -> bool {
        match value.get_ref() {
            DeValue::Array(list) => self.is_of_blocks(list),
            _ => matches!(self.form_of(value), Form::Header(_)),
        }
    }

    /// Takes away a header and its keys, and the blank lines behind them.
    fn remove_block(&mut self, header: &Span) {
        let mut start = self.line_start(header.start);
        let mut end = self.end_of_entries(header);
        let is_blank = |line: &str| line.trim().is_empty();
        while end < self.text.len() && is_blank(&self.text[end..self.line_end(end)]) {
            end = self.line_end(end);
        }
        // At the end of the file, those before them.
        while end == self.text.len() && start > 0 {
            let line = self.line_start(start - 1);
            if !is_blank(&self.text[line..start]) {
                break;
            }
            start = line;
        }
        self.patches.remove(start..end);
    }

    fn line_start(&self, at: usize) -> usize {
        self.text[..at].rfind('\n').map_or(0, |end| end + 1)
    }

    /// The start of the next line.
    fn line_end(&self, at: usize) -> usize {
        let end = self.text[at..].find('\n');
        end.map_or(self.text.len(), |end| at + end + 1)
    }

    /// The line of the next header.
    fn next_header(&self, header: &Span) -> usize {
        let mut starts = self.headers.iter().map(|header| header.span.start);
        let next = starts.find(|start| *start > header.start);
        next.map_or(self.text.len(), |next| self.line_start(next))
    }

    /// Behind the line of the last key under a header.
    fn end_of_entries(&self, header: &Span) -> usize {
        let body = header.start..self.next_header(header);
        let values = self
            .values
            .iter()
            .filter(|value| body.contains(&value.start));
        let last = values.map(|value| value.end).max();
        self.line_end(last.unwrap_or(header.end))
    }

    /// The same behind comments that follow, unless they stand over the next header.
    fn end_of_paragraph(&self, header: &Span) -> usize {
        let (start, limit) = (self.end_of_entries(header), self.next_header(header));
        let mut at = start;
        while at < limit
            && self.text[at..limit]
                .trim_start_matches([' ', '\t'])
                .starts_with('#')
        {
            at = self.line_end(at);
        }
        match at == limit && limit < self.text.len() {
            true => start,
            false => at,
        }
    }

    /// Behind the last of all tables whose names begin so.
    fn end_of_group(&self, name: &str) -> Option<usize> {
        let is_inside = |header: &&Header| {
            let rest = header.name.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let last = self.headers.iter().rfind(is_inside)?;
        Some(self.end_of_paragraph(&last.span))
    }
}

/// `path` and one step more: a key, or the number of an entry.
fn below(path: &[String], step: &str) -> Vec<String> {
    path.iter().cloned().chain([step.to_owned()]).collect()
}

/// As headers have it: without numbers, which are no names of keys.
fn name_of(path: &[String]) -> String {
    let names = path.iter().filter(|step| step.parse::<usize>().is_err());
    names.map(String::as_str).collect::<Vec<_>>().join(".")
}

fn entry<'a, 'i>(table: &'a DeTable<'i>, name: &str) -> Option<(Span, &'a Spanned<DeValue<'i>>)> {
    let mut entries = table.iter();
    let (key, value) = entries.find(|(key, _)| key.get_ref() == name)?;
    Some((key.span(), value))
}

fn is_list_of_tables(value: &Value) -> bool {
    let list = value.as_array();
    list.is_some_and(|list| list.iter().any(Value::is_table))
}

fn written_at<'a>(root: &'a DeTable<'a>, path: &[String]) -> Option<&'a DeTable<'a>> {
    let (first, rest) = path.split_first()?;
    let mut value = entry(root, first)?.1.get_ref();
    for step in rest {
        value = match value {
            DeValue::Table(table) => entry(table, step)?.1.get_ref(),
            DeValue::Array(list) => list.get(step.parse::<usize>().ok()?)?.get_ref(),
            _ => return None,
        };
    }
    value.as_table()
}

fn table_at<'a>(root: &'a mut Table, path: &[String]) -> Option<&'a mut Table> {
    let (first, rest) = path.split_first()?;
    let mut value = root.get_mut(first)?;
    for step in rest {
        value = match value {
            Value::Table(table) => table.get_mut(step)?,
            Value::Array(list) => list.get_mut(step.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    value.as_table_mut()
}
