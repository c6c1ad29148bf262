//! Every tolerance and limit of the engine. No other file contains a numeric literal that decides a
//! result.
//!
//! Each entry states its unit, the reason for its value, and the effect of a larger or a smaller
//! value. In an entry, "this" is the value. "Relative to" a length means that the value is
//! multiplied by that length before use.
//!
//! The values are grouped by top-level module and then by task, in the order of the pipeline. Each
//! group's heading names the modules that use it. A value that several modules use is in the
//! group of the first of these modules.

// algebra: poses and matrices

/// Relative to the largest coordinate: how far rounding may put a vertex above a supporting
/// plane of its polytope. The value is also the largest allowed error of the length of a unit
/// normal or a unit quaternion.
///
/// The value is about fifty ulps. A larger value hides a wrong plane; a smaller one reports mere
/// rounding as an error.
pub const WELL_FORMED_ROUNDING: f64 = 1e-14;

/// Number of sweeps of Jacobi rotations over a 3 × 3 symmetric matrix. The sweeps converge
/// quadratically: after five, only rounding errors are left.
pub const JACOBI_SWEEPS: usize = 8;

// body: from a file to a mesh (mesh, weld, orient)

/// Model units: a coordinate larger than this is refused.
///
/// The exact predicates multiply three coordinates, and then multiply two of these products. The
/// result must not overflow. No real model is this large.
pub const LARGEST_COORDINATE: f64 = 1e50;

/// Model units: a model whose largest extent is smaller than this is refused.
///
/// The exact predicates multiply three coordinates, and the rounding terms of these products must
/// not underflow.
pub const SMALLEST_EXTENT: f64 = 1e-50;

/// Relative to the largest coordinate extent of the point set: two vertices closer than this are
/// merged.
///
/// In a file with 7 significant digits, different points are at least about 1e-7 of the size apart
/// and must stay apart. A larger value merges features of fine meshes; a smaller one leaves
/// cracks where copies of a vertex differ by rounding.
pub const WELD: f64 = 1e-9;

/// Relative to the largest coordinate extent: the side of a cell of the welding grid.
///
/// This value affects only speed. It is far larger than [`WELD`], so a vertex's neighbourhood is
/// nearly always one cell. It is far smaller than the spacing of vertices, so a cell nearly always
/// holds one vertex.
pub const WELD_CELL: f64 = 1e-5;

/// Relative to the longest edge of the triangle: a triangle whose height over its longest edge is
/// smaller than this counts as having no area.
///
/// The normal of such a triangle would be rounding noise. A larger value drops real slivers of CAD
/// meshes and opens the surface.
pub const ZERO_AREA: f64 = 1e-12;

/// Largest number of rounds of edge flips that remove triangles without area.
///
/// One round is enough unless several of these triangles share one long side. More rounds only cost
/// time. Triangles without area that remain after the last round are dropped; each leaves a
/// crack of zero width.
pub const CAP_ROUNDS: usize = 8;

/// A component counts as nested in another component only if this number of its vertices lie inside
/// the other.
///
/// One vertex would be enough if components never crossed. Several vertices distinguish a nested
/// component from one that crosses the surface of the other.
pub const NESTING_SAMPLES: usize = 8;

// body: queries on a mesh (health, mass, triangle_tree, winding)

/// Largest number of pairs of a mesh's own triangles that are tested for crossing, per triangle of
/// the mesh.
///
/// A valid mesh has about ten to twenty pairs of overlapping boxes per triangle. Only meshes that
/// intersect themselves nearly everywhere reach the limit. The reported count is then marked as a
/// lower bound.
pub const SELF_PAIRS: usize = 500;

/// Relative to the cube of the bounding diagonal: a closed mesh or hull with a smaller volume
/// counts as enclosing nothing.
///
/// The volume between two coinciding sheets is rounding noise of either sign, and the centre of
/// mass is computed by dividing by the volume.
pub const LEAST_VOLUME: f64 = 1e-12;

/// Relative to the bounding diagonal: a flat mesh gets the mass of a sheet of this thickness.
///
/// Any positive value gives a body that can be moved; at a thousandth, the model is like a sheet of
/// paper.
pub const SHEET_THICKNESS: f64 = 1e-3;

/// Largest number of triangles in a leaf of the triangle tree. This value affects only speed.
pub const LEAF_TRIANGLES: usize = 4;

/// Relative to the ray's parameter: a ray hits a box if the parameter at its entry exceeds the
/// parameter at its exit by at most this.
///
/// The parameters at the box's slabs are rounded to a few ulps. With zero, triangles that lie in a
/// face of their box would be lost.
pub const RAY_SLACK: f64 = 1e-14;

/// A point is inside an open surface if its winding number is at least this.
///
/// The winding number is 0 far outside the surface, and 1 at a point that the surface encloses.
pub const INSIDE_WINDING: f64 = 0.5;

/// In radii of a box: at this distance or farther, the box's triangles are approximated by one
/// dipole.
///
/// The error of one box falls with the square of this factor, and the errors of many boxes may add
/// up. A factor of 3 keeps the error of the winding number below about 0.01 on real models. A
/// smaller factor is faster.
pub const DIPOLE_REACH: f64 = 3.0;

// body: hulls and polytopes (hull)

/// Model units: the largest coordinate that a hull accepts.
///
/// Products of three differences and their rounding errors must not overflow, because then signs
/// would not be exact.
pub const HULL_LARGEST: f64 = 1e70;

/// Model units: the hull treats a point set smaller than this as one point, and a coordinate
/// smaller than this as zero.
///
/// The last error term of the orientation predicate is about 1e-96 of the product of three sizes.
/// For smaller sets this term underflows, and signs are not exact.
pub const HULL_SMALLEST: f64 = 1e-70;

/// A hull's face that has merged too many facets is merged again, with its merge distance
/// multiplied by this factor.
///
/// The factor is small enough to separate the nearly coplanar facets that caused the failure. It is
/// large enough to merge facets that differ less.
pub const HULL_MERGE_RETREAT: f64 = 0.1;

/// Relative to the merge distance: a face whose merge distance is below this merges only exactly
/// coplanar facets.
///
/// This value times [`COPLANAR`] is 1e-15 of the size, which is the rounding error of a rotated
/// body.
pub const HULL_MERGE_SMALLEST: f64 = 1e-6;

/// After this number of reductions of the merge distance, the faces of a hull merge only exactly
/// coplanar facets.
///
/// Each reduction costs as much as the merge itself, and nearly all hulls need no reduction. A
/// smaller value leaves more slivers in hulls that are a few merge distances thick.
pub const HULL_MERGE_PASSES: u32 = 32;

// body: facets, and the rounding of coordinates in a file (facet, precision)

/// Relative to the model's bounding diagonal: how far a vertex may lie above or below the plane of
/// a face and still count as lying in it.
///
/// Coplanar triangles must merge into one polygon: the Gauss arc between two coplanar triangles has
/// no length and would stall every depth walk. A larger value flattens real curvature; a smaller
/// one leaves the faces of rotated boxes cut into triangles.
pub const COPLANAR: f64 = 1e-9;

/// A coordinate with at least this many significant decimal digits was computed, not read from a
/// decimal file.
///
/// A double needs up to 17 digits, and the shortest decimal form of a computed double rarely has
/// fewer than 15 digits. Coordinates in files have 6 to 9 digits.
pub const COMPUTED_DIGITS: i32 = 15;

/// In steps of the file's decimal grid: how far rounding may put a vertex off the plane or smooth
/// surface that it belongs to. That distance is the *noise* of the surface.
///
/// Rounding moves each of the four points that are compared by up to 0.87 steps. A smaller value
/// leaves CAD models cut into slivers (round peg: 4870 pieces at 1e-9 of its size, 1 piece at two
/// steps). A larger value flattens real features.
pub const NOISE_PER_STEP: f64 = 2.0;

/// Cosine: two neighbouring triangles whose normals differ by a larger angle are never one face,
/// even if all their vertices lie in one plane.
///
/// The normal of a needle may be wrong by tens of degrees and must not prevent merging. The two
/// sides of a surface that folds back onto itself must not merge.
pub const FOLDED: f64 = 0.5;

// body: patches grown over the facets (trial_hull, grow, whole, wide_hull)

/// Area divided by the squared longest side: a triangle of a trial hull with a smaller ratio is a
/// needle, and its plane is not used.
///
/// The plane of a needle is noise and would cut the hull anywhere. Without that plane the tested
/// hull is slightly larger, so the containment test errs on the safe side. A larger value refuses
/// good patches; with a smaller one, noise can hide a surface that enters a hull.
pub const NEEDLE_NORMAL: f64 = 1e-10;

/// Factor of the rounding error of a point's height above a triangle's plane. The error is this
/// value times the largest coordinate, times the squared longest side over the area. For points
/// nearer to the plane than the error, the exact determinant decides the side.
///
/// The value is about twenty ulps. A larger value only computes the determinant more often; a
/// smaller one accepts wrong signs.
pub const ORIENTATION_ROUNDING: f64 = 4e-15;

/// Multiples of the surface's noise: a patch thinner than this is flat.
///
/// Each of two facets may deviate from the common plane by the noise, to either side. The value is
/// well above [`ENTERED`]. So every patch that is not flat has an interior, and containment can be
/// tested there. A larger value turns thin curved patches into plates.
pub const FLAT_PATCH: f64 = 8.0;

/// Multiples of the surface's noise: the surface enters a hull if it comes deeper into the hull
/// than this.
///
/// Rounding may put a facet below the plane of a neighbouring face of the hull. With a larger
/// value, thin wedges of a hull may extend beyond the solid (over a notch, by less than twice this
/// value). A smaller value refuses patches because of rounding (peg: 135 pieces at 1e-4, 41 at
/// 0.25, both at a noise of 1e-6).
pub const ENTERED: f64 = 0.25;

/// Number of a trial hull's newest planes against which whole boxes of the triangle tree are
/// tested.
///
/// A new point adds a fan of about six faces. This value affects only speed.
pub const FENCE_PLANES: usize = 12;

/// A connected part of the surface with at least this many facets is first tried as one patch.
/// Smaller parts grow just as fast facet by facet.
pub const WHOLE_FACETS: usize = 64;

/// A patch with at least this number of points uses a hull that stores each face's neighbours.
///
/// Scanning all faces of a small hull is faster than searching from neighbour to neighbour. This
/// value affects only speed.
pub const WIDE_PATCH: usize = 400;

/// Number of a wide hull's largest new faces whose planes are tested first against boxes and
/// triangles.
///
/// A new point's fan has about six faces; a fan that closes over an opening has hundreds of faces,
/// nearly in one plane. This value affects only speed.
pub const WIDE_FENCE: usize = 24;

/// A triangle counts as entering a wide hull after it was cut by this number of planes.
///
/// Each cut removes more than half of the remaining triangle, so the triangle shrinks
/// geometrically. Only triangles that touch the hull at a point reach the limit. The patch is then
/// refused. This is safe, because smaller patches stay valid.
pub const WIDE_CUTS: usize = 100;

