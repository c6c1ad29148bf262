#!/usr/bin/env python3
"""A driver for the palpus bridge. The device is simulated: a hand holds a small mass and moves it up and down.

    python3 examples/bridge/driver.py /tmp/palpus.sock        or   udp:127.0.0.1:7000
    palpus run --device bridge:/tmp/palpus.sock

Needs only Python 3.8 or newer. To drive your own device, replace `Mass`. Test your driver with
`palpus devices --conformance ADDRESS`.
"""

import argparse
import math
import signal
import sys
import time

from palpus_bridge import Bridge, Spec


class Mass:
    """A mass that a spring ties to the position of a moving hand (kg, N/m, N s/m)."""

    MASS, STIFFNESS, DAMPING = 0.1, 150.0, 6.0

    def __init__(self):
        self.position, self.velocity = [0.0] * 3, [0.0] * 3
        self.begun = time.monotonic()

    def step(self, force, dt):
        """Applies `force` (N) for `dt` seconds, and moves the mass."""
        passed = time.monotonic() - self.begun
        wanted = (0.01 * math.sin(1.9 * passed), 0.0, -0.02 * (1.0 - math.cos(1.3 * passed)))
        for k in range(3):
            hand = self.STIFFNESS * (wanted[k] - self.position[k]) - self.DAMPING * self.velocity[k]
            self.velocity[k] += (hand + force[k]) / self.MASS * dt
            self.position[k] += self.velocity[k] * dt


def main():
    parser = argparse.ArgumentParser(description="A mass in a hand as a device for palpus.")
    parser.add_argument("address", help="the path of a socket, or udp:127.0.0.1:PORT")
    parser.add_argument("--rate", type=float, default=1000.0, help="states per second, 500 to 1000 [1000]")
    arguments = parser.parse_args()
    if not 500.0 <= arguments.rate <= 1000.0:
        parser.error("the rate must be from 500 to 1000")
    spec = Spec(name="mass in a hand (Python)", force_max=5.0, workspace=(0.2, 0.2, 0.2), rate_hz=arguments.rate)
    try:
        bridge = Bridge(arguments.address, spec)
    except (OSError, ValueError, OverflowError) as error:
        sys.exit(f"driver: cannot listen at {arguments.address}: {error}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    print(f"listening at {arguments.address}", flush=True)
    mass, period = Mass(), 1.0 / arguments.rate
    due = time.monotonic()
    try:
        while True:
            bridge.receive()
            force, torque = bridge.wrench()
            mass.step(force, period)
            bridge.send(mass.position, linear=mass.velocity, force=force, torque=torque)
            # Late steps are caught up, but after a pause of more than 20 ms they are skipped.
            due = max(due + period, time.monotonic() - 0.02)
            time.sleep(max(0.0, due - time.monotonic()))
    except KeyboardInterrupt:
        pass
    finally:
        bridge.close()


if __name__ == "__main__":
    main()
