/*
 * A driver for the palpus bridge. The device is simulated: a hand holds a small mass and moves it up and down.
 *
 *   cc -std=c99 -O2 -I include -o driver examples/bridge/driver.c -lm
 *   ./driver /tmp/palpus.sock             or   ./driver udp:127.0.0.1:7000
 *   palpus run --device bridge:/tmp/palpus.sock
 *
 * To drive your own device, replace `sense_and_push`. The rest is the protocol of docs/bridge.md. Test your
 * driver with `palpus devices --conformance ADDRESS`. This program runs on Linux and other POSIX systems;
 * only Linux has Unix sockets of type SOCK_SEQPACKET.
 */
#define _DEFAULT_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "palpus_bridge.h"

#define RATE_HZ 1000.0
#define FORCE_MAX 5.0
/* If the loop is later than this, it skips the missed steps, ns. */
#define LATEST 20000000

static volatile sig_atomic_t stopped = 0;

static void stop(int signal_number) {
    (void)signal_number;
    stopped = 1;
}

/* Returns the time by the device's clock, ns. */
static uint64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static uint64_t new_nonce(void) {
    uint64_t nonce = 0;
    FILE *random = fopen("/dev/urandom", "rb");
    if (!random || fread(&nonce, sizeof nonce, 1, random) != 1) {
        fprintf(stderr, "driver: /dev/urandom cannot be read\n");
        exit(1);
    }
    fclose(random);
    return nonce;
}

/* ---- the device: a mass that a spring ties to the position of a moving hand ---- */

typedef struct {
    double position[3], velocity[3];
    uint64_t begun;
} device;

/* Applies `force` (N) for one step, and moves the mass. */
static void sense_and_push(device *device, const double force[3], uint64_t now) {
    const double mass = 0.1, stiffness = 150.0, damping = 6.0, dt = 1.0 / RATE_HZ;
    double time = (double)(now - device->begun) * 1e-9;
    double wanted[3] = {0.01 * sin(1.9 * time), 0.0, -0.02 * (1.0 - cos(1.3 * time))};
    for (int k = 0; k < 3; k++) {
        double hand = stiffness * (wanted[k] - device->position[k]) - damping * device->velocity[k];
        device->velocity[k] += (hand + force[k]) / mass * dt;
        device->position[k] += device->velocity[k] * dt;
    }
}

/* ---- the protocol ---- */

typedef struct {
    int listener, socket;   /* equal for UDP; for a path, socket is -1 while no client is connected */
    struct sockaddr_in peer; /* UDP: the client of the session, or the last sender */
    int is_udp, running;    /* running: a session is open */
    uint64_t hello, session, offer; /* nonces of the answered hello, the session and the offered session */
    uint64_t heard;         /* time of the last command, ns */
    uint64_t sent, accepted; /* sequences of the last state and the last command */
    uint64_t floor;         /* a wrench is applied only if its echo is this state or a newer one */
    int withheld;           /* a wrench has ended, and palpus has not yet echoed a later state */
    double force[3];
    uint64_t until; /* time at which the force expires, ns */
} bridge;

static void no_force(bridge *bridge) { memset(bridge->force, 0, sizeof bridge->force); }

/* Sets the force to zero, until a command echoes a state that is sent after this call. */
static void withhold(bridge *bridge) {
    no_force(bridge);
    bridge->withheld = 1;
    bridge->floor = bridge->sent + 1;
}

static void end_session(bridge *bridge) {
    no_force(bridge);
    bridge->running = 0;
    bridge->hello = 0;
    bridge->offer = 0;
}

static void hang_up(bridge *bridge) {
    end_session(bridge);
    if (!bridge->is_udp && bridge->socket >= 0) {
        close(bridge->socket);
        bridge->socket = -1;
    }
}

/* True after a quarter of a second without a command, or two seconds without a session. */
static int is_silent(const bridge *bridge, uint64_t now) {
    if (bridge->running) return now - bridge->heard > PALPUS_BRIDGE_SILENCE_NS;
    return !bridge->is_udp && bridge->socket >= 0 && now - bridge->heard > 8 * PALPUS_BRIDGE_SILENCE_NS;
}