// body: sheets (mesh/sheet)

/// Relative to the diagonal of a component's bounding box: a component with an opening at least
/// this wide is a sheet, whose both sides can be touched.
///
/// With a larger value, the inside of a tube with narrow ends cannot be touched. With a smaller
/// value, a scan of a solid with small holes consists of flat pieces, which are more and thinner.
pub const SHEET_OPENING: f64 = 0.02;

// body: patches dissolved and grown again (decompose)

/// Facets: a patch of at most this size is dissolved if its neighbours can take all its facets.
///
/// The larger a patch is, the less often its neighbours can take all of it. Larger sizes were not
/// tried.
pub const DISSOLVED_FACETS: usize = 8;

/// Corners of facets: if a patch has more corners, it is not tried as the receiver of a dissolved
/// patch's facets.
///
/// Each trial rebuilds a hull. A larger value only costs time: large patches grew early and have
/// already refused these facets.
pub const RECEIVER_CORNERS: usize = 300;

/// Seed of the random numbers of the regrowth. With another seed, the number of pieces changes by
/// one or two in two hundred.
pub const REGROWTH_SEED: u64 = 0x2002_0302;

/// Number of facets that the regrowth tries, per facet of the model. Small models converge earlier
/// (the teaspoon after 120 trials per facet).
pub const REGROWTH_PER_FACET: usize = 150;

/// Largest number of facets that the regrowth tries.
///
/// Each trial takes 5 to 10 microseconds. A larger value gives fewer pieces for models of more than
/// 500 facets, and makes their preparation slower.
pub const REGROWTH_MOST: usize = 75_000;

/// Facets: a removal of patches (the "ruin" of ruin and recreate) does not start from a larger
/// patch, since larger patches seldom disappear.
pub const REGROWN_CENTRE: usize = 12;

/// Facets: larger patches are never removed for regrowth, since the time to grow a patch is
/// quadratic in its size.
pub const REGROWN_MEMBER: usize = 24;

/// Largest number of patches that are removed at once. Values from 4 to 16 gave the same number of
/// pieces on the cup and the spoon.
pub const REGROWN_PATCHES: usize = 6;

/// The product of this value and a random number in \[0, 1) is added to the cosine that ranks a
/// facet for joining a patch. The values 0.2 and 5 gave the same result.
pub const REGROWTH_JITTER: f64 = 1.0;

/// The share of the free facets that are not offered to the surrounding patches. With 0, all
/// trials that offer facets would be alike.
pub const REGROWTH_KEPT_BACK: f64 = 0.3;

// body: thick pieces (thicken)

/// The slope of an inward path predicts the distance to the surface. The true distance may be
/// smaller than the predicted distance by this share.
///
/// At a piece's corner on the medial axis, the known distance is too small by up to this share.
/// With a larger value, pieces overlap more around the medial axis. With a smaller one, the
/// roughness of the surface ends paths early, and each search for a nearer part of the surface is
/// more expensive.
pub const INWARD_SLACK: f64 = 0.1;

/// Smallest growth of the distance to the surface, per length, at which an inward path leaves a
/// vertex. At the edge of a blade, this growth equals the sine of half the blade's angle.
///
/// A larger value leaves the pieces along blades thin; with a smaller one, paths follow the
/// rounding of needles' normals.
pub const INWARD_FIRST_SLOPE: f64 = 0.05;

/// Smallest growth of the distance, per length, along a later step of an inward path. Where the
/// growth is smaller, the surrounding parts of the surface lie opposite each other.
pub const INWARD_SLOPE: f64 = 0.3;

/// Number of steps of an inward path: the first step leads to the medial axis, the second along it.
///
/// With only one step, corners of flat faces with rounded rims reach no deeper than the rounded
/// rim. On the armadillo, the force then vanishes in 5 % of the test pushes, instead of 1 %. A
/// third step costs as much as the second and has no visible benefit.
pub const INWARD_STEPS: usize = 2;

/// Largest number of searches for a nearer part of the surface in one step of an inward path; about
/// 4 are needed. A step that needs more searches is not taken.
pub const INWARD_SEARCHES: u32 = 32;

/// If a part of the surface limits the length of a step toward the medial axis, the step is
/// shortened further by this share.
///
/// With a larger value paths end short of the medial axis; a smaller one needs more searches for
/// the nearest surface (at 0 twice as many).
pub const INWARD_CUT: f64 = 0.06;

/// Largest number of steps of the search for the point of a convex hull that is nearest to the
/// origin. The hull of a few normals takes 1 to 10 steps.
pub const HULL_POINT_STEPS: u32 = 32;

/// The search of [`HULL_POINT_STEPS`] ends if a step would reduce the squared length by less than
/// this. The direction of the found point is only a first estimate of the best inward path.
pub const HULL_POINT_GAIN: f64 = 1e-9;

/// Multiplied by the distance to the surface: how far below its patch an inner corner of a piece
/// may lie.
///
/// The value must be above 1/(1 − [`INWARD_SLACK`]), because otherwise a patch would refuse its own
/// inward paths. With a larger value, pieces extend farther below neighbouring patches, and report
/// depths larger than the distance to the nearest surface.
pub const THICK_DEPTH: f64 = 1.2;

/// Relative to its depth below the patch: an inner corner that is nearer than this to another inner
/// corner is left out.
pub const THICK_MERGED: f64 = 0.1;

/// Largest number of inner corners of a piece. Each corner makes depth and distance queries slower;
/// few pieces have more than 8 corners.
pub const THICK_CORNERS: usize = 16;

/// Multiples of the surface's noise: the surface enters a thick hull if it comes deeper into the
/// hull than this.
///
/// The value is larger than [`ENTERED`] because of notches in the outline of flat patches. A patch
/// may extend over a notch by about the noise, and the walls of the notch go down into the piece
/// below the patch. With a larger value, pieces extend farther beyond the solid. With a smaller
/// one, rounding leaves pieces thin (M16 nut: the force vanishes in 16 % of the test pushes at
/// 0.25, in 6 % at 2).
pub const THICK_ENTERED: f64 = 2.0;

/// All inner corners of a piece are tried together at these shares of the distance from the surface
/// to the ends of their paths.
pub const THICK_SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.35, 0.2];

/// Largest number of times that an inner corner is moved half way back to the surface, because the
/// surface enters the hull with this corner.
pub const THICK_RETREATS: i32 = 3;

/// Facets: patches with more facets get no inner corners.
///
/// The trial hull of so many points takes a tenth of a second and is built several times. A larger
/// value makes the preparation of smooth bodies with a few dents slow.
pub const THICK_PATCH: usize = 4000;

/// Relative to the depth that the inward paths from the patch's corners reach: a facet wider than
/// this gets an inward path of its own.
///
/// A smaller value costs time on fine meshes and does not change their pieces.
pub const WIDE_FACET: f64 = 0.5;

// body: pieces and their admissible normals (piece, admissible)

/// Multiples of the surface's noise: a facet lies in a face of its piece if it is within this
/// distance of the face's plane.
///
/// The facet may deviate from its own plane by the noise, and the merge into the face may add the
/// same error again. The growth of patches allows both errors.
pub const ON_FACE: f64 = 4.0;

/// A face of a piece is original if at least this share of its area lies on the mesh.
///
/// The value is slightly less than one half, so that rounding does not exclude a share of exactly
/// one half.
pub const COVERED_HALF: f64 = 0.499_999;

/// If at least this share of a face's area lies on the mesh, every point of the face counts as
/// lying on the mesh.
///
/// Rounding, and the straight corners that a hull drops, uncover a smaller share of a face. A
/// larger value causes needless searches of triangles; a smaller one counts a bridged gap as
/// surface.
pub const COVERED_WHOLE: f64 = 0.999;

/// Radians: how far a contact normal may lie beyond the true normals of its features on the source
/// mesh.
///
/// The error of the direction between two closest points is their rounding error divided by their
/// distance. The normals of neighbouring pieces meet at a limit; with this slack, both pieces
/// report a contact at the limit, instead of neither. With a larger value, a piece also reports
/// contacts on its neighbour's surface. A smaller one loses contacts at seams of bodies that nearly
/// touch.
pub const ADMISSIBLE_ANGLE: f64 = 1e-4;

/// Sine of the angle by which a point beside a valley may be below the mesh beyond the valley. At
/// this angle, the plane on this side of the valley no longer matters to the point.
///
/// With a smaller value, the force changes faster where a point passes a ridge that is narrower
/// than the contact tolerance. With a larger one, it pushes points that are behind such a ridge.
pub const VALLEY_BELOW: f64 = 0.25;

/// Share of the contact tolerance. Nearer to a valley than this, a point is held by both planes
/// beside it, at its height above each.
///
/// With a larger value, the gap grows faster from the height to the distance. With a smaller one, a
/// tool that is pressed into the valley crosses it in one step, and the force changes sides in each
/// step.
pub const VALLEY_SHARE: f64 = 0.5;

/// Radians: the spherical cap around a piece's normals is widened by this. So the cap still
/// contains a normal after rounding in the other body's frame.
///
/// A larger value tests more normals that are not admissible for the piece. A value below the
/// rounding of a transformed normal (1e-15) loses depths.
pub const CAP_SLACK: f64 = 1e-3;

/// Cosine of the half angle of the widest cap that is used. A wider cap excludes hardly anything,
/// and a cap beyond half a sphere is not convex.
///
/// A smaller value allows caps up to the half sphere; 0 or less gives wrong results for arcs. A
/// larger value only tests more normals.
pub const CAP_LEAST: f64 = 0.05;

/// The search for the triangle at a closest point, on a partly covered face, examines at most this
/// many triangles. On a face with more triangles, every point counts as lying on the mesh.
///
/// This limit bounds the time of a tick. A partly covered face bridges a gap between facets of one
/// plane, and has only a few triangles.
pub const ADMISSIBLE_TRIANGLES: usize = 256;

// body: hierarchy (hierarchy, bounds)

/// Cosine of the angle within which a face of an inner hull and an original face of a piece can be
/// the same face.
///
/// [`COPLANAR`] decides whether they are the same; this value only keeps the two sides of a plate
/// apart.
pub const SAME_FACE: f64 = 0.5;

/// Each child of a node has at least the node's number of pieces divided by this.
///
/// With this limit, the depth of the tree is at most the logarithm of the number of pieces to the
/// base 8/7. A smaller value forces worse cuts; a larger one allows deeper trees and stacks.
pub const SPLIT_SHARE: usize = 8;

/// Number of steps toward the farthest point in the search for a small bounding sphere. Step k goes
/// 1/(k + 4) of the way to this point.
///
/// The resulting radius is within a few percent of the smallest radius. Any number of steps is
/// safe, since the radius is measured at the end.
pub const SPHERE_STEPS: u32 = 24;

/// In debug builds, the hierarchy's validation checks this many heights of a child's vertices above
/// the planes of its parent's hull.
///
/// For hulls of up to about sixty vertices, the validation checks all heights. A larger value finds
/// a broken hull sooner, and makes debug tests on scans slow.
pub const VALIDATED_HEIGHTS: usize = 4096;

