//! How files name the program and the file that they were made from.

/// xxh3-64 of `bytes` as 16 hexadecimal digits: how files name what they were made from.
pub fn content_hash(bytes: &[u8]) -> String {
    format!("{:016x}", xxhash_rust::xxh3::xxh3_64(bytes))
}

/// Name and version of this program, as recorded in files.
pub fn tool_version() -> String {
    concat!("strandlight ", env!("CARGO_PKG_VERSION")).to_owned()
}
