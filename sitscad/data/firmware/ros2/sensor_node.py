"""ROS 2 node that publishes the sensor's newtons as geometry_msgs/WrenchStamped on the topic `wrench`.

A sensor with cells has the topics `cell_1/wrench`, `cell_2/wrench`, ... in the order of the columns.

    python3 sensor_node.py --ros-args -p port:=/dev/ttyACM0 -p frame_id:=sensor

The node reads the lines of ../sensor_line.h. Compile the firmware with a calibration.h. Axes belong to the board: x
runs along the jaw towards the tail, and z away from the board. A press is therefore a force along -z. Torques and
forces that the sensor does not measure are NaN. Readings with a fault are not published, for each cell separately. The
node logs the number of lines that are lost, corrupted or of another sensor.

If the design measures its temperature, the newtons on `wrench` are compensated by the temperature change since the
tare. Newtons without a valid temperature are not compensated: they go to the topic `wrench_uncompensated` instead
(of a cell `cell_1/wrench_uncompensated`), and the node logs their number.
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
LOG_PERIOD = 5.0  # seconds


class SensorNode(Node):
    """The node, with the parameters port, baud and frame_id."""

    def __init__(self):
        super().__init__("sensor")
        path = self.declare_parameter("port", "/dev/ttyACM0").value
        config = CONFIG.read_text()
        baud = self.declare_parameter("baud", int(re.search(r"SENSOR_BAUD (\d+)", config).group(1))).value
        self.frame = self.declare_parameter("frame_id", "sensor").value
        self.identity = re.search(r"SENSOR_ID 0x(\w{8})", config).group(1)
        self.columns, self.sequence, self.rest = None, None, None
        self.lost = self.corrupted = self.another = self.logged = 0
        self.uncompensated = 0
        self.publishers_by_prefix = {}  # two by the prefix of a cell's axes; empty prefix without cells
        self.port = serial.Serial(path, baud, timeout=0)
        self.create_timer(0.002, self.read)
        self.create_timer(LOG_PERIOD, self.log_losses)

    def read(self):
        """Read the received lines."""
        received = self.port.read(4096)
        *lines, rest = ((self.rest or b"") + received).split(b"\n")
        for number, line in enumerate(lines):
            self.take(line.strip(), is_part=self.rest is None and number == 0)
        self.rest = rest[-4096:] if received or self.rest is not None else None

    def take(self, line, is_part=False):
        """Read one line. The first line after the start may be incomplete."""
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
        """Create a publisher for each prefix of forces in the header."""
        if not prefixes:
            self.get_logger().error("the firmware has no newtons: compile it with calibration.h")
        topics = {prefix: f"cell_{number}/wrench" if prefix else "wrench" for number, prefix in enumerate(prefixes, 1)}
        for prefix, topic in topics.items():
            if prefix not in self.publishers_by_prefix:
                names = (topic, f"{topic}_uncompensated") if "warming_K" in self.columns else (topic,)
                self.publishers_by_prefix[prefix] = [self.create_publisher(WrenchStamped, name, 10) for name in names]

    def publish(self, row):
        """Publish the newtons of a line. They are missing if a coil of the cell has a fault, or before the tare."""
        number = int(row["sequence"])
        if self.sequence is not None and number > self.sequence:
            self.lost += number - self.sequence - 1
        self.sequence = number
        is_compensated = row.get("warming_K") != ""  # always without a temperature sensor in the design
        self.uncompensated += not is_compensated
        for prefix, publishers in self.publishers_by_prefix.items():
            if row.get(f"{prefix}normal_N"):
                publishers[0 if is_compensated else -1].publish(self.message(row, prefix))

    def message(self, row, prefix):
        """Return the message of one cell, whose axes have a prefix."""
        message = WrenchStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frame
        force, torque = message.wrench.force, message.wrench.torque
        force.x, force.y = (float(row.get(f"{prefix}shear_{axis}_N") or math.nan) for axis in "xy")
        force.z = -float(row[f"{prefix}normal_N"])
        torque.x, torque.y = (1e-3 * float(row.get(f"{prefix}moment_{axis}_Nmm") or math.nan) for axis in "xy")
        torque.z = math.nan
        return message

    def log_losses(self):
        """Log the number of unused lines if it has grown."""
        wrong = self.lost + self.corrupted + self.another + self.uncompensated
        if wrong > self.logged:
            text = f"{self.lost} lines lost, {self.corrupted} corrupted, {self.another} of another sensor"
            more = f", {self.uncompensated} without a valid temperature" if self.uncompensated else ""
            self.get_logger().warning(text + more)
        self.logged = wrong


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    node = SensorNode()
    with contextlib.suppress(KeyboardInterrupt):
        rclpy.spin(node)
    node.destroy_node()


if __name__ == "__main__":
    main()