/// The hierarchy's validation takes this many evenly spaced nodes, and checks the bounds of all
/// nodes above them.
pub const VALIDATED_PIECES: usize = 128;

// body: work in parts (body, hierarchy, thicken, admissible)

/// Number of pieces in one part of the work.
///
/// A piece takes about 10 µs. With fewer pieces, distributing the parts costs more; with more
/// pieces, workers are idle at the end. This value affects only speed.
pub const PIECES_PER_PART: usize = 64;

/// A part of the hierarchy with fewer pieces than this is built by one worker.
///
/// In larger parts, each node's hull is a work item of its own. This value affects only speed.
pub const SUBTREE_PIECES: usize = 512;

/// Number of vertices whose inward paths form one part of the work. This value affects only speed.
pub const INWARD_PATHS_PER_PART: usize = 256;

/// Number of pieces whose admissible normals form one part of the work. A part takes some
/// milliseconds. This value affects only speed.
pub const OWNERS_PER_PART: usize = 1024;

/// Number of triangles whose normals form one part of the work. A part takes about a millisecond.
/// This value affects only speed.
pub const NORMALS_PER_PART: usize = 16384;

// collision: both the march and GJK (scale, gjk/simplex)

/// Relative to the pair's size: bodies nearer than this count as touching, and the depth walk gives
/// their contact.
///
/// The direction between two points this near is noise. A larger value would report a false contact
/// at zero separation.
pub const TOUCHING: f64 = 1e-12;

/// Relative to the largest coordinates of the pair in either frame: the rounding of a transformed
/// vertex. The tests of the march and of GJK ignore differences below it.
///
/// The value is eight ulps: a transformation is nine products and their sums. With a larger value,
/// the march stops before it reaches the closest points; with a smaller one, noise can make the
/// march alternate between parallel edges and faces.
pub const MARCH_NOISE: f64 = 8.0 * f64::EPSILON;

// collision: the march (march, scale, clip)

/// Largest number of states that the march may visit. A search without earlier results visits about
/// 200 states on a hull of 5000 vertices. A search from the previous tick's features visits 1 to 5.
///
/// A larger value only delays the fallback to GJK when the march fails without repeating a state; a
/// smaller one sends searches without earlier results to the fallback.
pub const MARCH_STEPS: u32 = 1000;

/// Relative to the distance: how far a result's distance may exceed the separation along the
/// result's normal. The separation along a normal is a proven lower bound of the distance.
///
/// A smaller value checks good results a second time because of the rounding of planes; a larger
/// one accepts worse results.
pub const MARCH_PROOF: f64 = 1e-12;

/// Relative to the distance: the largest difference that the check of [`MARCH_PROOF`] accepts,
/// even where rounding explains a larger one.
///
/// Only bodies whose distance is below about 1e-7 of their size come near this limit. A larger
/// value would report touching bodies as separate; a smaller one sends more of these few pairs to
/// the fallback.
pub const MARCH_DOUBT: f64 = 1e-2;

/// In debug builds, one in this many results of the march and of the depth query is validated.
///
/// A validation costs as much as a query that starts from the previous result. A smaller value
/// makes debug tests slow; a larger one finds errors later.
pub const VALIDATED_ANSWERS: u64 = 16;

/// Sine of the angle below which two edges are nearly parallel; their closest points are then
/// refined by a second solve.
///
/// A single solve has an error of about the rounding error divided by the squared angle. A larger
/// value wastes a few nanoseconds.
pub const NEARLY_PARALLEL: f64 = 1e-2;

// collision: GJK (gjk)

/// GJK has converged if the relative gap between its upper and lower bounds of the distance is
/// below this.
pub const GJK_GAP: f64 = 1e-13;

/// Number of steps after which GJK gives up. GJK takes 5 to 20 steps on hulls of any size, and 40
/// on needles that nearly touch.
///
/// A larger value only costs time where GJK does not converge; a smaller one returns points that
/// are not the closest.
pub const GJK_STEPS: u32 = 128;

/// GJK may take this many steps in a row without shortening its vector to the origin.
///
/// Near contact, changes of the length are lost in rounding while the normal still turns. With a
/// larger value, GJK repeats its steps longer on parallel faces. With a smaller one, GJK stops
/// before it finds the faces.
pub const GJK_PLATEAU: u32 = 8;

// collision: spheres and boxes (bounds)

/// Squared sine of the angle between two box axes. If the angle is smaller, the cross product of
/// the axes is not tested as a separating axis.
///
/// The direction of the product would be noise, and the face normals of the boxes give nearly the
/// same gap. A larger value only loosens the bound.
pub const PARALLEL_AXES: f64 = 1e-12;

// collision: the front (motion bound, front)

/// Relative to the bodies' size: the unit in which the motion bound counts.
///
/// The value is about 1.5e-11. A tick adds at least one unit. The sum can count 2⁶¹ units, which is
/// a motion of some 3e7 sizes. With a smaller unit, this limit is reached sooner, and the unit
/// comes near the rounding of transformed points (1e-16 of the coordinates). A larger unit only
/// tests pairs early.
pub const MOTION_QUANTUM: f64 = 1.0 / (1u64 << 36) as f64;

/// Relative to the bodies' size and their distance: each tick adds this to the motion bound for the
/// rounding of transformed points.
///
/// The value is about fifty roundings. With a smaller value, a pair of bodies far from the origin
/// may be tested too late. A larger value tests resting pairs too often.
pub const MOTION_NOISE: f64 = 1e-14;

/// Relative to the smaller body's half diagonal: a larger motion between two queries is a jump.
/// After a jump the front starts again from the roots, and all cached results of pairs are dropped.
///
/// A hand at 1 m/s moves a 10 cm tool by 1 % of its size in a tick. With a larger value, a depth
/// walk may start on the wrong side of a body after a jump and not leave it. With a smaller one,
/// queries start without cached results in fast motion. After a larger motion, nearly all close
/// pairs must be tested, and a search from the roots visits fewer pairs.
pub const JUMP: f64 = 0.1;

/// Like [`JUMP`], for bodies that were not near each other in the last query.
///
/// Then no depth walk can start on the wrong side. With 0.1, the front of a tool of 8 mm at 0.4 m/s
/// started again in each query, and the first of these queries had too little work: in the air, the
/// force changed by 1.5 N in a step.
pub const JUMP_APART: f64 = 1.0;

/// Ticks: if the sphere bound shows that a pair need not be tested for more ticks than this, no
/// tighter bound is computed.
///
/// A sphere test costs a tenth of a march, and its bound is less tight. This value affects only
/// speed.
pub const SPHERE_WAIT: f64 = 8.0;

/// Relative to the distance of a piece from the other body's origin: an upper bound of the rounding
/// error of a point bound. The bound's normals and base point have single precision.
pub const POINT_BOUND_ROUNDING: f64 = 4e-7;

/// Relative to the distance of a vertex from the middle of its node: an upper bound of the rounding
/// error of its height along a unit vector, in single precision. The two factors, the product and
/// two sums are each rounded by at most half of the machine epsilon.
pub const OFFSET_ROUNDING: f32 = 3.0 * f32::EPSILON;

/// Ticks: like [`SPHERE_WAIT`] for the box bound. This value affects only speed.
pub const BOX_WAIT: f64 = 4.0;

/// Share of the estimated speed (motion per tick) that is kept from tick to tick. This value
/// affects only speed.
pub const PACE_FADE: f64 = 0.8;

/// The number of times that an expected path of the bodies repeats their last motion.
///
/// Pairs that slide along each other wait for about this number of ticks. With a larger value, more
/// pairs wait at a time, and the bodies leave the path earlier. This value affects only speed.
pub const PATH_LENGTH: f64 = 16.0;

/// A pair slides along an expected path if it can then wait for this times the motion for which it
/// would wait otherwise. This value affects only speed.
pub const PATH_GAIN: f64 = 2.0;

/// Expected paths are used if at least this number of pairs were due in the last query. If fewer
/// are due, to follow the paths takes longer than to measure these pairs. This value affects only
/// speed.
pub const PATH_PAIRS: u32 = 32;

/// Relative to the number of places of a front: the number of pairs for which an expected path has
/// room. Other pairs are due sooner. This value affects only speed.
pub const PATH_ROOM: f64 = 1.0 / 16.0;

/// Relative to the tolerance plus the length of an expected path: more than the rounding errors of
/// the gaps of a pair, which are compared in single precision. This is eight such roundings.
pub const PATH_ROUNDING: f64 = 1e-6;

/// In tolerances: two halves of a split pair may be merged if both halves, and the whole, have at
/// least this clearance.
///
/// A smaller value splits and merges the same pairs again and again; a larger one keeps more pairs
/// in the front.
pub const MERGE_CLEARANCE: f64 = 1.0;

/// If at most this number of pairs of pieces touch, each query measures every pair and returns the
/// corners of its patch.
///
/// A query can measure this number of pairs in a millisecond. A smaller value simplifies contacts
/// although there is time to measure them. With a larger one, a query reaches its work limit first.
pub const REST_FROM: f64 = 128.0;

/// If at least this number of pairs touch, each pair gives one contact and keeps it while it is
/// valid.
///
/// With a value nearer to [`REST_FROM`], one more touching pair would change the contacts
/// noticeably.
pub const REST_ALL: f64 = 512.0;

/// Relative to the radius of the smaller piece of a pair: the largest motion over which the pair's
/// result may be kept (its *rest*).
///
/// A larger value moves contacts past the ends of the faces on which they lie.
pub const REST_TRAVEL: f64 = 0.2;

/// Share of the motion of [`REST_TRAVEL`] over which the first result of a pair is kept.
pub const REST_FIRST: f64 = 0.5;

/// Allowed error of a separation just before its pair is measured again, relative to the tolerance
/// plus the deepest depth.
///
/// The error of the force is then at most a hundredth, and the errors of many contacts cancel. A
/// larger error can be felt; a smaller value measures more pairs in each query.
pub const REST_ERROR: f64 = 0.03;

/// The next rest of a pair is this share of the motion over which the error would reach
/// [`REST_ERROR`].
pub const REST_SAFETY: f64 = 0.7;

/// A pair's rest is shortened by up to this share, differently for each pair, so that not all pairs
/// must be measured in the same tick.
///
/// A larger value measures more pairs; with a smaller one, the cost of ticks varies more.
pub const REST_SPREAD: f64 = 0.5;

/// The rest of a pair ends if its extrapolated contact presses harder by this share than all but a
/// few contacts of its direction.
///
/// The force follows the hardest contact. On a nut that is loose on its bolt, contacts that had
/// moved past the ends of their faces made the force up to 27 % too large. A smaller value measures
/// more pairs.
pub const REST_OUTLIER: f64 = 0.05;

/// The number of hardest contacts of a direction that do not rest.
///
/// With 1, two contacts that have both moved past the ends of their faces can keep each other at
/// rest. A larger value measures more pairs.
pub const REST_HARDEST: u32 = 2;

