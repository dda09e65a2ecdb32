"""A headless Chromium that tests drive over its debugging pipe: pages opened from a disk, scripts run in them."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

PROGRAM = shutil.which("chromium")

ARGUMENTS = ("--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--no-first-run", "--disable-extensions",
             "--disable-dev-shm-usage", "--remote-debugging-pipe")


class Browser:
    """One tab. Messages are JSON, each ended by a zero byte: to the program's descriptor 3, from its descriptor 4."""

    def __init__(self, *arguments: str) -> None:
        assert PROGRAM is not None
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)  # its children may still write
        commands, self.out = os.pipe()
        self.into, answers = os.pipe()

        def given() -> None:  # both ends first go out of each other's way
            high = os.dup(commands), os.dup(answers)
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        line = [PROGRAM, *ARGUMENTS, f"--user-data-dir={self.folder.name}", *arguments, "about:blank"]
        self.process = subprocess.Popen(line, pass_fds=(3, 4, commands, answers), preexec_fn=given,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(commands)
        os.close(answers)
        self.number, self.rest, self.session = 0, b"", ""
        self.events: list[dict[str, Any]] = []
        (target,) = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self.out)
        os.close(self.into)
        self.folder.cleanup()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """A command of the debugging protocol and what it gives; events that come meanwhile are kept."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                assert "error" not in answer, (method, answer["error"])
                return dict(answer["result"])

    def receive(self) -> dict[str, Any]:
        """The next message."""
        while b"\0" not in self.rest:
            more = os.read(self.into, 1 << 16)
            assert more, "the browser has gone"
            self.rest += more
        item, _, self.rest = self.rest.partition(b"\0")
        message: dict[str, Any] = json.loads(item)
        if "method" in message:
            self.events.append(message)
        return message

    def open(self, address: str | Path, ready: str = "document.documentElement.dataset.sitscadReady") -> None:
        """Go to a page and wait until it says that all is ready."""
        self.events.clear()
        self.call("Page.navigate", url=address.as_uri() if isinstance(address, Path) else address)
        while not any(event["method"] == "Page.loadEventFired" for event in self.events):
            self.receive()
        self.run(f"new Promise(done => {{ (function look() {{ {ready} ? done(1) : setTimeout(look, 20); }})(); }})")

    def run(self, script: str) -> Any:
        """The value of an expression in the page; a promise is waited for. Exceptions of the page are raised."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def size(self, width: int, height: int) -> None:
        """Show the page in a window of so many pixels."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def press(self, key: str) -> None:
        """A key pressed and let go."""
        codes = {"Tab": 9, "Enter": 13, "ArrowLeft": 37, "ArrowRight": 39, "ArrowUp": 38, "Space": 32}
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=codes.get(key, 0))

    def picture(self, path: Path) -> None:
        """A picture of the window."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    @property
    def exceptions(self) -> list[str]:
        """What scripts threw since the page was opened."""
        return [str(event["params"]) for event in self.events if event["method"] == "Runtime.exceptionThrown"]

    @property
    def requests(self) -> list[str]:
        """What the page asked for since it was opened."""
        return [str(event["params"]["request"]["url"]) for event in self.events
                if event["method"] == "Network.requestWillBeSent"]
