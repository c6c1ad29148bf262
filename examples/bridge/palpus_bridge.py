"""The driver's side of the palpus bridge, for Python 3.8 or newer. docs/bridge.md specifies the protocol.

    bridge = Bridge("/tmp/palpus.sock", Spec(name="my arm", force_max=5.0))
    while True:
        bridge.receive()                  # takes the frames from palpus
        force, torque = bridge.wrench()   # the wrench to apply now; zero if none is valid
        ...                               # apply the wrench, read the sensors
        bridge.send(position=(x, y, z), linear=(vx, vy, vz), force=force, torque=torque)

All units are SI. The frame has x to the right, y away from the user, z up. Use an object from one thread only.
"""

import math
import os
import secrets
import socket
import struct
import time
import zlib
from dataclasses import dataclass

HELLO, WELCOME, COMMAND, STATE, CLOSE = 1, 2, 3, 4, 5
READY, WITHHELD = 1, 2

_HEADER = struct.Struct("<4sHHIIQQ")  # magic, version, kind, size, check, nonce, sequence
_BODIES = {
    HELLO: struct.Struct("<d"),
    WELCOME: struct.Struct("<Q64s9d8B"),
    COMMAND: struct.Struct("<QQ6dII"),
    STATE: struct.Struct("<Q19dQII"),
    CLOSE: struct.Struct("<96s"),
}
_MOST_VALID_FOR_US = 100_000
_LARGEST = 1e9
# A session ends after _SILENCE without a command. A connection ends after _HANDSHAKE without a
# session. Both are in ns.
_SILENCE = 250_000_000
_HANDSHAKE = 2_000_000_000
# Largest number of frames that one call takes, so that a flood of frames does not delay the device.
_MOST_FRAMES = 64
_NO_WRENCH = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def encode(kind, nonce, sequence, *fields):
    """Returns the bytes of a frame."""
    body = _BODIES[kind].pack(*fields)
    size = _HEADER.size + len(body)
    unchecked = _HEADER.pack(b"PLPB", 1, kind, size, 0, nonce, sequence) + body
    return unchecked[:12] + struct.pack("<I", zlib.crc32(unchecked)) + unchecked[16:]


def decode(frame):
    """Returns (kind, nonce, sequence, fields), or None if the bytes are not a valid frame."""
    if len(frame) < _HEADER.size:
        return None
    magic, version, kind, size, check, nonce, sequence = _HEADER.unpack_from(frame)
    if magic != b"PLPB" or version != 1 or kind not in _BODIES:
        return None
    if not len(frame) == size == _HEADER.size + _BODIES[kind].size:
        return None
    if zlib.crc32(frame[:12] + bytes(4) + frame[16:]) != check:
        return None
    return kind, nonce, sequence, _BODIES[kind].unpack_from(frame, _HEADER.size)


@dataclass
class Spec:
    """Capabilities of the device in SI units; 0 means none or unknown."""

    name: str
    force_max: float = 0.0
    torque_max: float = 0.0
    force_continuous: float = 0.0
    torque_continuous: float = 0.0
    workspace: tuple = (0.0, 0.0, 0.0)
    delay: float = 0.0
    rate_hz: float = 1000.0
    actuated: tuple = (3, 0, 0)  # translation, rotation, gripper
    sensed: tuple = (3, 0, 0)
    buttons: int = 0

    def fields(self, session):
        """Returns the fields of a welcome."""
        numbers = (self.force_max, self.torque_max, self.force_continuous, self.torque_continuous)
        axes = (*self.actuated, *self.sensed, self.buttons, 0)
        return (session, self.name.encode()[:64], *numbers, *self.workspace, self.delay, self.rate_hz, *axes)