/// A pair's rest may be at most this many times its previous rest.
pub const REST_GROWTH: f64 = 4.0;

/// A pair without a contact is idle only if it has no contact for at least this number of ticks at
/// the present pace.
///
/// Computing how long it has none takes about as long as measuring the pair twice. With a smaller
/// value, this does not pay; with a larger one, fewer pairs are idle.
pub const IDLE_LEAST: f64 = 4.0;

/// Relative to the angle by which the direction of the closest points may turn in the ticks of
/// [`IDLE_LEAST`]: larger angles to the admissible normals are not computed to the end. This value
/// affects only speed.
pub const IDLE_ENOUGH: f64 = 8.0;

/// Ticks at the present pace after which a pair is tried again that could not become idle. This
/// value affects only speed.
pub const IDLE_RETRY: f64 = 32.0;

/// Radians: the rounding of a stored direction in single precision.
///
/// The value is some ten roundings. With a smaller one, a pair might be idle too long by this
/// rounding; a larger one only shortens its idleness.
pub const IDLE_ROUNDING: f64 = 1e-6;

/// Largest turn (rad) of an idle pair, if a vertex of the other piece may admit the normal of a
/// valley after a larger turn.
///
/// With a larger value, more vertices are within the turn, and fewer pairs are idle. With a smaller
/// one, pairs are idle for a shorter time.
pub const IDLE_TURN: f64 = 0.05;

/// Relative to [`QuerySettings::turn`](crate::detect::QuerySettings): the turn for which idle pairs
/// are computed.
///
/// With a smaller value, idleness ends more often when the bodies turn faster; with a larger one,
/// fewer pairs are idle.
pub const IDLE_TURN_AHEAD: f64 = 2.0;

/// Share of the turn for which idle pairs are computed that is kept to the next query, if the
/// bodies turn more slowly.
///
/// With a smaller value, idleness ends more often where the speed varies; with a larger one, fewer
/// pairs are idle for some time after a fast turn.
pub const IDLE_TURN_FADE: f64 = 0.99;

/// A query of two bodies is divided into parts for several threads if the product of their numbers
/// of pieces is at least this.
///
/// Each part costs some tenths of a microsecond in each tick, even without contacts. A nut on its
/// bolt has 9 million pairs of pieces, and a spoon in a cup 20 thousand.
pub const DIVIDED_FROM: usize = 1_000_000;

/// Helper threads take part in a divided query if the last query had at least this much work, in
/// units of [`crate::algebra::Work`].
///
/// This work takes about 0.1 ms. To hand over the data of a part to another thread takes about a
/// microsecond, so helpers would make shorter queries slower.
pub const HELPED_WORK: u64 = 1000;

/// Up to this number of touching pairs, each pair is measured. If more pairs touch, a sample of
/// about this size represents all pairs.
///
/// For contacts that all push in the same direction, the relative error of the wrench of an even
/// sample of n contacts is about s/√n. Here s is the relative spread of the depths at which the
/// contacts press. A larger value costs time on close-fitting bodies.
pub const SAMPLE_PAIRS: f64 = 160.0;

/// Largest size of the sample, in pairs, also while it shrinks gradually.
///
/// A larger value costs time where many pairs suddenly touch. A smaller value lets the force jump
/// more often.
pub const SAMPLE_MOST: f64 = 1.25 * SAMPLE_PAIRS;

/// If more than this share of the pairs within the tolerance are new, the size of the sample is set
/// before they are measured.
///
/// With a smaller value, pairs that slide along each other are counted more often, which costs
/// time. With a larger one, a query may measure more pairs than the sample has.
pub const NEW_PAIRS: f64 = 0.1;

/// The contacts in the last part of the sample have smaller weights. This value is the size of that
/// part, as a share of the sample.
///
/// A larger value lets contacts come and go more gradually, and measures more pairs.
pub const SAMPLE_FADE: f64 = 0.25;

/// From query to query, the sample grows or shrinks by at most this share of its size.
///
/// The weight of a contact then changes by at most SAMPLE_PACE / SAMPLE_FADE in a query.
pub const SAMPLE_PACE: f64 = 0.02;

/// A pair outside the sample is not measured if it presses harder than the sample by at most this
/// share.
///
/// The size of the force is wrong by up to this share. A smaller value measures more pairs.
pub const SAMPLE_EXCESS: f64 = 0.05;

/// A pair outside the sample is not measured if another pair outside the sample presses harder by
/// this share.
///
/// The share is above 0, so that of two pairs that press equally hard at least one is measured.
pub const SAMPLE_EQUAL: f64 = 0.02;

/// A sample with this number of contacts stands for all pairs that touch in the same directions,
/// also while some of its contacts end.
///
/// A larger value costs time on close-fitting bodies. With a smaller one, a hard contact may be
/// missed for some ticks after an impact.
pub const SAMPLE_LARGE: usize = 40;

/// If the separation of the deepest contact rises by this share of its depth below the contact
/// offset (at least of the contact offset), the bounds of all represented pairs are tested.
///
/// A smaller value tests them more often. With a larger one, a pair may press harder than all
/// contacts that are left for some ticks.
pub const FLOOR_RISE: f64 = 0.25;

/// A contact has its full weight if it presses harder than the sample by [`SAMPLE_EXCESS`] plus
/// this share.
///
/// A smaller value makes the force change faster while the contact appears.
pub const SAMPLE_FULL_EXCESS: f64 = 0.05;

/// Lower limit of the pressing depth in comparisons with the sample, as a share of the contact
/// offset.
///
/// With 0, each contact that has just started to press would be measured.
pub const SAMPLE_LEAST: f64 = 0.05;

/// A pair is compared with at most this number of contacts of the sample and of other pairs.
pub const SAMPLE_LOADS: usize = 512;

/// Relative to the radius of the smaller piece: the motion after which a represented pair is
/// measured again. A represented pair touches but is not in the sample.
///
/// Surfaces that slide along each other have different contacts after about this motion. A smaller
/// value costs time. With a larger one, a deeper contact may be missed for longer.
pub const SAMPLE_TRAVEL: f64 = 1.0;

/// Assumed change of a represented pair's gap relative to the motion that causes it.
///
/// Surfaces that slide along each other change their gap by a small part of the motion. A larger
/// value costs time. With a smaller one, a pair may be deeper than its bound for some ticks.
pub const REPRESENTED_SLOPE: f64 = 0.04;

/// In a small sample: assumed change of a represented pair's gap in a motion like the last one, as
/// a multiple of the change of its nearest bound in the last motion.
///
/// Bodies that fall onto each other approach as fast as they move. A larger value costs time. With
/// a smaller one, a pair may be deeper than its bound for some ticks if the bodies speed up.
pub const REPRESENTED_APPROACH: f64 = 1.5;

/// In a large sample, surfaces count as sliding along each other, except where the nearest bound of
/// a represented pair changed by at least this share of the last motion.
///
/// On a nut that turns on its bolt, nine tenths of the pairs stay below. With a smaller value,
/// pairs are tested more often. With a larger one, a contact may begin some ticks late where bodies
/// hit each other.
pub const REPRESENTED_IMPACT: f64 = 0.3;

/// A pair that is apart and has no contact is represented down to this share of its distance.
///
/// A contact may begin there, but it presses only if the pieces are near. With a smaller value, it
/// may begin late. A larger one measures more pairs.
pub const REPRESENTED_NEARER: f64 = 0.5;

/// Smallest motion after which a represented pair is tested again, as a share of the motion of
/// [`SAMPLE_TRAVEL`].
///
/// With a smaller value, each query tests the pairs whose gap is near its bound.
pub const REPRESENTED_LEAST: f64 = 0.05;

/// Smallest motion after which a represented pair is tested again, as a share of the tolerance.
///
/// Behind a coupling, the tolerance is larger than the motion of a query. A smaller value costs
/// time where bodies slide slowly. With a larger one, a pair may be deeper than its bound for a
/// query.
pub const REPRESENTED_PAUSE: f64 = 0.25;

/// Relative to the clearance of [`MERGE_CLEARANCE`]: the motion after which a refused merge is
/// tried again.
pub const MERGE_RETRY: f64 = 0.25;

/// The wake time of a pair of nodes implies a least distance. The front's validation reports an
/// error if the true distance is smaller by more than this value times the pair's size.
///
/// The results of marches from different starts differ by up to 1e-11 of the size. A larger value
/// hides a wake time that is too late; a smaller one reports mere rounding.
pub const LATE_WAKE: f64 = 1e-10;

/// Number of places of the front that the front's validation checks in each query of a debug build.
///
/// A larger value finds an error sooner after it occurs, and makes debug tests slow.
pub const VALIDATED_PLACES: u32 = 64;

// depth: the walk over the Minkowski difference (antipodal, gauss_map, overlay, walk)

/// Relative to the pair's size: an improvement of the depth smaller than this ends the walk.
///
/// Each step must decrease the depth, so the walk ends. The rounding of a support offset is a few
/// ulps of the size.
pub const WALK_DECREASE: f64 = 1e-15;

/// Radians: a normal counts as a corner of the overlap even if it lies outside a normal cone by up
/// to this.
///
/// The normal cones of aligned boxes, plates and prisms only touch, so rounding (1e-15) decides the
/// signs of dot products. With a smaller slack, a walk stalls on aligned bodies. A larger slack
/// accepts false corners. A false corner has an offset that is too small by the slack times the
/// size, and hides a true corner beside it. Its witness points are wrong by the slack divided by
/// the angle between the two corners.
pub const CONE_SLACK: f64 = 1e-14;

/// Sine: two edges that are nearer to parallel than this form no facet, since the facet's normal
/// would be noise.
///
/// The ends of two nearly coincident Gauss arcs are face normals within [`CONE_SLACK`] of the other
/// cone, so nothing is lost as long as this value is at most [`CONE_SLACK`]. For a larger sine,
/// rounding still moves a crossing along its arcs, by the rounding error divided by the sine.
/// Therefore each crossing is tested against both cones before it is accepted.
pub const PARALLEL_EDGES: f64 = 1e-14;

/// Radians: features that lie in the supporting plane within this angle are part of the walk's
/// current facet of the CSO.
///
/// The walk does not turn its plane about the sides of this facet. So the depth at the end of a
/// walk may exceed a local minimum by this angle times the size. With a value below the rounding of
/// the pose, the walk would go from corner to corner of a box on a table.
pub const FLUSH_FACET: f64 = 1e-9;

/// Radians: features that lie in the supporting plane within this angle share one witness point,
/// the middle of their overlap.
///
/// The value is the merge distance divided by the length of an edge of a hundredth of the size. A
/// larger value puts witness points off their bodies (by half of this value times the size). With a
/// smaller one, small errors of merged faces decide which corner of a box on a table gets the
/// contact.
pub const FLUSH_WITNESS: f64 = 1e-7;

