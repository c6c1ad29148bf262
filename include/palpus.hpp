/*
 * palpus for C++17: the functions of palpus.h as classes that destroy their handles and throw exceptions.
 * See docs/c.md.
 */
#ifndef PALPUS_HPP
#define PALPUS_HPP

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpus.h"

namespace palpus {

using Pose = palpus_pose;
using Twist = palpus_twist;
using Wrench = palpus_wrench;
using Contact = palpus_contact;
using Probe = palpus_probe;
using Tick = palpus_tick;
using Object = palpus_object;
using Tool = palpus_tool;
using Settings = palpus_settings;
using BodySettings = palpus_body_settings;
using BodyFacts = palpus_body_facts;
using QuerySettings = palpus_query_settings;
using DepthBounds = palpus_depth_bounds;

/* Thrown when a function fails. what() is the text of palpus_last_error. */
class Error : public std::runtime_error {
  public:
    explicit Error(palpus_result code) : std::runtime_error(palpus_last_error()), code_(code) {}
    palpus_result code() const noexcept { return code_; }

  private:
    palpus_result code_;
};

inline void check(palpus_result result) {
    if (result != PALPUS_OK) throw Error(result);
}

/* Throws if the header and the library have different ABI versions. Call this function first. */
inline void check_abi() { check(palpus_check_abi(PALPUS_ABI_VERSION)); }

/* Returns the pose with position x, y, z (m) and no rotation. */
inline Pose at(double x, double y, double z) { return Pose{{x, y, z}, {0, 0, 0, 1}}; }

/* Returns settings for a coupled tool: limits of the device in N and N m, period in s, tolerance in m. */
inline Settings coupled(double force, double torque, double period, double tolerance) {
    Settings settings{};
    check(palpus_settings_coupled(force, torque, period, tolerance, &settings));
    return settings;
}

namespace detail {

/* Owns a handle. The owner can be moved but not copied. */
template <class Handle, palpus_result (*destroy)(Handle)>
class Owner {
  public:
    Owner() = default;
    Owner(Owner &&other) noexcept : handle_(std::exchange(other.handle_, Handle{})) {}
    Owner &operator=(Owner &&other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    Owner(const Owner &) = delete;
    Owner &operator=(const Owner &) = delete;
    ~Owner() {
        if (handle_.id != 0) destroy(handle_);
    }
    Handle handle() const noexcept { return handle_; }

  protected:
    Handle handle_{};
};

/* Calls a function that fills an array. Calls the function again with a larger array if there are more contacts. */
template <class Call>
std::vector<Contact> contacts(Call call) {
    std::vector<Contact> found(64);
    size_t count = 0;
    check(call(found.data(), found.size(), &count));
    if (count > found.size()) {
        found.resize(count);
        check(call(found.data(), found.size(), &count));
    }
    found.resize(count);
    return found;
}

} // namespace detail

/* A body. A body that a query or a world uses stays in memory. */
class Body : public detail::Owner<palpus_body, palpus_body_destroy> {
  public:
    /* `vertices` has x, y, z of each vertex; `triangles` has three vertex indices of each triangle. */
    Body(const std::vector<double> &vertices, const std::vector<uint32_t> &triangles,
         const BodySettings *settings = nullptr) {
        check(palpus_body_from_triangles(vertices.data(), vertices.size() / 3, triangles.data(),
                                         triangles.size() / 3, settings, &handle_));
    }
    explicit Body(const std::string &path, const BodySettings *settings = nullptr) {
        check(palpus_body_from_file(path.c_str(), settings, &handle_));
    }
    /* Returns the convex hull of points: x, y, z of each point, m. */
    static Body convex(const std::vector<double> &points) {
        Body body;
        check(palpus_body_from_convex(points.data(), points.size() / 3, &body.handle_));
        return body;
    }
    BodyFacts facts() const {
        BodyFacts facts{};
        check(palpus_body_get_facts(handle_, &facts));
        return facts;
    }

