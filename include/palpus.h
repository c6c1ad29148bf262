/*
 * palpus as a C library: contacts and penetration depth of triangle meshes, and 6-DOF haptic rendering.
 * docs/c.md is its page. C99 or later, C++11 or later (palpus.hpp: C++17).
 *
 * Written by `PALPUS_WRITE_HEADER=1 cargo test -p palpus-capi --test header`; do not edit.
 *
 * Units are SI: m, rad, s, N, N m, kg. Frames are right-handed. A pose of a in b's frame takes points
 * of a to points of b. Handles are numbers, and a wrong one is an error. A pointer must be NULL or point
 * to as many values as the function says.
 */

#ifndef PALPUS_H
#define PALPUS_H

#include <stddef.h>
#include <stdint.h>

/**
 * Number of this header's ABI: raised whenever a structure, or a function that was there, changes.
 * New functions do not raise it.
 */
#define PALPUS_ABI_VERSION 2

/**
 * Flatness for measuring: distances are exact to this share of the model's size.
 */
#define PALPUS_FLATNESS_EXACT 3e-8

/**
 * Flatness for touching: planes that a file wrote with six digits are one face each.
 */
#define PALPUS_FLATNESS_HAPTIC 3e-5

/**
 * The result of a function. For all but PALPUS_OK, palpus_last_error has a text.
 */
typedef enum {
    /**
     * Done.
     */
    PALPUS_OK = 0,
    /**
     * A pointer is NULL where it must not be, or not aligned for what it points to.
     */
    PALPUS_ERROR_POINTER = 1,
    /**
     * A handle is of another kind, was destroyed, or never was one.
     */
    PALPUS_ERROR_HANDLE = 2,
    /**
     * Another thread is using the handle. Nothing was done.
     */
    PALPUS_ERROR_BUSY = 3,
    /**
     * A number, size or text is not allowed.
     */
    PALPUS_ERROR_VALUE = 4,
    /**
     * The triangles or points make no body.
     */
    PALPUS_ERROR_MESH = 5,
    /**
     * A file cannot be read.
     */
    PALPUS_ERROR_FILE = 6,
    /**
     * Header and library do not fit together.
     */
    PALPUS_ERROR_ABI = 7,
    /**
     * A defect of palpus. The handle that was in use can only be destroyed.
     */
    PALPUS_ERROR_INTERNAL = 8,
} palpus_result;

/**
 * How a body is made of a mesh.
 */
typedef struct {
    /**
     * m per unit of the model.
     */
    double scale;
    /**
     * How far a piece may deviate from the surface, as a share of the model's size, 0 to 0.001.
     */
    double flatness;
    /**
     * 1: pieces reach into the solid, so that deep penetration is seen. 0: they are as thick as
     * their patch.
     */
    uint32_t thick;
} palpus_body_settings;

/**
 * A body. Any number of threads, queries and worlds may use it at once, also after it was
 * destroyed.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_body;

/**
 * Properties of a body. Lengths are in m, after scaling.
 */
typedef struct {
    /**
     * Triangles after cleaning.
     */
    uint64_t triangle_count;
    /**
     * Convex pieces.
     */
    uint64_t piece_count;
    /**
     * 1 if the surface has no boundary.
     */
    uint32_t is_closed;
    /**
     * 1 if each edge has one or two triangles that agree, and parts of the surface do not touch in
     * a vertex.
     */
    uint32_t is_manifold;
    /**
     * m^3.
     */
    double volume;
    /**
     * m, in the model's frame.
     */
    double center_of_mass[3];
    /**
     * m^5: inertia about the centre of mass at density 1, rows one after the other.
     */
    double inertia[9];
    /**
     * m: the box along the axes.
     */
    double bounds_min[3];
    /**
     * m.
     */
    double bounds_max[3];
} palpus_body_facts;

/**
 * Settings of a query.
 */
