"""A headless Chromium that opens a file and says what it saw, over the DevTools protocol on a pipe."""

import base64
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe",
)  # fmt: skip
_PATIENCE = 60.0


def find_browser() -> str | None:
    """Path of a Chromium, None where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@dataclass(frozen=True)
class Seen:
    """What a page showed: texts of its console and failed requests, requested addresses, widths, and a screenshot."""

    problems: tuple[str, ...]
    requests: tuple[str, ...]
    page_width: int
    view_width: int
    broken_images: int
    text: str
    screenshot: bytes


class Browser:
    """One process, used as a context manager."""

    def __init__(self, program: str) -> None:
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        theirs_in, ours_out = os.pipe()
        ours_in, theirs_out = os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 20) for end in (theirs_in, theirs_out)]

        def place_pipes() -> None:
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        self._process = subprocess.Popen(
            [program, *_SWITCHES, f"--user-data-dir={self._profile.name}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            close_fds=False, preexec_fn=place_pipes,
        )  # fmt: skip
        for end in (theirs_in, theirs_out, *ends):
            os.close(end)
        self._out, self._in = ours_out, ours_in
        os.set_blocking(self._in, False)
        self._buffer, self._number, self._events = b"", 0, []

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._out)
        os.close(self._in)
        self._profile.cleanup()

    def _read(self, deadline: float) -> dict:
        while b"\0" not in self._buffer:
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise TimeoutError("the browser does not answer")
            try:
                self._buffer += os.read(self._in, 1 << 20)
            except BlockingIOError:
                time.sleep(0.02)
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def call(self, method: str, session: str | None = None, **parameters: object) -> dict:
        """Result of a DevTools command; events that come meanwhile are kept."""
        self._number += 1
        body = {"id": self._number, "method": method, "params": parameters}
        data = json.dumps(body | ({"sessionId": session} if session else {})).encode() + b"\0"
        while data:
            data = data[os.write(self._out, data) :]
        deadline = time.monotonic() + _PATIENCE
        while True:
            answer = self._read(deadline)
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            self._events.append(answer)

    def _wait_for(self, event: str) -> None:
        deadline = time.monotonic() + _PATIENCE
        while not any(e.get("method") == event for e in self._events):
            self._events.append(self._read(deadline))

    def open(self, page: Path, width: int, height: int, print_out: bool = False) -> Seen:
        """Open a file in a view of a width [px] and look at it."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call(
            "Emulation.setDeviceMetricsOverride", session, width=width, height=height, deviceScaleFactor=1,
            mobile=width < 600,
        )  # fmt: skip
        if print_out:
            self.call("Emulation.setEmulatedMedia", session, media="print")
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable", session)
        self._events.clear()
        self.call("Page.navigate", session, url=page.resolve().as_uri())
        self._wait_for("Page.loadEventFired")

        def value(expression: str) -> object:
            found = self.call("Runtime.evaluate", session, expression=expression, returnByValue=True)
            return found["result"]["value"]

        images = value("[...document.images].filter(i => !i.complete || i.naturalWidth == 0).length")
        widths = [value("document.documentElement.scrollWidth"), value("window.innerWidth")]
        text = value("document.body.innerText")
        full = self.call("Page.captureScreenshot", session, captureBeyondViewport=True)["data"]
        self.call("Target.closeTarget", targetId=target)
        problems, requests = _problems(self._events)
        return Seen(problems, requests, *widths, images, text, base64.b64decode(full))


def _problems(events: list[dict]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    problems, requests = [], []
    for event in events:
        method, body = event.get("method"), event.get("params", {})
        if method == "Log.entryAdded" and body["entry"]["level"] in ("warning", "error"):
            problems.append(body["entry"]["text"])
        if method == "Runtime.exceptionThrown":
            problems.append(str(body["exceptionDetails"]))
        if method == "Runtime.consoleAPICalled":
            problems.append(str(body["args"]))
        if method == "Network.loadingFailed":
            problems.append(body["errorText"])
        if method == "Network.requestWillBeSent":
            requests.append(body["request"]["url"])
    return tuple(problems), tuple(requests)
