"""The documentation as built into site/, in a browser."""

import pytest
from browser import Tab
from page_checks import assert_accessible, assert_readable, in_chromium

from tests.checkout import ROOT

DOCS, SITE = ROOT / "docs", ROOT / "site"
PAGES = sorted(DOCS.glob("*.md"))
# Pages of the site without a source of their own in docs.
GENERATED = ("search", "genindex", "py-modindex")

no_site = pytest.mark.skipif(not (SITE / "index.html").exists(), reason="no site/: `make docs` builds it")
in_site = [no_site, in_chromium, pytest.mark.xdist_group("chromium")]


@pytest.fixture
def browser(chromium):
    """A telephone: Chromium's own window is never narrower than 500 pixels."""
    telephone = Tab(chromium, width=390, height=800, is_mobile=True)
    yield telephone
    telephone.context.close()


class TestSite:
    pytestmark = in_site

    @pytest.mark.slow
    def test_pages_need_no_network_fit_a_narrow_screen_and_have_contrast(self, browser):
        pages = sorted(SITE.rglob("*.html"))
        assert len(pages) > len(PAGES)
        for page in pages:
            browser.open(page)
            assert " object at 0x" not in page.read_text(encoding="utf-8"), page.name
            width = browser.run("document.documentElement.scrollWidth")
            assert width <= 390, f"{page.name}: {width} px wide"
            for scheme in ("light", "dark"):
                browser.page.emulate_media(color_scheme=scheme)
                assert_readable(browser, least=10)
        assert [url for url in browser.requests if not url.startswith(("file:", "data:", "blob:"))] == []
        assert browser.console == []

    def test_formulas_are_drawn(self, browser):
        browser.open(SITE / "theory.html")
        assert browser.run("document.querySelectorAll('.formula .eqno').length") == 17
        heights = "[...document.querySelectorAll('math')].map(m => m.getBoundingClientRect().height)"
        assert min(browser.run(heights)) > 5

    def test_search_finds_pages(self, browser):
        browser.open(SITE / "search.html", "?q=polytropic")
        script = """new Promise(done => {
            const found = () => [...document.querySelectorAll('#search-results li a')].map((a) => a.href);
            const look = () => found().length ? done(found()) : setTimeout(look, 50);
            look(); setTimeout(() => done([]), 30000); })"""
        result = browser.run(script)
        assert result

    @pytest.mark.slow
    @pytest.mark.parametrize("page", [*(page.stem for page in PAGES), *GENERATED])
    def test_pages_are_accessible(self, page, chromium):
        tabs = []

        def visit(file, **options):
            tabs.append(Tab(chromium, **options))
            tabs[-1].open(file)
            return tabs[-1]

        assert_accessible(visit, SITE / f"{page}.html")
        for tab in tabs:
            tab.context.close()
