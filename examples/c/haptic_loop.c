/*
 * A haptic loop in C at 1 kHz: a device moves down onto a plate.
 *
 *   cargo build --release -p palpus-capi
 *   cc -std=c99 -O2 -I include -o haptic_loop examples/c/haptic_loop.c -L target/release -lpalpus_capi -lm
 *   LD_LIBRARY_PATH=target/release ./haptic_loop
 */
#include <stdio.h>
#include <stdlib.h>

#include "palpus.h"

static void check(palpus_result result) {
    if (result == PALPUS_OK) return;
    fprintf(stderr, "haptic_loop: %s\n", palpus_last_error());
    exit(1);
}

static palpus_body block(double x, double y, double z) {
    double points[24];
    palpus_body body;
    for (int k = 0; k < 8; k++) {
        points[3 * k] = k & 1 ? x / 2 : -x / 2;
        points[3 * k + 1] = k & 2 ? y / 2 : -y / 2;
        points[3 * k + 2] = k & 4 ? z / 2 : -z / 2;
    }
    check(palpus_body_from_convex(points, 8, &body));
    return body;
}

int main(void) {
    const double period = 1e-3;
    const palpus_pose origin = {{0, 0, 0}, {0, 0, 0, 1}}, on_plate = {{0, 0, 0.03}, {0, 0, 0, 1}};
    double tolerance;
    palpus_settings settings;
    palpus_world world;
    palpus_object plate;
    palpus_tool tool;
    palpus_probe probe = {{{0, 0, 0.04}, {0, 0, 0, 1}}, {{0, 0, 0}, {0, 0, 0}}};
    palpus_wrench wrench = {{0, 0, 0}, {0, 0, 0}};

    check(palpus_check_abi(PALPUS_ABI_VERSION));
    palpus_body big = block(0.1, 0.1, 0.02), small = block(0.01, 0.01, 0.04);
    /* The small body is on the big one at this pose. */
    check(palpus_contact_tolerance(small, big, &on_plate, &tolerance));
    /* A device of 8.5 N and 0.19 N m. */
    check(palpus_settings_coupled(8.5, 0.19, period, tolerance, &settings));
    check(palpus_world_create(&settings, &world));
    check(palpus_world_add_fixed(world, big, &origin, &plate));
    check(palpus_world_add_tool(world, small, &settings, &tool));

    for (int tick = 0; tick < 1000; tick++) {
        /* Read the state of your device here. The tool touches the plate at 0.03 m. */
        probe.pose.position[2] = 0.04 - 0.000012 * tick;
        check(palpus_world_step(world, &probe, &wrench, 1, period));
        /* Send the wrench to your device here. */
        if (tick % 100 == 99) printf("%3d ms: %.6f N\n", tick + 1, wrench.force[2]);
    }
    check(palpus_world_destroy(world));
    check(palpus_body_destroy(big));
    check(palpus_body_destroy(small));
    return wrench.force[2] > 1 ? 0 : 1;
}
