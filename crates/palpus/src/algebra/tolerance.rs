//! The register of every tolerance in the engine. No other file holds a small literal that decides
//! something.
//!
//! Each entry says its unit, why it has that size, and what breaks if it moves. "Relative" means:
//! multiplied by a length of the thing at hand (stated) before use.
//!
//! Grouped by room, and in a room by task, in the order of the pipeline; behind a group's name, the
//! modules of the room that use it. A value for several rooms stands in the first of them, a value
//! for several modules in the first group.

// algebra: poses and matrices

/// Relative to the largest coordinate: how far rounding may put a vertex above a supporting
/// plane of its polytope, and how far a unit normal, or a unit quaternion, may be from unit length.
///
/// Some tens of ulps. Larger hides a wrong plane; smaller accuses rounding.
pub const WELL_FORMED_ROUNDING: f64 = 1e-14;

/// Sweeps of Jacobi rotations over a 3 × 3 symmetric matrix; it converges quadratically, five leave
/// only rounding.
pub const JACOBI_SWEEPS: usize = 8;

// body: from a file to a mesh (mesh, weld, orient)

/// Model units: a coordinate larger than this is refused.
///
/// The exact predicates multiply three coordinates and products of those must not overflow; nothing
/// real is this large.
pub const LARGEST_COORDINATE: f64 = 1e50;

/// Model units: a model whose largest extent is smaller than this is refused.
///
/// The exact predicates multiply three coordinates and the rounding terms of those must not
/// underflow.
pub const SMALLEST_EXTENT: f64 = 1e-50;

/// Relative to the largest coordinate extent of the point set: two vertices closer than this are
/// one.
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

/// Relative to the longest edge of the triangle: a triangle lower than this over its longest edge
/// has no area.
///
/// Its normal would be noise. Larger drops real slivers of CAD meshes and opens the surface.
pub const ZERO_AREA: f64 = 1e-12;

/// Rounds in which triangles of no area are exchanged with their neighbours.
///
/// One is enough unless such triangles lie in rows along one side. More only costs time; what is
/// left after the last round is dropped and leaves a crack of no width.
pub const CAP_ROUNDS: usize = 8;

/// Vertices of a component that must lie inside another for the component to count as nested in it.
///
/// One would do if components never crossed; a few more tell a crossing one from a cavity.
pub const NESTING_SAMPLES: usize = 8;

// body: what is asked of a mesh (health, mass, triangle_tree, winding)

/// Times the number of triangles: pairs of a mesh's own triangles that are tested for crossing, at
/// most.
///
/// A sound mesh has some ten to twenty pairs of overlapping boxes a triangle. Reached only by
/// meshes that are wound around themselves all over; the answer then says that it is a lower bound.
pub const SELF_PAIRS: usize = 500;

/// Relative to the cube of the bounding diagonal: a closed mesh or hull that holds less encloses
/// nothing.
///
/// The volume of two coinciding sheets is rounding noise of either sign, and the centre of mass
/// divides by it.
pub const LEAST_VOLUME: f64 = 1e-12;

/// Relative to the bounding diagonal: the thickness of the sheet that a flat mesh's mass is that
/// of.
///
/// Anything positive gives a body that can be moved; a thousandth is a sheet of paper of the
/// model's size.
pub const SHEET_THICKNESS: f64 = 1e-3;

/// Triangles in a leaf of the triangle tree, at most. Only speed depends on it.
pub const LEAF_TRIANGLES: usize = 4;

/// Relative to the ray's parameter: how much later a ray may enter a box than leave it and still be
/// let in.
///
/// The slabs' parameters are rounded to a few ulps. Zero would lose triangles that lie in a face of
/// their box.
pub const RAY_SLACK: f64 = 1e-14;

/// Winding number from which on a point is inside an open surface.
///
/// Half way between nowhere near (0) and enclosed (1).
pub const INSIDE_WINDING: f64 = 0.5;

/// Multiples of a box's radius from which on its triangles are seen as one dipole.
///
/// The error of one box falls with the square of it, errors of many boxes may add up: 3 keeps the
/// winding number within about 0.01 on real models. Smaller is faster.
pub const DIPOLE_REACH: f64 = 3.0;

// body: hulls and polytopes (hull)

/// Model units: the largest coordinate that a hull accepts.
///
/// Products of three differences and their rounding errors must not overflow, or signs stop being
/// exact.
pub const HULL_LARGEST: f64 = 1e70;

/// Model units: a point set of smaller size is one point for the hull, and a smaller coordinate is
/// zero.
///
/// The last error term of an orientation is about 1e-96 of the product of three sizes; below this
/// it vanishes and signs stop being exact.
pub const HULL_SMALLEST: f64 = 1e-70;

/// Factor on the merge distance of a hull's face that has merged too much.
///
/// Far enough to leave the cluster of near-coplanar facets that made the trouble, near enough to
/// still merge what differs by less.
pub const HULL_MERGE_RETREAT: f64 = 0.1;

/// Relative to the merge distance: below this a face merges only what is exactly coplanar.
///
/// With [`COPLANAR`] it is 1e-15 of the size, the rounding of a turned body.
pub const HULL_MERGE_SMALLEST: f64 = 1e-6;

/// Retreats after which the faces of a hull merge only what is exactly coplanar.
///
/// Each costs as much as the merge itself. Nearly all hulls need none; smaller leaves more slivers
/// in hulls that are a few merge distances thick.
pub const HULL_MERGE_PASSES: u32 = 32;

// body: facets, and how finely a file was written (facet, precision)

/// Relative to the model's bounding diagonal: how far a vertex may lie over the plane of a face and
/// still count as in it.
///
/// Coplanar triangles must merge into one polygon, since between them lie Gauss arcs of no
/// length that stall every walk. Larger flattens real curvature; smaller leaves rotated boxes cut
/// into triangles.
pub const COPLANAR: f64 = 1e-9;

/// Significant decimal digits from which on a coordinate was computed, not read from a decimal
/// file.
///
/// A double needs up to 17; the shortest form of a computed one rarely has fewer than 15. Files
/// write 6 to 9.
pub const COMPUTED_DIGITS: i32 = 15;

/// Steps of the coordinates: how far a vertex of a plane or of a smooth surface may be off it by
/// rounding (the noise).
///
/// Each of four points is off by up to 0.87 steps. Smaller leaves CAD models read from decimals cut
/// into slivers (round peg: 4870 pieces at 1e-9 of its size, 1 at two steps); larger flattens what
/// the file really says.
pub const NOISE_PER_STEP: f64 = 2.0;

/// Cosine of the angle between two normals beyond which neighbours are not one face, even when all
/// their vertices lie in one plane.
///
/// A needle's normal may be off by tens of degrees without harm; a surface folded back onto itself
/// must not merge.
pub const FOLDED: f64 = 0.5;

// body: patches grown over the facets (trial_hull, grow, whole, wide_hull)

/// Area over squared longest side: a triangle of a trial hull lower than this is a needle whose
/// plane is not used.
///
/// The plane of a needle is noise and would cut the hull anywhere. Leaving it out makes the hull
/// seem a little larger, so containment errs on the safe side. Larger refuses good patches; smaller
/// lets noise hide a surface in a hull.
pub const NEEDLE_NORMAL: f64 = 1e-10;

