//! Every tolerance and limit of the engine. No other file contains a numeric literal that decides a
//! result.
//!
//! Each entry states its unit, the reason for its value, and what a larger or a smaller value
//! breaks. "Relative to" a length means that the value is multiplied by that length before use.
//!
//! The values are grouped by room (top-level module) and then by task, in the order of the
//! pipeline. Each group's heading names the modules that use it. A value that several rooms use
//! stands in the first of these rooms; a value that several groups use stands in the first of these
//! groups.

// algebra: poses and matrices

/// Relative to the largest coordinate: how far rounding may put a vertex above a supporting
/// plane of its polytope, and how far a unit normal, or a unit quaternion, may be from unit length.
///
/// Some tens of ulps. A larger value hides a wrong plane; a smaller one reports mere rounding as an
/// error.
pub const WELL_FORMED_ROUNDING: f64 = 1e-14;

/// Sweeps of Jacobi rotations over a 3 × 3 symmetric matrix. They converge quadratically: after
/// five only rounding is left.
pub const JACOBI_SWEEPS: usize = 8;

// body: from a file to a mesh (mesh, weld, orient)

/// Model units: a coordinate larger than this is refused.
///
/// The exact predicates multiply three coordinates, and then such products with each other; these
/// must not overflow. No real model is this large.
pub const LARGEST_COORDINATE: f64 = 1e50;

/// Model units: a model whose largest extent is smaller than this is refused.
///
/// The exact predicates multiply three coordinates, and the rounding terms of these products must
/// not underflow.
pub const SMALLEST_EXTENT: f64 = 1e-50;

/// Relative to the largest coordinate extent of the point set: two vertices closer than this are
/// merged.
///
/// Files written with 7 significant digits differ by 1e-7 of their size between copies of one
/// vertex. Larger swallows features of fine meshes; smaller leaves cracks along the seams of STL
/// files.
pub const WELD: f64 = 1e-9;

/// Relative to the largest coordinate extent: the side of a cell of the welding grid.
///
/// Only speed depends on it. It is far larger than [`WELD`], so that a vertex's neighbourhood is
/// nearly always one cell, and far smaller than the spacing of vertices, so that a cell nearly
/// always holds one vertex.
pub const WELD_CELL: f64 = 1e-5;

/// Relative to the longest edge of the triangle: a triangle whose height over its longest edge is
/// smaller than this counts as having no area.
///
/// Its normal would be noise. A larger value drops real slivers of CAD meshes and opens the
/// surface.
pub const ZERO_AREA: f64 = 1e-12;

/// Rounds of edge flips that remove triangles of no area.
///
/// One round is enough unless such triangles lie in rows along one side. More rounds only cost
/// time. Triangles of no area that remain after the last round are dropped; each leaves a crack of
/// zero width.
pub const CAP_ROUNDS: usize = 8;

/// Number of a component's vertices that must lie inside another component for the first to count
/// as nested in it.
///
/// One would be enough if components never crossed; a few more distinguish a component that crosses
/// from a cavity.
pub const NESTING_SAMPLES: usize = 8;

// body: what is asked of a mesh (health, mass, triangle_tree, winding)

/// Most pairs of a mesh's own triangles that are tested for crossing, per triangle of the mesh.
///
/// A sound mesh has some ten to twenty pairs of overlapping boxes per triangle. Only meshes that
/// are wound around themselves all over reach the limit; the reported count is then marked as a
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

/// Triangles in a leaf of the triangle tree, at most. Only speed depends on it.
pub const LEAF_TRIANGLES: usize = 4;

/// Relative to the ray's parameter: a ray hits a box if it enters the box no later than this after
/// it leaves it.
///
/// The parameters at the box's slabs are rounded to a few ulps. With zero, triangles that lie in a
/// face of their box would be lost.
pub const RAY_SLACK: f64 = 1e-14;

/// A point is inside an open surface if its winding number is at least this.
///
/// Half way between far outside (0) and enclosed (1).
pub const INSIDE_WINDING: f64 = 0.5;

/// In radii of a box: at this distance or farther, the box's triangles are approximated by one
/// dipole.
///
/// The error of one box falls with the square of this factor, and the errors of many boxes may add
/// up. 3 keeps the winding number within about 0.01 on real models. A smaller factor is faster.
pub const DIPOLE_REACH: f64 = 3.0;

// body: hulls and polytopes (hull)

/// Model units: the largest coordinate that a hull accepts.
///
/// Products of three differences and their rounding errors must not overflow, or signs stop being
/// exact.
pub const HULL_LARGEST: f64 = 1e70;

/// Model units: the hull treats a point set smaller than this as one point, and a coordinate
/// smaller than this as zero.
///
/// The last error term of the orientation predicate is about 1e-96 of the product of three sizes.
/// For smaller sets this term underflows, and signs stop being exact.
pub const HULL_SMALLEST: f64 = 1e-70;

/// A hull's face that has merged too many facets is merged again, with its merge distance
/// multiplied by this factor.
///
/// Small enough to separate the near-coplanar facets that caused the failure, and large enough to
/// still merge facets that differ by less.
pub const HULL_MERGE_RETREAT: f64 = 0.1;

/// Relative to the merge distance: a face whose merge distance is below this merges only exactly
/// coplanar facets.
///
/// Times [`COPLANAR`] this is 1e-15 of the size, which is the rounding of a rotated body.
pub const HULL_MERGE_SMALLEST: f64 = 1e-6;

/// After so many reductions of the merge distance, the faces of a hull merge only exactly coplanar
/// facets.
///
/// Each reduction costs as much as the merge itself, and nearly all hulls need none. A smaller
/// value leaves more slivers in hulls that are a few merge distances thick.
pub const HULL_MERGE_PASSES: u32 = 32;

// body: facets, and how finely a file was written (facet, precision)

/// Relative to the model's bounding diagonal: how far a vertex may lie over the plane of a face and
/// still count as in it.
///
/// Coplanar triangles must merge into one polygon: the Gauss arc between two of them has no length
/// and would stall every depth walk. A larger value flattens real curvature; a smaller one leaves
/// the faces of rotated boxes cut into triangles.
pub const COPLANAR: f64 = 1e-9;

/// A coordinate with at least this many significant decimal digits was computed, not read from a
/// decimal file.
///
/// A double needs up to 17 digits, and the shortest decimal form of a computed double rarely has
/// fewer than 15. Files have 6 to 9.
pub const COMPUTED_DIGITS: i32 = 15;

/// In steps of the file's decimal grid: how far rounding may put a vertex off the plane or smooth
/// surface that it belongs to. That distance is the *noise* of the surface.
///
/// Each of four points is off by up to 0.87 steps. Smaller leaves CAD models read from decimals cut
/// into slivers (round peg: 4870 pieces at 1e-9 of its size, 1 at two steps); larger flattens what
/// the file really says.
pub const NOISE_PER_STEP: f64 = 2.0;

/// Cosine: two neighbouring triangles whose normals differ by a larger angle are never one face,
/// even if all their vertices lie in one plane.
///
/// The normal of a needle may be wrong by tens of degrees and must not prevent merging; a surface
/// that is folded back onto itself must not merge.
pub const FOLDED: f64 = 0.5;

// body: patches grown over the facets (trial_hull, grow, whole, wide_hull)

/// Area over squared longest side: a triangle of a trial hull below this is a needle, and its plane
/// is not used.
///
/// The plane of a needle is noise and would cut the hull anywhere. Without that plane the tested
/// hull is slightly larger, so the containment test errs on the safe side. A larger value refuses
/// good patches; with a smaller one, noise can hide a surface that enters a hull.
pub const NEEDLE_NORMAL: f64 = 1e-10;

/// Relative to the largest coordinate, times the squared longest side over the area: the rounding
/// of a point's height over a triangle's plane. For points nearer to the plane than this, the exact
/// determinant decides the side.
///
/// About twenty ulps. A larger value only calls the determinant more often; a smaller one trusts
/// wrong signs.
pub const ORIENTATION_ROUNDING: f64 = 4e-15;

