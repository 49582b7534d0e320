"""The built site, looked at in a real browser: wide and as narrow as a phone, from the disk, without a network.

`make docs` builds the site and then runs this. Without a site or a browser the tests are skipped.
"""

import os
import shutil
from pathlib import Path

import pytest

SITE = Path(os.environ.get("PNEUSMA_SITE", Path(__file__).resolve().parents[2] / "out" / "site"))
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SITE / "index.html").exists(), reason="no site: make docs"),
    pytest.mark.skipif(BROWSER is None, reason="no browser: install chromium"),
]
WIDTHS = {"wide": 1400, "phone": 375}
OVERFLOW = """() => {
    const width = document.documentElement.clientWidth, wide = [];
    const scrolls = e => { for (; e; e = e.parentElement) {
        const s = getComputedStyle(e); if (['auto', 'scroll', 'hidden', 'clip'].includes(s.overflowX)) return true; }
        return false; };
    for (const e of document.querySelectorAll('article *')) {
        const box = e.getBoundingClientRect();
        if (box.width && box.right > width + 1 && !scrolls(e.parentElement)) wide.push(e.tagName + ': ' + e.textContent.slice(0, 60));
    }
    if (document.documentElement.scrollWidth > width + 1) wide.push('page: ' + document.documentElement.scrollWidth);
    return wide.slice(0, 3);
}"""


def pages() -> list[str]:
    """Pages by their place; that of a server's error 404 has addresses from the server's root."""
    found = sorted(str(path.relative_to(SITE)) for path in SITE.rglob("*.html")) if SITE.exists() else []
    return [name for name in found if name != "404.html"]


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield opened
        opened.close()


def test_there_are_pages_of_every_part():
    found = pages()
    for name in (
        "index.html",
        "commands.html",
        "files.html",
        "comparison.html",
        "api/pneusma_jax.actuator.html",
    ):
        assert name in found
    notebooks = Path(__file__).resolve().parents[2] / "notebooks"
    assert sum(name.startswith("tutorials/") for name in found) == len(list(notebooks.glob("*.ipynb")))


@pytest.mark.parametrize("width", WIDTHS)
def test_no_page_says_an_error_overflows_or_asks_another_host(browser, width):
    page = browser.new_page(viewport={"width": WIDTHS[width], "height": 800})
    said: list[str] = []
    page.on(
        "console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None
    )
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: said.append(request.url) if request.url.startswith("http") else None)
    wrong = {}
    for name in pages():
        said.clear()
        page.goto((SITE / name).as_uri())
        wide = page.evaluate(OVERFLOW)
        if said or wide:
            wrong[name] = [*said[:3], *wide]
    page.close()
    assert not wrong, "\n".join(f"{name}: {what}" for name, what in wrong.items())


def test_the_search_works_from_the_disk(browser):
    page = browser.new_page(viewport={"width": WIDTHS["wide"], "height": 800})
    page.goto((SITE / "index.html").as_uri())
    page.keyboard.press("s")  # opens the search, as a slash does
    page.keyboard.type("mullins")
    page.wait_for_selector(".md-search-result__link", timeout=15_000)
    assert "ullins" in page.inner_text(".md-search-result__list")
    page.close()


@pytest.mark.parametrize(("name", "least"), [("corrections", 5), ("model", 100)])
def test_formulas_are_drawn_without_a_script(browser, name, least):
    page = browser.new_page(viewport={"width": WIDTHS["wide"], "height": 800})
    page.goto((SITE / f"{name}.html").as_uri())
    assert page.locator("math").count() > least
    assert "\\(" not in page.inner_text("article")
    page.close()
