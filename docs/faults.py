"""Report each fault of a simulated board by the compiled driver and by `read --diagnose`.

    python docs/faults.py templates/three_axis_pad.yaml

The driver is the C code of the package. `cc` compiles it, and it runs on the simulated converters. "right" means that
the report names the fault and no working coil.
"""

import ctypes
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from pathlib import Path

import sitscad
from sitscad.apps.hardware.bench_board import AMPLITUDE, GOOD
from sitscad.apps.hardware.converter import FAULTS, SimulatedConverter
from sitscad.apps.hardware.diagnosis import NOT_MET, diagnose_board, read_scans
from sitscad.apps.hardware.source import Simulation
from sitscad.estimates.circuits.settings import STATUS
from sitscad.files.documents import firmware

NAMED = {
    "open": ("open",), "short": ("shorted",), "lost-layer": ("a layer is missing",), "low-amplitude": ("amplitude",),
    "swapped": ("exchanged",), "nack": ("no answer", "no acknowledge"), "stuck": ("stale", "stuck"), "reset": ("lost",),
    "glitch": ("stale", "far off"),
}
"""Words that name each fault. A right report has at least one word of its fault."""

SCANS, BEGINS, EVERY = 300, 0.1, 0.25
"""Number of scans, start of the fault (s), and period of glitches (s)."""
Call = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_uint8, ctypes.POINTER(ctypes.c_uint8), ctypes.c_size_t,
    ctypes.POINTER(ctypes.c_uint8), ctypes.c_size_t,
)


class Bus(ctypes.Structure):
    """The C struct ldc161x_bus. Its `write` does not have the last two arguments."""

    _fields_ = (("context", ctypes.c_void_p), ("write", Call), ("write_read", Call))


def boards(design: sitscad.Design, fault: str) -> list[SimulatedConverter]:
    """Return the converters of a board with a fault."""
    number = design.spec.readout.device.converter_count(len(design.estimates.coils))
    return [SimulatedConverter(design, faults=[fault] if fault else [], number=k) for k in range(number)]


def seconds(design: sitscad.Design) -> float:
    """Return the duration (s) of the readings."""
    return SCANS / design.estimates.readout.scan_rate


class Driver:
    """The compiled driver of a design."""

    def __init__(self, design: sitscad.Design, folder: Path) -> None:
        self.design, self.coils = design, [coil.name for coil in design.estimates.coils]
        if design.spec.readout.device.coil_channels(len(self.coils))[-1].bus:
            raise SystemExit("faults.py runs a driver on one I2C bus")
        for name, content in firmware.render(design.spec, design.estimates).items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        sources = [folder / "firmware" / name for name in ("sensor.c", "ldc161x.c")]
        flags = ["-std=c99", "-O2", "-shared", "-fPIC"]
        subprocess.run(["cc", *flags, "-o", folder / "driver.so", *sources], check=True)
        self.c = ctypes.CDLL(str(folder / "driver.so"))
        for name in ("sensor_text", "sensor_coil_text"):
            getattr(self.c, name).restype = ctypes.c_char_p
        number = len(self.coils)
        words, bytes_ = ctypes.c_uint32 * number, ctypes.c_uint8 * number
        self.Reading = type("Reading", (ctypes.Structure,), {"_fields_": [
            ("counts", words), ("status", bytes_), ("frequency", ctypes.c_float * number)]})
        self.Report = type("Report", (ctypes.Structure,), {"_fields_": [
            ("state", ctypes.c_uint8), ("told_apart", ctypes.c_uint8), ("coil", bytes_), ("amplitude", bytes_),
            ("counts", words), ("inductance", ctypes.c_int16 * number)]})

    def said(self, fault: str) -> list[str]:
        """Return all reports of start, polls and self-test, except good readings."""
        chips, addresses = boards(self.design, fault), self.design.spec.readout.device.addresses

        def moved(context, address, out, count, into, wanted):
            chip = chips[addresses.index(address)]
            try:
                if into is None:
                    chip.write(out[0], out[1] << 8 | out[2])
                else:
                    into[0], into[1] = chip.read(out[0]).to_bytes(2, "big")
            except OSError:
                return 1
            for other in chips:
                other.advance(max(chip.time - other.time, 0))
            return 0

        write = Call(lambda context, address, out, count, *_: moved(context, address, out, count, None, 0))
        bus, sensor = Bus(None, write, Call(moved)), ctypes.create_string_buffer(4096)
        begun = self.c.sensor_begin(sensor, ctypes.byref(bus))
        said = [] if begun == 0 else [self._text(begun)]
        reading, report, given, is_begun = self.Reading(), self.Report(), [], False
        while chips[0].time < seconds(self.design) * 1e9:
            found = self.c.sensor_poll(sensor, ctypes.byref(reading))
            is_begun = is_begun or found < 0 or not any(reading.status)
            found *= is_begun
            said += [self._text(found)] if found < 0 else []
            if found > 0:
                status = [STATUS[one] for one in reading.status]
                said += [f"{name} {one}" for name, one in zip(self.coils, status, strict=True) if one != GOOD]
                given += [reading.counts[1]] if status[1] in (GOOD, AMPLITUDE) else []
            for chip in chips:
                chip.advance(1_000_000)
        if fault.startswith("glitch"):
            said.append(f"of {len(given)} counts of C2 given out {off(given)} wrong")
        wrong = self.c.sensor_self_test(sensor, ctypes.byref(report))
        said += [self._text(wrong)] if wrong < 0 else self._tested(report)
        return list(dict.fromkeys(said))

    def _text(self, error: int) -> str:
        return self.c.sensor_text(error).decode()

    def _tested(self, report: ctypes.Structure) -> Iterator[str]:
        """Yield the report of the self-test for each coil with a fault."""
        for name, one in zip(self.coils, report.coil, strict=True):
            if one:
                yield f"self-test: {name} {self.c.sensor_coil_text(one).decode()}"