/* If there is no room, the frame is lost; palpus detects this from the sequence numbers. */
static void send_frame(bridge *bridge, const void *frame, size_t size) {
    if (bridge->is_udp) {
        sendto(bridge->socket, frame, size, MSG_DONTWAIT, (struct sockaddr *)&bridge->peer, sizeof bridge->peer);
    } else if (bridge->socket >= 0) {
        send(bridge->socket, frame, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    }
}

static void welcome(bridge *bridge, const palpus_bridge_header *header) {
    palpus_bridge_welcome frame;
    if (bridge->offer == 0 || bridge->hello != header->nonce) {
        bridge->hello = header->nonce;
        bridge->offer = new_nonce();
    }
    memset(&frame, 0, sizeof frame);
    frame.session = bridge->offer;
    strcpy(frame.name, "mass in a hand (C)");
    frame.force_max = FORCE_MAX;
    frame.workspace[0] = frame.workspace[1] = frame.workspace[2] = 0.2;
    frame.rate_hz = RATE_HZ;
    frame.actuated[0] = frame.sensed[0] = 3;
    palpus_bridge_seal(&frame, PALPUS_BRIDGE_WELCOME, sizeof frame, header->nonce, header->sequence);
    send_frame(bridge, &frame, sizeof frame);
}

static int is_bounded(const palpus_bridge_command *command) {
    for (int k = 0; k < 3; k++) {
        /* This form also refuses NaN. */
        if (!(fabs(command->force[k]) <= 1e9 && fabs(command->torque[k]) <= 1e9)) return 0;
    }
    return command->valid_for_us <= PALPUS_BRIDGE_MOST_VALID_FOR_US && command->reserved == 0;
}

static void obey(bridge *bridge, const palpus_bridge_command *command, uint64_t now) {
    uint64_t until = command->time_ns + 1000ull * command->valid_for_us;
    double length = 0.0, scale;
    bridge->accepted = command->header.sequence;
    bridge->heard = now;
    for (int k = 0; k < 3; k++) length += command->force[k] * command->force[k];
    length = sqrt(length);
    if (length <= 0.0) {
        no_force(bridge);
        if (command->echo >= bridge->floor) bridge->withheld = 0;
        return;
    }
    if (command->echo < bridge->floor || command->echo > bridge->sent || now >= until) {
        withhold(bridge);
        return;
    }
    scale = length > FORCE_MAX ? FORCE_MAX / length : 1.0;
    for (int k = 0; k < 3; k++) bridge->force[k] = command->force[k] * scale;
    bridge->until = until;
    bridge->withheld = 0;
}

static void take(bridge *bridge, const uint8_t *bytes, size_t size, uint64_t now) {
    palpus_bridge_header header;
    palpus_bridge_command command;
    palpus_bridge_hello hello;
    switch (palpus_bridge_kind(bytes, size)) {
    case PALPUS_BRIDGE_HELLO:
        memcpy(&hello, bytes, sizeof hello);
        if (!bridge->running && hello.rate_hz >= 1.0 && hello.rate_hz <= 1e5) welcome(bridge, &hello.header);
        return;
    case PALPUS_BRIDGE_COMMAND:
        memcpy(&command, bytes, sizeof command);
        if (!is_bounded(&command)) return;
        if (!bridge->running && bridge->offer != 0 && command.header.nonce == bridge->offer) {
            bridge->running = 1;
            bridge->session = bridge->offer;
            bridge->sent = bridge->accepted = 0;
            bridge->floor = 1;
            bridge->withheld = 0;
        }
        if (!bridge->running || command.header.nonce != bridge->session) return;
        if (command.header.sequence > bridge->accepted) obey(bridge, &command, now);
        return;
    case PALPUS_BRIDGE_CLOSE:
        memcpy(&header, bytes, sizeof header);
        if (bridge->running && header.nonce == bridge->session) end_session(bridge);
        return;
    default:
        return; /* damaged, or not meant for a driver */
    }
}

/* Takes the frames that have arrived. */
static void receive(bridge *bridge) {
    uint8_t bytes[PALPUS_BRIDGE_LONGEST + 64];
    if (!bridge->is_udp && bridge->socket < 0) {
        bridge->socket = accept(bridge->listener, NULL, NULL);
        if (bridge->socket < 0) return;
        bridge->heard = now_ns();
    }
    /* The number is bounded, so that a flood of frames does not delay the device. */
    for (int k = 0; k < 64; k++) {
        struct sockaddr_in from;
        socklen_t length = sizeof from;
        ssize_t size = recvfrom(bridge->socket, bytes, sizeof bytes, MSG_DONTWAIT,
                                bridge->is_udp ? (struct sockaddr *)&from : NULL, bridge->is_udp ? &length : NULL);
        if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
        if (size <= 0) {
            if (!bridge->is_udp) {
                hang_up(bridge); /* palpus has closed the connection */
                return;
            }
            continue;
        }
        if (bridge->is_udp && !bridge->running) bridge->peer = from;
        if (bridge->is_udp && (from.sin_port != bridge->peer.sin_port || from.sin_addr.s_addr != bridge->peer.sin_addr.s_addr))
            continue;
        take(bridge, bytes, (size_t)size, now_ns());
    }
}

static void send_state(bridge *bridge, const device *device, uint64_t now) {
    palpus_bridge_state frame;
    memset(&frame, 0, sizeof frame);
    frame.time_ns = now;
    memcpy(frame.position, device->position, sizeof frame.position);
    frame.orientation[3] = 1.0;
    memcpy(frame.linear, device->velocity, sizeof frame.linear);
    memcpy(frame.applied_force, bridge->force, sizeof frame.applied_force);
    frame.echo = bridge->accepted;
    frame.flags = PALPUS_BRIDGE_READY | (bridge->withheld ? PALPUS_BRIDGE_WITHHELD : 0);
    palpus_bridge_seal(&frame, PALPUS_BRIDGE_STATE, sizeof frame, bridge->session, ++bridge->sent);
    send_frame(bridge, &frame, sizeof frame);
}

static int listen_at(bridge *bridge, const char *address) {
    memset(bridge, 0, sizeof *bridge);
    bridge->socket = -1;
    if (strncmp(address, "udp:127.", 8) == 0) {
        char host[64];
        const char *colon = strrchr(address, ':');
        struct sockaddr_in here;
        size_t length = (size_t)(colon - (address + 4));
        if (length >= sizeof host) return -1;
        memcpy(host, address + 4, length);
        host[length] = 0;
        memset(&here, 0, sizeof here);
        here.sin_family = AF_INET;
        here.sin_port = htons((uint16_t)atoi(colon + 1));
        if (inet_pton(AF_INET, host, &here.sin_addr) != 1) return -1;
        bridge->is_udp = 1;
        bridge->listener = bridge->socket = socket(AF_INET, SOCK_DGRAM, 0);
        return bridge->socket < 0 ? -1 : bind(bridge->socket, (struct sockaddr *)&here, sizeof here);
    } else {
        struct sockaddr_un here;
        memset(&here, 0, sizeof here);
        here.sun_family = AF_UNIX;
        if (strlen(address) >= sizeof here.sun_path) return -1;
        strcpy(here.sun_path, address);
        unlink(address);
        bridge->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0);
        if (bridge->listener < 0 || bind(bridge->listener, (struct sockaddr *)&here, sizeof here)) return -1;
        return listen(bridge->listener, 1);
    }
}

