"""Picture of the live page for the documentation, from results/: `python tests/readme_pictures.py`."""

from pathlib import Path

from browser import Tab, chromium_launched

ROOT = Path(__file__).parents[1]
LIVE, LIVE_PICTURE = ROOT / "results/live.html", ROOT / "paper/readme/live.png"
WIDTH = 1200  # px


if __name__ == "__main__":
    with chromium_launched() as chromium:
        browser = Tab(chromium, width=WIDTH)
        browser.open(LIVE)
        browser.wait("live.steps() > 6000")
        top, bottom = browser.run(
            "['header', 'main'].map((part) => document.querySelector(part).getBoundingClientRect())"
            ".map(({ top, bottom }, i) => (i ? bottom : top) + scrollY)"
        )
        clip = {"x": 0, "y": top - 12, "width": WIDTH, "height": bottom - top + 24}
        LIVE_PICTURE.write_bytes(browser.page.screenshot(clip=clip, full_page=True))
