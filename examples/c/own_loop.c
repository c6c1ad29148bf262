/*
 * Your own haptic loop in plain C. The device is a process behind the palpus bridge (docs/bridge.md), the wrench
 * comes from the C library, and this file limits the wrench before it reaches the hand.
 *
 *   cc -std=c99 -O2 -I include -o driver examples/bridge/driver.c -lm && ./driver /tmp/lab.sock &
 *   cargo build --release -p palpus-capi
 *   cc -std=c99 -O2 -I include -o own_loop examples/c/own_loop.c -L target/release -lpalpus_capi -lm
 *   LD_LIBRARY_PATH=target/release ./own_loop /tmp/lab.sock
 *
 * Your own loop needs at least the limits below: size, slew, a slow start, and zero when the device withholds
 * its force or is silent. `palpus run --device bridge:…` has the whole safety chain (docs/safety.md).
 */
#define _DEFAULT_SOURCE
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "palpus.h"
#include "palpus_bridge.h"

#define PERIOD 1e-3
#define SECONDS 3.0
/* Largest change of the force in a tick, N. */
#define SLEW 0.2
/* Time in which the force ramps up, at the start and after the device has withheld it, s. */
#define GROW_IN 0.5

static void check(palpus_result result) {
    if (result == PALPUS_OK) return;
    fprintf(stderr, "own_loop: %s\n", palpus_last_error());
    exit(1);
}

static void fail(const char *what) {
    fprintf(stderr, "own_loop: %s: %s\n", what, strerror(errno));
    exit(1);
}

static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void shorten(double v[3], double most) {
    double scale = length(v) > most ? most / length(v) : 1.0;
    for (int k = 0; k < 3; k++) v[k] *= scale;
}

/* ---- the device ---- */

typedef struct {
    int socket;
    uint64_t session, sequence;
    palpus_bridge_welcome spec;
    palpus_bridge_state state; /* newest state */
} device;