/// Relative to the pair's size: the walk's result is rejected if its true offset exceeds the walk's
/// offset by more than this. It is also rejected if another seed's offset is lower than the walk's
/// by more than this.
///
/// The value is slightly more than the merge distances of two bodies together. A vertex of a merged
/// face may lie below the face's plane by the merge distance. A smaller value searches again over
/// rough faces without benefit; a larger one accepts a walk that ended at a false facet.
pub const OFFSET_SLACK: f64 = 4e-9;

/// Relative to a polytope's radius: if its bulge is at most this, the offset of a facet is computed
/// from the facet's features, without a search over the vertices. The bulge is the largest
/// distance of a vertex from the plane of an adjacent face.
///
/// The value is about a dozen roundings of a coordinate. A larger value increases the error of
/// depths; a smaller one computes exact values a second time.
pub const CRISP: f64 = 1e-14;

/// Relative to the shortest edge: if a polytope's bulge is larger than this, the edge to the next
/// higher vertex may be missing. Support climbs then also search the vertices of adjacent faces.
///
/// With a larger value, a climb may end too early, between two vertices that differ only by
/// rounding. A smaller one makes climbs over accurate polytopes slower.
pub const SHORT_EDGE: f64 = 1e-6;

/// A walk gives up after this many moves. A walk over half of a body of 2000 vertices takes about
/// 30 moves.
pub const WALK_STEPS: u32 = 500;

/// If a face has at most this many sides, a walk tests the facets across all of them. Otherwise it
/// tests only the facet across the side beyond which the origin lies farthest.
///
/// One side is enough to reach a local minimum. If all sides are tested, the walk moves to the
/// lowest facet. For a face with few sides, testing all of them costs no more than finding the side
/// for the origin.
pub const FACET_SIDES: usize = 8;

/// Largest number of corners in the clipping of flush features. If two flush faces together have
/// more corners, the witness is one point of their overlap instead of the centroid.
///
/// Two polygons of 48 sides fit. The value is also the size of a scratch buffer.
pub const CLIP_CORNERS: usize = 128;

/// Relative to the pair's size: if the origin lies farther than this beyond a side of a facet, the
/// facet is no local minimum.
///
/// The depth falls at best by the square of this distance, so the smallest distance that can be
/// detected is the square root of the rounding. With a larger value, witness points may lie off
/// their bodies by that value.
pub const STRAY: f64 = 1e-7;

// depth: admissible normals (admissible)

/// Largest number of pairs of Gauss arcs that one search for an admissible depth may examine.
///
/// This limit bounds the time of a tick: one pair costs about 20 instructions. A piece has about
/// ten arcs, and most arcs are excluded because they cannot improve the best depth. Only large
/// patches of two bodies that overlap along virtual faces come near the limit; the search then
/// returns the best depth found.
pub const ADMISSIBLE_CROSSINGS: usize = 1 << 14;

/// A crossing of two edges is preferred to a plane only if its depth is less by this, divided by
/// the sum of the radii of the two pieces.
///
/// Both have the same depth if the edges cross at the end of an arc. With a smaller value, rounding
/// decides between them, and the contact changes its features from tick to tick; a larger one makes
/// depths inexact.
pub const CROSSING_GAIN: f64 = 1e-13;

/// Number of searches along admissible normals for which candidates stay valid.
///
/// With a larger value there are more candidates; with a smaller one, all facets are searched more
/// often.
pub const CANDIDATE_SEARCHES: f64 = 16.0;

/// The largest path for which candidates are found, divided by the radius of the smaller piece.
///
/// In faster motion all facets are searched each time. A larger value then finds candidates that
/// are almost all facets; a smaller one searches all facets in moderate motion.
pub const CANDIDATE_PATH: f64 = 0.1;

/// As [`CANDIDATE_PATH`], for the turn (rad).
pub const CANDIDATE_TURN: f64 = 0.05;

/// The smallest path for which candidates are found, divided by the radius of the smaller piece,
/// and the smallest turn (rad).
///
/// With a larger value there are more candidates at rest; with a smaller one, all facets are
/// searched several times when a motion begins.
pub const CANDIDATE_LEAST: f64 = 1e-3;

// depth: the certificate (certificate, inner)

/// Largest gap between the lower and upper bound of a proof, relative to the depth. No direction
/// has a depth that is smaller than a proven depth by more than this.
///
/// If the inner surface contains the facet of the CSO at the result, both bounds agree to rounding.
/// A larger value saves growth steps where the CSO is nearly round. Below 1e-12, the rounding of
/// normals disturbs the growth.
pub const PROOF_RELATIVE: f64 = 1e-9;

/// Relative to the coordinates of the pair: the gap that a proof allows for rounding, in addition
/// to [`PROOF_RELATIVE`].
///
/// The value is about a hundred roundings of a transformed point. With a larger value, deeper
/// contacts count as touching, and are not proven. With a smaller one, flat triangles grow onto
/// themselves.
pub const PROOF_ROUNDING: f64 = 1e-13;

/// Relative to the pair's size: smallest wanted height of a corner of a proof's first tetrahedron.
/// If a support point is lower, the support point in the opposite direction is tried too.
///
/// The value affects only the shape of the first tetrahedron. A proof that begins with a flat
/// tetrahedron costs less than additional support queries.
pub const PROOF_BEGIN: f64 = 0.01;

/// Largest number of corners of an inner surface. Proofs for ellipsoids of 100 vertices take 20 to
/// 60 corners. Two concentric round bodies take a thousand corners if they have 500 vertices each,
/// and three thousand if they have 2000, in some milliseconds. The depths of larger pairs of this
/// kind are not proven.
pub const PROOF_CORNERS: usize = 4096;

/// Largest number of triangles of an inner surface. The 16-bit numbers of triangle edges allow at
/// most a quarter of 65 536.
pub const PROOF_TRIANGLES: usize = 8192;

/// Largest number of triangles that one growth step may remove, or that may surround the hole.
pub const PROOF_HOLE: usize = 1024;

/// Largest number of growth steps of a new inner surface.
pub const PROOF_GROWTHS: u32 = 4096;

/// Largest number of growth steps of a new inner surface while the depth is not known. After these
/// steps, a walk finds the depth, and a new surface is started.
///
/// Pairs other than concentric round bodies take fewer than 80 steps. A larger value costs time if
/// rounding has torn a surface; with a smaller one, large round bodies need a second surface.
pub const PROOF_BLIND: u32 = 128;

/// Largest number of growth steps that repair the surface of the previous tick. A new surface costs
/// less than more repairs.
pub const PROOF_REPAIRS: u32 = 48;

/// A kept surface is dropped if it has more than this many times the triangles that it had when it
/// was new.
///
/// With a larger value, each tick tests triangles that only past poses needed; a smaller one builds
/// a new surface more often.
pub const PROOF_GATHERED: usize = 2;

/// Largest number of corners of a surface that is kept from tick to tick.
pub const KEPT_CORNERS: usize = 256;

/// Largest number of triangles of a surface that is kept from tick to tick. A closed surface of n
/// corners has 2n − 4 triangles.
pub const KEPT_TRIANGLES: usize = 512;

// depth: contact patches (patch)

/// Largest number of corners of a face's outline in a patch. If a face has more corners, every n-th
/// corner is used.
///
/// Between two corners, a disc loses 2 % of its radius. More corners make every flush pair of round
/// faces slower, by the square of their number.
pub const PATCH_SIDES: usize = 16;

/// Largest number of faces (or edges, if there are no faces) of one piece in a patch. If there are
/// more, the flattest are used, and the patch's slope limit is reduced to the slope of the first
/// omitted face.
///
/// Finely tessellated curved pieces roll on their patches, and a larger value widens these patches.
/// With a smaller one, only one facet of a cylinder remains.
pub const PATCH_FACES: usize = 4;

/// Largest number of corners of one patch, before corners with too large a separation are left out.
///
/// The overlap of two polygons with [`PATCH_SIDES`] corners each has at most this number of
/// corners. A smaller value drops corners that carry load.
pub const PATCH_CORNERS: usize = 2 * PATCH_SIDES;

/// Relative to the pair's size: corners of a patch nearer than this are merged.
///
/// Two faces that share a corner compute it with different rounding errors. A larger value merges
/// distinct corners.
pub const PATCH_SAME: f64 = 1e-9;

// depth: the depth of solids of any shape (global)

/// Relative to the body's size: a part of the surface that enters a cell by less than this is
/// ignored. A ball with a smaller radius does not start a cell.
///
/// The value is some hundreds of roundings, so that coplanar triangles share one plane. With a
/// larger value, cells extend beyond their solids.
pub const CELL_BEYOND: f64 = 1e-13;

/// Share of a triangle's distance from a cell's seed: the plane of the triangle bounds the cell
/// only if its distance from the seed is at least this share.
///
/// Planes of triangles make cells flush with flat faces. A smaller value makes cells thin; a larger
/// one rounds off the corners of solids.
pub const CELL_OWN_PLANE: f64 = 0.5;

/// Largest number of planes of a cell. Cells that need more are not grown. This value affects only
/// speed.
pub const CELL_PLANES: usize = 96;

/// Merge distance of the dual hull of a cell, whose points lie within the unit ball. Corners that
/// differ only by rounding are merged.
///
/// Afterwards the corners are moved inside all planes. So the cell stays inside its solid, and
/// loses only this share of its size.
pub const CELL_DUAL: f64 = 1e-12;

/// Relative to the body's size: a solid counts as convex if it has one piece and that piece extends
/// beyond the solid by at most this.
///
/// The value is the rounding of coordinates in a file. With a larger value, the bounds of the
/// depth of convex pairs differ by more than 1e-8 of the size.
pub const CONVEX_SHORTFALL: f64 = 4e-9;

/// Relative to the body's size: a sample of the surface counts as covered if the point this far
/// below it lies in a cell.
///
/// The value is a tenth of the default gap ([`DEPTH_GAP`]). A smaller value needs many more cells;
/// with a larger one, the query has to grow more cells.
pub const CELL_DEPTH: f64 = 1e-3;

/// Approximate number of sample points on a surface of few triangles. A surface with more triangles
/// gets at most this number of points, and at most one per triangle.
pub const CELL_SAMPLES: usize = 8192;

/// Largest number of cells of a body. This value affects only speed.
pub const CELLS: usize = 1024;

/// Number of cells that are grown in one batch. This number is constant, so the cells do not depend
/// on the number of workers.
pub const CELL_BATCH: usize = 16;

/// Largest number of rounds in which a ball shrinks until it touches the surface on two sides.
/// Three or four are enough for most balls.
pub const SHRINKING_BALL_STEPS: usize = 24;

/// Relative to the ball's radius: within this distance the ball counts as touching the surface.
pub const SHRINKING_BALL_DONE: f64 = 1e-6;

/// Relative to a slope or to the obstacle's radius: in the search for the exit of a ray, smaller
/// differences count as rounding.
pub const PORTAL_ROUNDING: f64 = 1e-13;

/// Largest number of steps of a search for the exit of a ray; ten are usual. The result is valid
/// after any number of steps.
pub const PORTAL_STEPS: usize = 64;

/// Relative to the smaller body's size: default gap between the lower and upper bound of a depth.
pub const DEPTH_GAP: f64 = 0.01;