/// Multiples of the surface's noise: a patch thinner than this is flat.
///
/// Each of two facets may be off by the noise on either side. The value is well above [`ENTERED`],
/// so that every patch that is not flat has an interior in which containment can be tested. A
/// larger value turns thin curved patches into plates.
pub const FLAT_PATCH: f64 = 8.0;

/// Multiples of the surface's noise: the surface enters a hull if it comes deeper into the hull
/// than this.
///
/// Neighbouring facets in the plane of a face may lie below it by rounding. With a larger value,
/// thin wedges of a hull may extend beyond the solid (over a notch, by less than twice this). A
/// smaller value refuses patches because of rounding (peg: 135 pieces at 1e-4, 41 at 0.25, both at
/// a noise of 1e-6).
pub const ENTERED: f64 = 0.25;

/// Number of planes of a trial hull, newest first, against which boxes of the triangle tree are
/// tested as a whole.
///
/// A new point adds a fan of about six faces. This value affects only speed.
pub const FENCE_PLANES: usize = 12;

/// A connected part of the surface with at least this many facets is first tried as one patch.
/// Smaller parts grow just as fast facet by facet.
pub const WHOLE_FACETS: usize = 64;

/// From this number of points on, a patch uses a hull that stores each face's neighbours.
///
/// Scanning all faces of a small hull is faster than searching from neighbour to neighbour. This
/// value affects only speed.
pub const WIDE_PATCH: usize = 400;

/// Number of planes, of the largest new faces of a wide hull, against which boxes and triangles are
/// tested first.
///
/// A new point's fan has about six faces; a fan that closes over an opening has hundreds, nearly in
/// one plane. This value affects only speed.
pub const WIDE_FENCE: usize = 24;

/// Planes by which a triangle is cut before it counts as entering a wide hull.
///
/// Each cut removes more than half of the remaining triangle, so it shrinks geometrically. Only
/// triangles that touch the hull at a point reach the limit. Then the patch is refused, which is
/// safe.
pub const WIDE_CUTS: usize = 100;

// body: patches dissolved and grown again (decompose)

/// Facets: a patch of at most this size is dissolved if its neighbours can take all its facets.
///
/// The larger a patch is, the less often its neighbours can take all of it. Larger sizes were not
/// tried.
pub const HANDED_OUT: usize = 8;

/// Corners of facets: a patch with more than this is not tried as a taker for facets of a dissolved
/// patch.
///
/// Each trial rebuilds a hull. A larger value only costs time: large patches grew early and have
/// refused those facets before.
pub const HEIR_CORNERS: usize = 300;

/// Seed of the random numbers of the regrowth. With another seed, the number of pieces changes by
/// one or two in two hundred.
pub const REGROWTH_SEED: u64 = 0x2002_0302;

/// Facets that the regrowth tries, per facet of the model. Small models converge within that (the
/// teaspoon within 120).
pub const REGROWTH_PER_FACET: usize = 150;

/// Most facets that the regrowth tries.
///
/// Each trial takes 5 to 10 microseconds. A larger value gives fewer pieces for models of more than
/// 500 facets, and makes their preparation slower.
pub const REGROWTH_MOST: usize = 75_000;

/// Facets: a removal of patches (the "ruin" of ruin and recreate) does not start from a larger
/// patch, since larger patches seldom disappear.
pub const REGROWN_CENTRE: usize = 12;

/// Facets: larger patches are never removed for regrowth, since growing one again costs the square
/// of its size.
pub const REGROWN_MEMBER: usize = 24;

/// Patches removed at once, at most. Values from 4 to 16 gave the same number of pieces on the cup
/// and the spoon.
pub const REGROWN_PATCHES: usize = 6;

/// This times a random number in \[0, 1) is added to the cosine that ranks the facets that may join
/// next. The values 0.2 and 5 gave the same result.
pub const REGROWTH_JITTER: f64 = 1.0;

/// The share of the free facets that are not offered to the surrounding patches. With 0, all these
/// trials would be alike.
pub const REGROWTH_KEPT_BACK: f64 = 0.3;

// body: thick pieces (thicken)

/// Relative: how much the distance to the surface along an inward path may fall below the distance
/// that the path's slope predicts.
///
/// It is also the allowed relative error of the distance at a piece's corner on the medial axis.
/// With a larger value, pieces overlap more around the medial axis. A smaller one ends paths at the
/// surface's roughness and makes each search for nearer surface more expensive.
pub const WAY_SLACK: f64 = 0.1;

/// Smallest growth of the distance to the surface, per length, at which an inward path leaves a
/// vertex. At the edge of a blade this growth is the sine of half the blade's angle.
///
/// A larger value leaves the pieces along blades thin; with a smaller one, paths follow the
/// rounding of needles' normals.
pub const WAY_BEGINS: f64 = 0.05;

/// Smallest growth of the distance, per length, along a later step of an inward path. Where it is
/// smaller, the surrounding surfaces lie opposite each other.
pub const WAY_SLOPE: f64 = 0.3;

/// Steps of an inward path: the first leads to the medial axis, the second along it.
///
/// With only one step, corners of flat faces with rounded rims reach no deeper than the rounding
/// (armadillo: 5 % of the pushes lost instead of 1 %). A third step costs as much as the second and
/// has no visible benefit.
pub const WAY_STEPS: usize = 2;

/// Most searches for nearer surface in one step of an inward path; about 4 are needed. A step that
/// is not done by then is not taken.
pub const WAY_LOOKS: u32 = 32;

/// A step toward the medial axis is made shorter than the length at which nearer surface was found,
/// by this share of that length.
///
/// With a larger value paths end short of the medial axis; a smaller one needs more searches for
/// the nearest surface (at 0 twice as many).
pub const WAY_CUT: f64 = 0.06;

/// Most steps of the search for the point, in the convex hull of some normals, that is nearest to
/// the origin. A few normals take 1 to 10 steps.
pub const HULL_POINT_STEPS: u32 = 32;

/// The search of [`HULL_POINT_STEPS`] ends if a step would reduce the squared length by less than
/// this. Its direction is only a first estimate of the best inward path.
pub const HULL_POINT_GAIN: f64 = 1e-9;

/// Times the distance to the nearest surface: how far below its patch a corner of a piece may lie.
///
/// It must be above 1/(1 − [`WAY_SLACK`]), or a patch would refuse its own inward paths. With a
/// larger value, pieces cover more of one another's part of the solid and report depths that a
/// nearer surface contradicts.
pub const THICK_HONEST: f64 = 1.2;

/// Relative to its depth below the patch: an inner corner that is nearer than this to another one
/// is left out.
pub const THICK_MERGED: f64 = 0.1;

/// Inner corners of a piece, at most. Each one makes depth and distance queries slower; few pieces
/// have more than 8.
pub const THICK_CORNERS: usize = 16;

/// Multiples of the surface's noise: the surface enters a thick hull if it comes deeper into the
/// hull than this.
///
/// Larger than [`ENTERED`]: a flat patch may extend over a notch in its outline by about the noise,
/// and the walls of that notch go down into the piece below the patch. With a larger value, walls
/// of pieces may extend beyond the solid by as much. A smaller value leaves pieces thin because of
/// rounding (M16 nut: 16 % of the pushes lost at 0.25, 6 % at 2).
pub const THICK_ENTERED: f64 = 2.0;

/// Shares of their inward paths at which all inner corners of a piece are tried together.
pub const THICK_SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.35, 0.2];

/// How often an inner corner is moved half way back to the surface while the hull with it contains
/// surface.
pub const THICK_RETREATS: i32 = 3;

/// Facets: patches with more get no inner corners.
///
/// The trial hull of so many points takes a tenth of a second and is built several times. A larger
/// value makes the preparation of smooth bodies with a few dents slow.
pub const THICK_PATCH: usize = 4000;

