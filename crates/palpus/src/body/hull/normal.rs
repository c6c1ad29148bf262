//! Normals of triangles to full precision, however thin the triangle.
//!
//! A plain cross product of a needle's sides loses more digits the thinner the needle is. A plane
//! with such a normal does not support the hull. Here differences and products carry their rounding
//! errors along (Dekker's double-double), so that the result is right to about 1e-31 of the product
//! of the sides.

use glam::DVec3;

/// (b − a) × (c − a), rounded once.
pub(super) fn cross_of(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    // Uses the two shorter sides: they cancel least, and the result does not depend on which corner
    // comes first.
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

/// The unit vector along `v`, which may be of any non-zero length; zero for zero.
pub(super) fn unit(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 { (v / largest).normalize() } else { DVec3::ZERO }
}

/// p·q − r·s of numbers given as rounded value and rounding error.
fn minor(p: (f64, f64), q: (f64, f64), r: (f64, f64), s: (f64, f64)) -> f64 {
    let (pq, pq_error) = exact_product(p.0, q.0);
    let (rs, rs_error) = exact_product(r.0, s.0);
    let (high, low) = exact_difference(pq, rs);
    let crossed = (p.0 * q.1 + p.1 * q.0) - (r.0 * s.1 + r.1 * s.0);
    high + (low + (pq_error - rs_error) + crossed)
}

/// x − y as rounded value and rounding error (Knuth).
fn exact_difference(x: f64, y: f64) -> (f64, f64) {
    let difference = x - y;
    let taken = x - difference;
    (difference, (x - (difference + taken)) + (taken - y))
}

/// x·y as rounded value and rounding error.
fn exact_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_of_a_needle_keeps_its_digits() {
        // 1 + 2^-52 − 1 along y over a side of length 3: the plain product of unshifted coordinates
        // has no digits left.
        let height = f64::EPSILON;
        let (a, b, c) = (DVec3::ONE, DVec3::new(4.0, 1.0, 1.0), DVec3::new(2.0, 1.0 + height, 1.0));
        assert_eq!(cross_of(a, b, c), DVec3::new(0.0, 0.0, 3.0 * height));
        assert_eq!(unit(cross_of(a, b, c)), DVec3::Z);
        assert_eq!(cross_of(b, c, a), cross_of(a, b, c));
    }
}
