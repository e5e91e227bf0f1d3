//! The tables of a binary layer.

use super::bytes::{Bytes, Reader};
use super::integers::Width;
use super::path::Path;
use crate::error::{Error, Result};

/// All tables.
#[derive(Debug)]
pub(super) struct Sections {
    pub tokens: Vec<String>,
    pub strings: Vec<u32>,
    /// Token of the name, value.
    pub fields: Vec<(u32, u64)>,
    /// Indices of fields; `u32::MAX` ends a set.
    pub field_sets: Vec<u32>,
    pub paths: Vec<Path>,
    /// Path, field set, kind.
    pub specs: Vec<[u32; 3]>,
}

/// Second and third number of a version.
type Version = (u8, u8);

/// Reads them.
pub(super) fn read(bytes: &Bytes, version: Version) -> Result<Sections> {
    let mut toc = bytes.at(bytes.at(16).u64()?);
    let mut entries = Vec::new();
    for _ in 0..toc.count(32)? {
        let name: [u8; 16] = toc.array()?;
        entries.push((name, toc.u64()?));
        toc.u64()?;
    }
    let section = |name: &str| {
        let named =
            |entry: &&([u8; 16], u64)| entry.0.split(|&b| b == 0).next() == Some(name.as_bytes());
        match entries.iter().find(named) {
            Some(&(_, start)) => Ok(bytes.at(start)),
            None => Err(Error::invalid(format!("section {name} is missing"), 16)),
        }
    };
    let is_compressed = version >= (4, 0);
    let mut strings_section = section("STRINGS")?;
    let n_strings = strings_section.count(4)?;
    let tokens = tokens(section("TOKENS")?, is_compressed)?;
    Ok(Sections {
        strings: (0..n_strings)
            .map(|_| strings_section.u32())
            .collect::<Result<_>>()?,
        fields: fields(section("FIELDS")?, is_compressed)?,
        field_sets: field_sets(section("FIELDSETS")?, is_compressed)?,
        paths: paths(section("PATHS")?, version, tokens.len())?,
        specs: specs(section("SPECS")?, version)?,
        tokens,
    })
}

fn tokens(mut reader: Reader, is_compressed: bool) -> Result<Vec<String>> {
    let at = reader.at;
    let n = reader.u64()?;
    let length = reader.u64()?;
    let unpacked;
    let text = match is_compressed {
        true => {
            unpacked = reader.block(length)?;
            &unpacked[..]
        }
        false => reader.take(length)?,
    };
    let words = text.strip_suffix(&[0]).unwrap_or(text).split(|&b| b == 0);
    let tokens: Vec<String> = words
        .map(|word| String::from_utf8_lossy(word).into_owned())
        .collect();
    match tokens.len() as u64 == n || (n == 0 && text.is_empty()) {
        true => Ok(tokens),
        false => Err(Error::invalid(
            format!("{} tokens of {n}", tokens.len()),
            at,
        )),
    }
}

fn fields(mut reader: Reader, is_compressed: bool) -> Result<Vec<(u32, u64)>> {
    if !is_compressed {
        let n = reader.count(16)?;
        let field = |_| {
            reader.u32()?;
            Ok((reader.u32()?, reader.u64()?))
        };
        return (0..n).map(field).collect();
    }
    let n = reader.u64()?;
    let names = reader.indices(n)?;
    let at = reader.at;
    let values = reader.block(n.saturating_mul(8))?;
    if values.len() != 8 * names.len() {
        return Err(Error::invalid("values of fields are missing", at));
    }
    let (values, _) = values.as_chunks::<8>();
    let values = values.iter().map(|value| u64::from_le_bytes(*value));
    Ok(names.into_iter().zip(values).collect())
}

fn field_sets(mut reader: Reader, is_compressed: bool) -> Result<Vec<u32>> {
    if is_compressed {
        let n = reader.u64()?;
        return reader.indices(n);
    }
    let n = reader.count(4)?;
    (0..n).map(|_| reader.u32()).collect()
}

