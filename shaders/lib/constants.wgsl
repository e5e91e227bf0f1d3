// Mathematical constants; the twin in Rust is `core::f32::consts`.

const PI: f32 = 3.14159265358979;
const HALF_PI: f32 = 1.57079632679490;
const SQRT_PI: f32 = 1.77245385090552;