def off(counts: list[int]) -> int:
    """Return the number of counts that differ from the median by more than 1e-3."""
    middle = sorted(counts)[len(counts) // 2]
    return sum(abs(one / middle - 1.0) > 1e-3 for one in counts)


def diagnosed(design: sitscad.Design, fault: str) -> list[str]:
    """Return the items that `read --diagnose` reports as not met."""
    source = Simulation(design, boards(design, fault))
    board = source.board(design)
    try:
        wrong = board.set_up()
        rows = list(read_scans(board, source, seconds(design)))
        found = diagnose_board(board, wrong, [[row[k] for row in rows if k in row] for k in range(len(board.bands))])
    except OSError as error:
        return [f"answer: {error}"]
    return [f"{one.name}: {one.observation}" for one in found if one.verdict == NOT_MET]


def judged(fault: str, said: list[str]) -> str:
    """Return whether the report names the fault and no working coil."""
    if not said:
        return "not seen" if fault else "right"
    name, is_of_one = fault.partition(":")[0].partition("@")[0], fault.count(":") == 1
    is_named = any(word in one for one in said for word in NAMED.get(name, ()))
    is_accused = is_of_one and any(one.removeprefix("self-test: ").startswith(("C1", "C3", "C4")) for one in said)
    return "right" if is_named and not is_accused else "wrong"


def table(design: sitscad.Design) -> Iterator[tuple[str, str, str, str]]:
    """Yield fault, reporter, report and verdict. The board without a fault comes first."""
    on = {name: f"{name}@{BEGINS}" for name in ("nack", "reset")}
    on |= {"swapped": "swapped:C1:C2", "glitch": f"glitch:C2@{EVERY}"}
    with tempfile.TemporaryDirectory() as folder:
        driver = Driver(design, Path(folder))
        for name in ("", *FAULTS):
            fault = on.get(name, f"{name}:C2@{BEGINS}") if name else ""
            for who, said in (("driver", driver.said(fault)), ("diagnose", diagnosed(design, fault))):
                yield fault or "none", who, "; ".join(said) or "no report", judged(fault, said)


if __name__ == "__main__":
    for fault, who, said, right in table(sitscad.Design(sitscad.load(sys.argv[1]))):
        head = f"{fault if who == 'driver' else '':22}{who:9} {right:9} "
        print(textwrap.fill(said, 118, initial_indent=head, subsequent_indent=42 * " "))
