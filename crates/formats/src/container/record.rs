//! Small records: serde through bincode, fixed-size little-endian integers.

use serde::{Serialize, de::DeserializeOwned};

use crate::error::{Error, Result};

/// Largest record. bincode refuses any length field that would read past it, so a damaged
/// count cannot allocate more than this.
const RECORD_LIMIT_BYTES: usize = 1 << 20;

const fn config() -> bincode::config::Configuration<
    bincode::config::LittleEndian,
    bincode::config::Fixint,
    bincode::config::Limit<RECORD_LIMIT_BYTES>,
> {
    bincode::config::standard()
        .with_little_endian()
        .with_fixed_int_encoding()
        .with_limit::<RECORD_LIMIT_BYTES>()
}

/// The bytes of `record`.
pub(crate) fn encode_record(record: &impl Serialize) -> Result<Vec<u8>> {
    let bytes = bincode::serde::encode_to_vec(record, config())
        .map_err(|error| Error::invalid(format!("record cannot be written: {error}"), 0))?;
    if bytes.len() > RECORD_LIMIT_BYTES {
        return Err(Error::invalid("record is larger than 1 MiB", 0));
    }
    Ok(bytes)
}

/// The record in `bytes`, all of which it must use; `offset` is where they stand in the file.
pub(crate) fn decode_record<T: DeserializeOwned>(bytes: &[u8], offset: u64) -> Result<T> {
    let (record, used) = bincode::serde::decode_from_slice(bytes, config())
        .map_err(|error| Error::invalid(format!("record does not decode: {error}"), offset))?;
    if used != bytes.len() {
        return Err(Error::invalid(
            format!("record has {} bytes too many", bytes.len() - used),
            offset,
        ));
    }
    Ok(record)
}
