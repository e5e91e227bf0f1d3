// What the passes of a visibility list share.

struct ListLayout {
    // Columns and rows of tiles, which triangles of meshes are sorted into.
    n_tiles: vec2u,
    // Of the band that there is room for, and where they end.
    first_row: u32,
    end_row: u32,
    n_segments: u32,
    // 0: hits are counted; 1: they are written.
    is_writing: u32,
    // 1: not all points were lit, and those that were not are black.
    is_draft: u32,
    // 1: the entries of the band are kept beside those of the others.
    is_keeping: u32,
    // Of wide strands: WidthProfile.even of lib/width_profile.
    even: vec4f,
}

// What there is of a pixel.
struct Pixel {
    n_hits: atomic<u32>,
    // Where the next hit goes; once all are there, where they end, and where entries of several bands are kept, where
    // those of the pixel end.
    next: atomic<u32>,
    // At that end, the first entry last.
    n_entries: u32,
    pad: u32,
}

// A surface behind the hair of a pixel.
struct SeenSurface {
    // Which proxy, or from their number on which triangle.
    surface: u32,
    // Share of the pixel.
    weight: f32,
    // Where it is, from the middle of the pixel, px: two numbers of 16 bits.
    moved: u32,
    // Along the line of sight, cm.
    depth: f32,
}

// A triangle of a mesh as the eye sees it.
struct Triangle {
    // For each corner, the side of the plane through the eye and the other two: a constant, and the growth along x and
    // y from the middle of the picture, px. Rays through the triangle have the same side of all three.
    sides: array<vec4f, 3>,
    // Which surfaces.
    corners: vec3u,
    // Times the inverse of the sum of the sides, the depth along the line of sight, cm.
    depth: f32,
}

// Side of a tile, px.
const TILE: u32 = 16u;

// Surfaces of a pixel that are kept: two proxies and a triangle.
const N_BEHIND: u32 = 3u;