typedef struct {
    /**
     * m: contacts are nearer than this; 0 finds overlaps only.
     */
    double tolerance;
    /**
     * The most contacts of one query, 1 to 1048576; of more, the deepest are kept.
     */
    uint64_t capacity;
    /**
     * 1: the depth of each pair of pieces is proven the least. 0: it is the least nearby.
     */
    uint32_t prove;
    /**
     * rad, 0 to 1: flush pieces give contacts at the corners of their overlap for tilts up to this
     * angle. 0: one exact contact for each pair of pieces.
     */
    double patch_angle;
} palpus_query_settings;

/**
 * The contacts of a body a with a body b. One thread at a time; any number of queries at once.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_query;

/**
 * A rigid placement of one frame in another.
 */
typedef struct {
    /**
     * Origin of the placed frame in the other one: x, y, z, m.
     */
    double position[3];
    /**
     * Unit quaternion x, y, z, w. Its length may be off by 0.001.
     */
    double rotation[4];
} palpus_pose;

/**
 * A pair of points, one on each body, nearer than the tolerance:
 * point_a - point_b = separation * normal.
 */
typedef struct {
    /**
     * On a, m.
     */
    double point_a[3];
    /**
     * On b, m.
     */
    double point_b[3];
    /**
     * Unit, from b into a.
     */
    double normal[3];
    /**
     * m: the distance, or minus the depth where the bodies overlap.
     */
    double separation;
    /**
     * Number of the convex piece of a.
     */
    uint32_t piece_a;
    /**
     * Number of the convex piece of b.
     */
    uint32_t piece_b;
} palpus_contact;

/**
 * How near the bounds of a depth come, and what may be spent.
 */
typedef struct {
    /**
     * m: the search ends if upper - lower is no more than this.
     */
    double gap;
    /**
     * The search ends after about so many evaluations.
     */
    uint64_t budget;
    /**
     * 1: only translations count as free from which a can leave b in a straight line.
     */
    uint32_t outside;
} palpus_depth_settings;

/**
 * The penetration depth of a body a in a body b. One thread at a time.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_depth;

/**
 * Bounds of the least translation that frees a from b, in b's frame.
 */
typedef struct {
    /**
     * m: no shorter translation frees the bodies. 0 if they are free.
     */
    double lower;
    /**
     * m: the length of `translation`.
     */
    double upper;
    /**
     * m: moving a by this frees the bodies.
     */
    double translation[3];
    /**
     * 1 if the gap is as small as was asked for.
     */
    uint32_t certified;
    /**
     * 1: a lies in b's solid. 2: b lies in a's. 0: neither.
     */
    uint32_t contained;
    /**
     * m: distance of the surfaces if the bodies are free or one lies in the other; else -1.
     */
    double distance;
} palpus_depth_bounds;

/**
 * A spring and damper between device and tool, and the tool's mass.
 */
typedef struct {
    /**
     * N/m.
     */
    double stiffness;
    /**
     * N s/m.
     */
    double damping;
    /**
     * N m/rad.
     */
    double angular_stiffness;
    /**
     * N m s/rad.
     */
    double angular_damping;
    /**
     * m, above 0 and at most the contact tolerance: contacts push from this separation on.
     */
    double skin;
    /**
     * kg; 0: the tool is where all forces balance.
     */
    double mass;
} palpus_coupling;

/**
 * Smoothed normals.
 */
typedef struct {
    /**
     * rad: edges where the mesh bends by more stay sharp.
     */
    double crease_angle;
    /**
     * rad: the farthest that shading may turn a force.
     */
    double most_turn;
} palpus_shading;

/**
 * Stick-slip friction.
 */
typedef struct {
    /**
     * Coefficient of a contact that sticks; at least the dynamic one.
     */
    double static_coefficient;
    /**
     * Coefficient of a contact that slides.
     */
    double dynamic_coefficient;
    /**
     * N/m.
     */
    double tangential_stiffness;
} palpus_friction;

