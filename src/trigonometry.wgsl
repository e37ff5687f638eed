// Angles and unit vectors, as accurate as 32-bit floats allow on every driver. Twin of `trigonometry.rs`.
//
// WGSL allows its own `atan2` an error of 4096 units in the last place, and its `sin` and `cos` one of 2⁻¹¹; some
// drivers use that up. This library uses only operations that are accurate to 3 units. The polynomials are those of
// Cephes (Moshier 1989).

#define_import_path bevy_mirrorball::trigonometry

const FRAC_PI_2: f32 = 1.57079632679;
const FRAC_PI_4: f32 = 0.78539816340;
const PI: f32 = 3.14159265359;
/// tan(π ÷ 8): above it, angles are measured from π ÷ 4.
const TAN_FRAC_PI_8: f32 = 0.41421356237;

/// Angle of a vector from the +x axis towards +y in radians, −π…π; 0 for the zero vector. Maximum error 3e-7.
fn angle_of(v: vec2f) -> f32 {
    let size = abs(v);
    let low = min(size.x, size.y);
    let high = max(size.x, size.y);
    let is_upper = low > TAN_FRAC_PI_8 * high;
    let x = select(low, low - high, is_upper) / max(select(high, low + high, is_upper), 1e-30);
    let z = x * x;
    let p = ((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1;
    let octant = select(0.0, FRAC_PI_4, is_upper) + (p * z * x + x);
    let quadrant = select(octant, FRAC_PI_2 - octant, size.y > size.x);
    let half_turn = select(quadrant, PI - quadrant, v.x < 0.0);
    return select(half_turn, -half_turn, v.y < 0.0);
}

/// Cosine and sine of an angle in −π…π. Maximum error of each 7e-7.
fn unit_vector(angle: f32) -> vec2f {
    let x = 0.25 * angle;
    let z = x * x;
    let quarter = vec2f(
        ((2.443315711809948e-5 * z - 1.388731625493765e-3) * z + 4.166664568298827e-2) * z * z - 0.5 * z + 1.0,
        ((-1.9515295891e-4 * z + 8.3321608736e-3) * z - 1.6666654611e-1) * z * x + x,
    );
    return doubled(doubled(quarter));
}

/// Unit vector at twice the angle of another.
fn doubled(v: vec2f) -> vec2f {
    return vec2f(1.0 - 2.0 * v.y * v.y, 2.0 * v.x * v.y);
}
