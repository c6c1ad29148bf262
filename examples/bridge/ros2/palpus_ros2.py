#!/usr/bin/env python3
"""A ROS 2 node that connects a device on ROS topics to palpus, through the bridge.

    ROS 2 topics of the device                     palpus
    ~/pose    geometry_msgs/PoseStamped   in   ──►  state
    ~/twist   geometry_msgs/TwistStamped  in   ──►  state
    ~/ready   std_msgs/Bool               in   ──►  READY flag (true until a message arrives)
    ~/wrench  geometry_msgs/WrenchStamped out  ◄──  command; zero if none is valid

    source /opt/ros/jazzy/setup.bash
    python3 examples/bridge/ros2/palpus_ros2.py --ros-args \
        -p address:=/tmp/palpus.sock -p force_max:=5.0 -r '~/pose:=/arm/pose' -r '~/wrench:=/arm/wrench'
    palpus run --device bridge:/tmp/palpus.sock

All values are in the device's frame (x to the right, y away from the user, z up) and in SI units. The twist
is the velocity of the grip. Without a new pose for 5 ms the node withholds the force and publishes zero. The subscriber
to the wrench must also set the force to zero when no more wrenches arrive.
Needs rclpy. The script was compiled, but not yet run with a robot.
"""

import pathlib
import sys
import time

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Bool

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from palpus_bridge import Bridge, Spec  # noqa: E402

# No force is given if the last pose is older than this, s.
STALE = 0.005


class Adapter(Node):
    """Converts ROS messages to bridge frames, and bridge frames to ROS messages."""

    def __init__(self):
        super().__init__("palpus")
        parameter = lambda name, default: self.declare_parameter(name, default).value  # noqa: E731
        torque_max = parameter("torque_max", 0.0)
        rotation = 3 if torque_max > 0.0 else 0
        spec = Spec(
            name=parameter("name", "ROS 2 device"),
            force_max=parameter("force_max", 1.0),
            torque_max=torque_max,
            # Delay of the ROS topics, s, which palpus takes into account.
            delay=parameter("delay", 0.002),
            rate_hz=parameter("rate", 1000.0),
            actuated=(3, rotation, 0),
            sensed=(3, 3, 0),
        )
        self.bridge = Bridge(parameter("address", "/tmp/palpus.sock"), spec)
        self.frame = parameter("frame", "device")
        self.pose, self.twist, self.ready, self.heard = None, None, True, 0.0
        self.create_subscription(PoseStamped, "~/pose", self.take_pose, qos_profile_sensor_data)
        self.create_subscription(TwistStamped, "~/twist", self.take_twist, qos_profile_sensor_data)
        self.create_subscription(Bool, "~/ready", self.take_ready, 1)
        self.publisher = self.create_publisher(WrenchStamped, "~/wrench", qos_profile_sensor_data)
        self.create_timer(1.0 / spec.rate_hz, self.step)

    def take_pose(self, message):
        self.pose, self.heard = message.pose, time.monotonic()

    def take_twist(self, message):
        self.twist = message.twist

    def take_ready(self, message):
        self.ready = message.data

    def step(self):
        self.bridge.receive()
        if self.pose is None:
            return
        stale = time.monotonic() - self.heard > STALE
        may_push = self.ready and not stale
        force, torque = self.bridge.wrench() if may_push else ((0.0,) * 3, (0.0,) * 3)
        self.publish(force, torque)
        linear = angular = (0.0, 0.0, 0.0)
        if self.twist is not None and not stale:
            linear, angular = _three(self.twist.linear), _three(self.twist.angular)
        turn = self.pose.orientation
        self.bridge.send(
            _three(self.pose.position),
            (turn.x, turn.y, turn.z, turn.w),
            linear,
            angular,
            force,
            torque,
            ready=self.ready,
            withheld=stale,
        )

    def publish(self, force, torque):
        message = WrenchStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frame
        for part, value in zip("xyz", force):
            setattr(message.wrench.force, part, value)
        for part, value in zip("xyz", torque):
            setattr(message.wrench.torque, part, value)
        self.publisher.publish(message)

    def end(self):
        """Publishes a zero wrench and ends the session."""
        self.publish((0.0,) * 3, (0.0,) * 3)
        self.bridge.close("the ROS 2 adapter was stopped")


def _three(vector):
    return vector.x, vector.y, vector.z


def main():
    rclpy.init()
    adapter = Adapter()
    try:
        rclpy.spin(adapter)
    except KeyboardInterrupt:
        pass
    finally:
        adapter.end()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