int main(int count, char **arguments) {
    bridge bridge;
    device device;
    uint64_t next;
    if (count != 2) {
        fprintf(stderr, "usage: driver /path/to.sock | driver udp:127.0.0.1:PORT\n");
        return 2;
    }
    if (listen_at(&bridge, arguments[1]) != 0) {
        fprintf(stderr, "driver: cannot listen at %s: %s\n", arguments[1], strerror(errno));
        return 1;
    }
    signal(SIGINT, stop);
    signal(SIGTERM, stop);
    signal(SIGPIPE, SIG_IGN);
    printf("listening at %s\n", arguments[1]);
    fflush(stdout);
    memset(&device, 0, sizeof device);
    device.begun = next = now_ns();
    while (!stopped) {
        uint64_t now;
        receive(&bridge);
        now = now_ns();
        if (is_silent(&bridge, now)) hang_up(&bridge);
        if (now >= bridge.until && (bridge.force[0] != 0.0 || bridge.force[1] != 0.0 || bridge.force[2] != 0.0))
            withhold(&bridge);
        sense_and_push(&device, bridge.force, now);
        if (bridge.running) send_state(&bridge, &device, now);
        next += (uint64_t)(1e9 / RATE_HZ);
        now = now_ns();
        if (now > next + LATEST) next = now;
        if (now < next) {
            struct timespec left = {0, (long)(next - now)};
            nanosleep(&left, NULL);
        }
    }
    if (bridge.running) {
        palpus_bridge_close frame;
        memset(&frame, 0, sizeof frame);
        strcpy(frame.reason, "the driver was stopped");
        palpus_bridge_seal(&frame, PALPUS_BRIDGE_CLOSE, sizeof frame, bridge.session, ++bridge.sent);
        send_frame(&bridge, &frame, sizeof frame);
    }
    if (!bridge.is_udp) unlink(arguments[1]);
    return 0;
}