/// Relative to the largest coordinate, times the squared longest side over the area: the
/// rounding of a point's height over a triangle's plane. Nearer than this the exact determinant
/// decides.
///
/// About twenty ulps. Larger only calls the determinant more often; smaller trusts wrong signs.
pub const ORIENTATION_ROUNDING: f64 = 4e-15;

/// Multiples of the surface's noise: a patch thinner than this is flat.
///
/// Two facets may each be off by the noise on either side. Well above [`ENTERED`], so that whatever
/// is not flat has an inside that containment can test. Larger turns thin curved patches into
/// plates.
pub const FLAT_PATCH: f64 = 8.0;

/// Multiples of the surface's noise: the surface enters a hull when it comes deeper into it than
/// this.
///
/// Neighbours in the plane of a face may lie below it by rounding. Larger lets thin wedges of a
/// hull stand out of the solid (over a notch, by less than twice this); smaller refuses patches for
/// rounding (peg: 135 pieces at 1e-4, 41 at 0.25, both at a noise of 1e-6).
pub const ENTERED: f64 = 0.25;

/// Planes of a trial hull, the newest first, against which whole boxes of the triangle tree are
/// tested.
///
/// A new point's fan of faces has about six. Only speed depends on it.
pub const FENCE_PLANES: usize = 12;

/// Facets: connected parts of the surface with at least as many are tried whole; smaller ones grow
/// as fast.
pub const WHOLE_FACETS: usize = 64;

/// Points from which on a patch has a hull with neighbours.
///
/// Looking at all of a small hull is quicker than searching its neighbours. Only speed depends on
/// it.
pub const WIDE_PATCH: usize = 400;

/// Planes of the largest new faces of a wide hull, against which boxes and triangles are tested
/// first.
///
/// A new point's fan has about six; one that closes over an opening has hundreds, nearly in one
/// plane. Only speed depends on it.
pub const WIDE_FENCE: usize = 24;

/// Planes by which a triangle is cut before it counts as entering a wide hull.
///
/// Each cut goes beyond the middle of what is left, so that it shrinks geometrically. Reached only
/// by triangles that touch the hull at a point; refusing the patch then is safe.
pub const WIDE_CUTS: usize = 100;

// body: patches dissolved and grown again (decompose)

/// Facets: patches up to this size are dissolved when their neighbours can take all of them.
///
/// The larger a patch, the rarer takers for all of it; larger sizes were not tried.
pub const HANDED_OUT: usize = 8;

/// Corners of facets: patches with more are not asked to take facets of a dissolved one.
///
/// Asking rebuilds a hull. Larger only costs time, since large patches grew early and have
/// refused those facets before.
pub const HEIR_CORNERS: usize = 300;

/// Seed of the random numbers of the regrowth. Another seed changes counts by a piece or two in two
/// hundred.
pub const REGROWTH_SEED: u64 = 0x2002_0302;

/// Facets tried by the regrowth, per facet of the model: small models converge (teaspoon within
/// 120).
pub const REGROWTH_PER_FACET: usize = 150;

/// Facets tried by the regrowth, at most.
///
/// Some 5 to 10 microseconds each. Larger makes the preparation of models of more than 500 facets
/// slower for fewer pieces.
pub const REGROWTH_MOST: usize = 75_000;

/// Facets: larger patches are not what a ruin starts from; they seldom go.
pub const REGROWN_CENTRE: usize = 12;

/// Facets: larger patches are not ruined, since growing one again costs the square of its size.
pub const REGROWN_MEMBER: usize = 24;

/// Patches ruined at once, at most. 4 to 16 came to the same counts on the cup and the spoon.
pub const REGROWN_PATCHES: usize = 6;

/// Added, times a random number in \[0, 1), to the cosine that ranks what joins next. 0.2 and 5 did
/// the same.
pub const REGROWTH_JITTER: f64 = 1.0;

/// The share of the free facets that are not offered to the patches around. 0 makes every such
/// trial alike.
pub const REGROWTH_KEPT_BACK: f64 = 0.3;

// body: thick pieces (thicken)

/// Relative: how much nearer than promised the surface may be along an inward path.
///
/// Allowed error of the distance at a piece's corner on the medial axis, relative. Larger lets
/// pieces overlap more around the medial axis; smaller ends paths at the surface's roughness and
/// makes every look for nearer surface dearer.
pub const WAY_SLACK: f64 = 0.1;

/// The least growth of the distance along an inward path, per length, at a vertex: the sine of half
/// the angle of a blade.
///
/// Larger leaves the pieces along blades thin; smaller follows the rounding of needles' normals.
pub const WAY_BEGINS: f64 = 0.05;

/// The least growth of the distance along a later step of an inward path: below it the surfaces
/// around lie opposite each other.
pub const WAY_SLOPE: f64 = 0.3;

/// Steps of an inward path: to the medial axis and along it.
///
/// With one, corners of flat faces with rounded rims reach no deeper than the rounding (armadillo:
/// 5 % of the pushes lost instead of 1 %); a third costs as much as the second without visible
/// gain.
pub const WAY_STEPS: usize = 2;

/// Looks for nearer surface in one step of a way; about 4 are needed. A step that has not ended by
/// then is not taken.
pub const WAY_LOOKS: u32 = 32;

/// By how much a step of a path toward the medial axis is cut below the length at which nearer
/// surface was found, relative to that length.
///
/// With a larger value paths end short of the medial axis; a smaller one needs more searches for
/// the nearest surface (at 0 twice as many).
pub const WAY_CUT: f64 = 0.06;

/// Steps of the search for the point of a hull of normals that is nearest to the origin; a few
/// normals take 1 to 10.
pub const HULL_POINT_STEPS: u32 = 32;

/// Squared length below which a step of that search gains nothing; the direction is only a first
/// estimate of the best inward path.
pub const HULL_POINT_GAIN: f64 = 1e-9;

/// Times the distance to the nearest surface: how far below its patch a corner of a piece may lie.
///
/// Above 1/(1 − [`WAY_SLACK`]), or a patch would refuse its own ways. Larger lets pieces cover
/// more of one another's part of the solid, and report depths that a nearer surface denies.
pub const THICK_HONEST: f64 = 1.2;

/// Relative to its depth below the patch: an inner corner nearer than this to another is not
/// needed.
pub const THICK_MERGED: f64 = 0.1;

/// Inner corners of a piece, at most. Depth and distance queries pay for each; few pieces have more
/// than 8.
pub const THICK_CORNERS: usize = 16;

/// Multiples of the surface's noise: the surface enters a thick hull when it comes deeper into it
/// than this.
///
/// More than [`ENTERED`], since a flat patch may cover a notch of its outline by about the noise,
/// and the walls of that notch go down into whatever is below the patch. Larger lets walls of
/// pieces stand out of the solid by as much; smaller leaves pieces thin for rounding (M16 nut: 16
/// % of the pushes lost at 0.25, 6 % at 2).
pub const THICK_ENTERED: f64 = 2.0;

/// Shares of their ways at which all inner corners are tried at once.
pub const THICK_SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.35, 0.2];

/// How often a single inner corner that lets surface into the hull is pulled half way back to the
/// surface.
pub const THICK_RETREATS: i32 = 3;

/// Facets: patches with more get no inner corners.
///
/// The trial hull of so many points takes a tenth of a second, and is made several times. Larger
/// makes smooth bodies with a few dents slow to prepare.
pub const THICK_PATCH: usize = 4000;