/// Default limit of the evaluations for one depth. This number of evaluations takes about a second.
pub const DEPTH_BUDGET: u64 = 400_000;

/// Relative to the smaller body's size: the clearance that a free translation leaves between the
/// bodies.
///
/// The value is far above the rounding of transformed vertices, and far below any measurable
/// length.
pub const DEPTH_HAIR: f64 = 1e-9;

/// Relative to the larger body's size: a lower bound is lowered by this for the rounding of
/// transformed cells.
pub const DEPTH_ROUNDING: f64 = 1e-11;

/// A transformed box is enlarged by this, relative to its size and to its distance from the origin.
/// So the box contains all transformed corners despite rounding.
///
/// The value is about 45 roundings. A smaller value could miss a pair of triangles that touch; a
/// larger one only costs time.
pub const PLACED_BOX: f64 = 1e-14;

/// Number of queries on two surfaces at one pose that are answered before all boxes of the moving
/// surface are transformed.
pub const LOOSE_QUESTIONS: u32 = 6;

/// Squared, relative to the triangle's side: an edge pierces a triangle if it meets the triangle's
/// plane within this distance of the triangle.
///
/// The value affects only the point at which a search for common points begins.
pub const COMMON_POINT: f64 = 1e-12;

/// Largest number of steps of a straight translation out of contact. Each step is as long as the
/// distance of the surfaces, so an exit along a wall that recedes slowly is not found.
pub const ESCAPE_STEPS: usize = 400;

/// Number of pairs of crossing triangles that are examined if no known obstacle blocks a
/// translation.
pub const DEPTH_PROBES: usize = 48;

/// The deepest common point is searched near this many of the [`DEPTH_PROBES`] pairs. The
/// deepest of the points found becomes the seed of two cells.
pub const DEPTH_LENSES: usize = 4;

/// Relative to the smaller body's size: the first step from a crossing into both bodies.
pub const LENS_FIRST_STEP: f64 = 1e-7;

/// Ratio of the lengths of successive steps. The last of the [`LENS_STEPS`] steps is about half of
/// the body's size.
pub const LENS_STEP_GROWTH: f64 = 3.0;

/// Number of steps away from a crossing into both bodies.
pub const LENS_STEPS: usize = 15;

/// Number of steps away from the nearer surface. Each step goes half of the distance to that
/// surface.
pub const LENS_CENTERING: usize = 6;

/// Number of likely obstacles that a query tests before it tests all obstacles. This value affects
/// only speed.
pub const DEPTH_TRIES: usize = 24;

/// Number of obstacles that blocked the latest translations and are tested before all others. This
/// value affects only speed.
pub const RECENT_HOLDERS: usize = 6;

/// Relative to the smaller body's size: if the body has moved less than this since the last search,
/// the next search starts with the cones of the last search.
///
/// This value affects only speed.
pub const DEPTH_NEAR: f64 = 0.02;

/// Relative to the smaller body's size: if the body has moved farther than this since the last
/// list, the pairs of cells that may block a cone are listed again.
///
/// This value affects only speed. If a pair is missing from the list, a new cell has to grow. A new
/// list costs 0.1 ms.
pub const DEPTH_LISTED: f64 = 0.1;

/// Relative to the length of the last translation: at first, a search ignores translations that are
/// longer than this.
///
/// The next translation is hardly longer than the last one. A larger value transforms more
/// cells that block nothing; with a smaller one, more searches have to start again.
pub const DEPTH_REACH: f64 = 1.5;

/// Largest number of half-spaces that a projection collects before it gives up.
pub const DEPTH_PROJECT_STEPS: usize = 24;

/// Number of times that a search for a near facet of an obstacle is repeated along the last found
/// normal.
pub const EXIT_TURNS: usize = 6;

/// Largest number of half-spaces that a slide collects before it gives up.
pub const DEPTH_SLIDE_STEPS: usize = 64;

/// The search always tests this many of the obstacles that may block a cone's triangle, and uses
/// the best one. This value affects only speed.
pub const CONE_FIRST_TRIES: usize = 12;

/// After the first [`CONE_FIRST_TRIES`] obstacles, more are tested until one blocks the cone's
/// triangle, up to this number. This value affects only speed.
pub const CONE_TRIES: usize = 64;

/// Number of obstacles that a cone caches. This value affects only speed.
pub const CONE_HINTS: usize = 4;

/// Share of the gap: a cone is cut if one step raises its bound by less than this.
pub const CONE_GAIN: f64 = 0.1;

/// Share of the gap: if a cone's triangle is smaller than this, its corners are tested one by one.
pub const CONE_SMALL: f64 = 0.05;

/// Share of the gap: a cone whose triangle is smaller than this is not cut any more.
pub const CONE_SMALLEST: f64 = 1e-4;

/// Number of cuts of cones between two searches for a shorter free translation.
pub const CONE_CUTS_PER_WAY_OUT: u64 = 12;

/// If a cone has at least this many candidate obstacles, each of its halves keeps only the
/// candidates in its own directions.
pub const CONE_FILTER: usize = 64;

// detect: the contact query (search, confirm)

/// A depth is rejected unless a witness point lies below the surface by at least this share of the
/// depth.
///
/// If the surface bends, the nearest point of the surface is slightly nearer than the point along
/// the contact's normal. A larger value drops true contacts on curved parts; a smaller one accepts
/// depths that another surface contradicts.
pub const CONFIRMED_SHARE: f64 = 0.8;

/// Like [`CONFIRMED_SHARE`] for a contact of two edges. A point beyond an edge is nearer to the
/// faces at the edge than to the edge.
///
/// At right-angled edges the distance to a face is smaller by a factor √½. A larger value drops
/// true contacts of sharp edges; a smaller one accepts depths that another surface contradicts.
pub const CONFIRMED_EDGE_SHARE: f64 = 0.65;

/// A depth in an open body is rejected if the place to which it moves the witness point is farther
/// from the body's surface than this share of the depth.
///
/// A larger value accepts depths at points beside the body; a smaller one drops true contacts at
/// its rim.
pub const CONFIRMED_NEAR: f64 = 0.5;

/// Radians: two overlapping pieces may have no shared surface normal. If the bodies must turn by at
/// least this angle before they can have one, the pair is skipped until then.
///
/// This value affects only speed: a smaller rotation takes only a few ticks, and the walk then
/// starts again.
pub const SKIPPED_TURN: f64 = 0.004;

// detect: the guard against tunnelling (guard, sub_step)

/// In tolerances: the longest motion of any point in a sub-step.
///
/// The value is below 1, so that every surface comes within the tolerance before the tool passes
/// it. With a larger value the tool passes sheets without a contact; a smaller one sub-steps
/// harmless motion. At 1 mm tolerance and 1 kHz, half a tolerance per tick is 0.5 m/s.
pub const GUARD_STEP: f64 = 0.5;

/// Relative to the motion of a tick: a tick cannot tunnel through a piece at least this thick.
///
/// A larger value examines more pairs in fast ticks. A smaller one loses contacts at the tips of
/// wedges, where a piece is thinner than elsewhere. At 2, a point that entered through one side may
/// already be nearer to the other side.
pub const GUARD_THICK: f64 = 8.0;

/// Largest number of sub-steps of a tick. A tick that needs more sub-steps counts as a jump, not as
/// motion (8 m/s at 1 mm tolerance and 1 kHz).
///
/// A larger value makes fast ticks more expensive; a smaller one protects only slower motions.
pub const GUARD_SUB_STEPS: u32 = 16;

/// In tolerances: a pair that tunnelled is held until it is this much deeper than at the moment of
/// tunnelling.
///
/// With a larger value, the force lasts longer if the user pushed through on purpose. With a
/// smaller one, the pair is released during the motion that tunnelled.
pub const GUARD_HOLD: f64 = 20.0;

/// Cosine: a normal that turns by more than this angle (120°) in a sub-step has turned over.
///
/// A tool that slides off the side of a part turns the normal by a right angle. A value nearer to
/// −1 misses oblique tunnelling; a value nearer to 0 also holds pairs that only slid off.
pub const TURNED_OVER: f64 = -0.5;

// force: shading (smooth_surface, smooth_body)

/// Cosine of the largest angle between the normals on both sides of an edge that shading treats as
/// equal.
///
/// The normals of a smooth vertex are computed once and copied to its corners, so they agree to
/// rounding. A larger angle hides faint creases; with a smaller one, rounding would look like
/// creases.
pub const SHADING_SAME: f64 = 1.0 - 1e-9;

/// Cosine of the largest angle between a face of a piece and a triangle of the mesh that lies in
/// it.
///
/// The angle is half a degree. Merged faces are far flatter, but the normals of needles are noisy.
/// A larger angle counts neighbouring triangles of fine meshes as part of the face; a smaller one
/// leaves needles without shading.
pub const SHADING_IN_FACE: f64 = 0.999_96;

/// The search for the triangle at a contact point examines at most this many triangles of a face.
///
/// This limit bounds the time to a few microseconds per contact. Contacts on larger merged faces,
/// which are flat, keep their true normal.
pub const SHADING_TRIANGLES: usize = 1024;

// force: clusters (cluster, representative, sharing)

/// Number of cells of the clustering grid along one axis. A cell's key has 21 bits per axis; a few
/// values are reserved for neighbours on both sides.
///
/// Contacts beyond this many cells share the outermost cells. The clustering is then slower, but
/// its result does not change.
pub const CLUSTER_CELLS: f64 = 2_097_140.0;

/// Number of steps of the search for a cone that contains all normals of a cluster.
///
/// The cone found is within about 1/steps of the smallest. A smaller value cuts a few clusters
/// whose normals would just fit into a cone.
pub const CAP_STEPS: u32 = 16;

/// Relative to the sum of the weights: a weighted sum of normals shorter than this has no direction
/// (eq. 3).
///
/// The sum of cancelling normals is rounding noise, or the difference of two large, nearly equal
/// loads. A larger value rejects valid directions; with a smaller one, noise decides the
/// direction of the force.
pub const CANCELLED_NORMAL: f64 = 1e-6;

/// Relative to the largest coordinate: how far rounding may put a representative's midpoint outside
/// the bounding box of its members' midpoints. The value is also the largest allowed error of the
/// normal's length.
///
/// A sum over a thousand contacts rounds a thousand times. A larger value hides a wrong weight; a
/// smaller one reports mere rounding.
pub const MIDPOINT_ROUNDING: f64 = 1e-12;

/// m: debug builds validate a representative only if its sum of weights lies between these values.
///
/// Outside of this range, products of weights and lengths underflow or overflow. A wider range
/// reports mere rounding; a narrower one excludes real contacts.
pub const SANE_WEIGHTS: [f64; 2] = [1e-100, 1e100];

/// In debug builds, the validation of clusters compares all pairs of contacts if there are at most
/// this many contacts. The time is quadratic in their number.
pub const VALIDATED_CONTACTS: usize = 64;