/**
 * How a material rings when it is hit: a vibration that decays.
 */
typedef struct {
    /**
     * Hz.
     */
    double frequency;
    /**
     * 1/s: it falls to 1/e in one over this.
     */
    double decay;
    /**
     * N for each m/s of approach.
     */
    double gain;
} palpus_material;

/**
 * The most that a device may be asked for; infinite for no limit.
 */
typedef struct {
    /**
     * N.
     */
    double force;
    /**
     * N m about the grip.
     */
    double torque;
} palpus_limits;

/**
 * How contact is rendered. Begin with palpus_settings_coupled or palpus_settings_default, and
 * change what you need.
 */
typedef struct {
    /**
     * m: contacts are looked for up to this separation. A hundredth of the smaller body suits.
     */
    double contact_tolerance;
    /**
     * m: with smooth_clusters 0, contacts nearer than this share one force.
     */
    double cluster_radius;
    /**
     * N/m, of each cluster of contacts.
     */
    double stiffness;
    /**
     * N s/m, of the normal motion of each cluster.
     */
    double damping;
    /**
     * rad, 60 to 170 degrees: opening of the cone that holds a cluster's normals. 0: no cut.
     */
    double split_angle;
    /**
     * rad, 0.1 to 20 degrees: flush pieces touch at the corners of their overlap, for tilts up to
     * this. 0: one contact for each pair of pieces.
     */
    double patch_angle;
    /**
     * If has_coupling is 1.
     */
    palpus_coupling coupling;
    /**
     * If has_shading is 1.
     */
    palpus_shading shading;
    /**
     * If has_friction is 1.
     */
    palpus_friction friction;
    /**
     * If has_material is 1. At first that of wood.
     */
    palpus_material material;
    /**
     * Limits of the device.
     */
    palpus_limits limits;
    /**
     * m: where the hand holds the tool, in the tool's frame.
     */
    double grip[3];
    /**
     * The most contacts of a step, 1 to 1048576; of more, the deepest are kept.
     */
    uint64_t capacity;
    /**
     * 1: contacts share force smoothly. 0: exact single linkage, which jumps.
     */
    uint32_t smooth_clusters;
    /**
     * 0: force and torque are limited each by itself. 1: by one factor. 2: the device gives no
     * torque.
     */
    uint32_t saturation;
    /**
     * 1: a spring ties the tool to the device. 0: the tool is where the device is.
     */
    uint32_t has_coupling;
    /**
     * 1: forces follow smoothed normals.
     */
    uint32_t has_shading;
    /**
     * 1: contacts have friction.
     */
    uint32_t has_friction;
    /**
     * 1: impacts ring, as much as the device's limits leave room for.
     */
    uint32_t has_material;
} palpus_settings;

/**
 * Tools and objects, and the contacts between them. One thread at a time; any number of worlds at
 * once.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_world;

/**
 * An object or a tool's body in a world. Of other worlds it is refused.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_object;

/**
 * A tool of a world.
 */
typedef struct {
    /**
     * 0 for none.
     */
    uint64_t id;
} palpus_tool;

/**
 * The velocity of a rigid body.
 */
typedef struct {
    /**
     * m/s, of the point that the function states.
     */
    double linear[3];
    /**
     * rad/s.
     */
    double angular[3];
} palpus_twist;

/**
 * State of a device: pose and motion of its grip.
 */
typedef struct {
    /**
     * The grip in the world, with the tool's axes.
     */
    palpus_pose pose;
    /**
     * Twist of the grip, along the world's axes. Only dampers use it.
     */
    palpus_twist twist;
} palpus_probe;

/**
 * A force and a torque.
 */
typedef struct {
    /**
     * N.
     */
    double force[3];
    /**
     * N m, about the point that the function states.
     */
    double torque[3];
} palpus_wrench;

/**
 * Result of the last step for a tool.
 */