/// Relative to the depth that the ways from its patch's corners reach: a facet wider than this has
/// a way of its own.
///
/// Smaller costs time on fine meshes, where it changes nothing.
pub const WIDE_FACET: f64 = 0.5;

// body: pieces and the normals that they own (piece, admissible)

/// Multiples of the surface's noise: a facet lies in a face of its piece when no farther than this
/// from its plane.
///
/// The facet may be off its own plane by the noise, the face's merge by another, and the patch
/// accepted both.
pub const ON_FACE: f64 = 4.0;

/// The share of a face's area that must be real for the face to be original.
///
/// A little less than one half, so that exactly half counts.
pub const COVERED_HALF: f64 = 0.499_999;

/// The share of a face's area that must be real for every point of the face to be.
///
/// Straight corners that a hull drops and rounding take less. Larger searches triangles for
/// nothing; smaller takes a bridged gap for surface.
pub const COVERED_WHOLE: f64 = 0.999;

/// Radians: how far a contact normal may lie beyond the true normals of its features on the source
/// mesh.
///
/// The direction between closest points is rounding over their distance, and where one piece's
/// normals end its neighbour's begin: the slack lets both answer there rather than neither. Larger
/// shows as contacts of one piece where the neighbour's surface is; smaller loses contacts at
/// seams of bodies that nearly touch.
pub const ADMISSIBLE_ANGLE: f64 = 1e-4;

/// Radians: a cap of a piece's normals is wider by this than they are, so that no rounding of a
/// direction in the other body's frame leaves it.
///
/// Larger looks at more normals than are owned; smaller than the rounding of a placed normal
/// (1e-15) loses depths.
pub const CAP_SLACK: f64 = 1e-3;

/// Cosine of the widest cap that is kept: a wider one sorts next to nothing out, and half a sphere
/// is not convex.
///
/// Smaller keeps caps up to the half sphere; 0 or less is wrong for arcs. Larger only looks at
/// more.
pub const CAP_LEAST: f64 = 0.05;

/// The most triangles of a partly real face that are searched for the one under a closest point; on
/// a face with more, every point counts as real.
///
/// Bounds the tick. Such faces bridge a gap between facets of one plane and have a handful.
pub const ADMISSIBLE_TRIANGLES: usize = 256;

// body: hierarchy (hierarchy, bounds)

/// Cosine of the angle within which a face of an inner hull and an original face of a piece can be
/// the same face.
///
/// The register's coplanar distance decides; this keeps the two sides of a plate apart.
pub const SAME_FACE: f64 = 0.5;

/// Neither child of a node has fewer pieces than the node's over this.
///
/// Bounds the depth by the logarithm of the number of pieces to the base 8/7. Smaller forces worse
/// cuts; larger allows deeper trees and stacks.
pub const SPLIT_SHARE: usize = 8;

/// Steps toward the farthest point when a small sphere is sought. The k-th is 1/(k + 4) of the way.
///
/// Enough for a radius within a few percent of the least; any number is safe, since the radius is
/// measured.
pub const SPHERE_STEPS: u32 = 24;

/// Heights of a child's vertices above the planes of its parent's hull that the walker of a
/// hierarchy looks at in debug builds.
///
/// All of them in nodes of up to some sixty vertices. More finds a broken hull sooner, and makes
/// debug tests on scans slow.
pub const VALIDATED_HEIGHTS: usize = 4096;

/// Nodes of a hierarchy whose bounds that walker follows up to the root, evenly spaced.
pub const VALIDATED_PIECES: usize = 128;

// body: work in parts (body, hierarchy, thicken, admissible)

/// Pieces that one part of the work makes or looks at.
///
/// Some 10 microseconds each. Fewer cost more handing out; more leave hands idle at the end. Only
/// speed depends on it.
pub const PIECES_PER_PART: usize = 64;

/// Pieces below which a part of the hierarchy is built by one hand.
///
/// Above it each node's hull is a part of its own. Only speed depends on it.
pub const SUBTREE_PIECES: usize = 512;

/// Vertices whose inward paths are one part of the work. Only speed depends on it.
pub const WAYS_PER_PART: usize = 256;

/// Pieces whose own normals are one part of the work: some milliseconds. Only speed depends on it.
pub const OWNERS_PER_PART: usize = 1024;

/// Triangles whose normals are one part of the work: a millisecond. Only speed depends on it.
pub const NORMALS_PER_PART: usize = 16384;

// collision: the march and GJK alike (scale, gjk/simplex)

/// Relative to the pair's size: bodies nearer than this touch, and are answered by the depth walk.
///
/// The direction between two points this near is noise. Larger would report a false contact at zero
/// separation.
pub const TOUCHING: f64 = 1e-12;

/// Relative to the largest coordinates of the pair in either frame: the rounding of a placed
/// vertex that the tests of the march and of GJK must not chase.
///
/// Eight ulps: a placement is nine products and their sums. Larger leaves answers short of the
/// closest points; smaller lets parallel edges and faces hand the march back and forth on noise.
pub const MARCH_NOISE: f64 = 8.0 * f64::EPSILON;

// collision: the march (march, scale, clip)

/// States that the march may visit. A cold start on a hull of 5000 vertices needs about 200; a
/// coherent one 1 to 5.
///
/// Larger only delays the fallback on a failure that no repeated state betrays; smaller sends cold
/// starts to it.
pub const MARCH_STEPS: u32 = 1000;

/// Relative to the distance: how much the separation that an answer's normal proves may fall
/// short of its distance.
///
/// Smaller sends good answers to a second look, for the rounding of planes; larger would accept
/// worse ones.
pub const MARCH_PROOF: f64 = 1e-12;

/// Relative to the distance: the most that the proof of the march may fall short, whatever rounding
/// would excuse.
///
/// Only bodies within some 1e-7 of their size of each other come near it. Larger would call bodies
/// apart that touch elsewhere; smaller sends more of these few to the fallback.
pub const MARCH_DOUBT: f64 = 1e-2;

/// One of so many answers of the march and of the depth is validated in debug builds.
///
/// Validating costs as much as a warm answer does. Fewer makes debug tests slow; more finds what is
/// wrong later.
pub const VALIDATED_ANSWERS: u64 = 16;

/// Sine of the angle below which two edges are nearly parallel: their closest points are then
/// solved for twice.
///
/// One solve leaves a residual of rounding over the angle squared. Larger wastes a few nanoseconds.
pub const NEARLY_PARALLEL: f64 = 1e-2;

// collision: GJK (gjk)

/// Relative gap between GJK's upper and lower bound of the distance at which it has converged.
pub const GJK_GAP: f64 = 1e-13;

/// Steps after which GJK gives up. It takes 5 to 20 on hulls of any size; needles at grazing
/// distance take 40.
///
/// Larger only costs time on data that doesn't converge; smaller returns points that are not
/// closest.
pub const GJK_STEPS: u32 = 128;

/// Steps of GJK in a row that may gain nothing in length.
///
/// Near contact the length is lost in rounding while the normal still turns; larger circles longer
/// on parallel faces, smaller stops before the faces are found.
pub const GJK_PLATEAU: u32 = 8;

// collision: spheres and boxes (bounds)

/// Squared sine of the angle between two box axes below which their cross product is no axis to
/// test.
///
/// The direction would be noise; the boxes' own faces then give nearly the same gap. Larger only
/// loosens the bound.
pub const PARALLEL_AXES: f64 = 1e-12;

// collision: the front (motion bound, front)