/// Relative to their distance from b's origin: contacts nearer to each other than this,
/// perpendicular to the force, count as one contact.
///
/// Two pieces that share a corner compute it with different rounding errors. With a larger value,
/// one of two near contacts vanishes.
pub const TILT_SAME: f64 = 1e-9;

/// Least part of its tilt share that a contact inside a flat face keeps beside equally loaded
/// contacts at the rim.
///
/// With 0, a query that is cut off and misses the rim of one face may leave this face without any
/// share. With a larger value, many contacts inside a face bear a noticeable part of its load.
pub const TILT_INSIDE: f64 = 1e-6;

/// Largest number of contacts for smooth clustering, which compares all pairs of contacts
/// ([`crate::force::LinkageSettings::most`]).
///
/// This limit bounds the time of the step after the query: 256 contacts take some 0.4 ms in all. If
/// one contact replaces another, the force's point of application jumps by at most
/// 2/[`SMOOTH_CONTACTS`] of the contacts' extent. So a smaller value allows larger jumps.
pub const SMOOTH_CONTACTS: usize = 256;

/// [`SMOOTH_CONTACTS`] for two bodies that no hand holds.
///
/// No hand feels the jumps between them, and a heap has many such pairs. While 12 scanned and CAD
/// parts fall in real time, the time of a step without its queries exceeds half a millisecond in 5
/// instead of 264 of 7000 steps, 0 instead of 35, and 2 instead of 90 (three heaps), and the parts
/// lie still sooner.
pub const OBJECT_CONTACTS: usize = 64;

/// The size of a drawn contact is its load plus this share of the mean load of all contacts from
/// which it is drawn.
///
/// With 0, a contact with a very small load may represent very many contacts. A large value ignores
/// the loads, so the mean over the drawn contacts is less exact.
pub const DRAW_EVEN: f64 = 0.5;

/// A drawn contact counts fully if its priority is above the lowest drawn priority by this share.
///
/// A larger value lets contacts come and go more gradually, and lets fewer contacts count fully.
pub const DRAW_FADE: f64 = 0.5;

// force: friction (friction)

/// Relative to the stretch of the coupling under the static friction of a contact: μ falls from its
/// static to its dynamic value within the static z_max and this share of the stretch.
///
/// With 0, μ falls within a tick, and the torque of a tool changes by up to half more in a tick.
/// With 1, gears that turn in mesh have the static μ on a large part of each tooth.
pub const FRICTION_WEAKENS: f64 = 0.1;

/// s: after a slip, μ of a contact that sticks rises from its dynamic to its static value in this
/// time.
///
/// With a smaller value, two contacts of a tool may stick and slide in turns from tick to tick.
/// With a larger one, a tool that is pushed again soon starts without the peak of static friction.
pub const FRICTION_HEALS: f64 = 0.04;

/// Relative to the strain at which a contact slides: a contact counts as sticking if its strain
/// exceeds the sliding strain by at most this.
///
/// The adhesion point is stored as a position, so the strain of a resting contact contains the
/// rounding of that position. With a smaller value, rounding keeps a resting contact sliding; with
/// a larger one, a slowly sliding contact sticks.
pub const FRICTION_HELD: f64 = 1e-9;

/// A new contact takes over the strain of a lost contact near it only if the cosine between their
/// normals is at least this.
///
/// Around a rounded edge, the normals of neighbours differ by tens of degrees; opposite walls of a
/// slot must not exchange strains.
pub const FRICTION_SUCCESSOR: f64 = 0.5;

/// Distance from the middle of a patch at which a corner's friction acts, as a share of the
/// corner's own distance from the middle.
///
/// The ideal value is the mean distance of an even load from the middle, divided by the corners'
/// distance: 0.50 on a line segment, 0.54 on a square and 0.67 on a disc. A larger value brakes a
/// spin too strongly; a smaller one brakes it too weakly.
pub const FRICTION_SPREAD: f64 = 0.54;

/// Largest number of comparisons with tracked contacts in one tick, to find the predecessors of new
/// contacts.
///
/// This limit bounds the time of a tick. Beyond the limit, new contacts begin without strain. A
/// tick of 300 contacts with 100 new contacts needs 30 000 comparisons.
pub const FRICTION_LOOKS: usize = 65_536;

// render: the virtual coupling (coupling)

/// m: the stretch at which the coupling reaches the device's largest force.
///
/// A longer stretch makes the coupling softer than necessary; a shorter one needs more stiffness
/// than most devices allow.
pub const COUPLING_STRETCH: f64 = 8e-3;

/// rad: the rotation at which the coupling reaches the device's largest torque.
pub const COUPLING_TURN: f64 = 0.2;

/// kg: the mass of a device's grip if the device does not state it.
///
/// The light commercial devices have 0.05 to 0.2 kg at the grip. A larger value allows couplings at
/// which the lighter devices vibrate when they are not held.
pub const APPARENT_MASS: f64 = 0.1;

/// kg·m²: the inertia of a device's grip if the device does not state it.
pub const APPARENT_INERTIA: f64 = 5e-5;

/// Largest stiffness of a coupling, times the square of the period, over the apparent mass
/// (dimensionless).
///
/// With the matching damping, a device that is not held starts to vibrate at two to three times
/// this stiffness. (The device has 0.1 kg, 0.04 N of dry friction, one tick of delay and 0.03 mm
/// encoder steps.)
pub const COUPLING_SAMPLED: f64 = 0.01;

/// In periods of the loop: damping of a coupling over its stiffness.
///
/// The loop lags by one and a half periods; a value below 1.5 has no effect. With a larger value,
/// the user feels the noise of the velocity.
pub const COUPLING_LEAD: f64 = 3.0;

/// N·m/rad: stiffness of the torque that turns the tool to the hand's orientation. The torque is
/// used for devices that give forces but no torques.
///
/// With this value, the force equals the force on a six-axis device. On a six-axis device, a
/// contact turns an ordinary hand (0.6 N·m/rad) and the coupling (0.5 N·m/rad at 1 kHz), which are
/// in series. Without torques the hand does not turn, so the tool must turn instead. At 5, a spoon
/// in a cup gave three times the force of the six-axis device. At 0.3, the force on a box that
/// tilts was wrong by 3 % instead of 0.6 %.
pub const COUPLING_ALIGNMENT: f64 = 0.27;

/// s: damping of the torque of [`COUPLING_ALIGNMENT`] over its stiffness.
///
/// A hand resists quick turns: its damping is its stiffness times 13 to 17 ms. In series with the
/// coupling of a six-axis device, the ratio is about 12 ms. With [`COUPLING_LEAD`] instead, quick
/// contacts turned the tool too soon: when a spoon touched a cup for 0.1 s, the force was wrong by
/// 18 %.
pub const COUPLING_ALIGNMENT_LEAD: f64 = 12e-3;

/// m: after the force of a coupling has reached its limit, the coupling stretches by this much more
/// before its anchor slips.
///
/// With a shorter length, the anchor slips as soon as the hand presses slightly harder than the
/// device can. With a longer one, the user feels the stretch when the hand moves back.
pub const COUPLING_SLIP: f64 = 3e-3;

/// rad: like [`COUPLING_SLIP`] for rotation, in the ratio of [`COUPLING_TURN`] to
/// [`COUPLING_STRETCH`].
pub const COUPLING_SLIP_TURN: f64 = 0.075;

/// rad: a coupling without a torque limit turns no farther than this before it slips.
///
/// At half a turn (π) the shortest way back changes its direction, and so does the torque. The
/// difference to π leaves room for the motion of a tick.
pub const COUPLING_MOST_TURN: f64 = 2.4;

/// In free air, an anchor that has slipped returns to the grip by this share of the device's
/// motion.
///
/// Users do not notice if the tool moves by a third more or less than the hand. With 1 or more, the
/// tool could move against the hand.
pub const COUPLING_RETURN: f64 = 0.3;

/// Relative to the tool's contact offset: how far the tool sinks into the offset under the device's
/// largest force.
///
/// If the tool sank by the whole offset, hard presses would end at exact touch, where normals and
/// witness points are least accurate.
pub const TOOL_SINKS: f64 = 0.5;

/// Relative to the contact tolerance: the contact offset, which is the separation below which
/// contacts push the tool.
///
/// A larger value keeps a peg out of a hole whose clearance is smaller than the tolerance. A
/// smaller one makes contacts stiffer than the accuracy of curved meshes justifies, and a fast tool
/// then overlaps the object before it stops.
pub const TOOL_OFFSET: f64 = 0.1;

// render: the tool's step (tool, together, touches)

/// In contact offsets: the shortest look-ahead distance of contacts.
///
/// This distance covers the encoder steps and the slow motion of a tool at rest. A larger value
/// examines more pairs that are not in contact; a smaller one limits the first steps of a tool that
/// is pulled away, which is felt: with 1.2, by 4 mN in the air.
pub const REACH_LEAST: f64 = 2.0;

/// In contact offsets: a tool in contact may always move this far in a step, even if its query did
/// not examine all surfaces that may have come near.
///
/// At 1 kHz and an offset of 20 µm, the value allows 10 mm/s. A smaller value is felt as a drag
/// when close-fitting parts turn, for which the work limit is always too small. With a larger one,
/// the tool sinks in deeper before an unexamined part of the surface pushes back.
pub const REACH_CREEP: f64 = 0.5;

/// In the next step, the tool may move at most this many times as far as in the last step.
///
/// A hand cannot double its speed in a millisecond. A larger value examines more pairs when the
/// tool is fast; with 1, the tool could never accelerate.
pub const REACH_GROWTH: f64 = 2.0;

/// Factor by which the look-ahead distance of contacts shrinks in each step that needs a shorter
/// distance.
///
/// Whenever the tolerance grows, pairs in the front must be tested earlier. So the tolerance should
/// not shrink and grow in every step.
pub const REACH_FADE: f64 = 0.9;

/// Relative to the device's force limit: largest change of the coupling's force in a step in which
/// a tool moves on after it was held.
///
/// A tool is held if the work limit ends its query. If it came back to the hand in one step, the
/// whole force would vanish in this step. With a smaller value, the tool stays behind for longer.
pub const REACH_RELEASE: f64 = 0.03;

/// Factor by which the look-ahead distance of a body in contact shrinks in a step whose query could
/// not examine everything within this distance.
///
/// Fewer pairs are within a shorter distance. With a larger value, more steps in a row are cut, and
/// the tool only creeps in each. With a smaller one, the tool stays behind a fast hand for longer.
pub const REACH_CUT: f64 = 0.5;

/// Factor by which the look-ahead distance of a body in contact may grow in each step after a query
/// that could not examine everything.
///
/// With a larger value, the next query is cut sooner. With a smaller one, the tool stays behind a
/// fast hand for longer.
pub const REACH_RECOVERY: f64 = 1.1;

/// Margin of a moving body's box: in radii of the body for a tool, and in contact tolerances for
/// other bodies.
///
/// While a body stays within the margin it keeps its box, and no new pairs are searched. For a
/// tool of 6 cm the margin is 7 mm, which is 20 steps of a quick hand. A larger value queries
/// pairs that are far apart. With 0, the boxes are computed and sorted in every step.
pub const BOX_SPARE: f64 = 0.25;

