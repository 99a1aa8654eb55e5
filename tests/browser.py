"""Chromium without a window, spoken to over a pair of pipes (DevTools protocol); needs no other package."""

import json
import os
import select
import shutil
import subprocess
import tempfile
from collections import deque
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

PATIENCE = 300  # s, on a busy machine


class Browser:
    """One page in a headless Chromium; keeps what the console and the network report.

    Use as a context manager.
    """

    def __init__(self, width: int = 1280, height: int = 900):
        assert CHROMIUM
        self.profile = tempfile.mkdtemp(prefix="chromium-")
        to_browser, self.writing = os.pipe()
        self.reading, from_browser = os.pipe()

        def wire() -> None:  # Chromium reads commands from 3 and answers on 4
            one, two = os.dup(to_browser), os.dup(from_browser)
            os.dup2(one, 3)
            os.dup2(two, 4)

        profile = f"--user-data-dir={self.profile}"
        command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        command += ["--hide-scrollbars", f"--window-size={width},{height}", profile, "about:blank"]
        streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(command, close_fds=False, preexec_fn=wire, **streams)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer, self.events, self.number, self.session = b"", deque(), 0, None
        self.console: list[str] = []
        self.requests: list[str] = []
        pages = self.send("Target.getTargets")["targetInfos"]
        target = next(page["targetId"] for page in pages if page["type"] == "page")
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(timeout=20)
        os.close(self.writing)
        os.close(self.reading)
        shutil.rmtree(self.profile, ignore_errors=True)

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self.buffer:
            ready, _, _ = select.select([self.reading], [], [], PATIENCE)
            part = os.read(self.reading, 1 << 16) if ready else b""
            if not part:
                raise RuntimeError("Chromium went away" if ready else f"Chromium silent for {PATIENCE} s")
            self.buffer += part
        message, self.buffer = self.buffer.split(b"\0", 1)
        event = json.loads(message)
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.console.append(str(parameters["args"]))
        elif method == "Runtime.exceptionThrown":
            self.console.append(str(parameters["exceptionDetails"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.console.append(parameters["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        return event

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its answer."""
        self.number += 1
        command = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            command["sessionId"] = self.session
        os.write(self.writing, json.dumps(command).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer.get("method"))

    def open(self, file: Path, anchor: str = "") -> None:
        """Load a file and wait until it is there; where it is already, only go to the anchor."""
        self._go(file.as_uri() + anchor)

    def leave(self) -> None:
        """Leave the page: it draws no more."""
        self._go("about:blank")

    def _go(self, url: str) -> None:
        self.events.clear()
        loads = "loaderId" in self.send("Page.navigate", url=url)
        while loads and "Page.loadEventFired" not in self.events:
            self.events.append(self._receive().get("method"))

    def run(self, script: str) -> Any:
        """Return the value of a JavaScript expression."""
        result = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(str(result["exceptionDetails"]))
        return result["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        look = f"(function look() {{({condition}) ? resolve(true) : setTimeout(look, 20)}})()"
        late = f"new Promise(end => setTimeout(end, {PATIENCE * 500}))"
        waited = f"Promise.race([new Promise(resolve => {look}), {late}])"
        assert self.run(waited), f"never came true: {condition}"

    def press(self, key: str, code: int, text: str = "") -> None:
        """Press and release a key."""
        common = {"key": key, "code": key, "windowsVirtualKeyCode": code}
        self.send("Input.dispatchKeyEvent", type="keyDown", **common, **({"text": text} if text else {}))
        self.send("Input.dispatchKeyEvent", type="keyUp", **common)