/// Relative to the bodies' size: the unit in which the motion bound counts.
///
/// About 1.5e-11. A tick adds at least one unit. A smaller unit lets rounding of placed points
/// (1e-16 of the coordinates) come near it, and uses up the 2⁶¹ units of the sum (some 3e7 sizes of
/// travel) sooner; a larger one only wakes pairs early.
pub const MOTION_QUANTUM: f64 = 1.0 / (1u64 << 36) as f64;

/// Relative to the bodies' size and their distance: what each tick adds to the motion for the
/// rounding of placed points.
///
/// Some fifty roundings. Smaller lets a pair oversleep by rounding when bodies are far from the
/// origin; larger wakes pairs that rest.
pub const MOTION_NOISE: f64 = 1e-14;

/// Relative to the smaller body's half diagonal: motion between two queries that is a jump, after
/// which the front begins anew and nothing is known of any pair.
///
/// A hand at 1 m/s moves a 10 cm tool by 1 % of its size in a tick. Larger lets a depth walk start
/// on the wrong side of a body after a jump and stay there; smaller pays for cold starts in fast
/// motion. Beyond it nearly everything near is due, and searching from the roots looks at less.
pub const JUMP: f64 = 0.1;

/// Ticks: a bound by spheres is enough when the pair may sleep longer than this by it.
///
/// A sphere test costs a tenth of a march and is looser. Speed alone depends on it.
pub const SPHERE_NAP: f64 = 8.0;

/// Ticks: a bound by boxes is enough when the pair may sleep longer than this by it. Speed alone
/// depends on it.
pub const BOX_NAP: f64 = 4.0;

/// How much of the pace is remembered from tick to tick. Speed alone depends on it.
pub const PACE_FADE: f64 = 0.8;

/// Tolerances: halves that both have at least this clearance may be merged, when the whole has it
/// too.
///
/// Smaller splits and merges the same pairs in turn; larger keeps a longer front.
pub const MERGE_CLEARANCE: f64 = 1.0;

/// Pairs of pieces in contact up to which each of them is measured in each query, and has the
/// corners of its patch.
///
/// That many fit into a millisecond. A smaller value changes contacts although there is time to
/// measure them; with a larger one the limit of work is reached first.
pub const CROWD_FROM: f64 = 128.0;

/// Pairs in contact from which on each pair gives one contact, and keeps it as long as it is good.
///
/// Nearer to [`CROWD_FROM`], contacts would change noticeably as one more pair comes near.
pub const CROWD_ALL: f64 = 512.0;

/// Relative to the radius of the smaller piece of a pair: the motion for which its answer is good
/// at most.
///
/// Larger carries contacts past the ends of the faces that they lie on.
pub const REST_TRAVEL: f64 = 0.1;

/// Share of that motion for which the first answer of a pair is taken to be good.
pub const REST_FIRST: f64 = 0.5;

/// Allowed error of a separation just before its pair is measured again, relative to the sum of
/// the tolerance and the deepest depth.
///
/// A hundredth is a hundredth of the force at most; the errors of many contacts cancel. Larger
/// is felt; smaller measures more pairs in each query.
pub const REST_ERROR: f64 = 0.01;

/// Share of the motion over which the error would be that large: the next rest.
pub const REST_SAFETY: f64 = 0.7;

/// How much of its rest a pair may lose, so that not all pairs are due in the same tick.
///
/// Larger measures more pairs; smaller lets ticks differ more in what they cost.
pub const REST_SPREAD: f64 = 0.5;

/// Factor by which a rest may be longer than the one before.
pub const REST_GROWTH: f64 = 4.0;

/// Share of that clearance: the motion before a refused merge is tried again.
pub const MERGE_RETRY: f64 = 0.25;

/// Relative to the size of a sleeping pair of nodes: by how much it may be nearer than its wake
/// value says before the walker of the front calls it overslept.
///
/// A march from another start answers up to 1e-11 of the size differently. Larger hides a
/// sleep that is too long; smaller accuses rounding.
pub const OVERSLEPT: f64 = 1e-10;

/// Places of the front that the walker looks at in each query of a debug build.
///
/// More finds what is broken sooner after it broke, and makes debug tests slow.
pub const VALIDATED_PLACES: u32 = 64;

// depth: the walk over the Minkowski difference (gauss_map, overlay, walk, descent)

/// Relative to the pair's size: an improvement of the depth smaller than this ends the walk.
///
/// Strict decrease is what makes the walk end; rounding of a support offset is a few ulps of the
/// size.
pub const WALK_DECREASE: f64 = 1e-15;

/// Radians: how far a normal may lie outside a normal cone and still count as a corner of the
/// overlap.
///
/// Aligned boxes, plates and prisms have cones that only touch, so that exact signs of dot products
/// are a matter of rounding (1e-15): a smaller slack lets a walk stall on aligned bodies. A larger
/// one accepts false corners. Their offset is too small by slack times size, they hide a true
/// corner beside them, and the witness points stray by the slack over the angle between the two.
pub const CONE_SLACK: f64 = 1e-14;

/// Sine: edges nearer to parallel than this span no facet of their own (their normal would be
/// noise).
///
/// The ends of two nearly coincident Gauss arcs are face normals within [`CONE_SLACK`] of the other
/// cone, so nothing is lost as long as this is not larger than that. Above it a crossing still
/// moves along its arcs by rounding over this sine, which is why every crossing that would be taken
/// is held against both cones.
pub const PARALLEL_EDGES: f64 = 1e-14;

/// Radians: features that lie in the supporting plane within this angle widen the facet of the
/// CSO that a walk stands on.
///
/// The walk leaves a facet by its sides, so this bounds how far from a local minimum it may end:
/// this times the size in depth. Smaller than rounding of the pose would have boxes on tables
/// walked corner by corner.
pub const FLUSH_FACET: f64 = 1e-9;

/// Radians: features that lie in the supporting plane within this angle share the witness: the
/// middle of their overlap.
///
/// The merge distance over an edge of a hundredth of the size. Larger puts witness points off their
/// bodies (by half of this times the size); smaller lets the flatness of merged faces decide at
/// which corner a box on a table is held.
pub const FLUSH_WITNESS: f64 = 1e-7;

/// Relative to the pair's size: an answer whose true offset exceeds the walk's by more than this is
/// walked on from.
///
/// Two bodies' merge distances, by which a vertex of a merged face lies lower than its plane, and
/// some. Smaller repeats walks over rough faces for nothing; larger accepts a walk that ended at a
/// false corner.
pub const OFFSET_SLACK: f64 = 4e-9;

/// Relative to a polytope's radius: with a bulge of no more than this, the planes of its faces
/// support it, and an offset that is taken from the features of a facet needs no vertices looked
/// at.
///
/// Some dozen roundings of a coordinate. Larger adds to the error of depths; smaller measures exact
/// values again.
pub const CRISP: f64 = 1e-14;

/// Relative to the shortest edge: a bulge of more than this may hide an edge that leads on from
/// one of its ends, so that climbs look further there.
///
/// Larger lets a climb end at a pair of vertices that are one but for rounding; smaller makes
/// climbs over sound polytopes slower.
pub const SHORT_EDGE: f64 = 1e-6;

/// Moves after which a walk is ended with what it has. A cold walk over 2000 vertices takes about
/// 30.
pub const WALK_STEPS: u32 = 500;

