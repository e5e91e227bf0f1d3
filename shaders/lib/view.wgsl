// The view. Twin: ViewUniform in crates/scene/src/camera.rs.

// Strands that are wider on the screen, px, have a profile over their width, and round tips.
const WIDE_PX: f32 = 2.0;

// Pixels around the picture in which points are shaded at least.
const LEAST_MARGIN_PX: f32 = 16.0;

struct View {
    eye: vec3f,
    focal_px: f32,
    right: vec3f,
    near: f32,
    up: vec3f,
    far: f32,
    forward: vec3f,
    margin_px: f32,
    size: vec2u,
    radiance_scale: f32,
    n_points: u32,
    // The part of the picture that is drawn: its upper left pixel, and its width and height.
    origin: vec2u,
    extent: vec2u,
}

// A point on the screen: x to the right and y downwards in pixels from the upper left corner,
// and the depth along the line of sight in cm (not positive: behind the eye).
fn screen_position(view: View, position: vec3f) -> vec3f {
    let from_eye = position - view.eye;
    let depth = dot(from_eye, view.forward);
    let scale = view.focal_px / max(depth, view.near);
    let x = 0.5 * f32(view.size.x) + scale * dot(from_eye, view.right);
    let y = 0.5 * f32(view.size.y) - scale * dot(from_eye, view.up);
    return vec3f(x, y, depth);
}

// Unit vector from the eye through a point of the screen.
fn ray_direction(view: View, at_px: vec2f) -> vec3f {
    let across = at_px.x - 0.5 * f32(view.size.x);
    let upwards = 0.5 * f32(view.size.y) - at_px.y;
    return normalize(view.forward * view.focal_px + view.right * across + view.up * upwards);
}

// How far from the picture, px, a point of this depth is shaded whose strand reaches `reach` cm from it: to the other
// ends of its segments, and over its width. So both ends of what is seen of a segment are.
fn shading_margin(view: View, depth: f32, reach: f32) -> f32 {
    let reach_px = reach * view.focal_px / max(depth - reach, view.near);
    return view.margin_px + max(reach_px - LEAST_MARGIN_PX, 0.0);
}