static void send_command(device *device, const double force[3]) {
    palpus_bridge_command frame;
    memset(&frame, 0, sizeof frame);
    frame.echo = device->state.header.sequence;
    frame.time_ns = device->state.time_ns;
    memcpy(frame.force, force, sizeof frame.force);
    frame.valid_for_us = 20000; /* after this time the device goes to zero by itself, even if this program has failed */
    palpus_bridge_seal(&frame, PALPUS_BRIDGE_COMMAND, sizeof frame, device->session, ++device->sequence);
    if (send(device->socket, &frame, sizeof frame, MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno != EAGAIN)
        fail("the connection to the device is lost");
}

/* Takes all states that have arrived; waits at most `timeout_ms` for the first one. Returns 0 without a state. */
static int newest_state(device *device, int timeout_ms) {
    uint8_t bytes[PALPUS_BRIDGE_LONGEST + 64];
    struct pollfd ready = {device->socket, POLLIN, 0};
    int found = 0;
    if (poll(&ready, 1, timeout_ms) <= 0) return 0;
    for (;;) {
        ssize_t size = recv(device->socket, bytes, sizeof bytes, MSG_DONTWAIT);
        palpus_bridge_state state;
        if (size < 0) return found;
        if (size == 0) {
            errno = ECONNRESET;
            fail("the connection to the device is lost");
        }
        if (palpus_bridge_kind(bytes, (size_t)size) != PALPUS_BRIDGE_STATE) continue;
        memcpy(&state, bytes, sizeof state);
        if (state.header.nonce != device->session || state.header.sequence <= device->state.header.sequence) continue;
        device->state = state;
        found = 1;
    }
}

static void open_device(device *device, const char *path) {
    const double none[3] = {0, 0, 0};
    struct sockaddr_un there;
    FILE *random = fopen("/dev/urandom", "rb");
    uint64_t nonce = 0;
    memset(device, 0, sizeof *device);
    memset(&there, 0, sizeof there);
    there.sun_family = AF_UNIX;
    strncpy(there.sun_path, path, sizeof there.sun_path - 1);
    if (!random || fread(&nonce, sizeof nonce, 1, random) != 1) fail("/dev/urandom");
    fclose(random);
    device->socket = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    if (device->socket < 0 || connect(device->socket, (struct sockaddr *)&there, sizeof there)) fail(path);
    for (int tries = 1; tries <= 20; tries++) {
        uint8_t bytes[PALPUS_BRIDGE_LONGEST + 64];
        struct pollfd ready = {device->socket, POLLIN, 0};
        palpus_bridge_hello hello = {.rate_hz = 1.0 / PERIOD};
        palpus_bridge_seal(&hello, PALPUS_BRIDGE_HELLO, sizeof hello, nonce, (uint64_t)tries);
        if (send(device->socket, &hello, sizeof hello, MSG_NOSIGNAL) < 0) fail("hello");
        if (poll(&ready, 1, 50) <= 0) continue;
        ssize_t size = recv(device->socket, bytes, sizeof bytes, 0);
        if (size <= 0 || palpus_bridge_kind(bytes, (size_t)size) != PALPUS_BRIDGE_WELCOME) continue;
        memcpy(&device->spec, bytes, sizeof device->spec);
        if (device->spec.header.nonce != nonce) continue;
        device->session = device->spec.session;
        send_command(device, none); /* this begins the session */
        if (newest_state(device, 250)) return;
    }
    errno = ETIMEDOUT;
    fail("no driver answers");
}

/* ---- the scene: a block on a rod, 10 mm above a table ---- */

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

int main(int count, char **arguments) {
    device device;
    palpus_settings settings;
    palpus_world world;
    palpus_object table;
    palpus_tool tool;
    double force[3] = {0, 0, 0}, start[3], grown = 0.0, strongest = 0.0;
    long ticks = 0, missed = 0, silent = 0;
    if (count != 2) {
        fprintf(stderr, "usage: own_loop /path/to.sock\n");
        return 2;
    }
    check(palpus_check_abi(PALPUS_ABI_VERSION));
    open_device(&device, arguments[1]);
    double force_max = device.spec.force_max;
    memcpy(start, device.state.position, sizeof start);

    check(palpus_settings_coupled(force_max, device.spec.torque_max, PERIOD, 2e-4, &settings));
    if (device.spec.actuated[1] == 0) settings.saturation = 2; /* the device has no motors for torques */
    settings.has_material = 1;                                 /* taps sound like wood */
    check(palpus_world_create(&settings, &world));
    const palpus_pose table_pose = {{0, 0, -0.03}, {0, 0, 0, 1}};
    check(palpus_world_add_fixed(world, block(0.2, 0.2, 0.02), &table_pose, &table));
    check(palpus_world_add_tool(world, block(0.02, 0.02, 0.02), &settings, &tool));

    struct timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    while (ticks < SECONDS / PERIOD && silent < 250) {
        palpus_probe probe;
        palpus_wrench wrench;
        int fresh = newest_state(&device, 0);
        silent = fresh ? 0 : silent + 1;
        missed += !fresh;
        memset(&probe, 0, sizeof probe);
        for (int k = 0; k < 3; k++) probe.pose.position[k] = device.state.position[k] - start[k];
        memcpy(probe.pose.rotation, device.state.orientation, sizeof probe.pose.rotation);
        memcpy(probe.twist.linear, device.state.linear, sizeof probe.twist.linear);
        memcpy(probe.twist.angular, device.state.angular, sizeof probe.twist.angular);
        /* After an error the wrench is zero, so the hand gets no force. */
        if (palpus_world_step(world, &probe, &wrench, 1, PERIOD) != PALPUS_OK)
            fprintf(stderr, "own_loop: %s\n", palpus_last_error());

        int pushes = (device.state.flags & PALPUS_BRIDGE_READY) && !(device.state.flags & PALPUS_BRIDGE_WITHHELD) && silent < 5;
        grown = pushes ? fmin(1.0, grown + PERIOD / GROW_IN) : 0.0;
        double wanted[3], change[3];
        for (int k = 0; k < 3; k++) wanted[k] = grown * wrench.force[k];
        shorten(wanted, force_max);
        for (int k = 0; k < 3; k++) change[k] = wanted[k] - force[k];
        if (pushes) shorten(change, SLEW);
        for (int k = 0; k < 3; k++) force[k] += change[k];
        send_command(&device, force);

        strongest = fmax(strongest, length(force));
        ticks++;
        next.tv_nsec += (long)(PERIOD * 1e9);
        if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, next.tv_sec++;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    }
    /* Sends zero, however the loop has ended. */
    const double none[3] = {0, 0, 0};
    send_command(&device, none);
    palpus_bridge_close last;
    memset(&last, 0, sizeof last);
    strcpy(last.reason, "done");
    palpus_bridge_seal(&last, PALPUS_BRIDGE_CLOSE, sizeof last, device.session, ++device.sequence);
    send(device.socket, &last, sizeof last, MSG_NOSIGNAL);
    check(palpus_world_destroy(world));
    printf("%s: %ld ticks, %ld without a new state; largest force %.2f N of %.1f N\n", device.spec.name, ticks, missed, strongest, force_max);
    return strongest > 0.1 && strongest <= force_max * 1.000001 ? 0 : 1;
}