/// Relative to the depth that the inward paths from the patch's corners reach: a facet wider than
/// this gets an inward path of its own.
///
/// A smaller value costs time on fine meshes and does not change their pieces.
pub const WIDE_FACET: f64 = 0.5;

// body: pieces and the normals that they own (piece, admissible)

/// Multiples of the surface's noise: a facet lies in a face of its piece if it is within this
/// distance of the face's plane.
///
/// The facet may be off its own plane by the noise, and the merge of the face may add the same
/// error again; the patch accepted both.
pub const ON_FACE: f64 = 4.0;

/// A face of a piece is original if at least this share of its area lies on the mesh.
///
/// Slightly less than one half, so that a share of exactly one half is enough.
pub const COVERED_HALF: f64 = 0.499_999;

/// If at least this share of a face's area lies on the mesh, every point of the face counts as
/// lying on the mesh.
///
/// Rounding, and the straight corners that a hull drops, take away a smaller share. A larger value
/// searches triangles for nothing; a smaller one counts a bridged gap as surface.
pub const COVERED_WHOLE: f64 = 0.999;

/// Radians: how far a contact normal may lie beyond the true normals of its features on the source
/// mesh.
///
/// The error of the direction between closest points is their rounding over their distance. Where
/// one piece's normals end, its neighbour's begin; with the slack both pieces report a contact
/// there instead of neither. A larger value gives contacts of one piece where the neighbour's
/// surface is; a smaller one loses contacts at seams of bodies that nearly touch.
pub const ADMISSIBLE_ANGLE: f64 = 1e-4;

/// Radians: the spherical cap around a piece's normals is widened by this, so that a normal stays
/// in the cap when it is rounded in the other body's frame.
///
/// A larger value tests more normals that the piece does not own. A value below the rounding of a
/// transformed normal (1e-15) loses depths.
pub const CAP_SLACK: f64 = 1e-3;

/// Cosine of the half angle of the widest cap that is kept. A wider cap excludes hardly anything,
/// and a cap beyond half a sphere is not convex.
///
/// A smaller value keeps caps up to the half sphere; 0 or less gives wrong results for arcs. A
/// larger value only tests more normals.
pub const CAP_LEAST: f64 = 0.05;

/// The most triangles, of a face that lies on the mesh only in part, that are searched for the one
/// under a closest point. On a face with more, every point counts as lying on the mesh.
///
/// This bounds the time of a tick. Such faces bridge a gap between facets of one plane and have
/// only a few triangles.
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
/// This bounds the depth of the tree by the logarithm of the number of pieces to the base 8/7. A
/// smaller value forces worse cuts; a larger one allows deeper trees and stacks.
pub const SPLIT_SHARE: usize = 8;

/// Steps toward the farthest point in the search for a small bounding sphere. Step k goes 1/(k + 4)
/// of the way.
///
/// This gives a radius within a few percent of the smallest. Any number is safe, since the radius
/// is measured at the end.
pub const SPHERE_STEPS: u32 = 24;

/// How many heights of a child's vertices above the planes of its parent's hull the hierarchy's
/// validation checks in debug builds.
///
/// In nodes of up to some sixty vertices all are checked. A larger value finds a broken hull
/// sooner, and makes debug tests on scans slow.
pub const VALIDATED_HEIGHTS: usize = 4096;

/// Number of nodes, evenly spaced, whose bounds the hierarchy's validation follows up to the root.
pub const VALIDATED_PIECES: usize = 128;

// body: work in parts (body, hierarchy, thicken, admissible)

/// Number of pieces that one part of the work builds or examines.
///
/// Each takes some 10 microseconds. With fewer, distributing the parts costs more; with more,
/// workers are idle at the end. This value affects only speed.
pub const PIECES_PER_PART: usize = 64;

/// A part of the hierarchy with fewer pieces than this is built by one worker.
///
/// In larger parts, each node's hull is a work item of its own. This value affects only speed.
pub const SUBTREE_PIECES: usize = 512;

/// Vertices whose inward paths are one part of the work. Only speed depends on it.
pub const WAYS_PER_PART: usize = 256;

/// Pieces whose own normals are one part of the work: some milliseconds. Only speed depends on it.
pub const OWNERS_PER_PART: usize = 1024;

/// Triangles whose normals are one part of the work: a millisecond. Only speed depends on it.
pub const NORMALS_PER_PART: usize = 16384;

// collision: the march and GJK alike (scale, gjk/simplex)

/// Relative to the pair's size: bodies nearer than this count as touching, and the depth walk gives
/// their contact.
///
/// The direction between two points this near is noise. A larger value would report a false contact
/// at zero separation.
pub const TOUCHING: f64 = 1e-12;

/// Relative to the largest coordinates of the pair in either frame: the rounding of a transformed
/// vertex. The tests of the march and of GJK ignore differences below it.
///
/// Eight ulps: a transformation is nine products and their sums. With a larger value, results fall
/// short of the closest points; with a smaller one, noise can make the march alternate between
/// parallel edges and faces.
pub const MARCH_NOISE: f64 = 8.0 * f64::EPSILON;

// collision: the march (march, scale, clip)

/// Most states that the march may visit. A cold start on a hull of 5000 vertices needs about 200; a
/// start from the previous tick's features needs 1 to 5.
///
/// A larger value only delays the fallback to GJK when the march fails without repeating a state; a
/// smaller one sends cold starts to the fallback.
pub const MARCH_STEPS: u32 = 1000;

/// Relative to the distance: how far the separation that a result's normal proves may fall short of
/// the result's distance.
///
/// A smaller value checks good results a second time because of the rounding of planes; a larger
/// one accepts worse results.
pub const MARCH_PROOF: f64 = 1e-12;

/// Relative to the distance: the most that the proof of [`MARCH_PROOF`] may fall short, even where
/// rounding explains more.
///
/// Only bodies whose distance is below some 1e-7 of their size come near this limit. A larger value
/// would report bodies as separate that touch elsewhere; a smaller one sends more of these few
/// pairs to the fallback.
pub const MARCH_DOUBT: f64 = 1e-2;

/// In debug builds, one in this many results of the march and of the depth query is validated.
///
/// A validation costs as much as a warm-started query. A smaller value makes debug tests slow; a
/// larger one finds errors later.
pub const VALIDATED_ANSWERS: u64 = 16;

/// Sine of the angle below which two edges are nearly parallel; their closest points are then
/// refined by a second solve.
///
/// One solve leaves an error of rounding over the squared angle. A larger value wastes a few
/// nanoseconds.
pub const NEARLY_PARALLEL: f64 = 1e-2;

// collision: GJK (gjk)

/// GJK has converged when the relative gap between its upper and lower bound of the distance is
/// below this.
pub const GJK_GAP: f64 = 1e-13;

/// Steps after which GJK gives up. It takes 5 to 20 on hulls of any size; needles at grazing
/// distance take 40.
///
/// A larger value only costs time where GJK does not converge; a smaller one returns points that
/// are not the closest.
pub const GJK_STEPS: u32 = 128;

/// GJK may take this many steps in a row without shortening the vector.
///
/// Near contact, changes of the length are lost in rounding while the normal still turns. With a
/// larger value GJK circles longer on parallel faces; with a smaller one it stops before it finds
/// the faces.
pub const GJK_PLATEAU: u32 = 8;

// collision: spheres and boxes (bounds)

/// Squared sine of the angle between two box axes; below it, their cross product is not tested as a
/// separating axis.
///
/// The direction would be noise, and the face normals of the boxes then give nearly the same gap. A
/// larger value only loosens the bound.
pub const PARALLEL_AXES: f64 = 1e-12;

// collision: the front (motion bound, front)

/// Relative to the bodies' size: the unit in which the motion bound counts.
///
/// About 1.5e-11. A tick adds at least one unit. A smaller unit comes near the rounding of
/// transformed points (1e-16 of the coordinates) and uses up the 2⁶¹ units of the sum (some 3e7
/// sizes of travel) sooner. A larger unit only wakes pairs early.
pub const MOTION_QUANTUM: f64 = 1.0 / (1u64 << 36) as f64;

