"""Pages in the system's Chromium, driven by Playwright."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
PATIENCE = 300_000  # ms, on a busy machine


@contextmanager
def chromium_launched() -> Iterator[Any]:
    """Playwright's browser, without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


class Tab:
    """A page of its own, with the complaints of its console and the addresses that it requested."""

    def __init__(self, chromium: Any, width: int = 1280, height: int = 900, **options: Any):
        # Options as of Playwright's `new_context`: is_mobile, color_scheme, bypass_csp ...
        self.context = chromium.new_context(viewport={"width": width, "height": height}, **options)
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.console: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", self._on_console)
        self.page.on("pageerror", lambda error: self.console.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _on_console(self, message: Any) -> None:
        if message.type in ("error", "warning", "assert"):
            self.console.append(message.text)

    def open(self, file: Path, anchor: str = "") -> None:
        """Load a file and wait until it is loaded."""
        self.page.goto(file.as_uri() + anchor)

    def run(self, script: str) -> Any:
        """Return the value of JavaScript; a promise is awaited."""
        return self.page.evaluate(script)

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        # A page's policy may forbid what Playwright's own waiting evaluates.
        deadline = time.monotonic() + PATIENCE / 1000
        while not self.page.evaluate(condition):
            assert time.monotonic() < deadline, condition
            self.page.wait_for_timeout(20)

    def press(self, key: str) -> None:
        """Press and release a key."""
        self.page.keyboard.press(key)