/// m/s: the speed of a tool is limited to this, even if the device reports a higher speed.
///
/// Even a thrown tool is slower. The limit bounds the tolerance of the query.
pub const TOOL_FASTEST: f64 = 5.0;

/// m/s: if a free body overlaps another body at the start, its contacts resist this much more of
/// the overlap in each second.
///
/// A block of 64 g that begins 1 mm deep in a table rises 15 mm above it if the contacts resist the
/// whole overlap at once, and 0.2 mm with this value.
pub const START_EASE: f64 = 0.05;

/// Largest number of times that a tool's step is solved to find which contacts press and which
/// slide.
///
/// Two or three rounds settle most steps. Bodies with contacts on all sides, such as one that spins
/// inside another, need up to 20 rounds. If they do not settle, they may gain energy. More rounds
/// only cost time.
pub const COUPLING_ROUNDS: u32 = 24;

/// Largest number of guesses on a line that a search tries.
///
/// Three or four are usual. More only cost time.
pub const SEARCH_TRIES: u32 = 10;

/// A search ends where the slope is below this share of the slope at its beginning.
///
/// The next round solves again, so a smaller share only costs time. A larger one ends far from the
/// lowest point.
pub const SEARCH_SLOPE: f64 = 0.1;

/// Relative to a contact's friction limit: a larger change of its friction causes another round of
/// a tool's step.
///
/// The error of a round falls with its square, so a smaller value costs few rounds. With 0.01, the
/// remaining errors of a tool that slides steadily change sign in every tick.
pub const COUPLING_SETTLED: f64 = 1e-3;

// render: the vibration after an impact (transient)

/// s: an impact along a direction is rendered only if no contact has pressed along it for this
/// long.
///
/// A hand taps at most ten times a second; a tool that bounces by encoder steps is off the surface
/// for a few ticks. With a longer time, taps are not rendered. With a shorter one, a tool that
/// rests on a rough surface vibrates.
pub const IMPACT_REST: f64 = 0.02;

/// Cosine: normals within this angle of each other count as one direction of contact.
///
/// The angle is 30°. With a wider angle, a tool that slides down a slope onto a wall feels no
/// impact; with a narrower one, a tool vibrates when it rolls over facets.
pub const IMPACT_CONE: f64 = 0.866;

/// Relative to the device's largest force: the largest force of an impact's vibration.
///
/// The remaining force is left for the contact itself. At 200 Hz the slew limit (the largest force
/// in 2 ms) does not clip the vibration.
pub const TRANSIENT_MOST: f64 = 1.0 / 3.0;

/// Smallest number of ticks in a period of a vibration.
///
/// With five ticks, the steps of the sampled force are 2 dB below the vibration itself. With fewer
/// ticks, the vibration becomes noise.
pub const TRANSIENT_SAMPLES: f64 = 5.0;

// render: the limits (saturate)

/// Relative to the limit: a saturated force or torque is smaller than its limit by this.
///
/// The value is a few roundings, so that rounding cannot put an output above the limit. A larger
/// value wastes force.
pub const SATURATION_ROUNDING: f64 = 1e-15;

/// In motions of the last step: if the work is limited and no contact presses, due pairs that may
/// press after such a motion are bounded and visited first. They stop the body.
///
/// A tool that was held wants to move much farther than in the last step. With 2, a gear that is
/// lifted off with little work changed its force by 1.5 N in a step instead of 0.3 N. With a larger
/// value, more pairs are bounded in the same query.
pub const CLEAR_MOTIONS: f64 = 4.0;

/// Relative to the distance by which the search goes beyond the contact offset: due pairs nearer
/// than the offset plus this are bounded and visited first, however slow the bodies are.
///
/// Without it, a body at rest could never begin to move.
pub const CLEAR_LEAST: f64 = 0.5;

/// Number of expected motions up to which pairs are split before they are near.
///
/// With fewer, a fast landing leaves too little time. With more, the bodies have left the expected
/// path before they touch.
pub const PREPARED_TICKS: u32 = 32;

/// In tolerances: pairs that are nearer than this at an expected pose are split before they are
/// near.
///
/// With 1, a tool that is a little nearer to a wall than expected lands without preparation. With
/// more, pairs are split in vain.
pub const PREPARED_TOLERANCE: f64 = 1.5;

/// In tolerances: the motion beyond the first leaf pair within the tolerance up to which pairs are
/// split before they are near.
///
/// The first such pair may be far from the surfaces that will touch. Far inside the other body, no
/// surfaces will touch.
pub const PREPARED_DEPTH: f64 = 3.0;

/// Least number of queries between two searches for pairs that will soon be near.
///
/// With fewer, slow bodies that are near each other are searched all the time. With more, a change
/// of the motion is seen later.
pub const PREPARED_PAUSE: u32 = 4;

/// The search for pairs that will soon be near gets one part in this many of the work that is left.
///
/// The search reads memory that the processor's caches have lost, so its work takes several times
/// as long. With 1, steps in free motion end late. With more, less is prepared.
pub const PREPARED_WORK: u64 = 4;

/// Relative to the places of the front: no pair is split before it is near if more places are used.
pub const PREPARED_SHARE: f64 = 0.5;

/// Number of due pairs whose cheapest bounds cost one unit of work.
pub const WORK_BOUNDED: u64 = 4;

/// Number of due pairs whose wake values are read at the cost of one bound.
pub const BOUNDED_READS: usize = 4;

/// Least work for the bounds of due pairs in a query with limited work, if no contact presses.
///
/// This suffices for 512 pairs. A nut that turns on its thread has 40 000 due pairs. To bound all
/// of them takes some milliseconds, and leaves no time to visit them. Without a least value, a tool
/// whose contacts take all of the work could not move on.
pub const BOUNDED_WORK: u64 = 128;

/// Cost of starting a march, in units of [`crate::algebra::Work`]. One unit is the cost of
/// examining a pair of nodes.
///
/// The pacer that sets the work limit measures the time per unit. So the `WORK_` values need to be
/// correct only relative to each other, within a factor of about two. The parts of a query then
/// share the limit in proportion to their time.
pub const WORK_MARCH: u64 = 2;

/// Cost of a step of a march or of a depth walk, in units of work.
pub const WORK_STEP: u64 = 1;

/// Cost of the result of a leaf pair, in units of work: the checks of its surface and of its depth.
pub const WORK_ANSWER: u64 = 6;

/// Cost of an upper bound of a pair's depth, in units of work.
pub const WORK_BOUND: u64 = 2;

/// Cost of starting a depth walk and of its search for a shared surface normal, in units of work.
pub const WORK_WALK: u64 = 20;

/// Cost of a patch, and of each of its corners, in units of work.
pub const WORK_PATCH: u64 = 12;

/// Number of times that a query gives parts with due pairs more of a limit of work. With 3, they
/// get up to seven eighths of what the first stage leaves and the answers do not need.
pub const DUE_ROUNDS: u32 = 3;

/// After a step that took longer than estimated, a pacer corrects its estimates by this share of
/// the difference.
pub const PACE_DEARER: f64 = 0.25;

/// After a step that took less time than estimated, a pacer corrects its estimates by this share of
/// the difference. The estimates adapt within about 10 steps.
///
/// With a share of 0.001, one step that the system interrupts would limit the work for a second.
/// With 0.04, a drill that landed on a robot wrist still had too little work after 25 steps,
/// because the first of these steps had read cold memory. The force changed by up to 0.55 N in a
/// step (now 0.2 to 0.5 N). A larger share lets steps end late that are slower than the last few.
pub const PACE_CHEAPER: f64 = 0.1;

/// A step raises a pacer's price as if a unit of work had taken at most this many times the price.
pub const PACE_SPIKE: f64 = 4.0;

/// ns: assumed time of a unit of work before any was measured.
pub const PACE_FIRST_PRICE: f64 = 100.0;

/// ns: assumed time of a unit of work that reads memory for the first time in a while. The time was
/// 0.7 to 2 µs where gears touch again, and 0.2 µs in the following steps.
pub const PACE_COLD_PRICE: f64 = 1000.0;

/// Apart from work at [`PACE_COLD_PRICE`], a step may do this many times the work of the step
/// before.
///
/// With 2, the first steps of a landing take up to 2 ms where fine meshes meet. With 1, a tool that
/// lands has too little work for longer.
pub const PACE_GROWTH: f64 = 1.25;

/// Units of work: a step with less work than this is too short to measure the cost of a unit. Less
/// than [`PACE_LEAST_WORK`], so that a step with the least allowance is measured.
pub const PACE_TELLING: u64 = 150;

/// Units of work that a query may always do. So the query makes progress even if the loop is late.
pub const PACE_LEAST_WORK: u64 = 200;

/// Default share of the loop's period that a step should take.
///
/// The remaining time is left for the device, the recorder and other load of the machine.
pub const PACE_SHARE: f64 = 0.6;

/// s: assumed interval between a host's updates of a driven body (60 Hz) before a real interval is
/// known.
pub const DRIVEN_PERIOD: f64 = 1.0 / 60.0;

/// s: without an update, a driven body keeps its velocity for this time, and then slows down to
/// rest in an equal time.
///
/// The value is six periods of the slowest usual host (60 Hz). With a longer time, a robot whose
/// program hangs keeps pushing; with a shorter one, the user feels a late update.
pub const DRIVEN_PATIENCE: f64 = 0.1;

/// s: a group of free bodies that has been still for this time sleeps, if it lies on a fixed body.
///
/// Bodies that are still for this time are slower than 8 µm/s at usual offsets, see
/// [`SLEEP_MOTION`]. A body of 0.1 m that tips over moves e times as far in each 0.07 s. Box2D
/// allows 10 mm/s and waits for 0.5 s, PhysX waits for 0.4 s, and Bullet for 2 s.
pub const SLEEP_AFTER: f64 = 0.25;

/// Relative to the contact offset: a free body is still while no point of it has moved farther than
/// this. With an offset of 0.02 mm, this is 2 µm.
///
/// In a heap of twelve scanned and CAD parts, a nut that is jammed between others hums by half of
/// that.
pub const SLEEP_MOTION: f64 = 0.1;

/// m: the default contact tolerance of large bodies that do not fit closely.
pub const DEFAULT_TOLERANCE: f64 = 1e-3;

/// Relative to the size of the smaller body: its largest default contact tolerance. The program
/// and the Python package query contacts within the same distance by default.
///
/// On bodies of one millimetre, [`DEFAULT_TOLERANCE`] would be the whole body.
pub const TOLERANCE_SHARE: f64 = 0.01;

/// Relative to the tolerance that bodies would have without play: the least to which their play
/// lowers it.
///
/// Contacts get stiffer as the tolerance gets smaller, and the play of parts of the same diameter
/// is 0.
pub const LEAST_BY_PLAY: f64 = 0.05;

/// Work limit of the search for the play of the bodies of a scene, in units of `Work`; about a
/// second.
pub const PLAY_WORK: u64 = 3_000_000;