/// Relative to the bodies' size and their distance: each tick adds this to the motion bound for the
/// rounding of transformed points.
///
/// Some fifty roundings. With a smaller value, rounding may wake a pair too late when bodies are
/// far from the origin; a larger value wakes resting pairs too often.
pub const MOTION_NOISE: f64 = 1e-14;

/// Relative to the smaller body's half diagonal: a larger motion between two queries is a jump.
/// After a jump the front starts again from the roots, and all cached results of pairs are dropped.
///
/// A hand at 1 m/s moves a 10 cm tool by 1 % of its size in a tick. With a larger value, a depth
/// walk may start on the wrong side of a body after a jump and stay there; a smaller one causes
/// cold starts in fast motion. After a larger motion nearly all close pairs are due, so that a
/// search from the roots visits fewer pairs.
pub const JUMP: f64 = 0.1;

/// Ticks: the bound by spheres is enough if it lets the pair sleep longer than this.
///
/// A sphere test costs a tenth of a march and is looser. This value affects only speed.
pub const SPHERE_NAP: f64 = 8.0;

/// Relative to the distance of a piece from the other body's origin: more than the rounding of a
/// point bound's normals and base to single precision.
pub const POINT_BOUND_ROUNDING: f64 = 4e-7;

/// Ticks: the bound by boxes is enough if it lets the pair sleep longer than this. This value
/// affects only speed.
pub const BOX_NAP: f64 = 4.0;

/// Share of the estimated speed (motion per tick) that is kept from tick to tick. This value
/// affects only speed.
pub const PACE_FADE: f64 = 0.8;

/// In tolerances: two halves of a split pair may be merged if both halves, and the whole, have at
/// least this clearance.
///
/// A smaller value splits and merges the same pairs again and again; a larger one keeps the front
/// longer.
pub const MERGE_CLEARANCE: f64 = 1.0;

/// Up to this many pairs of pieces in contact, each query measures every pair and returns the
/// corners of its patch.
///
/// That many fit into a millisecond. A smaller value simplifies contacts although there is time to
/// measure them; with a larger one the query reaches its work limit first.
pub const CROWD_FROM: f64 = 128.0;

/// From this many pairs in contact on, each pair gives one contact and keeps it as long as it is
/// valid.
///
/// Nearer to [`CROWD_FROM`], contacts would change noticeably as one more pair comes near.
pub const CROWD_ALL: f64 = 512.0;

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
/// larger value is felt; a smaller one measures more pairs in each query.
pub const REST_ERROR: f64 = 0.03;

/// The next rest of a pair is this share of the motion over which the error would reach
/// [`REST_ERROR`].
pub const REST_SAFETY: f64 = 0.7;

/// A pair's rest is shortened by up to this share, differently for each pair, so that not all pairs
/// are due in the same tick.
///
/// A larger value measures more pairs; with a smaller one, the cost of ticks varies more.
pub const REST_SPREAD: f64 = 0.5;

/// A pair's rest may be at most this many times its previous rest.
pub const REST_GROWTH: f64 = 4.0;

/// Up to this number of touching pairs, each pair is measured. If more pairs touch, a sample of
/// about this size represents all pairs.
///
/// The wrench of N contacts that push in the same direction differs from the wrench of an even
/// sample of n by about 1/√n of the spread of their engagements. A larger value costs time on
/// close-fitting pairs.
pub const SAMPLE_PAIRS: f64 = 160.0;

/// Share of the sample, at its end, whose contacts count less.
///
/// A larger value lets contacts come and go more gradually, and measures more pairs.
pub const SAMPLE_FADE: f64 = 0.25;

/// The sample grows or shrinks by at most this share of itself from query to query.
///
/// The weight of a contact then changes by at most SAMPLE_PACE / SAMPLE_FADE in a query.
pub const SAMPLE_PACE: f64 = 0.02;

/// A pair outside the sample is not measured if it presses harder than the sample by at most this
/// share.
///
/// The size of the force is wrong by up to this share. A smaller value measures more pairs.
pub const SAMPLE_EXCESS: f64 = 0.05;

/// A pair outside the sample is not measured if another such pair presses harder by this share.
///
/// The share is above 0, so that of two pairs that press equally hard at least one is measured.
pub const SAMPLE_EQUAL: f64 = 0.02;

/// A contact counts fully if it presses harder by this share beyond [`SAMPLE_EXCESS`].
///
/// A smaller value makes the force change faster while such a contact appears.
pub const SAMPLE_FULL_EXCESS: f64 = 0.05;

/// Share of the contact offset that counts as pressing where the sample presses less.
///
/// With 0, each contact that has just begun to press would be measured.
pub const SAMPLE_LEAST: f64 = 0.05;

/// Largest number of contacts, of the sample and of other pairs, with which a pair is compared.
pub const SAMPLE_LOADS: usize = 512;

/// Relative to the radius of the smaller piece: the motion after which a represented pair is
/// measured again.
///
/// Surfaces that slide along each other have other contacts after about this motion. A smaller
/// value costs time. With a larger one, a deeper contact may be missed for longer.
pub const SAMPLE_TRAVEL: f64 = 1.0;

/// Assumed change of a represented pair's gap relative to the motion that causes it.
///
/// Surfaces that slide along each other change their gap by a small part of the motion. A larger
/// value costs time. With a smaller one, a pair may be deeper than its bound for some ticks.
pub const REPRESENTED_SLOPE: f64 = 0.04;

/// A represented pair is due at the earliest after this share of the motion after which it is
/// measured again.
///
/// A smaller value bounds pairs near their bound in each query.
pub const REPRESENTED_LEAST: f64 = 0.05;

/// Relative to the clearance of [`MERGE_CLEARANCE`]: the motion after which a refused merge is
/// tried again.
pub const MERGE_RETRY: f64 = 0.25;

/// Relative to the size of a sleeping pair of nodes: the front's validation reports a pair as
/// overslept if it is nearer than its wake value allows by more than this.
///
/// The results of marches from different starts differ by up to 1e-11 of the size. A larger value
/// hides a sleep that is too long; a smaller one reports mere rounding.
pub const OVERSLEPT: f64 = 1e-10;

/// Number of places of the front that the front's validation checks in each query of a debug build.
///
/// A larger value finds an error sooner after it occurs, and makes debug tests slow.
pub const VALIDATED_PLACES: u32 = 64;

// depth: the walk over the Minkowski difference (antipodal, gauss_map, overlay, walk)

/// Relative to the pair's size: an improvement of the depth smaller than this ends the walk.
///
/// The walk ends because each step must decrease the depth. The rounding of a support offset is a
/// few ulps of the size.
pub const WALK_DECREASE: f64 = 1e-15;

/// Radians: how far a normal may lie outside a normal cone and still count as a corner of the
/// overlap.
///
/// The normal cones of aligned boxes, plates and prisms only touch, so that rounding (1e-15)
/// decides the signs of dot products: with a smaller slack, a walk stalls on aligned bodies. A
/// larger slack accepts false corners. The offset of a false corner is too small by slack times
/// size, and it hides a true corner beside it. Its witness points are off by the slack over the
/// angle between the two corners.
pub const CONE_SLACK: f64 = 1e-14;

/// Sine: two edges that are nearer to parallel than this form no facet, since the facet's normal
/// would be noise.
///
/// The ends of two nearly coincident Gauss arcs are face normals within [`CONE_SLACK`] of the other
/// cone, so nothing is lost as long as this value is at most [`CONE_SLACK`]. Even for a larger
/// sine, a crossing moves along its arcs by the rounding over the sine; so each crossing is tested
/// against both cones before it is accepted.
pub const PARALLEL_EDGES: f64 = 1e-14;