/// Hub pairs of one facet up to which all are looked at; of a facet with more, only the two on the
/// side of the origin.
///
/// Looking at more than the origin's side is not needed to end in a local minimum; it lets the walk
/// see past facets that share only a corner with the present one. Polygons of 8 corners and all
/// pairs of edges are below it; two flush rectangles are above.
pub const FACET_HUBS: usize = 8;

/// Spokes of a vertex up to which a plane that turns about a side of a facet is held against all of
/// them; where a vertex has more, the walk goes over hubs.
///
/// Vertices of meshes have about 6. It sizes a buffer on the stack.
pub const FACET_SPOKES: usize = 24;

/// Corners of a flush overlap that are kept when it is clipped; flush faces with more in sum are
/// answered by a corner.
///
/// Two fans of 48 sides fit. It sizes a buffer of the scratch.
pub const CLIP_CORNERS: usize = 128;

// depth: where a walk starts, and starts again (query)

/// Faces per body, evenly chosen, whose normals a cold depth query tries beside its seeds.
///
/// On reference poses the centroid line alone ends in a merely local depth for 5.5 %; with 8
/// faces of each body and the lowest 3 walked from, for 0.4 %; with 32 faces, for 0.2 %. Each costs
/// two climbs, once when a pair begins to overlap.
pub const COLD_FACES: usize = 8;

/// How many of those normals are walked from.
pub const COLD_WALKS: usize = 3;

/// How often a walk is taken up again from an end that is not confirmed.
pub const WALK_RESUMES: u32 = 4;

/// Relative to the pair's size: an origin that lies farther than this beyond a side of the facet
/// shows that the walk has stopped early.
///
/// h falls by the square of it at best, so that the root of rounding is the least that can be seen.
/// Larger leaves witness points off their bodies by as much.
pub const STRAY: f64 = 1e-7;

/// Tilts of the normal that are tried to leave a facet on which a walk has stopped early; the first
/// is the stray over the size, the last as small as [`FLUSH_WITNESS`].
pub const TILTS: u32 = 7;

/// Factor from one such tilt to the next.
pub const TILT_SHRINK: f64 = 0.1;

// depth: admissible normals (admissible)

/// Pairs of own arcs that one search for an admissible depth may look at.
///
/// Bounds the tick: a look is some 20 instructions. Pieces of a patch have some ten arcs each, most
/// above the bar. Only large patches of two bodies that overlap along virtual faces come near the
/// limit, and keep the best result until then.
pub const ADMISSIBLE_CROSSINGS: usize = 1 << 14;

// depth: the certificate (certificate, inner)

/// Largest gap of a proof between its lower and upper bound, relative to the depth. No direction is
/// better than a proven one by more.
///
/// A surface within the CSO that is complete around the answer agrees with it to rounding; larger
/// saves growths where the CSO is nearly round, smaller than 1e-12 makes them fight with the
/// rounding of normals.
pub const PROOF_RELATIVE: f64 = 1e-9;

/// Relative to the coordinates of the pair: what a proof leaves to rounding, beside
/// [`PROOF_RELATIVE`].
///
/// Some hundred roundings of a point that is placed and subtracted. Larger calls deeper contacts
/// touching, which need no proof; smaller makes flat triangles grow onto themselves.
pub const PROOF_ROUNDING: f64 = 1e-13;

/// Relative to the pair's size: a support nearer than this to the plane it should lie off has the
/// opposite one tried as well.
///
/// Decides only how good the first tetrahedron of a proof is; supports cost more than a poor
/// tetrahedron.
pub const PROOF_BEGIN: f64 = 0.01;

/// Corners of an inner surface. Proofs for ellipsoids of 100 vertices take 20 to 60; evenly round
/// bodies about one centre take a thousand at 500 vertices each and three thousand at 2000, in some
/// milliseconds. Larger such pairs are not proven.
pub const PROOF_CORNERS: usize = 4096;

/// Triangles of an inner surface. The indices of a join do not suffice for more than a quarter of
/// 65 536.
pub const PROOF_TRIANGLES: usize = 8192;

/// Triangles that one growth may take away or leave around the hole.
pub const PROOF_HOLE: usize = 1024;

/// Growths of a new surface, at most.
pub const PROOF_GROWTHS: u32 = 4096;

/// Growths of a new surface for which the depth is not known, at most; then a walk finds it, and
/// another surface is begun.
///
/// Bodies that are not round about each other's centre take less than 80. More costs time where
/// rounding has torn a surface; fewer spends it twice on large round bodies.
pub const PROOF_BLIND: u32 = 128;

/// Growths of a surface of the last tick, at most; a new one then costs less than more repairs.
pub const PROOF_REPAIRS: u32 = 48;

/// How many times the triangles of a new surface one may gather before it is dropped.
///
/// Larger judges triangles each tick that only past poses needed; smaller builds a new surface more
/// often.
pub const PROOF_GATHERED: usize = 2;

/// Corners of a surface that is kept from tick to tick.
pub const KEPT_CORNERS: usize = 256;

/// Triangles of a surface that is kept from tick to tick; a closed surface has twice as many as
/// corners, less four.
pub const KEPT_TRIANGLES: usize = 512;

// depth: contact patches (patch)

/// Corners that the outline of a face has in a patch; of larger faces every n-th is taken.
///
/// A disc loses 2 % of its radius between two of them. More cost time in every flush pair of round
/// faces, by the square.
pub const PATCH_SIDES: usize = 16;

/// Faces, or else edges, of one piece in a patch. Of more, the flattest are taken, and the slope
/// shrinks to theirs.
///
/// More widen the patches of finely curved pieces, which roll on them; fewer leave a cylinder one
/// facet.
pub const PATCH_FACES: usize = 4;

/// Corners of one patch, before those that are too far apart are left out.
///
/// Two polygons of [`PATCH_SIDES`] have no more. Smaller drops corners with load on them.
pub const PATCH_CORNERS: usize = 2 * PATCH_SIDES;

/// Relative to the pair's size: corners of a patch nearer than this are one.
///
/// The same corner comes from two faces that share it, with different rounding. Larger merges
/// corners that are apart.
pub const PATCH_SAME: f64 = 1e-9;

// depth: the depth of solids of any shape (global)

/// Relative to the body's size: a surface that enters a cell by less does not count, and no ball
/// smaller than this starts a cell.
///
/// Some hundreds of roundings: coplanar triangles share one plane. Larger puts cells outside of
/// their solids.
pub const CELL_BEYOND: f64 = 1e-13;

/// Share of the distance of a triangle from a cell's seed: its own plane must lie at least that far
/// from the seed to bound the cell.
///
/// Own planes make cells flush with flat faces. Smaller makes cells thin; larger rounds off the
/// corners of solids.
pub const CELL_OWN_PLANE: f64 = 0.5;

/// Planes that a cell can have. Cells that need more are not grown; only speed depends on it.
pub const CELL_PLANES: usize = 96;

/// Merge distance of the dual hull of a cell, whose points lie within the unit ball: corners that
/// differ by rounding are one.
///
/// The corners are drawn into all planes afterwards, so this costs no truth, only that share of the
/// cell.
pub const CELL_DUAL: f64 = 1e-12;

/// Relative to the body's size: a solid is convex if its one piece reaches beyond it by no more.
///
/// Rounding of coordinates in a file. Larger makes the bounds of convex pairs differ by more than
/// 1e-8 of the size.
pub const CONVEX_SHORTFALL: f64 = 4e-9;