typedef struct {
    /**
     * Counts the steps from 0.
     */
    uint64_t index;
    /**
     * For the device: about the grip, along the world's axes, within the limits.
     */
    palpus_wrench wrench;
    /**
     * The same before the limits.
     */
    palpus_wrench computed;
    /**
     * Pose of the tool's frame in the world, at which contacts were looked for. With a coupling
     * the tool is not where the device is.
     */
    palpus_pose tool;
    /**
     * See palpus_world_contacts.
     */
    uint64_t contact_count;
    /**
     * Units of work that the step's query did.
     */
    uint64_t work;
    /**
     * Pairs that the step skipped to keep to its work are at least this far apart, m; infinite if
     * it skipped none.
     */
    double unseen_separation;
    /**
     * 1 if the force was cut to its limit.
     */
    uint32_t saturated_force;
    /**
     * 1 if the torque was cut to its limit.
     */
    uint32_t saturated_torque;
    /**
     * 1 if the wrench was not finite; it is zero then.
     */
    uint32_t non_finite_wrench;
    /**
     * 1 if the device's pose or twist was not valid.
     */
    uint32_t bad_state;
} palpus_tick;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The library's version as text, such as "0.1.0".
 */
const char *palpus_version(void);

/**
 * The library's PALPUS_ABI_VERSION.
 */
uint32_t palpus_abi_version(void);

/**
 * Fails with PALPUS_ERROR_ABI if the library is of another ABI than the header that you compiled
 * with. Call `palpus_check_abi(PALPUS_ABI_VERSION)` first of all.
 */
palpus_result palpus_check_abi(uint32_t header_version);

/**
 * Text of this thread's last error: UTF-8, empty if there was no error. Valid until the thread's
 * next error or its end; copy it to keep it. A function that succeeds leaves it unchanged.
 */
const char *palpus_last_error(void);

/**
 * Fills in: scale 1, PALPUS_FLATNESS_EXACT, thick.
 */
palpus_result palpus_body_settings_default(palpus_body_settings *settings);

/**
 * Makes a body of triangles. `vertices` has x, y, z of `vertex_count` vertices in the model's
 * unit; `triangles` has the three vertex numbers of `triangle_count` triangles, counter-clockwise
 * seen from outside. `settings` may be NULL for the defaults. Both arrays are copied. Takes
 * seconds for 100 000 triangles, on all cores.
 */
palpus_result palpus_body_from_triangles(const double *vertices,
                                         size_t vertex_count,
                                         const uint32_t *triangles,
                                         size_t triangle_count,
                                         const palpus_body_settings *settings,
                                         palpus_body *body);

/**
 * Makes a body of the convex hull of points: x, y, z of `point_count` points, m.
 */
palpus_result palpus_body_from_convex(const double *points, size_t point_count, palpus_body *body);

/**
 * Makes a body of a mesh file (OBJ, STL, PLY, OFF, glTF, GLB, also packed by gzip). `path` is
 * UTF-8. `settings` may be NULL for the defaults; a model in mm has the scale 0.001.
 */
palpus_result palpus_body_from_file(const char *path,
                                    const palpus_body_settings *settings,
                                    palpus_body *body);

/**
 * Writes the properties of a body.
 */
palpus_result palpus_body_get_facts(palpus_body body, palpus_body_facts *facts);

/**
 * Lets go of a body. Queries and worlds that use it keep it.
 */
palpus_result palpus_body_destroy(palpus_body body);

/**
 * Fills in: 1 mm, 4096 contacts, not proven, one contact for each pair of pieces.
 */
palpus_result palpus_query_settings_default(palpus_query_settings *settings);

/**
 * Makes a query, with all memory that it will need. `settings` may be NULL for the defaults.
 */
palpus_result palpus_query_create(palpus_body a,
                                  palpus_body b,
                                  const palpus_query_settings *settings,
                                  palpus_query *query);

