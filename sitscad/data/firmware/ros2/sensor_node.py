"""A ROS 2 node: the newtons of the sensor as geometry_msgs/WrenchStamped on the topic `wrench`; of a sensor with cells
on `cell_1/wrench`, `cell_2/wrench`, ... in the order of their columns.

    python3 sensor_node.py --ros-args -p port:=/dev/ttyACM0 -p frame_id:=sensor

It reads the lines of ../sensor_line.h, compiled with a calibration.h. Axes are the board's: x along the jaw towards the
tail, z away from the board, so that a press is a force along -z. Torques, and forces along axes that the array does not
tell apart, are not measured: they are NaN. What has a fault is not published, of cells each for itself; what is lost,
corrupted or of another sensor is counted and told.
"""

import binascii
import contextlib
import math
import re
from pathlib import Path

import rclpy
import serial
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node

CONFIG = Path(__file__).parent.parent / "sensor_config.h"
TOLD_EVERY = 5.0  # seconds


class SensorNode(Node):
    """The node; parameters port, baud, frame_id."""

    def __init__(self):
        super().__init__("sensor")
        path = self.declare_parameter("port", "/dev/ttyACM0").value
        config = CONFIG.read_text()
        baud = self.declare_parameter("baud", int(re.search(r"SENSOR_BAUD (\d+)", config).group(1))).value
        self.frame = self.declare_parameter("frame_id", "sensor").value
        self.identity = re.search(r"SENSOR_ID 0x(\w{8})", config).group(1)
        self.columns, self.sequence, self.rest = None, None, None
        self.lost = self.corrupted = self.another = self.told = 0
        self.publishers_by_prefix = {}  # what stands before the axes of a cell; nothing without cells
        self.port = serial.Serial(path, baud, timeout=0)
        self.create_timer(0.002, self.read)
        self.create_timer(TOLD_EVERY, self.tell)

    def read(self):
        """Take up what has come."""
        received = self.port.read(4096)
        *lines, rest = ((self.rest or b"") + received).split(b"\n")
        for number, line in enumerate(lines):
            self.take(line.strip(), is_part=self.rest is None and number == 0)
        self.rest = rest[-4096:] if received or self.rest is not None else None

    def take(self, line, is_part=False):
        """One line; the first after the start may be a part of one."""
        text, star, check = line.rpartition(b"*")
        if not line or line.startswith(b"#"):
            return
        if not star or b"%04X" % binascii.crc_hqx(text, 0xFFFF) != check:
            self.corrupted += not is_part
            return
        cells = text.decode("ascii", "replace").split(",")
        if cells[0] == "id":
            if cells != self.columns:
                self.columns = cells
                self.begin([name.removesuffix("normal_N") for name in cells if name.endswith("normal_N")])
        elif cells[0] != self.identity:
            self.another += 1
        elif self.columns is not None and len(cells) == len(self.columns):
            self.publish(dict(zip(self.columns, cells, strict=True)))

    def begin(self, prefixes):
        """A publisher for each prefix of forces in the header."""
        if not prefixes:
            self.get_logger().error("the firmware was compiled without calibration.h: there are no newtons")
        topics = {prefix: f"cell_{number}/wrench" if prefix else "wrench" for number, prefix in enumerate(prefixes, 1)}
        for prefix, topic in topics.items():
            if prefix not in self.publishers_by_prefix:
                self.publishers_by_prefix[prefix] = self.create_publisher(WrenchStamped, topic, 10)

    def publish(self, row):
        """Newtons of a line that is whole; without, a coil of the cell had a fault or nothing was tared."""
        number = int(row["sequence"])
        if self.sequence is not None and number > self.sequence:
            self.lost += number - self.sequence - 1
        self.sequence = number
        for prefix, publisher in self.publishers_by_prefix.items():
            if row.get(f"{prefix}normal_N"):
                publisher.publish(self.message(row, prefix))

    def message(self, row, prefix):
        """The message of one cell, whose axes stand behind a prefix."""
        message = WrenchStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frame
        force, torque = message.wrench.force, message.wrench.torque
        force.x, force.y = (float(row.get(f"{prefix}shear_{axis}_N") or math.nan) for axis in "xy")
        force.z = -float(row[f"{prefix}normal_N"])
        torque.x, torque.y = (1e-3 * float(row.get(f"{prefix}moment_{axis}_Nmm") or math.nan) for axis in "xy")
        torque.z = math.nan
        return message

    def tell(self):
        """Say what was not used, where that is more than before."""
        wrong = self.lost + self.corrupted + self.another
        if wrong > self.told:
            self.get_logger().warning(
                f"{self.lost} lines lost, {self.corrupted} corrupted, {self.another} of another sensor"
            )
        self.told = wrong


def main():
    """Until Ctrl-C."""
    rclpy.init()
    node = SensorNode()
    with contextlib.suppress(KeyboardInterrupt):
        rclpy.spin(node)
    node.destroy_node()


if __name__ == "__main__":
    main()
