// Which samples of a pixel a thin strand covers. Twin: crates/scene/src/sampling.rs.

fn hash_u32(value: u32) -> u32 {
    var x = value;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

fn coverage_key(segment: u32, x: u32, y: u32) -> u32 {
    return hash_u32(hash_u32(segment ^ (x * 0x9e3779b9u)) ^ (y * 0x85ebca6bu));
}

fn coverage_threshold(index: u32, key: u32) -> f32 {
    var x = reverseBits(index);
    x ^= x * 0x3d20adeau;
    x += key;
    x *= (key >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return f32(x >> 8u) * (1.0 / 16777216.0);
}

fn coverage_mask(alpha: f32, pass_ix: u32, key: u32) -> u32 {
    if alpha >= 1.0 {
        return 15u;
    }
    var mask = 0u;
    for (var sample = 0u; sample < 4u; sample++) {
        if coverage_threshold(4u * pass_ix + sample, key) < alpha {
            mask |= 1u << sample;
        }
    }
    return mask;
}
