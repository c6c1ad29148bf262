/* Reads frames from standard input and prints each field by its name.
 * The test compares this text with the text from Rust. Compiles as C99 and as C++. */
#include <stdio.h>

#include "palpus_bridge.h"

static void three(const char *name, double x, double y, double z) { printf("%s %g %g %g\n", name, x, y, z); }

int main(void) {
    unsigned char bytes[PALPUS_BRIDGE_LONGEST];
    unsigned char length;
    while (fread(&length, 1, 1, stdin) == 1 && fread(bytes, 1, length, stdin) == length) {
        int kind = palpus_bridge_kind(bytes, length);
        palpus_bridge_header header;
        memcpy(&header, bytes, sizeof header);
        printf("kind %d size %u version %u nonce %llu sequence %llu\n", kind, (unsigned)header.size,
               (unsigned)header.version, (unsigned long long)header.nonce, (unsigned long long)header.sequence);
        if (kind == PALPUS_BRIDGE_HELLO) {
            palpus_bridge_hello hello;
            memcpy(&hello, bytes, sizeof hello);
            printf("rate_hz %g\n", hello.rate_hz);
        } else if (kind == PALPUS_BRIDGE_WELCOME) {
            palpus_bridge_welcome w;
            memcpy(&w, bytes, sizeof w);
            printf("session %llu name %.64s\n", (unsigned long long)w.session, w.name);
            printf("limits %g %g %g %g\n", w.force_max, w.torque_max, w.force_continuous, w.torque_continuous);
            three("workspace", w.workspace[0], w.workspace[1], w.workspace[2]);
            printf("delay_s %g rate_hz %g\n", w.delay_s, w.rate_hz);
            printf("axes %d %d %d %d %d %d buttons %d\n", w.actuated[0], w.actuated[1], w.actuated[2], w.sensed[0],
                   w.sensed[1], w.sensed[2], w.buttons);
        } else if (kind == PALPUS_BRIDGE_COMMAND) {
            palpus_bridge_command c;
            memcpy(&c, bytes, sizeof c);
            printf("echo %llu time_ns %llu\n", (unsigned long long)c.echo, (unsigned long long)c.time_ns);
            three("force", c.force[0], c.force[1], c.force[2]);
            three("torque", c.torque[0], c.torque[1], c.torque[2]);
            printf("valid_for_us %u\n", (unsigned)c.valid_for_us);
            /* Sealing the frame again must reproduce the same bytes. */
            palpus_bridge_seal(&c, PALPUS_BRIDGE_COMMAND, sizeof c, header.nonce, header.sequence);
            printf("sealed %d\n", memcmp(&c, bytes, sizeof c) == 0);
        } else if (kind == PALPUS_BRIDGE_STATE) {
            palpus_bridge_state s;
            memcpy(&s, bytes, sizeof s);
            printf("time_ns %llu\n", (unsigned long long)s.time_ns);
            three("position", s.position[0], s.position[1], s.position[2]);
            printf("orientation %g %g %g %g\n", s.orientation[0], s.orientation[1], s.orientation[2], s.orientation[3]);
            three("linear", s.linear[0], s.linear[1], s.linear[2]);
            three("angular", s.angular[0], s.angular[1], s.angular[2]);
            three("applied_force", s.applied_force[0], s.applied_force[1], s.applied_force[2]);
            three("applied_torque", s.applied_torque[0], s.applied_torque[1], s.applied_torque[2]);
            printf("echo %llu buttons %u flags %u\n", (unsigned long long)s.echo, (unsigned)s.buttons, (unsigned)s.flags);
        } else if (kind == PALPUS_BRIDGE_CLOSE) {
            palpus_bridge_close c;
            memcpy(&c, bytes, sizeof c);
            printf("reason %.96s\n", c.reason);
        }
    }
    return 0;
}