/// Relative to the body's size: how far below the surface a sample must lie in a cell to count as
/// covered.
///
/// A tenth of the gap that is asked for by default. Smaller needs many more cells; larger leaves
/// more to cells grown in the query.
pub const CELL_DEPTH: f64 = 1e-3;

/// Samples of a surface of few triangles; one of many triangles has about as many, one a triangle.
pub const CELL_SAMPLES: usize = 8192;

/// Cells of a body. Only speed depends on it.
pub const CELLS: usize = 1024;

/// Cells that are grown at once. The same for any number of workers, so that the cells are the
/// same.
pub const CELL_BATCH: usize = 16;

/// Rounds in which a ball shrinks until it touches the surface on two sides. Three or four suffice
/// for most.
pub const SHRINKING_BALL_STEPS: usize = 24;

/// Relative to the ball's radius: so near to the surface is touching.
pub const SHRINKING_BALL_DONE: f64 = 1e-6;

/// Relative, to a slope or to the obstacle's radius: less than this is rounding in the search for
/// the exit of a ray.
pub const PORTAL_ROUNDING: f64 = 1e-13;

/// Steps of a search for the exit of a ray; ten are usual. The answer holds wherever it ends.
pub const PORTAL_STEPS: usize = 64;

/// Relative to the smaller body's size: the default of the gap between the bounds of a depth.
pub const DEPTH_GAP: f64 = 0.01;

/// Default of the evaluations that a depth may take: a second or so.
pub const DEPTH_BUDGET: u64 = 400_000;

/// Relative to the smaller body's size: how far beyond touching a free translation lies.
///
/// Far more than the rounding of placed vertices, far less than what anyone measures.
pub const DEPTH_HAIR: f64 = 1e-9;

/// Relative to the larger body's size: by how much a lower bound is lowered for the rounding of
/// placed cells.
pub const DEPTH_ROUNDING: f64 = 1e-11;

/// Relative to its size and place: what a placed box is grown by, so that rounding leaves no placed
/// corner outside.
///
/// A dozen roundings. Smaller could miss a pair of triangles that touch; larger only costs time.
pub const PLACED_BOX: f64 = 1e-14;

/// Questions about two surfaces at one pose that are answered before all boxes of the moving one
/// are placed.
pub const LOOSE_QUESTIONS: u32 = 6;

/// Relative to the side, squared: how near to a triangle a side must pierce its plane to pierce the
/// triangle.
///
/// Only where a search for common points begins depends on it.
pub const COMMON_POINT: f64 = 1e-12;

/// Steps of a straight way out, each as long as the surfaces are apart. A way out along a wall that
/// opens slowly is not seen.
pub const ESCAPE_STEPS: usize = 400;

/// Pairs of crossing triangles that are looked at where no known obstacle blocks a translation.
pub const DEPTH_PROBES: usize = 48;

/// Number of these pairs beside which the deepest common point is looked for; the deepest of all
/// seeds two cells.
pub const DEPTH_LENSES: usize = 4;

/// Relative to the smaller body's size: the first step from a crossing into both bodies.
pub const LENS_FIRST_STEP: f64 = 1e-7;

/// Factor from one step to the next, and steps: the last is about the body's size.
pub const LENS_STEP_GROWTH: f64 = 3.0;

/// Steps away from a crossing into both bodies.
pub const LENS_STEPS: usize = 15;

/// Steps away from the nearer surface, by half of its distance.
pub const LENS_CENTERING: usize = 6;

/// Obstacles that are looked at before all are. Only speed depends on it.
pub const DEPTH_TRIES: usize = 24;

/// Obstacles that held the last translations, which are looked at before all others. Only speed
/// depends on it.
pub const RECENT_HOLDERS: usize = 6;

/// Relative to the smaller body's size: a search begins with the cones of the last one if the body
/// has moved less since.
///
/// Only speed depends on it.
pub const DEPTH_NEAR: f64 = 0.02;

/// Relative to the smaller body's size: the pairs of cells that may block a cone are listed anew if
/// the body has moved farther since.
///
/// Only speed depends on it: a list that lacks a pair makes a new cell grow; a list costs 0.1 ms.
pub const DEPTH_LISTED: f64 = 0.1;

/// Radius around the last translation within which longer ones are ignored.
///
/// The next one is hardly longer. Larger places more cells that block nothing; smaller begins anew
/// more often.
pub const DEPTH_REACH: f64 = 1.5;

/// Half-spaces that a projection collects before it gives up.
pub const DEPTH_PROJECT_STEPS: usize = 24;

/// Times that a search for a near facet of an obstacle turns to the normal that it found.
pub const EXIT_TURNS: usize = 6;

/// Half-spaces that a slide collects before it gives up.
pub const DEPTH_SLIDE_STEPS: usize = 64;

/// Obstacles that may hold a cone's triangle of which the best is taken. Only speed depends on it.
pub const CONE_FIRST_TRIES: usize = 12;

/// Obstacles that may hold a cone's triangle which are looked at until one does. Only speed depends
/// on it.
pub const CONE_TRIES: usize = 64;

/// Obstacles that a cone remembers. Only speed depends on it.
pub const CONE_HINTS: usize = 4;

/// Share of the gap: a cone whose bound rises by less in one move is cut as well.
pub const CONE_GAIN: f64 = 0.1;

/// Share of the gap: the corners of a cone with a smaller triangle are looked at one by one.
pub const CONE_SMALL: f64 = 0.05;

/// Share of the gap: a cone with a smaller triangle is not cut any more.
pub const CONE_SMALLEST: f64 = 1e-4;

/// Cuts of cones between two searches for a shorter free translation.
pub const CONE_CUTS_PER_WAY_OUT: u64 = 12;

/// Candidates from which on a cone's halves look for those of them that come into their directions.
pub const CONE_FILTER: usize = 64;

// detect: the contact query (search, belief)

/// Share of a repaired depth by which the witness point must lie below the surface; otherwise the
/// depth is rejected.
///
/// If the surface bends, its nearest point is a little nearer than the surface along the contact's
/// normal. Larger drops true contacts on curved parts; smaller accepts depths that another surface
/// contradicts.
pub const BELIEVED_SHARE: f64 = 0.8;

/// The same where two edges meet: the point that lies beyond an edge is nearer to the faces at it.
///
/// At right-angled edges by the root of one half. Larger drops true contacts of sharp edges;
/// smaller believes depths that another surface denies.
pub const BELIEVED_EDGE_SHARE: f64 = 0.65;

/// Radians: an overlap without a normal that both pieces own is left alone if the bodies must turn
/// by as much to change that.
///
/// Only speed depends on it: less than that lasts a few ticks, and the walk begins anew afterwards.
pub const BARREN_LEAST: f64 = 0.004;

// detect: the guard against tunnelling (guard, sub_step)

/// Tolerances: the longest way of any point in a sub-step.
///
/// Below 1, so that whatever is passed is met within the tolerance first. Larger passes sheets
/// unseen; smaller cuts motion that is no danger: at 1 mm tolerance and 1 kHz, half a tolerance is
/// 0.5 m/s.
pub const GUARD_STEP: f64 = 0.5;

/// Times the way of a tick: pieces as thick as that are not tunnelled through in it.
///
/// Larger looks at more pairs in fast ticks; smaller lets go at the tips of wedges, where a piece
/// is thinner than it is as a whole. 2 is where a point that came in by one side may be nearer to
/// the other.
pub const GUARD_THICK: f64 = 8.0;

