//! Closest points of points, segments and triangles, in closed form.

use glam::DVec3;

/// Closest points of two segments, with their parameters along the segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentSegment {
    /// Parameter in \[0, 1\] on the first segment.
    pub s: f64,
    /// Parameter in \[0, 1\] on the second segment.
    pub t: f64,
    /// The point on the first segment.
    pub first: DVec3,
    /// The point on the second segment.
    pub second: DVec3,
}

impl SegmentSegment {
    /// Returns the square of the distance between the two points.
    pub fn squared(&self) -> f64 {
        self.first.distance_squared(self.second)
    }
}

/// Returns the parameter in \[0, 1\] of the point on segment `p`–`q` that is closest to `x`; 0 if
/// the segment has no length.
pub fn closest_on_segment(x: DVec3, p: DVec3, q: DVec3) -> f64 {
    let d = q - p;
    let length_squared = d.length_squared();
    if length_squared > 0.0 { ((x - p).dot(d) / length_squared).clamp(0.0, 1.0) } else { 0.0 }
}

/// Returns the closest points of segments `p1`–`q1` and `p2`–`q2`. Parallel segments can have many
/// closest pairs; the function returns one of them.
///
/// After Ericson, *Real-Time Collision Detection*, §5.1.9.
pub fn closest_segment_segment(p1: DVec3, q1: DVec3, p2: DVec3, q2: DVec3) -> SegmentSegment {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.length_squared(), d2.length_squared(), d2.dot(r));
    let (s, t);
    if a <= 0.0 {
        s = 0.0;
        t = if e > 0.0 { (f / e).clamp(0.0, 1.0) } else { 0.0 };
    } else {
        let c = d1.dot(r);
        if e <= 0.0 {
            t = 0.0;
            s = (-c / a).clamp(0.0, 1.0);
        } else {
            let b = d1.dot(d2);
            let denominator = a * e - b * b;
            let s0 = if denominator > 0.0 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
            let t0 = (b * s0 + f) / e;
            t = t0.clamp(0.0, 1.0);
            // If t is clamped to the end of its segment, the best s changes too.
            s = ((b * t - c) / a).clamp(0.0, 1.0);
        }
    }
    SegmentSegment { s, t, first: p1 + d1 * s, second: p2 + d2 * t }
}

/// Returns the point of triangle `abc` that is closest to `p`.
///
/// After Ericson, *Real-Time Collision Detection*, §5.1.5.
pub fn closest_on_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && (d4 - d3) >= 0.0 && (d5 - d6) >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let denominator = 1.0 / (va + vb + vc);
    a + ab * (vb * denominator) + ac * (vc * denominator)
}

/// Returns the closest points of two triangles that do not cross, the first on `a`.
pub fn closest_on_triangles(a: &[DVec3; 3], b: &[DVec3; 3]) -> [DVec3; 2] {
    let mut best = [a[0], b[0]];
    let mut least = f64::INFINITY;
    let mut consider = |on_a: DVec3, on_b: DVec3| {
        let squared = on_a.distance_squared(on_b);
        if squared < least {
            (best, least) = ([on_a, on_b], squared);
        }
    };
    let [[a0, a1, a2], [b0, b1, b2]] = [*a, *b];
    a.iter().for_each(|&p| consider(p, closest_on_triangle(p, b0, b1, b2)));
    b.iter().for_each(|&p| consider(closest_on_triangle(p, a0, a1, a2), p));
    for (p1, q1) in [(a0, a1), (a1, a2), (a2, a0)] {
        for (p2, q2) in [(b0, b1), (b1, b2), (b2, b0)] {
            let SegmentSegment { first, second, .. } = closest_segment_segment(p1, q1, p2, q2);
            consider(first, second);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_segments_meet_at_the_crossing() {
        let answer = closest_segment_segment(
            DVec3::new(-1.0, 0.0, 0.0),
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(0.5, -1.0, 2.0),
            DVec3::new(0.5, 3.0, 2.0),
        );
        assert!((answer.first - DVec3::new(0.5, 0.0, 0.0)).length() < 1e-15);
        assert!((answer.second - DVec3::new(0.5, 0.0, 2.0)).length() < 1e-15);
    }

    #[test]
    fn each_region_of_a_triangle_gives_its_point() {
        let (a, b, c) = (DVec3::ZERO, DVec3::X, DVec3::Y);
        for (p, expected) in [
            (DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.2, 0.2, 0.0)),
            (DVec3::new(-1.0, -1.0, 1.0), a),
            (DVec3::new(2.0, -1.0, 0.0), b),
            (DVec3::new(0.5, -1.0, 0.0), DVec3::new(0.5, 0.0, 0.0)),
            (DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.5, 0.5, 0.0)),
        ] {
            assert!((closest_on_triangle(p, a, b, c) - expected).length() < 1e-15);
        }
    }
}