class Bridge:
    """Listens at a path or at `udp:127.0.0.1:PORT`, and serves one session at a time."""

    def __init__(self, address, spec):
        self.spec = spec
        self._path = None
        self._listener = None
        self._socket = None  # for a path: None while no client is connected
        self._peer = None  # UDP only: address of the session's client, or of the last sender
        self._hello = self._offer = None
        if address.startswith("udp:"):
            host, _, port = address[4:].rpartition(":")
            if not host.startswith("127."):
                raise ValueError("a bridge listens on loopback addresses only, such as udp:127.0.0.1:PORT")
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.bind((host, int(port)))
            self._socket.setblocking(False)
        else:
            self._path = address
            if os.path.exists(address):
                os.unlink(address)
            self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            self._listener.bind(address)
            self._listener.listen(1)
            self._listener.setblocking(False)
        self._heard = 0
        self._end_session()

    def receive(self):
        """Takes the frames that have arrived from palpus. Does not wait."""
        now = time.monotonic_ns()
        limit = _SILENCE if self.session is not None else _HANDSHAKE
        if now - self._heard > limit and (self.session is not None or self._path):
            self._hang_up()
        if self._socket is None:
            try:
                self._socket, _ = self._listener.accept()
            except BlockingIOError:
                return
            self._socket.setblocking(False)
            self._heard = now
        for _ in range(_MOST_FRAMES):
            try:
                frame, source = self._socket.recvfrom(512)
            except BlockingIOError:
                return
            except OSError:
                frame, source = b"", None
            if not frame and self._path:
                self._hang_up()  # palpus has closed the connection
                return
            if not self._path:
                if self.session is None:
                    self._peer = source
                elif source != self._peer:
                    continue
            self._take(decode(frame), time.monotonic_ns())

    def wrench(self):
        """Returns (force, torque) to apply now (N, N m, about the grip, in the device's axes)."""
        if self._wrench != _NO_WRENCH and time.monotonic_ns() >= self._until:
            self._withhold()
        return self._wrench

    def send(self, position, orientation=(0.0, 0.0, 0.0, 1.0), linear=(0.0, 0.0, 0.0), angular=(0.0, 0.0, 0.0),
             force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), buttons=0, ready=True, withheld=False):
        """Sends a state: pose and velocity of the grip, and the force and torque that act on it now."""
        if self.session is None:
            return
        if withheld or not ready:
            self._withhold()
        flags = (READY if ready else 0) | (WITHHELD if self._withheld else 0)
        self._sent += 1
        fields = (time.monotonic_ns(), *position, *orientation, *linear, *angular, *force, *torque)
        self._send(encode(STATE, self.session, self._sent, *fields, self._accepted, buttons, flags))

    def close(self, reason="the driver was stopped"):
        """Ends the session and closes the sockets."""
        if self.session is not None:
            self._sent += 1
            self._send(encode(CLOSE, self.session, self._sent, reason.encode()[:96]))
        self._end_session()
        for each in (self._socket, self._listener):
            if each is not None:
                each.close()
        if self._path and os.path.exists(self._path):
            os.unlink(self._path)

    def _take(self, frame, now):
        if frame is None:
            return
        kind, nonce, sequence, fields = frame
        if kind == HELLO and self.session is None:
            if 1.0 <= fields[0] <= 1e5:
                self._welcome(nonce, sequence)
        elif kind == COMMAND:
            echo, time_ns, *wrench, valid_for_us, reserved = fields
            if not all(abs(part) <= _LARGEST for part in wrench):  # this form also refuses NaN
                return
            if valid_for_us > _MOST_VALID_FOR_US or reserved != 0:
                return
            if self.session is None and nonce == self._offer:
                self.session = nonce
            if nonce == self.session and sequence > self._accepted:
                self._accepted, self._heard = sequence, now
                self._obey(echo, time_ns + 1000 * valid_for_us, tuple(wrench), now)
        elif kind == CLOSE and self.session is not None and nonce == self.session:
            self._end_session()

    def _welcome(self, nonce, sequence):
        # A repeated hello gets the same session again.
        if self._hello != nonce:
            self._hello, self._offer = nonce, secrets.randbits(64)
        self._send(encode(WELCOME, nonce, sequence, *self.spec.fields(self._offer)))

    def _obey(self, echo, until, wrench, now):
        if wrench == (0.0,) * 6:
            self._wrench = _NO_WRENCH
            if echo >= self._floor:
                self._withheld = False
        elif self._floor <= echo <= self._sent and now < until:
            self._wrench = (_within(wrench[:3], self.spec.force_max), _within(wrench[3:], self.spec.torque_max))
            self._until, self._withheld = until, False
        else:
            self._withhold()

    def _withhold(self):
        """Sets the wrench to zero, until a command echoes a state that is sent after this call."""
        self._wrench, self._withheld, self._floor = _NO_WRENCH, True, self._sent + 1

    def _end_session(self):
        self.session = self._hello = self._offer = None
        self._sent = self._accepted = self._until = 0
        self._floor, self._withheld, self._wrench = 1, False, _NO_WRENCH

    def _hang_up(self):
        self._end_session()
        if self._path and self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, frame):
        """Sends a frame. If there is no room, it is lost; palpus detects this from the sequence numbers."""
        try:
            if self._path:
                self._socket.send(frame)
            else:
                self._socket.sendto(frame, self._peer)
        except OSError:
            pass


def _within(vector, most):
    """Returns the vector, shortened to at most the length `most`."""
    length = math.hypot(*vector)
    return tuple(part * most / length for part in vector) if length > most else tuple(vector)
