"""Checks of pages: structure, contrast, accessibility, requests."""

from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path

import pytest
from browser import CHROMIUM

in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: `apt-get install chromium`")

# Two frames drawn: the page has reacted to a change.
FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
CONTRAST = """
(() => {
  const channels = (text) => text.match(/[\\d.]+/g).map(Number);
  const luminance = ([r, g, b]) => [r, g, b].map((c) => c / 255)
    .map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const background = (node) => {
    if (!node) return [255, 255, 255];
    const [r, g, b, alpha = 1] = channels(getComputedStyle(node).backgroundColor);
    if (alpha === 1) return [r, g, b];
    const below = background(node.parentElement);
    return [r, g, b].map((c, i) => alpha * c + (1 - alpha) * below[i]);
  };
  let worst = {ratio: 99}, texts = 0;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || !node.checkVisibility() || node.closest("svg, script")) continue;
    const [a, b] = [luminance(channels(getComputedStyle(node).color)), luminance(background(node))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    texts += 1;
    if (ratio < worst.ratio) worst = {ratio, text: walker.currentNode.data.trim().slice(0, 60)};
  }
  return {...worst, texts};
})()
"""

# Elements that scroll sideways and cannot be focused, and the right edge of the captions.
UNREACHED = """[...document.querySelectorAll('*')].filter((e) => e.scrollWidth > e.clientWidth + 1
  && e.tabIndex < 0 && getComputedStyle(e).overflowX === 'auto').length"""
RIGHT_EDGE = """Math.max(...[...document.querySelectorAll('caption span, figcaption')]
  .map((e) => e.getBoundingClientRect().right))"""


def assert_quiet(browser, file) -> None:
    """Check that a page requested nothing but itself and that its console is empty."""
    requested = [url.split("#")[0] for url in browser.requests if not url.startswith("data:")]
    assert requested == [file.as_uri()]
    assert browser.console == []


def assert_readable(browser, least: int) -> None:
    """Check the contrast of at least so many texts."""
    worst = browser.run(CONTRAST)
    assert worst["texts"] > least
    assert worst["ratio"] >= 4.5, worst


def assert_accessible(visit, file, before: str = "0") -> None:
    """Check a page without its frames with axe at two widths, after a script."""
    package = find_spec("axe_core_python")
    if package is None or package.origin is None:
        pytest.skip("axe-core-python is not installed")
    axe = Path(package.origin).with_name("axe.min.js").read_text(encoding="utf-8")
    for width in (400, 1280):
        browser = visit(file, width=width, is_mobile=width < 500, bypass_csp=True)
        browser.run(f"{before};{axe};0")
        options = "{rules: {'color-contrast': {enabled: false}}, iframes: false}"
        broken = browser.run(f"axe.run({options}).then((r) => r.violations)")
        violations = [(rule["id"], [node["html"][:200] for node in rule["nodes"]]) for rule in broken]
        assert not violations, violations
        assert browser.run("document.documentElement.scrollWidth") == width


def assert_fit_for_a_phone(visit, text: str, file: Path, scheme: str, least: int, width: int = 420) -> None:
    """Check contrast, width and requests of a page in a colour scheme; the keyboard scrolls wider tables."""
    file.write_text(text, encoding="utf-8")
    phone = {"width": width, "height": 740, "device_scale_factor": 2, "is_mobile": True}
    browser = visit(file, color_scheme=scheme, **phone)
    assert_readable(browser, least)
    assert browser.run("[innerWidth, document.documentElement.scrollWidth]") == [width, width]
    dark = browser.run("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
    assert dark == (scheme == "dark")
    assert browser.run(UNREACHED) == 0
    assert browser.run(RIGHT_EDGE) <= width
    assert_quiet(browser, file)
    assert_accessible(visit, file)


def stands_alone(page: str) -> "Structure":
    """Check that a page loads nothing and has no identifier twice; return its structure."""
    structure = Structure(page)
    assert [target for target in structure.loads if not target.startswith("data:")] == []
    assert "url(" not in page and "@import" not in page
    assert len(set(structure.ids)) == len(structure.ids)
    return structure


class Structure(HTMLParser):
    """Identifiers, links and addresses to load of a page."""

    def __init__(self, text: str):
        super().__init__()
        self.ids, self.links, self.loads = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if "id" in attributes:
            self.ids.append(attributes["id"])
        if tag == "a":
            self.links.append(attributes["href"])
        self.loads += [attributes[name] for name in ("src", "srcset", "data", "poster") if name in attributes]
        if tag in ("link", "use"):
            self.loads.append(attributes.get("href", ""))
