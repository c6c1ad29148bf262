/*
 * Contacts and depth of two mesh files, and a haptic loop, in C++17. CMakeLists.txt in this folder builds it.
 *
 *   contacts TOOL PART      two mesh files, in mm
 */
#include <cstdio>

#include "palpus.hpp"

int main(int count, char **words) try {
    if (count != 3) throw std::runtime_error("name two mesh files");
    palpus::check_abi();
    const palpus::BodySettings millimetres{1e-3, PALPUS_FLATNESS_HAPTIC, 1};
    const palpus::Body tool(words[1], &millimetres), part(words[2], &millimetres);
    std::printf("%llu and %llu pieces\n", (unsigned long long)tool.facts().piece_count,
                (unsigned long long)part.facts().piece_count);

    palpus::ContactQuery query(tool, part);
    palpus::Depth depth(tool, part);
    const auto pose = palpus::at(0.0172, 0.015, 0.0058);
    for (const auto &contact : query.contacts(pose))
        std::printf("%.4f mm apart, normal %.3f %.3f %.3f\n", contact.separation * 1e3, contact.normal[0],
                    contact.normal[1], contact.normal[2]);
    const auto bounds = depth.bound(pose);
    std::printf("depth from %.4f to %.4f mm\n", bounds.lower * 1e3, bounds.upper * 1e3);

    const auto settings = palpus::coupled(8.5, 0.19, 1e-3, 2e-4);
    palpus::World world(settings);
    world.add_fixed(part, palpus::at(0, 0, 0));
    const auto held = world.add_tool(tool, settings);
    palpus::Wrench wrench{};
    for (int tick = 0; tick < 1000; tick++) {
        /* The tool moves down along z, and at the end into the part. */
        const palpus::Probe probe{palpus::at(0.0172, 0.015, 0.012 - 7e-6 * tick), {}};
        wrench = world.step(probe, 1e-3);
    }
    std::printf("%.3f %.3f %.3f N from %zu contacts\n", wrench.force[0], wrench.force[1], wrench.force[2],
                world.contacts(held).size());

    try {
        palpus::Body missing("not-there.obj");
    } catch (const palpus::Error &error) {
        std::printf("expected error: %s\n", error.what());
        return error.code() == PALPUS_ERROR_FILE ? 0 : 1;
    }
    return 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "contacts: %s\n", error.what());
    return 1;
}
