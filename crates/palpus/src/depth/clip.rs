//! Clipping of a convex polygon, segment or point by a half-plane.

/// Clips a convex polygon, segment or point to the part where `height` is not negative. Writes the
/// corners of this part to `kept`, as far as there is room, and returns their number. `lerp`
/// returns the point between two points at a share of the way.
pub(super) fn clip<P: Copy>(
    points: &[P],
    kept: &mut [P],
    height: impl Fn(P) -> f64,
    lerp: impl Fn(P, P, f64) -> P,
) -> usize {
    let Some(&last) = points.last() else { return 0 };
    let mut count = 0;
    let mut push = |p: P| {
        if count < kept.len() {
            kept[count] = p;
            count += 1;
        }
    };
    let mut from = last;
    let mut from_height = height(from);
    for &to in points {
        let to_height = height(to);
        if (from_height < 0.0) != (to_height < 0.0) {
            push(lerp(from, to, from_height / (from_height - to_height)));
        }
        if to_height >= 0.0 {
            push(to);
        }
        (from, from_height) = (to, to_height);
    }
    count
}