/// Radians: features that lie in the supporting plane within this angle widen the facet of the
/// CSO that a walk stands on.
///
/// The walk does not turn its plane about the sides of such a facet. So a walk may end this far
/// from a local minimum: this angle times the size, in depth. With a value below the rounding of
/// the pose, the walk would go from corner to corner of a box on a table.
pub const FLUSH_FACET: f64 = 1e-9;

/// Radians: features that lie in the supporting plane within this angle share one witness point,
/// the middle of their overlap.
///
/// It is the merge distance over an edge of a hundredth of the size. A larger value puts witness
/// points off their bodies (by half of this times the size). With a smaller one, small errors of
/// merged faces decide which corner of a box on a table gets the contact.
pub const FLUSH_WITNESS: f64 = 1e-7;

/// Relative to the pair's size: if the true offset of a result exceeds the walk's offset by more
/// than this, or if the offset of another seed is lower by more than this, the walk's result is
/// rejected.
///
/// It is a little more than the merge distances of two bodies: a vertex of a merged face may lie
/// that far below the face's plane. A smaller value searches again over rough faces without
/// benefit; a larger one accepts a walk that ended at a false facet.
pub const OFFSET_SLACK: f64 = 4e-9;

/// Relative to a polytope's radius: if its vertices stand off the planes of its faces by at most
/// this (its bulge), an offset that is computed from the features of a facet needs no search over
/// the vertices.
///
/// Some dozen roundings of a coordinate. A larger value increases the error of depths; a smaller
/// one computes values again that are already exact.
pub const CRISP: f64 = 1e-14;

/// Relative to the shortest edge: if the bulge is larger than this, the next improving edge may be
/// hidden behind a short edge, and support climbs search farther.
///
/// With a larger value, a climb may end at two vertices that differ only by rounding; a smaller one
/// makes climbs over sound polytopes slower.
pub const SHORT_EDGE: f64 = 1e-6;

/// After this many moves a walk gives up. A walk over half of a body of 2000 vertices takes about
/// 30.
pub const WALK_STEPS: u32 = 500;

/// A walk tests the facets across all sides of a face with up to this many; of a face with more,
/// only the one across the side of the origin.
///
/// The origin's side is enough to reach a local minimum. With all sides, the walk takes the lowest
/// of them. For a face of few sides this costs no more than finding the side of the origin.
pub const FACET_SIDES: usize = 8;

/// Corners of a flush overlap that clipping keeps. If two flush faces together have more corners,
/// the result is one corner.
///
/// Two polygons of 48 sides fit. The value is also the size of a scratch buffer.
pub const CLIP_CORNERS: usize = 128;

/// Relative to the pair's size: if the origin lies farther than this beyond a side of a facet, the
/// facet is no local minimum.
///
/// The depth falls at best by the square of this distance, so the smallest distance that can be
/// detected is the square root of the rounding. With a larger value, witness points may lie off
/// their bodies by as much.
pub const STRAY: f64 = 1e-7;

// depth: admissible normals (admissible)

/// Pairs of Gauss arcs of the pieces' own normals that one search for an admissible depth may
/// examine.
///
/// This bounds the time of a tick: one pair costs some 20 instructions. Pieces of a patch have some
/// ten arcs each, and most arcs are excluded because they cannot improve the best depth. Only large
/// patches of two bodies that overlap along virtual faces come near the limit; the search then
/// returns the best depth found.
pub const ADMISSIBLE_CROSSINGS: usize = 1 << 14;

// depth: the certificate (certificate, inner)

/// Largest gap between the lower and upper bound of a proof, relative to the depth. No direction
/// has a depth that is smaller than a proven one by more than this.
///
/// A surface inside the CSO that is complete around the result agrees with it to rounding. A larger
/// value saves growth steps where the CSO is nearly round. Below 1e-12, the rounding of normals
/// disturbs the growth.
pub const PROOF_RELATIVE: f64 = 1e-9;

/// Relative to the coordinates of the pair: the gap that a proof allows for rounding, in addition
/// to [`PROOF_RELATIVE`].
///
/// Some hundred roundings of a point that is transformed and subtracted. A larger value counts
/// deeper contacts as touching, which need no proof; with a smaller one, flat triangles grow onto
/// themselves.
pub const PROOF_ROUNDING: f64 = 1e-13;

/// Relative to the pair's size: if a support point is nearer than this to the plane from which it
/// should lie apart, the support point in the opposite direction is tried as well.
///
/// This affects only the quality of the first tetrahedron of a proof. Support queries cost more
/// than a poor tetrahedron.
pub const PROOF_BEGIN: f64 = 0.01;

/// Most corners of an inner surface. Proofs for ellipsoids of 100 vertices take 20 to 60 corners.
/// Evenly round bodies about one centre take a thousand at 500 vertices each, and three thousand at
/// 2000, in some milliseconds. Depths of larger such pairs are not proven.
pub const PROOF_CORNERS: usize = 4096;

/// Most triangles of an inner surface. The indices of a join allow at most a quarter of 65 536.
pub const PROOF_TRIANGLES: usize = 8192;

/// Most triangles that one growth step may remove, or that may surround the hole.
pub const PROOF_HOLE: usize = 1024;

/// Most growth steps of a new inner surface.
pub const PROOF_GROWTHS: u32 = 4096;

/// Most growth steps of a new inner surface while the depth is not known. After that a walk finds
/// the depth, and another surface is begun.
///
/// Bodies that are not round about each other's centre take fewer than 80 steps. A larger value
/// costs time where rounding has torn a surface; a smaller one does the work twice for large round
/// bodies.
pub const PROOF_BLIND: u32 = 128;

/// Most growth steps that repair the surface of the previous tick. Beyond that, a new surface costs
/// less than more repairs.
pub const PROOF_REPAIRS: u32 = 48;

/// A kept surface is dropped if it has more triangles than this many times those of a new surface.
///
/// With a larger value, each tick tests triangles that only past poses needed; a smaller one builds
/// a new surface more often.
pub const PROOF_GATHERED: usize = 2;

/// Corners of a surface that is kept from tick to tick.
pub const KEPT_CORNERS: usize = 256;

/// Triangles of a surface that is kept from tick to tick; a closed surface has twice as many as
/// corners, less four.
pub const KEPT_TRIANGLES: usize = 512;

// depth: contact patches (patch)

/// Most corners that the outline of a face has in a patch; of a face with more corners, every n-th
/// is used.
///
/// Between two such corners a disc loses 2 % of its radius. More corners make every flush pair of
/// round faces slower, by the square of their number.
pub const PATCH_SIDES: usize = 16;

/// Most faces (or edges, if there are no faces) of one piece in a patch. Of more, the flattest are
/// used, and the patch's slope limit shrinks to theirs.
///
/// Finely curved pieces roll on their patches, and a larger value widens these; a smaller one
/// leaves only one facet of a cylinder.
pub const PATCH_FACES: usize = 4;

/// Most corners of one patch, before corners with too large a separation are left out.
///
/// The overlap of two polygons of [`PATCH_SIDES`] has no more corners. A smaller value drops
/// corners that carry load.
pub const PATCH_CORNERS: usize = 2 * PATCH_SIDES;

/// Relative to the pair's size: corners of a patch nearer than this are merged.
///
/// Two faces that share a corner give it with different rounding. A larger value merges distinct
/// corners.
pub const PATCH_SAME: f64 = 1e-9;

// depth: the depth of solids of any shape (global)

/// Relative to the body's size: surface that enters a cell by less than this is ignored, and no
/// ball smaller than this starts a cell.
///
/// Some hundreds of roundings, so that coplanar triangles share one plane. With a larger value,
/// cells extend beyond their solids.
pub const CELL_BEYOND: f64 = 1e-13;

/// Share of the distance of a triangle from a cell's seed: the plane of the triangle bounds the
/// cell only if it is at least this share of the distance away from the seed.
///
/// Planes of triangles make cells flush with flat faces. A smaller value makes cells thin; a larger
/// one rounds off the corners of solids.
pub const CELL_OWN_PLANE: f64 = 0.5;