/// Sub-steps of a tick, at most: a tick that would need more is a leap and not a motion (8 m/s at 1
/// mm tolerance and 1 kHz).
///
/// Larger lets fast ticks cost more; smaller guards slower hands only.
pub const GUARD_SUB_STEPS: u32 = 16;

/// Tolerances: how much deeper than where it tunnelled a pair is held.
///
/// Larger pushes longer on a hand that went through on purpose; smaller lets go in the swing of the
/// hand that tunnelled.
pub const GUARD_HOLD: f64 = 20.0;

/// Cosine: a normal that turns by more than this angle (120°) in a sub-step has turned over.
///
/// Going off the side of a part turns it by a right angle. Nearer to −1 lets oblique passages
/// through; nearer to 0 holds what slid off.
pub const TURNED_OVER: f64 = -0.5;

// force: shading (smooth_surface, smooth_body)

/// Cosine of the largest angle between two normals that shading takes for one, on both sides of an
/// edge.
///
/// The normals of a smooth vertex are computed once and copied to its corners, so they agree to
/// rounding. Larger angles hide faint creases; smaller ones would find creases in rounding.
pub const SHADING_SAME: f64 = 1.0 - 1e-9;

/// Cosine of the largest angle between a face of a piece and a triangle of the mesh that lies in
/// it.
///
/// Half a degree: merged faces are planar to far less, but the normals of needles are noisy. Larger
/// takes neighbours of fine meshes for the face itself; smaller leaves needles without shading.
pub const SHADING_IN_FACE: f64 = 0.999_96;

/// The most triangles of a piece's faces that are searched for the one under a contact point.
///
/// Bounds the tick at a few microseconds a contact. Contacts on larger merged faces, which are flat
/// anyway, keep their true normal.
pub const SHADING_TRIANGLES: usize = 1024;

// force: clusters (cluster, representative, sharing)

/// Cells of the clustering grid along one axis; a cell's key has 21 bits for each, less two for
/// neighbours on both sides.
///
/// Contacts that spread over more than this many cells share the outermost ones: slower, never
/// wrong.
pub const CLUSTER_CELLS: f64 = 2_097_140.0;

/// Steps of the search for a cone that holds all normals of a cluster.
///
/// The cone found is within about 1/steps of the smallest. Fewer cut a few clusters that a cone
/// would just have held.
pub const CAP_STEPS: u32 = 16;

/// Relative to the sum of the weights: a weighted sum of normals shorter than this has no direction
/// (eq. 3).
///
/// The sum of cancelling normals is rounding, or the difference of two large, nearly equal loads.
/// Larger gives up valid directions; smaller lets noise point the force.
pub const CANCELLED_NORMAL: f64 = 1e-6;

/// Relative to the largest coordinate: by how much rounding may put a representative's midpoint
/// outside the box about its members', and how far its normal may be from unit length.
///
/// A sum over a thousand contacts rounds a thousand times. Larger hides a wrong weight; smaller
/// accuses rounding.
pub const MIDPOINT_ROUNDING: f64 = 1e-12;

/// m: sums of weights between which a representative is validated in debug builds.
///
/// Products of weights and lengths outside of them underflow or overflow. Wider accuses rounding,
/// narrower leaves real contacts out.
pub const SANE_WEIGHTS: [f64; 2] = [1e-100, 1e100];

/// Contacts of a run of the clustering up to which its walker looks at all pairs of them in debug
/// builds; it is quadratic.
pub const VALIDATED_CONTACTS: usize = 64;

/// Relative to their distance from b's origin: contacts across one direction nearer than this are
/// one place.
///
/// The corner that two pieces share comes from each with its own rounding. Larger lets the
/// second of two near contacts vanish.
pub const TILT_SAME: f64 = 1e-9;

/// Contacts that smooth clustering lets meet, each with each
/// ([`crate::force::LinkageSettings::most`]).
///
/// Bounds the step after the query: 256 contacts take some 0.4 ms in all. Fewer let the place of a
/// force that many contacts share jump by more where one takes another's place: by at most one part
/// in half this many of what they span.
pub const CROWD_MOST: usize = 256;

// force: friction (friction)

/// Relative to the strain at which a sliding contact is held: a strain above it by no more than
/// this is not being dragged.
///
/// The adhesion point is stored as a position, so a contact at rest reads its strain back with the
/// rounding of that position. Smaller lets rounding keep a resting contact sliding; larger lets a
/// slow slide stick.
pub const FRICTION_HELD: f64 = 1e-9;

/// Cosine of the largest angle between the normals of a lost contact and of a new one near it that
/// takes over its strain.
///
/// Around a rounded edge neighbours differ by tens of degrees; opposite walls of a slot must not
/// exchange strains.
pub const FRICTION_HEIR: f64 = 0.5;

/// Place of a corner's friction, as a share of its distance from the middle of its patch.
///
/// Under an even load the mean distance from the middle is 0.50 of the corners' on a stretch, 0.54
/// on a square, 0.67 on a disc. Larger brakes a spin too strongly, smaller lets it go on.
pub const FRICTION_SPREAD: f64 = 0.54;

/// How many tracked contacts may be looked at in one tick to find predecessors of new contacts.
///
/// Bounds the tick: past it, new contacts begin without strain. A tick of 300 contacts with 100 new
/// ones needs 30 000.
pub const FRICTION_LOOKS: usize = 65_536;

// render: the virtual coupling (coupling)

/// m: the stretch of the coupling at which the device's largest force comes.
///
/// Longer is softer than need be; shorter asks more stiffness than most devices have.
pub const COUPLING_STRETCH: f64 = 8e-3;

/// rad: the turn of the coupling at which the device's largest torque comes.
pub const COUPLING_TURN: f64 = 0.2;

/// kg: what a device's grip weighs when it does not say.
///
/// The light arms on sale have 0.05 to 0.2 kg there. Larger allows couplings at which the lighter
/// ones hum unheld.
pub const APPARENT_MASS: f64 = 0.1;

/// kg·m²: the inertia of a device's grip when it does not say.
pub const APPARENT_INERTIA: f64 = 5e-5;

/// Stiffness of a coupling times the square of the period over the apparent mass, at most.
///
/// A bare device (0.1 kg, 0.04 N of dry friction, one tick late, 0.03 mm steps) hums from two to
/// three times this on, with the damping that goes with it.
pub const COUPLING_SAMPLED: f64 = 0.01;

/// Periods: damping of a coupling over its stiffness.
///
/// The loop lags by one and a half; less than that is no damping at all. More makes the noise of
/// the velocity felt.
pub const COUPLING_LEAD: f64 = 3.0;

/// N·m/rad: turns the tool to the hand where the device pushes along three axes only.
///
/// The force is then that of a device which pushes along all six: there contact turns the hand
/// (0.15 N·m/rad in a relaxed one, 0.6 in an ordinary one) and stretches the coupling (0.94), in a
/// row 0.13 to 0.37. A hand that no torque turns does not give way, so the tool must. At 5 a spoon
/// in a cup felt three times the force of the whole device; far below 0.3 the tool points elsewhere
/// than the hand.
pub const COUPLING_ALIGNMENT: f64 = 0.3;

/// m: how much farther a coupling is stretched, whose spring has levelled off, before its anchor
/// slips.
///
/// Shorter slips in presses that are just harder than the device; longer is felt on the way back.
pub const COUPLING_SLIP: f64 = 3e-3;

