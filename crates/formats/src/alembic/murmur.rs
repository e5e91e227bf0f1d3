//! The hash of samples: MurmurHash3 for 128 bits (Appleby 2011), as upstream names samples by.
//! Readers take samples of the same hash for the same.

use super::ogawa::u64_at;

const C_1: u64 = 0x87c3_7b91_1142_53d5;
const C_2: u64 = 0x4cf5_ad43_2745_937f;

/// The hash of `bytes`, seed 0.
pub(super) fn murmur(bytes: &[u8]) -> [u8; 16] {
    let (mut h_1, mut h_2) = (0u64, 0u64);
    let mix_1 = |k: u64| k.wrapping_mul(C_1).rotate_left(31).wrapping_mul(C_2);
    let mix_2 = |k: u64| k.wrapping_mul(C_2).rotate_left(33).wrapping_mul(C_1);
    let mut blocks = bytes.chunks_exact(16);
    for block in &mut blocks {
        h_1 = (h_1 ^ mix_1(u64_at(block, 0))).rotate_left(27);
        h_1 = h_1
            .wrapping_add(h_2)
            .wrapping_mul(5)
            .wrapping_add(0x52dc_e729);
        h_2 = (h_2 ^ mix_2(u64_at(block, 8))).rotate_left(31);
        h_2 = h_2
            .wrapping_add(h_1)
            .wrapping_mul(5)
            .wrapping_add(0x3849_5ab5);
    }
    let rest = blocks.remainder();
    let mut tail = [0; 16];
    tail[..rest.len()].copy_from_slice(rest);
    h_1 ^= mix_1(u64_at(&tail, 0));
    h_2 ^= mix_2(u64_at(&tail, 8));
    let length = bytes.len() as u64;
    h_1 ^= length;
    h_2 ^= length;
    h_1 = h_1.wrapping_add(h_2);
    h_2 = h_2.wrapping_add(h_1);
    h_1 = finish(h_1);
    h_2 = finish(h_2);
    h_1 = h_1.wrapping_add(h_2);
    h_2 = h_2.wrapping_add(h_1);
    let mut hash = [0; 16];
    hash[..8].copy_from_slice(&h_1.to_le_bytes());
    hash[8..].copy_from_slice(&h_2.to_le_bytes());
    hash
}

fn finish(mut k: u64) -> u64 {
    k ^= k >> 33;
    k = k.wrapping_mul(0xff51_afd7_ed55_8ccd);
    k ^= k >> 33;
    k = k.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    k ^ (k >> 33)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hashes that upstream's library, 1.8.12, wrote in front of these samples.
    #[test]
    fn hashes_are_upstreams() {
        let hex = |bytes: &[u8]| -> String { murmur(bytes).map(|b| format!("{b:02x}")).concat() };
        assert_eq!(hex(&[1]), "16fe7483905cce7a85670e43e4678877");
        assert_eq!(hex(&[1, 0]), "2eda0f724f344d1b1e8bfee48a29e048");
        assert_eq!(
            hex(&[2, 0, 0, 0, 2, 0, 0, 0]),
            "2963852293169ba90d9d1e7d6308db5c"
        );
        let doubles: Vec<u8> = [1.0f64, 2.0, 3.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        assert_eq!(hex(&doubles), "715f49c2e26036e859c9a5bb9c4ffd7a");
    }
}
