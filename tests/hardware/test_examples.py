"""The examples beside the driver: they compile where their tools are, run where they can, and agree with the tables."""

from __future__ import annotations

import math
import re
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from tolerance import approx

from sitscad.apps.hardware.converter import NotAcknowledged
from sitscad.files.documents import firmware_driver
from sitscad.package.contents import incoming_tests
from tests.hardware.conftest import HERE, SANE, STRICT

SOURCES = ("sensor.c", "ldc161x.c")


def _made(command: list[object], folder: object) -> str:
    done = subprocess.run([*map(str, command)], cwd=str(folder), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.clients("gcc")
def test_linux_example_runs_on_simulated_converter(pad, tmp_path):
    program = tmp_path / "sensor"
    sources = ["example_linux.c", *SOURCES, "simulated/simulated.c"]
    _made(["gcc", *STRICT, "-DSIMULATED", "-o", program, *sources, "-lm"], pad.folder)
    lines = _made([program, "-", "3"], tmp_path).splitlines()
    assert lines[0] == "# three-axis-pad, read as assembled"
    assert [line.split(": ")[-1] for line in lines[1:5]] == ["good"] * 4
    assert len(lines) == 7 + 3 and all(line.count(" Hz (0)") == 4 for line in lines[7:])


@pytest.mark.slow
@pytest.mark.clients("gcc")
def test_linux_example_uses_i2c_dev_ioctls(pad, tmp_path):
    """Its ioctls, on a bus of ours; a bus that is not there is said."""
    program, calls = tmp_path / "sensor", ("open=bus_open", "ioctl=bus_ioctl", "nanosleep=bus_sleep")
    sources = ["example_linux.c", *SOURCES, "simulated/simulated.c", HERE / "wired.c"]
    defined = [f"-D{each}" for each in calls]
    _made(["gcc", *STRICT, *SANE, f"-I{pad.folder}", *defined, "-o", program, *sources, "-lm"], pad.folder)
    lines = _made([program, "/dev/i2c-1", "3"], tmp_path).splitlines()
    assert [line.split(": ")[-1] for line in lines[1:5]] == ["good"] * 4
    assert len(lines) == 7 + 3 and all(line.count(" Hz (0)") == 4 for line in lines[7:])
    assert subprocess.run([program, "/dev/no-bus"], capture_output=True, check=False).returncode == 1


@pytest.mark.slow
@pytest.mark.clients("gcc")
def test_linux_example_drives_sd_pin_as_wired(pad, tmp_path):
    """The resistor of the wiring holds SD high, which shuts the converter down: nothing answers without ``sd=``."""
    program, calls = tmp_path / "sensor", ("open=bus_open", "ioctl=bus_ioctl", "nanosleep=bus_sleep")
    sources = ["example_linux.c", *SOURCES, "simulated/simulated.c", HERE / "wired.c"]
    defined = [f"-D{each}" for each in (*calls, "SD_PULLED_UP")]
    _made(["gcc", *STRICT, *SANE, f"-I{pad.folder}", *defined, "-o", program, *sources, "-lm"], pad.folder)
    asleep = subprocess.run([program, "/dev/i2c-1", "3"], capture_output=True, text=True, check=False)
    assert asleep.returncode == 1 and "I2C" in asleep.stdout
    for words in (["sd=/dev/gpiochip0:17", "/dev/i2c-1", "3"], ["/dev/i2c-1", "3", "sd=/dev/gpiochip0:17"]):
        lines = _made([program, *words], tmp_path).splitlines()
        assert [line.split(": ")[-1] for line in lines[1:5]] == ["good"] * 4
        assert len(lines) == 7 + 3
    for place in ("/dev/gpiochip0:18", "/dev/gpiochip1:17", "17", "x" * 99 + ":1"):
        refused = subprocess.run([program, "/dev/i2c-1", f"sd={place}"], capture_output=True, text=True, check=False)
        assert refused.returncode == 1 and refused.stderr and not refused.stdout, place


def run_of_the_sketch(folder: Path, tmp_path: Path, *defined: str) -> list[str]:
    """What the Arduino sketch of a firmware's folder prints, compiled against the stub."""
    (tmp_path / "sketch.cpp").write_text('#include "arduino_stub.h"\n#include "firmware.ino"\n' + ARDUINO_MAIN)
    objects = [tmp_path / f"{name}.o" for name in ("sensor", "ldc161x", "simulated")]
    for one, source in zip(objects, [*SOURCES, "simulated/simulated.c"], strict=True):
        _made(["gcc", *STRICT, "-c", "-o", one, source], folder)
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Werror", f"-I{HERE}", f"-I{folder}", *(f"-D{one}" for one in defined)]
    _made(["g++", *flags, "-o", tmp_path / "sketch", tmp_path / "sketch.cpp", *objects], tmp_path)
    return _made([tmp_path / "sketch"], tmp_path).splitlines()


@pytest.mark.clients("g++")
def test_arduino_sketch_runs_against_stub(pad, tmp_path):
    """The stub's Wire is a bus without an answer, then one with a converter that is set up."""
    baud, *lines = run_of_the_sketch(pad.folder, tmp_path)
    assert f"#define SENSOR_BAUD {baud.removeprefix('baud ')} " in (pad.folder / "sensor_config.h").read_text()
    assert lines[0].startswith("# no answer on the I2C bus")
    assert lines[1:5] == [f"# C{k}: good" for k in range(1, 5)]
    assert lines[5].startswith("id,sequence,C1_counts,C1_status,")
    for number, line in enumerate(lines[5:9], -1):
        body, _, check = line.partition("*")
        assert _crc(body) == int(check, 16) and (number < 0 or body.split(",")[1] == str(number))


@pytest.mark.clients("g++")
def test_arduino_sketch_without_sd_pin_runs_with_sd_grounded(pad, tmp_path):
    lines = run_of_the_sketch(pad.folder, tmp_path, "SENSOR_SD_PIN=-1", "SD_TO_GND")
    assert lines[2:6] == [f"# C{k}: good" for k in range(1, 5)]


@pytest.mark.clients("g++")
def test_arduino_sketch_prints_no_report_of_interrupted_self_test(pad, tmp_path):
    """The bus ends within the self-test: the sketch starts anew, and says of the coils what the next test found."""
    lines = run_of_the_sketch(pad.folder, tmp_path, "TRANSFERS_UNTIL_A_FAULT=62")
    assert [line for line in lines[1:8] if line.startswith("# no answer")] == [lines[1], lines[2]]
    assert lines[3:7] == [f"# C{k}: good" for k in range(1, 5)]


@pytest.mark.clients("g++")
def test_driver_compiles_as_cpp_without_warning(pad, tmp_path):
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
    for source in (*SOURCES, "simulated/simulated.c"):
        _made(["g++", "-x", "c++", *flags, source], pad.folder)
    (tmp_path / "main.cpp").write_text('#include "sensor_line.h"\nsensor one;\nsensor_line line = {};\n')
    _made(["g++", *flags, f"-I{pad.folder}", "main.cpp"], tmp_path)


def _crc(text: str) -> int:
    """CRC-16 CCITT from 0xFFFF."""
    result = 0xFFFF
    for byte in text.encode():
        result ^= byte << 8
        for _ in range(8):
            result = (result << 1 ^ 0x1021 if result & 0x8000 else result << 1) & 0xFFFF
    return result


ARDUINO_MAIN = """
int main()
{
    setup();
    for (int k = 0; k < 4000; ++k)
        loop();
}
"""


@pytest.mark.clients("cppcheck")
def test_cppcheck_finds_nothing_in_driver(pad):
    checks = ["--std=c99", "--enable=warning,style,performance,portability", "--error-exitcode=2", "-q"]
    sources = [*SOURCES, "simulated/simulated.c", "example_linux.c"]
    _made(["cppcheck", *checks, "--suppress=missingInclude", "-I.", *sources], pad.folder)


@pytest.mark.clients("arm-none-eabi-gcc", "arm-none-eabi-size")
def test_driver_for_cortex_m0_has_documented_size_without_heap(pad, tmp_path):
    """Cortex-M0, nothing but the driver; no heap, no library but the compiler's own."""
    flags = ["-std=c99", "-mcpu=cortex-m0", "-mthumb", "-Os", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    objects = [tmp_path / "sensor.o", tmp_path / "ldc161x.o"]
    for item, source in zip(objects, SOURCES, strict=True):
        _made(["arm-none-eabi-gcc", *flags, "-c", "-o", item, source], pad.folder)
    rows = [row.split() for row in _made(["arm-none-eabi-size", *objects], tmp_path).splitlines()[1:]]
    text, writable = sum(int(row[0]) for row in rows), sum(int(row[1]) + int(row[2]) for row in rows)
    assert writable == 0
    (tmp_path / "one.c").write_text('#include "sensor.h"\nsensor one;\n')
    _made(["arm-none-eabi-gcc", *flags, f"-I{pad.folder}", "-c", "-o", "one.o", "one.c"], tmp_path)
    held = int(_made(["arm-none-eabi-size", "one.o"], tmp_path).splitlines()[1].split()[2])
    page = (HERE.parents[1] / "docs/bring_up.md").read_text()
    lines = re.search(r"(\d+) bytes of code and tables, (\d+) of RAM", page)
    assert (text, held) == (approx(int(lines[1]), rel=0.02), int(lines[2]))
    symbols = _made(["arm-none-eabi-nm", "-u", *objects], tmp_path)
    assert not re.findall(r"malloc|free|printf|delay", symbols)


class FakeI2C:
    """machine.I2C with simulated converters behind it."""

    def __init__(self, chip):
        self.chip, self.written = chip, []

    def readfrom_mem(self, address, register, count):
        assert (address, count) == (0x2A, 2)
        return self.chip.read(register).to_bytes(2, "big")

    def writeto_mem(self, address, register, content):
        assert address == 0x2A
        self.written.append((register, int.from_bytes(content, "big")))
        self.chip.write(register, self.written[-1][1])


slept: list[int] = []
"""Milliseconds that the MicroPython module slept."""


@pytest.fixture
def micropython(pad, monkeypatch):
    monkeypatch.syspath_prepend(str(pad.folder / "micropython"))
    monkeypatch.setattr(time, "sleep_ms", slept.append, raising=False)
    slept.clear()
    for name in ("sensor", "sensor_config"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    import sensor

    yield sensor
    for name in ("sensor", "sensor_config"):
        sys.modules.pop(name, None)


@pytest.mark.clients("gcc")
def test_micropython_module_sets_up_and_reads_like_c_driver(pad, micropython):
    from sitscad.apps.hardware.converter import SimulatedConverter

    bus = FakeI2C(SimulatedConverter(pad.design, faults="reset@0.05"))
    item = micropython.Sensor(bus)
    rows = re.findall(r"\{0u, 0x(\w\w)u, 0x(\w{4})u\}", (pad.folder / "sensor_config.h").read_text())
    assert bus.written == [(0x1C, 0x8000), *((int(where, 16), int(value, 16)) for where, value in rows)]
    assert item.poll() is None
    bus.chip.advance(6_000_000)
    result = item.poll()
    assert [status for _, status in result] == [micropython.GOOD] * 4
    assert abs(result[0][0] * 80e6 / 2**28 / pad.design.estimates.coils[0].states["rest"].frequency - 1.0) < 1e-4
    bus.chip.advance(60_000_000)
    for _ in range(8):
        item.poll()
    assert item.restarts == 1


@pytest.mark.clients("gcc")
def test_micropython_module_pulses_sd_and_waits_for_converter(pad, micropython):
    from sitscad.apps.hardware.converter import SimulatedConverter

    levels: list[tuple[int, int]] = []
    micropython.Sensor(FakeI2C(SimulatedConverter(pad.design)),
                       sd=SimpleNamespace(value=lambda level: levels.append((level, sum(slept)))))
    assert levels == [(1, 0), (0, 1)] and sum(slept) == 1 + 2


@pytest.mark.clients("gcc")
def test_micropython_module_polled_fast_reports_no_stale_coil(pad, micropython):
    """Polled more often than a coil is converted: each poll that finds one coil says good of the others."""
    from sitscad.apps.hardware.converter import SimulatedConverter

    bus = FakeI2C(SimulatedConverter(pad.design))
    item = micropython.Sensor(bus)
    bus.chip.advance(30_000_000)
    item.poll()
    seen = []
    for _ in range(200):
        bus.chip.advance(100_000)
        seen += [status for reading in [item.poll()] if reading for _, status in reading]
    assert len(seen) > 40 and set(seen) == {micropython.GOOD}


@pytest.mark.clients("gcc")
def test_micropython_module_reports_each_fault(pad, micropython):
    from sitscad.apps.hardware.converter import SimulatedConverter

    bus = FakeI2C(SimulatedConverter(pad.design, faults=["open:C2", "low-amplitude:C3", "lost-layer:C4"]))
    item = micropython.Sensor(bus)
    bus.chip.advance(30_000_000)
    states = [status for _, status in item.poll()]
    assert states == [micropython.GOOD, micropython.WATCHDOG, micropython.AMPLITUDE, micropython.OUT_OF_BAND]
    bus = FakeI2C(SimulatedConverter(pad.design, faults="nack"))
    with pytest.raises(NotAcknowledged):
        micropython.Sensor(bus)
    chip = SimulatedConverter(pad.design)
    chip.device_id_read = chip.words[0x7F]
    chip.words[0x7F] = 0x3054
    with pytest.raises(micropython.SensorError, match="no LDC1612"):
        micropython.Sensor(FakeI2C(chip))


@pytest.fixture
def node(pad, monkeypatch):
    """The node of ROS 2 on stubs of what it imports."""
    sent, message = [], []
    logger = SimpleNamespace(warning=message.append, error=message.append)

    class Node:
        def __init__(self, name):
            self.publisher = SimpleNamespace(publish=sent.append)

        declare_parameter = staticmethod(lambda name, value: SimpleNamespace(value=value))
        create_publisher = staticmethod(lambda kind, topic, depth: SimpleNamespace(publish=sent.append))
        create_timer = staticmethod(lambda period, act: None)
        get_logger = staticmethod(lambda: logger)
        get_clock = staticmethod(lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now")))

    class Wrench:
        def __init__(self):
            self.header = SimpleNamespace()
            self.wrench = SimpleNamespace(force=SimpleNamespace(), torque=SimpleNamespace())

    received: list[bytes] = []
    port = SimpleNamespace(read=lambda size: received.pop(0) if received else b"")
    stubs = {
        "rclpy": SimpleNamespace(), "rclpy.node": SimpleNamespace(Node=Node), "geometry_msgs": SimpleNamespace(),
        "geometry_msgs.msg": SimpleNamespace(WrenchStamped=Wrench),
        "serial": SimpleNamespace(Serial=lambda *given, **named: port),
    }
    for name, stub in stubs.items():
        monkeypatch.setitem(sys.modules, name, stub)
    path = pad.folder / "ros2" / "sensor_node.py"
    module = {"__name__": "sensor_node", "__file__": str(path)}
    exec(compile(path.read_text(), str(path), "exec"), module)
    return module["SensorNode"](), received, sent, message


def _checked(*cells: object) -> bytes:
    text = ",".join(map(str, cells))
    return f"{text}*{_crc(text):04X}\r\n".encode()


@pytest.mark.clients("gcc")
def test_ros_node_publishes_valid_lines_and_reports_invalid_lines(node):
    item, received, sent, message = node
    head = _checked("id", "sequence", "C1_counts", "C1_status", "normal_N", "shear_x_N")
    whole = _checked(item.identity, 0, 1, 0, "1.5", "-0.25")
    stream = [
        b"f,a,line*0000\r\n" + whole + head, whole[:9], whole[9:], _checked(item.identity, 4, 1, 4, "", ""),
        whole.replace(b"1.5", b"9.5") + _checked("0" * 8, 5, 1, 0, "7.0", "0.1"),
        _checked(item.identity, 5, 1, 0, "2.0", "0.0"),
    ]
    received += stream
    for _ in range(len(stream) + 1):
        item.read()
    item.log_losses()
    item.log_losses()
    assert [(each.wrench.force.x, each.wrench.force.z) for each in sent] == [(-0.25, -1.5), (0.0, -2.0)]
    assert all(math.isnan(value) for value in (sent[0].wrench.force.y, sent[0].wrench.torque.x))
    assert message == ["3 lines lost, 1 corrupted, 1 of another sensor"]


@pytest.mark.clients("gcc")
def test_ros_node_separates_uncompensated_newtons(node):
    item, received, _, message = node
    topics: list[str] = []
    item.create_publisher = lambda kind, topic, depth: SimpleNamespace(publish=lambda wrench: topics.append(topic))
    received += [
        _checked("id", "sequence", "C1_counts", "C1_status", "normal_N", "warming_K"),
        *(_checked(item.identity, number, 1, 0, "1.5", kelvin) for number, kelvin in enumerate(("0.25", "", "-0.1")))]
    for _ in range(5):
        item.read()
    item.log_losses()
    assert topics == ["wrench", "wrench_uncompensated", "wrench"]
    assert len(message) == 1 and "1 without a valid temperature" in message[0]


@pytest.mark.slow
@pytest.mark.clients("gcc")
def test_firmware_readme_wires_every_contact_in_ten_steps(pad, tmp_path):
    design = pad.design
    text = firmware_driver.render_readme(design.layout, design.estimates, incoming_tests(design).board)[
        "firmware/readme.txt"
    ].decode()
    for pin in ("VDD", "SCL", "SD ", "INTB", "ADDR", "CLKIN", "capacitor"):
        assert f"  {pin}" in text
    assert {f"IN{k}{end}" for k in range(4) for end in "AB"} <= set(re.findall(r"IN\d[AB]", text))
    assert re.findall(r"^ ?(\d+)\. ", text, re.M) == [str(k) for k in range(1, 11)]
    for coil, metered in zip(design.estimates.coils, incoming_tests(design).board.metered, strict=True):
        assert f"  {coil.name}    L {metered.inductance * 1e6:.4g} uH" in text
    assert "      cp -r .. ../../" in text  # nothing is put into the package, which `verify` would refuse
    for command in re.findall(r"^      (cc .*)$", text, re.M):  # as they stand: the last is that without a board
        _made(["sh", "-c", command.replace("-o sensor", f"-o {tmp_path}/sensor")], pad.folder)
    assert len(_made([tmp_path / "sensor", "-", "1"], tmp_path).splitlines()) == 8
    named = re.findall(r"^  ([\w./]+(?:, [\w.]+)?) {2,}\S", text[text.index("FILES") :], re.M)
    for name in ", ".join(named).split(", "):
        assert name == "wiring/" or (pad.folder / name).exists(), name
