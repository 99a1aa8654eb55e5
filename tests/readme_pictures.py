"""Pictures of two pages for the documentation, made from results/: `python tests/readme_pictures.py`."""

from pathlib import Path

from browser import Tab, chromium_launched

ROOT = Path(__file__).parents[1]
REPORT, REPORT_PICTURE = ROOT / "results/report.html", ROOT / "paper/readme/report.png"
VIEW = ""  # as it opens
LIVE, LIVE_PICTURE = ROOT / "results/live.html", ROOT / "paper/readme/live.png"
WIDTH = 1200  # px


def picture(page: Path, view: str, ready: str, first: str, last: str) -> bytes:
    """PNG of a page, once it is ready, from its first to its last element named."""
    with chromium_launched() as chromium:
        browser = Tab(chromium, width=WIDTH)
        browser.open(page, view)
        browser.wait(ready)
        top, bottom = browser.run(
            f"['{first}', '{last}'].map((part) => document.querySelector(part).getBoundingClientRect())"
            ".map(({ top, bottom }, i) => (i ? bottom : top) + scrollY)"
        )
        clip = {"x": 0, "y": top - 12, "width": WIDTH, "height": bottom - top + 24}
        return browser.page.screenshot(clip=clip, full_page=True)


if __name__ == "__main__":
    REPORT_PICTURE.write_bytes(picture(REPORT, VIEW, "plots.error", "#explore", ".panels"))
    LIVE_PICTURE.write_bytes(picture(LIVE, "", "live.steps() > 6000", "header", "main"))
