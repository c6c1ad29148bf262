/*
 * The frames of the bridge of palpus, version 1. A program that uses these frames acts as a haptic device.
 * The specification is docs/bridge.md. C99 or later, C++11 or later; no library is needed.
 *
 * All numbers are little-endian. All units are SI: m, rad, s, N, N m. Frames have fixed sizes and no
 * padding. One datagram or packet is one frame. On a big-endian machine, swap the fields.
 */
#ifndef PALPUS_BRIDGE_H
#define PALPUS_BRIDGE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define PALPUS_BRIDGE_VERSION 1u
/* Size of the largest frame in bytes. Receive into a larger buffer to detect frames that are too long. */
#define PALPUS_BRIDGE_LONGEST 208u
/* Largest allowed `valid_for_us` of a command. */
#define PALPUS_BRIDGE_MOST_VALID_FOR_US 100000u
/* A session ends after this time without a command, ns. */
#define PALPUS_BRIDGE_SILENCE_NS 250000000ull

/* Kinds of frames. */
enum {
    PALPUS_BRIDGE_HELLO = 1,   /* palpus requests a session */
    PALPUS_BRIDGE_WELCOME = 2, /* the driver offers a session */
    PALPUS_BRIDGE_COMMAND = 3, /* palpus sends the wrench to apply */
    PALPUS_BRIDGE_STATE = 4,   /* the driver sends the state of the grip */
    PALPUS_BRIDGE_CLOSE = 5    /* either side ends the session */
};

/* Flags of a state. */
enum {
    PALPUS_BRIDGE_READY = 1,   /* powered and calibrated; the device applies the commanded force */
    PALPUS_BRIDGE_WITHHELD = 2 /* the device applies no force now, whatever the command */
};

#pragma pack(push, 1)

typedef struct palpus_bridge_header {
    uint8_t magic[4];  /* "PLPB" */
    uint16_t version;  /* PALPUS_BRIDGE_VERSION */
    uint16_t kind;     /* PALPUS_BRIDGE_HELLO to PALPUS_BRIDGE_CLOSE */
    uint32_t size;     /* bytes of the whole frame */
    uint32_t check;    /* CRC-32 (IEEE 802.3, as in zlib) of the whole frame with this field 0 */
    uint64_t nonce;    /* nonce of the session; in hello and welcome, the nonce of the hello */
    uint64_t sequence; /* number of the sender's frame in the session, from 1 (driver: of the state) */
} palpus_bridge_header;

typedef struct palpus_bridge_hello {
    palpus_bridge_header header;
    double rate_hz; /* rate at which palpus will send commands, Hz */
} palpus_bridge_hello;

typedef struct palpus_bridge_welcome {
    palpus_bridge_header header;
    uint64_t session;         /* nonce of the offered session, chosen at random */
    char name[64];            /* UTF-8, padded with zeros, no control characters */
    double force_max;         /* N; 0: the device has no force output */
    double torque_max;        /* N m; 0: the device has no torque output */
    double force_continuous;  /* N that the motors can hold permanently; 0: not stated */
    double torque_continuous; /* N m that the motors can hold permanently; 0: not stated */
    double workspace[3];      /* sides of the box that the grip can reach, m; 0: not stated */
    double delay_s;           /* time from a command until its wrench acts, s, 0 to 0.1; 0: not known */
    double rate_hz;           /* number of states per second, at least 500 */
    uint8_t actuated[3];      /* axes with motors: translation 0-3, rotation 0-3, gripper 0-1 */
    uint8_t sensed[3];        /* axes with sensors, in the same order */
    uint8_t buttons;          /* number of buttons, 0-30 */
    uint8_t reserved;         /* 0 */
} palpus_bridge_welcome;

typedef struct palpus_bridge_command {
    palpus_bridge_header header;
    uint64_t echo;         /* sequence of the newest state used for the wrench; 0 before the first */
    uint64_t time_ns;      /* time_ns of that state */
    double force[3];       /* N, in the device's axes, at the grip's origin */
    double torque[3];      /* N m, in the device's axes, about the grip's origin */
    uint32_t valid_for_us; /* the wrench is valid until time_ns + valid_for_us, by the device's clock */
    uint32_t reserved;     /* 0 */
} palpus_bridge_command;