/// Most planes of a cell. Cells that need more are not grown; this value affects only speed.
pub const CELL_PLANES: usize = 96;

/// Merge distance of the dual hull of a cell, whose points lie within the unit ball: corners that
/// differ by rounding are one.
///
/// Afterwards the corners are moved inside all planes. So the cell stays inside its solid and only
/// loses this share of its size.
pub const CELL_DUAL: f64 = 1e-12;

/// Relative to the body's size: a solid counts as convex if it has one piece and that piece extends
/// beyond the solid by at most this.
///
/// It is the rounding of coordinates in a file. With a larger value, the bounds of the depth of
/// convex pairs differ by more than 1e-8 of the size.
pub const CONVEX_SHORTFALL: f64 = 4e-9;

/// Relative to the body's size: how far below the surface a sample must lie in a cell to count as
/// covered.
///
/// A tenth of the default gap ([`DEPTH_GAP`]). A smaller value needs many more cells; with a larger
/// one, the query has to grow more cells.
pub const CELL_DEPTH: f64 = 1e-3;

/// Number of sample points on a surface of few triangles. A surface of many triangles has about as
/// many, one per triangle.
pub const CELL_SAMPLES: usize = 8192;

/// Most cells of a body. This value affects only speed.
pub const CELLS: usize = 1024;

/// Cells that are grown in one batch. It does not depend on the number of workers, so that the
/// resulting cells do not either.
pub const CELL_BATCH: usize = 16;

/// Most rounds in which a ball shrinks until it touches the surface on two sides. Three or four are
/// enough for most balls.
pub const SHRINKING_BALL_STEPS: usize = 24;

/// Relative to the ball's radius: within this distance the ball counts as touching the surface.
pub const SHRINKING_BALL_DONE: f64 = 1e-6;

/// Relative to a slope or to the obstacle's radius: smaller differences are rounding in the search
/// for the exit of a ray.
pub const PORTAL_ROUNDING: f64 = 1e-13;

/// Most steps of a search for the exit of a ray; ten are usual. The result is valid after any
/// number of steps.
pub const PORTAL_STEPS: usize = 64;

/// Relative to the smaller body's size: default gap between the lower and upper bound of a depth.
pub const DEPTH_GAP: f64 = 0.01;

/// Default limit of the evaluations for one depth: a second or so.
pub const DEPTH_BUDGET: u64 = 400_000;

/// Relative to the smaller body's size: how far beyond touching a free translation lies.
///
/// Far more than the rounding of transformed vertices, and far less than any measurable length.
pub const DEPTH_HAIR: f64 = 1e-9;

/// Relative to the larger body's size: a lower bound is lowered by this for the rounding of
/// transformed cells.
pub const DEPTH_ROUNDING: f64 = 1e-11;

/// Relative to its size and its distance from the origin: a transformed box is grown by this, so
/// that all transformed corners are inside despite rounding.
///
/// A dozen roundings. A smaller value could miss a pair of triangles that touch; a larger one only
/// costs time.
pub const PLACED_BOX: f64 = 1e-14;

/// Number of queries on two surfaces at one pose that are answered before all boxes of the moving
/// surface are transformed.
pub const LOOSE_QUESTIONS: u32 = 6;

/// Squared, relative to the triangle's side: an edge pierces a triangle if it meets the triangle's
/// plane within this distance of the triangle.
///
/// This affects only where a search for common points begins.
pub const COMMON_POINT: f64 = 1e-12;

/// Most steps of a straight translation out of contact; each step is as long as the distance of the
/// surfaces. A way out along a wall that opens slowly is not found.
pub const ESCAPE_STEPS: usize = 400;

/// Number of pairs of crossing triangles that are examined if no known obstacle blocks a
/// translation.
pub const DEPTH_PROBES: usize = 48;

/// Near this many of these pairs ([`DEPTH_PROBES`]), the deepest common point is searched. The
/// deepest of all of them becomes the seed of two cells.
pub const DEPTH_LENSES: usize = 4;

/// Relative to the smaller body's size: the first step from a crossing into both bodies.
pub const LENS_FIRST_STEP: f64 = 1e-7;

/// Factor from one step to the next. After [`LENS_STEPS`] steps, the last step is about the body's
/// size.
pub const LENS_STEP_GROWTH: f64 = 3.0;

/// Steps away from a crossing into both bodies.
pub const LENS_STEPS: usize = 15;

/// Number of steps away from the nearer surface; each goes half of the distance to it.
pub const LENS_CENTERING: usize = 6;

/// Number of likely obstacles that are tested before all obstacles are. This value affects only
/// speed.
pub const DEPTH_TRIES: usize = 24;

/// Number of obstacles that blocked the latest translations and are tested before all others. This
/// value affects only speed.
pub const RECENT_HOLDERS: usize = 6;

/// Relative to the smaller body's size: if the body has moved less than this since the last search,
/// a search starts with the cones of the last one.
///
/// Only speed depends on it.
pub const DEPTH_NEAR: f64 = 0.02;

/// Relative to the smaller body's size: if the body has moved farther than this since the last
/// list, the pairs of cells that may block a cone are listed again.
///
/// This affects only speed: if a pair is missing from the list, a new cell has to grow; a new list
/// costs 0.1 ms.
pub const DEPTH_LISTED: f64 = 0.1;

/// Radius around the last translation within which longer ones are ignored.
///
/// The next translation is hardly longer. A larger value transforms more cells that block nothing;
/// a smaller one starts again more often.
pub const DEPTH_REACH: f64 = 1.5;

/// Most half-spaces that a projection collects before it gives up.
pub const DEPTH_PROJECT_STEPS: usize = 24;

/// How often a search for a near facet of an obstacle is repeated along the normal that it found.
pub const EXIT_TURNS: usize = 6;

/// Most half-spaces that a slide collects before it gives up.
pub const DEPTH_SLIDE_STEPS: usize = 64;

/// The first this many obstacles that may block a cone's triangle are all tested, and the best is
/// used. This value affects only speed.
pub const CONE_FIRST_TRIES: usize = 12;

/// After those of [`CONE_FIRST_TRIES`], obstacles are tested until one blocks the cone's triangle,
/// up to this many. This value affects only speed.
pub const CONE_TRIES: usize = 64;

/// Number of obstacles that a cone caches. This value affects only speed.
pub const CONE_HINTS: usize = 4;

/// Share of the gap: a cone is cut if one move raises its bound by less than this.
pub const CONE_GAIN: f64 = 0.1;

/// Share of the gap: if a cone's triangle is smaller than this, its corners are tested one by one.
pub const CONE_SMALL: f64 = 0.05;

/// Share of the gap: a cone whose triangle is smaller than this is not cut any more.
pub const CONE_SMALLEST: f64 = 1e-4;

/// Cuts of cones between two searches for a shorter free translation.
pub const CONE_CUTS_PER_WAY_OUT: u64 = 12;

/// If a cone has at least this many candidate obstacles, each of its halves keeps only the
/// candidates in its own directions.
pub const CONE_FILTER: usize = 64;

// detect: the contact query (search, belief)

/// A repaired depth is rejected unless the witness point lies below the surface by at least this
/// share of the depth.
///
/// If the surface bends, its nearest point is a little nearer than the surface along the contact's
/// normal. A larger value drops true contacts on curved parts; a smaller one accepts depths that
/// another surface contradicts.
pub const BELIEVED_SHARE: f64 = 0.8;

/// Like [`BELIEVED_SHARE`], where two edges meet: a point beyond an edge is nearer to the faces at
/// that edge.
///
/// At right-angled edges it is nearer by a factor √½. A larger value drops true contacts of sharp
/// edges; a smaller one accepts depths that another surface contradicts.
pub const BELIEVED_EDGE_SHARE: f64 = 0.65;