fn specs(mut reader: Reader, version: Version) -> Result<Vec<[u32; 3]>> {
    if version >= (4, 0) {
        let n = reader.u64()?;
        let columns = [reader.indices(n)?, reader.indices(n)?, reader.indices(n)?];
        let row = |ix| [0, 1, 2].map(|column: usize| columns[column][ix]);
        return Ok((0..columns[0].len()).map(row).collect());
    }
    // The first version has four bytes in front, a slip of its writer.
    let is_first = version < (1, 0);
    let n = reader.count(if is_first { 16 } else { 12 })?;
    let spec = |_| {
        if is_first {
            reader.u32()?;
        }
        Ok([reader.u32()?, reader.u32()?, reader.u32()?])
    };
    (0..n).map(spec).collect()
}

/// A tree of paths that is being read: of each entry whether a child follows and where the next
/// sibling is.
struct Entry {
    path: u32,
    token: u32,
    is_property: bool,
    has_child: bool,
    sibling: Option<u64>,
    /// Where the child is, which follows the entry.
    next: u64,
}

fn paths(mut reader: Reader, version: Version, n_tokens: usize) -> Result<Vec<Path>> {
    let at = reader.at;
    let n = reader.u64()?;
    if version < (4, 0) {
        // An entry has at least 12 bytes.
        reader.at = at;
        reader.count(12)?;
        let entry = |at: u64| old_entry(&reader, at, version);
        return walk(n, n, reader.at, n_tokens, entry);
    }
    let n_entries = reader.u64()?;
    let paths = reader.indices(n_entries)?;
    let tokens = reader.integers(n_entries, Width::Bits32)?;
    let jumps = reader.integers(n_entries, Width::Bits32)?;
    if n > n_entries.saturating_add(1) {
        let what = format!("{n} paths, {n_entries} are in the tree");
        return Err(Error::invalid(what, at));
    }
    let entry = |ix: u64| {
        let ix_here = usize::try_from(ix).ok().filter(|&ix| ix < paths.len());
        let Some(here) = ix_here else {
            return Err(Error::invalid(format!("path {ix} of {n_entries}"), at));
        };
        let jump = jumps[here];
        Ok(Entry {
            path: paths[here],
            token: tokens[here].unsigned_abs() as u32,
            is_property: tokens[here] < 0,
            // -2: an end; -1: a child follows; 0: a sibling follows; more: a child follows, and
            // the sibling is so many further on.
            has_child: jump > 0 || jump == -1,
            sibling: match jump {
                0 => Some(ix + 1),
                1.. => ix.checked_add_signed(jump),
                _ => None,
            },
            next: ix + 1,
        })
    };
    walk(n, n_entries, 0, n_tokens, entry)
}

/// An entry before version 0.4, at `at`.
fn old_entry(reader: &Reader, at: u64, version: Version) -> Result<Entry> {
    let mut reader = reader.clone();
    reader.at = at;
    if version < (1, 0) {
        reader.u32()?;
    }
    let (path, token) = (reader.u32()?, reader.u32()?);
    let [bits, ..] = reader.array::<4>()?;
    let (has_child, has_sibling) = (bits & 1 != 0, bits & 2 != 0);
    let sibling = match (has_child, has_sibling) {
        (_, false) => None,
        (false, true) => Some(reader.at),
        (true, true) => Some(reader.u64()?),
    };
    Ok(Entry {
        path,
        token,
        is_property: bits & 4 != 0,
        has_child,
        sibling,
        next: reader.at,
    })
}

/// The paths, from the entry at `start` on; at most `n_entries`, each visited once.
fn walk(
    n_paths: u64,
    n_entries: u64,
    start: u64,
    n_tokens: usize,
    entry: impl Fn(u64) -> Result<Entry>,
) -> Result<Vec<Path>> {
    let mut paths = vec![Path::default(); n_paths as usize];
    let mut open = match n_entries {
        0 => Vec::new(),
        _ => vec![(start, None)],
    };
    let mut n_visited = 0;
    while let Some((at, parent)) = open.pop() {
        n_visited += 1;
        let entry = entry(at)?;
        let path = entry.path as usize;
        let is_new = paths.get(path).is_some_and(|known| !known.is_known);
        let is_good = is_new && (parent.is_none() || (entry.token as usize) < n_tokens);
        if !is_good || n_visited > n_entries {
            return Err(Error::invalid("the tree of paths is damaged", at));
        }
        paths[path] = Path {
            parent,
            token: entry.token,
            is_property: entry.is_property,
            is_known: true,
        };
        open.extend(entry.sibling.map(|sibling| (sibling, parent)));
        if entry.has_child {
            open.push((entry.next, Some(entry.path)));
        }
    }
    Ok(paths)
}