/**
 * Finds all contacts nearer than the tolerance with a at `pose_ba` in b's frame; they are in b's
 * frame. Writes the first `capacity` of them to `contacts`, and how many there are to `count`.
 * `contacts` may be NULL with a capacity of 0. Poses near the last one are answered fastest.
 * Obtains no memory.
 */
palpus_result palpus_query_contacts(palpus_query query,
                                    const palpus_pose *pose_ba,
                                    palpus_contact *contacts,
                                    size_t capacity,
                                    size_t *count);

/**
 * Finds the nearest pair of points with a at `pose_ba` in b's frame, whatever the distance; where
 * the bodies overlap, the deepest contact. It is in b's frame.
 */
palpus_result palpus_query_nearest(palpus_query query,
                                   const palpus_pose *pose_ba,
                                   palpus_contact *nearest);

/**
 * Contacts are nearer than `tolerance` (m) from the next query on.
 */
palpus_result palpus_query_set_tolerance(palpus_query query, double tolerance);

/**
 * Forgets the past: the next answer is that of a new query.
 */
palpus_result palpus_query_clear(palpus_query query);

/**
 * Lets go of a query.
 */
palpus_result palpus_query_destroy(palpus_query query);

/**
 * Fills in what suits two bodies: a gap of 1 % of the smaller one, and a budget for most poses.
 */
palpus_result palpus_depth_settings_default(palpus_body a,
                                            palpus_body b,
                                            palpus_depth_settings *settings);

/**
 * Prepares two bodies for depths: once for each body, up to minutes for large ones, on all cores.
 * `settings` may be NULL for the defaults.
 */
palpus_result palpus_depth_create(palpus_body a,
                                  palpus_body b,
                                  const palpus_depth_settings *settings,
                                  palpus_depth *depth);

/**
 * Bounds the depth with a at `pose_ba` in b's frame. Takes milliseconds, and obtains memory: not
 * for a haptic loop.
 */
palpus_result palpus_depth_bound(palpus_depth depth,
                                 const palpus_pose *pose_ba,
                                 palpus_depth_bounds *bounds);

/**
 * Lets go of a depth.
 */
palpus_result palpus_depth_destroy(palpus_depth depth);

/**
 * Fills in direct rendering: 1 mm tolerance, 800 N/m, no coupling, friction or shading.
 */
palpus_result palpus_settings_default(palpus_settings *settings);

/**
 * Fills in a tool that is coupled to a device, as hard as the device can show: `force` (N) and
 * `torque` (N m) are the device's limits, `period` (s) is the loop's, and contacts are looked for
 * within `tolerance` (m). Without friction; for that, set has_friction and the coefficients.
 */
palpus_result palpus_settings_coupled(double force,
                                      double torque,
                                      double period,
                                      double tolerance,
                                      palpus_settings *settings);

/**
 * Makes an empty world without gravity. `settings` hold between objects and may be NULL for the
 * defaults; tools bring their own.
 */
palpus_result palpus_world_create(const palpus_settings *settings, palpus_world *world);

/**
 * Lets go of a world with all its objects and tools.
 */
palpus_result palpus_world_destroy(palpus_world world);

/**
 * Sets what pulls at free objects: three numbers x, y, z in m/s^2, along the world's axes. 0 at
 * first.
 */
palpus_result palpus_world_set_gravity(palpus_world world, const double *gravity);

/**
 * Adds an object that never moves, its frame at `pose` in the world.
 */
palpus_result palpus_world_add_fixed(palpus_world world,
                                     palpus_body body,
                                     const palpus_pose *pose,
                                     palpus_object *object);

/**
 * Adds an object that you move: see palpus_world_drive. It stands at `pose` until then.
 */
palpus_result palpus_world_add_driven(palpus_world world,
                                      palpus_body body,
                                      const palpus_pose *pose,
                                      palpus_object *object);