/// Radians: an overlap of two pieces that have no shared surface normal is skipped until the bodies
/// have turned, if at least this rotation is needed to change that.
///
/// This value affects only speed: a smaller rotation takes only a few ticks, and the walk then
/// starts again.
pub const BARREN_LEAST: f64 = 0.004;

// detect: the guard against tunnelling (guard, sub_step)

/// In tolerances: the longest motion of any point in a sub-step.
///
/// It is below 1, so that every surface comes within the tolerance before the tool passes it. With
/// a larger value the tool passes sheets without a contact; a smaller one sub-steps harmless
/// motion. At 1 mm tolerance and 1 kHz, half a tolerance per tick is 0.5 m/s.
pub const GUARD_STEP: f64 = 0.5;

/// In motions of a tick: a piece at least this thick is not tunnelled through in the tick.
///
/// A larger value examines more pairs in fast ticks. A smaller one loses contacts at the tips of
/// wedges, where a piece is thinner than elsewhere. At 2, a point that entered through one side may
/// already be nearer to the other.
pub const GUARD_THICK: f64 = 8.0;

/// Most sub-steps of a tick. A tick that would need more is treated as a jump, not as motion (8 m/s
/// at 1 mm tolerance and 1 kHz).
///
/// A larger value makes fast ticks more expensive; a smaller one protects only slower motions.
pub const GUARD_SUB_STEPS: u32 = 16;

/// In tolerances: a pair that tunnelled is held until it is this much deeper than at the moment of
/// tunnelling.
///
/// A larger value pushes longer on a hand that went through on purpose; a smaller one releases the
/// pair during the same motion that tunnelled.
pub const GUARD_HOLD: f64 = 20.0;

/// Cosine: a normal that turns by more than this angle (120°) in a sub-step has turned over.
///
/// A tool that slides off the side of a part turns the normal by a right angle. A value nearer to
/// −1 misses oblique tunnelling; one nearer to 0 holds pairs that only slid off.
pub const TURNED_OVER: f64 = -0.5;

// force: shading (smooth_surface, smooth_body)

/// Cosine of the largest angle between the normals on both sides of an edge that shading treats as
/// equal.
///
/// The normals of a smooth vertex are computed once and copied to its corners, so they agree to
/// rounding. Larger angles hide faint creases; smaller ones would find creases in rounding.
pub const SHADING_SAME: f64 = 1.0 - 1e-9;

/// Cosine of the largest angle between a face of a piece and a triangle of the mesh that lies in
/// it.
///
/// Half a degree: merged faces are planar to far less, but the normals of needles are noisy. A
/// larger angle counts neighbouring triangles of fine meshes as part of the face; a smaller one
/// leaves needles without shading.
pub const SHADING_IN_FACE: f64 = 0.999_96;

/// The most triangles of a piece's faces that are searched for the one under a contact point.
///
/// This bounds the time to a few microseconds per contact. Contacts on larger merged faces, which
/// are flat anyway, keep their true normal.
pub const SHADING_TRIANGLES: usize = 1024;

// force: clusters (cluster, representative, sharing)

/// Cells of the clustering grid along one axis. A cell's key has 21 bits per axis; a few values are
/// left for neighbours on both sides.
///
/// Contacts beyond this many cells share the outermost cells; this is slower, but the result is the
/// same.
pub const CLUSTER_CELLS: f64 = 2_097_140.0;

/// Steps of the search for a cone that holds all normals of a cluster.
///
/// The cone found is within about 1/steps of the smallest. A smaller value cuts a few clusters
/// whose normals would just fit into a cone.
pub const CAP_STEPS: u32 = 16;

/// Relative to the sum of the weights: a weighted sum of normals shorter than this has no direction
/// (eq. 3).
///
/// The sum of cancelling normals is rounding, or the difference of two large, nearly equal loads. A
/// larger value rejects valid directions; with a smaller one, noise decides the direction of the
/// force.
pub const CANCELLED_NORMAL: f64 = 1e-6;

/// Relative to the largest coordinate: how far rounding may put a representative's midpoint outside
/// the bounding box of its members' midpoints, and how far its normal may be from unit length.
///
/// A sum over a thousand contacts rounds a thousand times. A larger value hides a wrong weight; a
/// smaller one reports mere rounding.
pub const MIDPOINT_ROUNDING: f64 = 1e-12;

/// m: sums of weights between which a representative is validated in debug builds.
///
/// Outside of this range, products of weights and lengths underflow or overflow. A wider range
/// reports mere rounding; a narrower one excludes real contacts.
pub const SANE_WEIGHTS: [f64; 2] = [1e-100, 1e100];

/// In debug builds, the validation of clusters checks all pairs of contacts of a run with at most
/// this many contacts. The check is quadratic.
pub const VALIDATED_CONTACTS: usize = 64;

/// Relative to their distance from b's origin: contacts nearer than this, across the direction of
/// the force, are at one place.
///
/// Two pieces that share a corner give it with different rounding. With a larger value, the second
/// of two near contacts vanishes.
pub const TILT_SAME: f64 = 1e-9;

/// Most contacts of smooth clustering, which compares all pairs of them
/// ([`crate::force::LinkageSettings::most`]).
///
/// This bounds the time of the step after the query: 256 contacts take some 0.4 ms in all. When one
/// of many contacts replaces another, the point of application of their shared force jumps by at
/// most 2/[`CROWD_MOST`] of the extent of the contacts. So a smaller value allows larger jumps.
pub const CROWD_MOST: usize = 256;

// force: friction (friction)

/// Relative to the strain at which a contact slides: a contact whose strain exceeds that by no more
/// than this counts as sticking.
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
pub const FRICTION_HEIR: f64 = 0.5;

/// Distance from the middle of a patch at which a corner's friction acts, as a share of the
/// corner's own distance from the middle.
///
/// Under an even load the mean distance from the middle, relative to that of the corners, is 0.50
/// on a line segment, 0.54 on a square and 0.67 on a disc. A larger value brakes a spin too
/// strongly, a smaller one too weakly.
pub const FRICTION_SPREAD: f64 = 0.54;

/// How many tracked contacts one tick may compare to find the predecessors of new contacts.
///
/// This bounds the time of a tick: beyond the limit, new contacts begin without strain. A tick of
/// 300 contacts with 100 new ones needs 30 000 comparisons.
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
/// which the lighter devices vibrate when nobody holds them.
pub const APPARENT_MASS: f64 = 0.1;

/// kg·m²: the inertia of a device's grip if the device does not state it.
pub const APPARENT_INERTIA: f64 = 5e-5;

/// Largest stiffness of a coupling, times the square of the period, over the apparent mass
/// (dimensionless).
///
/// A device that nobody holds (0.1 kg, 0.04 N of dry friction, one tick of delay, 0.03 mm encoder
/// steps) starts to vibrate at two to three times this stiffness, with the matching damping.
pub const COUPLING_SAMPLED: f64 = 0.01;

/// In periods of the loop: damping of a coupling over its stiffness.
///
/// The loop lags by one and a half periods; with less than that, the damping has no effect. With
/// more, the noise of the velocity is felt.
pub const COUPLING_LEAD: f64 = 3.0;

/// N·m/rad: stiffness of the torque that turns the tool to the hand's orientation, for a device
/// that gives forces but no torques.
///
/// With this value the force equals that on a device with all six axes. There, contact turns the
/// hand (0.15 N·m/rad if it is relaxed, 0.6 for an ordinary grip) and also turns the coupling (0.94
/// N·m/rad); in series these give 0.13 to 0.37. Without torques the hand does not turn, so the tool
/// has to. At 5, a spoon in a cup gave three times the force of the six-axis device. Far below 0.3,
/// the tool's orientation differs visibly from the hand's.
pub const COUPLING_ALIGNMENT: f64 = 0.3;

/// s: damping of that torque over its stiffness.
///
/// A hand resists quick turns: its damper is 13 to 17 ms times its stiffness. In series with the
/// coupling of a six-axis device that gives about 12 ms. With [`COUPLING_LEAD`] instead, the tool
/// turned out of the way of quick contacts too soon: a spoon that touched a cup for a tenth of a
/// second was off by 18 % of the force.
pub const COUPLING_ALIGNMENT_LEAD: f64 = 12e-3;