typedef struct palpus_bridge_state {
    palpus_bridge_header header;
    uint64_t time_ns;         /* time by the device's clock, which never runs backwards, ns; any origin */
    double position[3];       /* of the grip in the device's frame, m: x right, y away from the user, z up */
    double orientation[4];    /* of the grip: unit quaternion x, y, z, w */
    double linear[3];         /* velocity of the grip's origin in the device's frame, m/s */
    double angular[3];        /* angular velocity of the grip in the device's frame, rad/s */
    double applied_force[3];  /* force that the device applies now, N */
    double applied_torque[3]; /* torque that the device applies now, N m */
    uint64_t echo;            /* sequence of the newest command that was accepted; 0 before the first */
    uint32_t buttons;         /* bit k: button k is pressed; bits 30 and 31 are 0 */
    uint32_t flags;           /* PALPUS_BRIDGE_READY, PALPUS_BRIDGE_WITHHELD; all other bits 0 */
} palpus_bridge_state;

typedef struct palpus_bridge_close {
    palpus_bridge_header header;
    char reason[96]; /* reason as text for the user: UTF-8, padded with zeros, no control characters */
} palpus_bridge_close;

#pragma pack(pop)

/* C99 has no static assertion. A false condition declares an array of negative length, which is an error. */
#define PALPUS_BRIDGE_ASSERT(name, condition) typedef char palpus_bridge_assert_##name[(condition) ? 1 : -1]
PALPUS_BRIDGE_ASSERT(header, sizeof(palpus_bridge_header) == 32);
PALPUS_BRIDGE_ASSERT(hello, sizeof(palpus_bridge_hello) == 40);
PALPUS_BRIDGE_ASSERT(welcome, sizeof(palpus_bridge_welcome) == 184);
PALPUS_BRIDGE_ASSERT(command, sizeof(palpus_bridge_command) == 104);
PALPUS_BRIDGE_ASSERT(state, sizeof(palpus_bridge_state) == PALPUS_BRIDGE_LONGEST);
PALPUS_BRIDGE_ASSERT(close, sizeof(palpus_bridge_close) == 128);
PALPUS_BRIDGE_ASSERT(check_offset, offsetof(palpus_bridge_header, check) == 12);
PALPUS_BRIDGE_ASSERT(doubles, sizeof(double) == 8);
#undef PALPUS_BRIDGE_ASSERT

/* Returns the CRC-32 (IEEE 802.3) of `size` bytes. Pass 0 as `crc`, or a previous result to continue. */
static inline uint32_t palpus_bridge_crc32(uint32_t crc, const uint8_t *bytes, size_t size) {
    crc = ~crc;
    for (size_t k = 0; k < size; k++) {
        crc ^= bytes[k];
        for (int bit = 0; bit < 8; bit++) crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
    }
    return ~crc;
}

/* Returns the CRC-32 for the header of a frame of `size` bytes (at least 32). */
static inline uint32_t palpus_bridge_check(const void *frame, size_t size) {
    const uint8_t *bytes = (const uint8_t *)frame;
    const uint8_t zeros[4] = {0, 0, 0, 0};
    uint32_t crc = palpus_bridge_crc32(0, bytes, 12);
    crc = palpus_bridge_crc32(crc, zeros, 4);
    return palpus_bridge_crc32(crc, bytes + 16, size - 16);
}

/* Fills the header of a frame; write all other fields first. `frame` is one of the structures above. */
static inline void palpus_bridge_seal(void *frame, uint16_t kind, uint32_t size, uint64_t nonce, uint64_t sequence) {
    palpus_bridge_header header;
    memcpy(header.magic, "PLPB", 4);
    header.version = PALPUS_BRIDGE_VERSION;
    header.kind = kind;
    header.size = size;
    header.check = 0;
    header.nonce = nonce;
    header.sequence = sequence;
    memcpy(frame, &header, sizeof header);
    header.check = palpus_bridge_check(frame, size);
    memcpy(frame, &header, sizeof header);
}

/* Returns the kind of a received frame, or 0 if its header, size or CRC-32 is wrong. The caller must
 * check the ranges of the fields: see docs/bridge.md. */
static inline int palpus_bridge_kind(const void *frame, size_t size) {
    static const uint32_t sizes[6] = {0,
                                      sizeof(palpus_bridge_hello),
                                      sizeof(palpus_bridge_welcome),
                                      sizeof(palpus_bridge_command),
                                      sizeof(palpus_bridge_state),
                                      sizeof(palpus_bridge_close)};
    palpus_bridge_header header;
    if (size < sizeof header) return 0;
    memcpy(&header, frame, sizeof header);
    if (memcmp(header.magic, "PLPB", 4) != 0 || header.version != PALPUS_BRIDGE_VERSION) return 0;
    if (header.kind < 1 || header.kind > 5 || header.size != size || sizes[header.kind] != size) return 0;
    return header.check == palpus_bridge_check(frame, size) ? header.kind : 0;
}

#endif
