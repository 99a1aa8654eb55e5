"""README's picture of the report, from the study in results/: `python tests/report_picture.py`."""

import base64
from pathlib import Path

from browser import Browser

ROOT = Path(__file__).parents[1]
PAGE, PICTURE = ROOT / "results/report.html", ROOT / "paper/readme/report.png"
VIEW = "#e=E06&t=exact&c=A&n=best&m=M5 M7 M8&w=20 22"  # as in the time traces above it
WIDTH = 1200  # px


def picture(page: Path, view: str, width: int) -> bytes:
    """PNG of the explorer of a page."""
    with Browser() as browser:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.send("Emulation.setDeviceMetricsOverride", **size)
        browser.open(page, view)
        browser.run("new Promise((done) => setTimeout(done, 1000))")
        top, bottom = browser.run(
            "['#explore', '.panels'].map((part) => document.querySelector(part).getBoundingClientRect())"
            ".map(({ top, bottom }, i) => (i ? bottom : top) + scrollY)"
        )
        clip = {"x": 0, "y": top - 12, "width": width, "height": bottom - top + 12, "scale": 1}
        shot = browser.send("Page.captureScreenshot", format="png", clip=clip, captureBeyondViewport=True)
        return base64.b64decode(shot["data"])


if __name__ == "__main__":
    PICTURE.write_bytes(picture(PAGE, VIEW, WIDTH))