/// m: after the force of a coupling has reached its limit, the coupling stretches by this much more
/// before its anchor slips.
///
/// With a shorter length the anchor slips as soon as the hand presses slightly harder than the
/// device can; a longer one is felt on the way back.
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
/// Users do not notice a third more or less of their own motion; from 1 on, the tool could move
/// against the hand.
pub const COUPLING_RETURN: f64 = 0.3;

/// Relative to the tool's contact offset: how far the tool sinks into it under the device's largest
/// force.
///
/// If it sank by the whole offset, hard presses would end at exact touch, where normals and witness
/// points are least accurate.
pub const TOOL_SINKS: f64 = 0.5;

/// Relative to the contact tolerance: the contact offset, which is the separation below which
/// contacts push the tool.
///
/// A larger value keeps a peg out of a hole whose clearance is smaller than the tolerance. A
/// smaller one makes contacts stiffer than the accuracy of curved meshes justifies, and lets a fast
/// tool overlap before it is stopped.
pub const TOOL_SKIN: f64 = 0.1;

// render: the tool's step (tool, together, touches)

/// In contact offsets: the shortest look-ahead distance of contacts.
///
/// This covers the encoder steps and the slow motion of a tool at rest. A larger value examines
/// more pairs that are not in contact; a smaller one limits the first steps of a tool that is
/// pulled away.
pub const REACH_LEAST: f64 = 2.0;

/// In contact offsets: a tool in contact may always move this far in a step, even if its query did
/// not examine everything that may have come near.
///
/// At 1 kHz and an offset of 20 µm this is 10 mm/s. A smaller value is felt as a drag when
/// close-fitting parts turn, for which the work limit is always too small. With a larger one the
/// tool sinks in deeper before unexamined surface pushes back.
pub const REACH_CREEP: f64 = 0.5;

/// In the next step the tool may move at most this many times as far as in the last one.
///
/// A hand cannot double its speed in a millisecond. A larger value examines more pairs when the
/// tool is fast; with 1, the tool could never accelerate.
pub const REACH_GROWTH: f64 = 2.0;

/// Factor by which the look-ahead of contacts shrinks in each step that needs less.
///
/// Each growth of the tolerance shortens the sleep of pairs in the front. So the tolerance should
/// not shrink and grow in every step.
pub const REACH_FADE: f64 = 0.9;

/// Margin of a moving body's box: in radii of the body for a tool, and in contact tolerances for
/// other bodies.
///
/// While a body stays within the margin it keeps its box, and no new pairs are searched. For a tool
/// of 6 cm the margin is 7 mm, which is 20 steps of a quick hand. A larger value queries pairs that
/// are far apart; 0 computes and sorts the boxes in every step.
pub const BOX_SPARE: f64 = 0.25;

/// m/s: the speed of a tool is limited to this, whatever the device reports.
///
/// A thrown tool is slower. The limit bounds the tolerance of the query.
pub const TOOL_FASTEST: f64 = 5.0;

/// Most times that a tool's step is solved to find which contacts press and which slide.
///
/// Which contacts press is found in two or three rounds; the error of sliding halves in each round.
/// More rounds only cost time.
pub const COUPLING_ROUNDS: u32 = 12;

/// The rounds of a tool's step oscillate if the distance of a solution to the last but one is less
/// than this share of its distance to the last one.
///
/// A contact that starts to press also reverses the change between rounds, but does not lead back
/// to the same solution.
pub const RELAX_DRIFT: f64 = 0.1;

/// Smallest share of the way from guess to solution that a relaxed round of a tool's step goes.
///
/// Friction that lifts its body off the surface converges with shares of a few hundredths. A
/// smaller share could need more than [`COUPLING_ROUNDS`] rounds.
pub const RELAX_LEAST: f64 = 0.02;

/// Relative to a contact's friction limit: a larger change of its friction causes another round of
/// a tool's step.
///
/// The remaining error is a hundredth of one contact's friction and is corrected in the next tick.
pub const COUPLING_SETTLED: f64 = 0.01;

// render: the ring of an impact (transient)

/// s: an impact along a direction is rendered only if no contact has pressed along it for this
/// long.
///
/// A hand taps at most ten times a second; a tool that bounces by encoder steps is off the surface
/// for a few ticks. A longer time drops taps; a shorter one makes a tool that rests on a rough
/// surface buzz.
pub const IMPACT_REST: f64 = 0.02;

/// Cosine: normals within this angle of each other count as one direction of contact.
///
/// 30°. With a wider angle, a tool that slides down a slope onto a wall feels no impact; with a
/// narrower one, a tool vibrates when it rolls over facets.
pub const IMPACT_CONE: f64 = 0.866;

/// Relative to the device's largest force: the largest force of an impact's vibration.
///
/// The rest is left for the contact itself. At 200 Hz the slew limit (the largest force in 2 ms)
/// does not clip the vibration.
pub const TRANSIENT_MOST: f64 = 1.0 / 3.0;

/// Ticks in a period of a vibration, at least.
///
/// With five, the steps of the sampled force are 2 dB below the vibration itself. With fewer, the
/// vibration becomes noise.
pub const TRANSIENT_SAMPLES: f64 = 5.0;

// render: the limits (saturate)

/// Relative: a saturated force or torque is shorter than its limit by this.
///
/// A few roundings, so that no output exceeds the limit even in the last bit. A larger value wastes
/// force.
pub const SATURATION_ROUNDING: f64 = 1e-15;

/// Cost of starting a march, in units of [`crate::algebra::Work`]. One unit is the cost of
/// examining a pair of nodes.
///
/// The caller that sets the work limit measures the time per unit. So the `WORK_` values only need
/// to be right relative to each other, within a factor of two or so: the parts of a query then
/// share the limit in proportion to their time.
pub const WORK_MARCH: u64 = 2;

/// Cost of a step of a march or of a depth walk, in the same units.
pub const WORK_STEP: u64 = 1;

/// Cost of the result of a leaf pair: the checks of its surface and of its depth.
pub const WORK_ANSWER: u64 = 6;

/// Units of work for an upper bound of a pair's depth.
pub const WORK_BOUND: u64 = 2;

/// Cost of starting a depth walk, with its search for a shared surface normal.
pub const WORK_WALK: u64 = 20;

/// Cost of a patch, and of each of its corners.
pub const WORK_PATCH: u64 = 12;

/// After a step that took longer than estimated, a pacer's estimates move toward it by this share.
pub const PACE_DEARER: f64 = 0.25;

/// After a step that took less time, a pacer's estimates move toward it by this share: they adapt
/// within a second or so.
pub const PACE_CHEAPER: f64 = 1e-3;

/// ns: assumed time of a unit of work before any was measured. The value is rather too large: the
/// first steps then do less work, while no force is on yet.
pub const PACE_FIRST_PRICE: f64 = 100.0;

/// Units of work: a step with less work than this is too short to measure the cost of a unit.
pub const PACE_TELLING: u64 = 500;

/// Units of work that a query may always do, so that it makes progress however late the loop is.
pub const PACE_LEAST_WORK: u64 = 200;

/// Default share of the loop's period that a step should take.
///
/// The rest is left for the device, the recorder and other load of the machine.
pub const PACE_SHARE: f64 = 0.6;

/// s: assumed interval between a host's updates of a driven body (60 Hz) before a real one is
/// known.
pub const DRIVEN_PERIOD: f64 = 1.0 / 60.0;

/// s: without an update, a driven body keeps its velocity for this long, and then slows down to
/// rest in the same time.
///
/// Six periods of the slowest usual host. With a longer time, a robot whose program hangs keeps
/// pushing; with a shorter one, a late update is felt.
pub const DRIVEN_PATIENCE: f64 = 0.1;