  private:
    Body() = default;
};

/* Returns a contact tolerance (m) that suits two bodies; see palpus_contact_tolerance. */
inline double contact_tolerance(const Body &a, const Body &b, const Pose &pose_ba) {
    double tolerance = 0;
    check(palpus_contact_tolerance(a.handle(), b.handle(), &pose_ba, &tolerance));
    return tolerance;
}

/* Finds the contacts of a with b, for poses of a in b's frame. */
class ContactQuery : public detail::Owner<palpus_query, palpus_query_destroy> {
  public:
    ContactQuery(const Body &a, const Body &b, const QuerySettings *settings = nullptr) {
        check(palpus_query_create(a.handle(), b.handle(), settings, &handle_));
    }
    std::vector<Contact> contacts(const Pose &pose_ba) {
        return detail::contacts([&](Contact *to, size_t capacity, size_t *count) {
            return palpus_query_contacts(handle_, &pose_ba, to, capacity, count);
        });
    }
    Contact nearest(const Pose &pose_ba) {
        Contact nearest{};
        check(palpus_query_nearest(handle_, &pose_ba, &nearest));
        return nearest;
    }
};

/* Proven bounds of the shortest translation that separates a from b. */
class Depth : public detail::Owner<palpus_depth, palpus_depth_destroy> {
  public:
    Depth(const Body &a, const Body &b, const palpus_depth_settings *settings = nullptr) {
        check(palpus_depth_create(a.handle(), b.handle(), settings, &handle_));
    }
    DepthBounds bound(const Pose &pose_ba) {
        DepthBounds bounds{};
        check(palpus_depth_bound(handle_, &pose_ba, &bounds));
        return bounds;
    }
};

/* Tools and objects. `step` allocates no memory. `step` can throw; catch exceptions in your haptic loop. */
class World : public detail::Owner<palpus_world, palpus_world_destroy> {
  public:
    explicit World(const Settings &settings) { check(palpus_world_create(&settings, &handle_)); }
    void set_gravity(double x, double y, double z) {
        const double gravity[3] = {x, y, z};
        check(palpus_world_set_gravity(handle_, gravity));
    }
    Object add_fixed(const Body &body, const Pose &pose) {
        Object object{};
        check(palpus_world_add_fixed(handle_, body.handle(), &pose, &object));
        return object;
    }
    Object add_driven(const Body &body, const Pose &pose) {
        Object object{};
        check(palpus_world_add_driven(handle_, body.handle(), &pose, &object));
        return object;
    }
    Object add_free(const Body &body, const Pose &pose, double mass) {
        Object object{};
        check(palpus_world_add_free(handle_, body.handle(), &pose, mass, &object));
        return object;
    }
    Tool add_tool(const Body &body, const Settings &settings) {
        Tool tool{};
        check(palpus_world_add_tool(handle_, body.handle(), &settings, &tool));
        return tool;
    }
    void step(const Probe *probes, Wrench *wrenches, size_t count, double dt) {
        check(palpus_world_step(handle_, probes, wrenches, count, dt));
    }
    Wrench step(const Probe &probe, double dt) {
        Wrench wrench{};
        step(&probe, &wrench, 1, dt);
        return wrench;
    }
    Tick tick(Tool tool) const {
        Tick tick{};
        check(palpus_world_get_tick(handle_, tool, &tick));
        return tick;
    }
    std::vector<Contact> contacts(Tool tool) const {
        return detail::contacts([&](Contact *to, size_t capacity, size_t *count) {
            return palpus_world_contacts(handle_, tool, to, capacity, count);
        });
    }
    Pose pose(Object object) const {
        Pose pose{};
        check(palpus_world_get_pose(handle_, object, &pose));
        return pose;
    }
    Twist twist(Object object) const {
        Twist twist{};
        check(palpus_world_get_twist(handle_, object, &twist));
        return twist;
    }
    void drive(Object object, const Pose &pose, const Twist &twist) {
        check(palpus_world_drive(handle_, object, &pose, &twist));
    }
    void put(Object object, const Pose &pose) { check(palpus_world_put(handle_, object, &pose)); }
    void set_velocity(Object object, const Twist &twist) { check(palpus_world_throw(handle_, object, &twist)); }
};

} // namespace palpus

#endif