/// rad: likewise how much farther it is turned, in the ratio of [`COUPLING_TURN`] to
/// [`COUPLING_STRETCH`].
pub const COUPLING_SLIP_TURN: f64 = 0.075;

/// rad: a coupling without a torque limit turns no farther than this before it slips.
///
/// At half a turn the shortest way back changes sides, and with it the torque. The rest is room for
/// the motion of a tick.
pub const COUPLING_MOST_TURN: f64 = 2.4;

/// Share of the device's motion in free air by which an anchor that has slipped returns to the
/// grip.
///
/// A third more or less of one's own motion passes unnoticed; from 1 on the tool could go against
/// the hand.
pub const COUPLING_RETURN: f64 = 0.3;

/// Relative to the tool's skin: how far it sinks under the device's largest force.
///
/// All of it would hold hard presses at exact touch, where normals and witnesses are least sure.
pub const TOOL_SINKS: f64 = 0.5;

/// Relative to the contact tolerance: from where on contacts push the tool.
///
/// Larger keeps a peg out of a hole whose clearance is a part of the tolerance; smaller makes
/// contacts stiffer than the roundness of meshes is worth, and lets a fast tool overlap before it
/// is stopped.
pub const TOOL_SKIN: f64 = 0.1;

// render: the tool's step (tool, together, touches)

/// Skins: the least way that contacts are looked ahead for.
///
/// Covers the encoder steps and the slow motion of a tool at rest. Larger looks at more pairs that
/// are no contact; smaller cuts the first steps of a tool that is pulled away.
pub const REACH_LEAST: f64 = 2.0;

/// In skins: among contacts, a tool may always move so far in a step, although its query did not
/// look at all that may have come near.
///
/// At 1 kHz and a skin of 20 µm that is 10 mm/s. Less is felt as a drag in close-fitting parts that
/// turn, for which the work never suffices; more lets the tool sink in deeper before what was not
/// looked at pushes back.
pub const REACH_CREEP: f64 = 0.5;

/// How many times as far as in the last step the tool may move in the next one.
///
/// A hand cannot double its speed in a millisecond. Larger looks at more pairs when the tool is
/// fast; 1 would never let it speed up.
pub const REACH_GROWTH: f64 = 2.0;

/// Factor by which the look-ahead of contacts shrinks in each step that needs less.
///
/// The front spends clearance whenever the tolerance grows, so that it had better not shrink and
/// grow with every step.
pub const REACH_FADE: f64 = 0.9;

/// Margin of a moving body's box, in sizes of a tool, or in contact tolerances for a body without a
/// hand.
///
/// A body that has not used it up keeps its box, and pairs are not looked for. A quarter of a
/// tool of 6 cm is 7 mm: 20 steps of a quick hand. Larger has pairs queried that are far apart; 0
/// makes boxes and sorts them in every step.
pub const BOX_SPARE: f64 = 0.25;

/// m/s: no tool is faster, whatever the device says.
///
/// Faster than a hand throws. It bounds the tolerance of the query.
pub const TOOL_FASTEST: f64 = 5.0;

/// Times that a tool's step is solved at most, to find which contacts press and which slide.
///
/// Pressing settles in two or three; sliding halves its error in each. More only costs time.
pub const COUPLING_ROUNDS: u32 = 12;

/// Rounds of a tool's step swing to and fro if a solution is as near to the last but one as this
/// share of its way to the last one.
///
/// A contact that comes to press turns rounds back too, but not to where they were.
pub const RELAX_DRIFT: f64 = 0.1;

/// Share of the way from guess to solution that a relaxed round of a tool's step goes at least.
///
/// Friction that lifts its body off settles at a few hundredths of the way. Smaller could take more
/// rounds than there are.
pub const RELAX_LEAST: f64 = 0.02;

/// Share of the most that a contact holds: a larger change of its friction needs another round of a
/// tool's step.
///
/// A hundredth of the friction of one contact, gone in the next tick.
pub const COUPLING_SETTLED: f64 = 0.01;

// render: the ring of an impact (transient)

/// s: a direction in which nothing has pressed for so long may be hit again.
///
/// A hand taps at most ten times a second; a tool that bounces by encoder steps is off the surface
/// for a few ticks. Longer swallows taps; shorter makes a tool that rests on a rough surface buzz.
pub const IMPACT_REST: f64 = 0.02;

/// Cosine: normals that are nearer to each other than this are one direction of contact.
///
/// 30°. Wider, and a wall is not felt from a slope; narrower, and a tool rings when it rolls over
/// facets.
pub const IMPACT_CONE: f64 = 0.866;

/// Relative to the device's largest force: the most that a ring may take.
///
/// The rest is for the contact itself, and at 200 Hz the slew limit (the largest force in 2 ms)
/// does not cut the swing.
pub const TRANSIENT_MOST: f64 = 1.0 / 3.0;

/// Ticks in a period of a vibration, at least.
///
/// Five: the steps of the held force are then 2 dB below the swing that they are to make. Fewer is
/// noise.
pub const TRANSIENT_SAMPLES: f64 = 5.0;

// render: the limits (saturate)

/// Relative: how much shorter than its limit a saturated force or torque is made.
///
/// A few roundings, so that "never beyond the limit" holds to the last bit. Larger gives force
/// away.
pub const SATURATION_ROUNDING: f64 = 1e-15;

/// In units of [`crate::algebra::Work`], which are what it takes to look at a pair of nodes: a
/// march begun.
///
/// The caller that sets the allowance measures the cost of a unit. So these values only need to be
/// right relative to each other, within a factor of two or so: the parts of a query then share the
/// allowance as they share the time.
pub const WORK_MARCH: u64 = 2;

/// A step of a march or of a depth walk.
pub const WORK_STEP: u64 = 1;

/// Answer of a leaf pair: the check of its surface and of its depth.
pub const WORK_ANSWER: u64 = 6;

/// A depth walk begun, with its search for a normal that both pieces own.
pub const WORK_WALK: u64 = 20;

/// A patch found, and each of its corners.
pub const WORK_PATCH: u64 = 12;

/// Share by which a pacer's estimates follow a step that took longer.
pub const PACE_DEARER: f64 = 0.25;

/// Share by which they follow one that took less time: a second or so.
pub const PACE_CHEAPER: f64 = 1e-3;

/// ns for a unit of work, before any was measured. Rather too much: the first steps then do less,
/// and no force is on yet.
pub const PACE_FIRST_PRICE: f64 = 100.0;

/// Units: less work than this takes too little time to say what a unit costs.
pub const PACE_TELLING: u64 = 500;

/// Units that a query may always do, so that it gets on however late the loop is.
pub const PACE_LEAST_WORK: u64 = 200;

/// Share of a loop's period that a step should take, unless the settings say otherwise.
///
/// The rest is for the device, the recorder and a busy machine.
pub const PACE_SHARE: f64 = 0.6;

/// s: a driven body's first way to where its host says that it is, when no interval between updates
/// is known yet: 60 Hz.
pub const DRIVEN_PERIOD: f64 = 1.0 / 60.0;

/// s: a driven body goes on for so long without an update, and slows down to rest in as long again.
///
/// Six periods of the slowest usual host. Longer, and a robot whose program hangs pushes on;
/// shorter, and a late update is felt.
pub const DRIVEN_PATIENCE: f64 = 0.1;
