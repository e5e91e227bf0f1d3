// A piece of a bent segment or of a tip on the screen. Mirrored by `Piece` in crates/render/src/passes/pieces.rs.

struct Piece {
    // Left edge x, y, right edge x, y from the middle of the picture in 1/256 px.
    begin: vec4i,
    end: vec4i,
    // There, 0..1 between the near and far planes.
    depth: vec2f,
    // Of the segment.
    first: u32,
    // Shares of the segment's way where it begins and where it ends, 16 bits each.
    part: u32,
}