/**
 * Adds an object of `mass` (kg) that moves under contact, friction and gravity. At `pose`, at
 * rest.
 */
palpus_result palpus_world_add_free(palpus_world world,
                                    palpus_body body,
                                    const palpus_pose *pose,
                                    double mass,
                                    palpus_object *object);

/**
 * Adds a tool that is held through a device. Its probe is the next in palpus_world_step.
 */
palpus_result palpus_world_add_tool(palpus_world world,
                                    palpus_body body,
                                    const palpus_settings *settings,
                                    palpus_tool *tool);

/**
 * One step: `dt` s have gone by since the last. `probes` has the state of each tool's device, in
 * the order in which tools were added, and `wrenches` (NULL if you do not need them) is what each
 * device is to give: about its grip, along the world's axes, within its limits. `count` is the
 * number of tools.
 *
 * A device whose state is not valid gets no force and the others go on: PALPUS_ERROR_VALUE after
 * the step. After any other error no step was made, and all wrenches are zero. Obtains no memory
 * and does not wait.
 */
palpus_result palpus_world_step(palpus_world world,
                                const palpus_probe *probes,
                                palpus_wrench *wrenches,
                                size_t count,
                                double dt);

/**
 * Writes the result of the last step for a tool.
 */
palpus_result palpus_world_get_tick(palpus_world world, palpus_tool tool, palpus_tick *tick);

/**
 * The contacts of a tool in the last step, in the world's frame; a is the tool. Writes the first
 * `capacity` of them, and how many there are to `count`.
 */
palpus_result palpus_world_contacts(palpus_world world,
                                    palpus_tool tool,
                                    palpus_contact *contacts,
                                    size_t capacity,
                                    size_t *count);

/**
 * The contacts of two objects in the last step, in the world's frame. As palpus_world_contacts.
 */
palpus_result palpus_world_contacts_between(palpus_world world,
                                            palpus_object a,
                                            palpus_object b,
                                            palpus_contact *contacts,
                                            size_t capacity,
                                            size_t *count);

/**
 * The object that is a tool's body.
 */
palpus_result palpus_world_tool_object(palpus_world world, palpus_tool tool, palpus_object *object);

/**
 * Writes the pose of an object's frame in the world.
 */
palpus_result palpus_world_get_pose(palpus_world world, palpus_object object, palpus_pose *pose);

/**
 * The velocity of an object: of its centre of mass, along the world's axes.
 */
palpus_result palpus_world_get_twist(palpus_world world, palpus_object object, palpus_twist *twist);

/**
 * Says where a driven object is now and how it moves (`twist` of its frame's origin, along the
 * world's axes), at your own rate: between two updates it goes on.
 */
palpus_result palpus_world_drive(palpus_world world,
                                 palpus_object object,
                                 const palpus_pose *pose,
                                 const palpus_twist *twist);

/**
 * Puts an object somewhere else, at rest. Tools are where their devices are.
 */
palpus_result palpus_world_put(palpus_world world, palpus_object object, const palpus_pose *pose);

/**
 * Gives a free object a velocity: of its centre of mass, along the world's axes.
 */
palpus_result palpus_world_throw(palpus_world world,
                                 palpus_object object,
                                 const palpus_twist *twist);

/**
 * Goes on with other settings of a tool from the next step on. Obtains no memory: capacity and
 * shading must be as they were when the tool was added.
 */
palpus_result palpus_world_set_tool_settings(palpus_world world,
                                             palpus_tool tool,
                                             const palpus_settings *settings);

/**
 * Limits the queries of each step to about `work` units of work. Pairs that a query does not reach
 * keep their contacts, extrapolated, and come first in the next step. 0: no limit.
 * palpus_tick.work has the work of a step.
 */
palpus_result palpus_world_allow(palpus_world world, uint64_t work);

/**
 * Forgets the past, but for where objects are and how they move.
 */
palpus_result palpus_world_clear(palpus_world world);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PALPUS_H */
