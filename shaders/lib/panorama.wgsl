// The environment map behind the hair. Twin: crates/scene/src/panorama.rs.

// Column and row in texels, whole numbers at their centres, of a direction in a map of `size` that is turned by
// `turn` of a whole turn.
fn panorama_place(omega: vec3f, turn: f32, size: vec2f) -> vec2f {
    let across = length(omega.xz);
    let lat = atan2(omega.y, across);
    let lon = select(0.0, atan2(omega.x, omega.z), across > 0.0);
    let around = 0.5 - lon / 6.283185307179586 + turn;
    return vec2f(around - floor(around), 0.5 - lat / 3.141592653589793) * size - 0.5;
}

// The texel of a column and a row, around the sphere and no further than its poles.
fn panorama_texel(map: texture_2d<f32>, size: vec2i, column: i32, row: i32) -> vec3f {
    let x = (column + size.x) % size.x;
    return textureLoad(map, vec2i(x, clamp(row, 0, size.y - 1)), 0).rgb;
}

// Linear radiance from a direction, bilinear between texels, times `factor`.
fn panorama_radiance(map: texture_2d<f32>, omega: vec3f, turn: f32, factor: vec3f) -> vec3f {
    let size = vec2i(textureDimensions(map));
    let at = panorama_place(omega, turn, vec2f(size));
    let base = floor(at);
    let f = at - base;
    let x = i32(base.x);
    let y = i32(base.y);
    let row_0 = mix(panorama_texel(map, size, x, y), panorama_texel(map, size, x + 1, y), f.x);
    let row_1 = mix(panorama_texel(map, size, x, y + 1), panorama_texel(map, size, x + 1, y + 1), f.x);
    // Brighter than any light: twin MAX_RADIANCE.
    return min(mix(row_0, row_1, f.y) * factor, vec3f(1e30));
}
