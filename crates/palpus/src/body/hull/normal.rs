//! Computes normals of triangles to full precision, even for very thin triangles.
//!
//! A plain cross product of two sides loses digits if the triangle is thin, and a plane with that
//! normal does not support the hull. Here each difference and each product is stored with its
//! rounding error (Dekker's double-double numbers). The error of the result is about 1e-31 of the
//! product of the side lengths.

use glam::DVec3;

/// Returns (b − a) × (c − a), rounded once.
pub(super) fn cross_of(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    // Uses the two shorter sides, because they cause the least cancellation. The result then does
    // not depend on which corner comes first.
    let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
    let [a, b, c] = if bc >= ab && bc >= ca {
        [a, b, c]
    } else if ca >= ab {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let difference = |p: DVec3, axis: usize| exact_difference(p[axis], a[axis]);
    let u = [difference(b, 0), difference(b, 1), difference(b, 2)];
    let w = [difference(c, 0), difference(c, 1), difference(c, 2)];
    DVec3::new(minor(u[1], w[2], u[2], w[1]), minor(u[2], w[0], u[0], w[2]), minor(u[0], w[1], u[1], w[0]))
}

/// Returns the unit vector along `v`, without overflow or underflow; zero if `v` is zero.
pub(super) fn unit(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 { (v / largest).normalize() } else { DVec3::ZERO }
}

/// Returns p·q − r·s. Each argument is a pair of rounded value and rounding error.
fn minor(p: (f64, f64), q: (f64, f64), r: (f64, f64), s: (f64, f64)) -> f64 {
    let (pq, pq_error) = exact_product(p.0, q.0);
    let (rs, rs_error) = exact_product(r.0, s.0);
    let (high, low) = exact_difference(pq, rs);
    let crossed = (p.0 * q.1 + p.1 * q.0) - (r.0 * s.1 + r.1 * s.0);
    high + (low + (pq_error - rs_error) + crossed)
}

/// Returns x − y as rounded value and rounding error (Knuth's two-sum).
fn exact_difference(x: f64, y: f64) -> (f64, f64) {
    let difference = x - y;
    let taken = x - difference;
    (difference, (x - (difference + taken)) + (taken - y))
}

/// Returns x·y as rounded value and rounding error.
fn exact_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_of_a_needle_is_exact() {
        // The triangle has a side of length 3 and a height of 2^-52 along y. A plain cross product
        // would have no correct digit.
        let height = f64::EPSILON;
        let (a, b, c) = (DVec3::ONE, DVec3::new(4.0, 1.0, 1.0), DVec3::new(2.0, 1.0 + height, 1.0));
        assert_eq!(cross_of(a, b, c), DVec3::new(0.0, 0.0, 3.0 * height));
        assert_eq!(unit(cross_of(a, b, c)), DVec3::Z);
        assert_eq!(cross_of(b, c, a), cross_of(a, b, c));
    }
}
