"""Looks at a report in a headless Chromium, and prints it: report.py SCENE FILE. Ends with 0 when it is as it should be.

Whatever the scene: the document is read by the browser's parser as it was written, asks for nothing, has no script, says
nothing in the console, is no wider than a sheet of A4, and prints in the colours of paper.
"""

import re
import sys

from playwright.sync_api import sync_playwright

# A sheet of A4 between its margins, at the 96 dots per inch of CSS.
SHEET = {"width": round((210 - 26) / 25.4 * 96), "height": 1000}


def line(page):
    assert page.title() == "Hall <3>", page.title()
    chapters = page.locator("section.drive")
    assert chapters.count() == 31, chapters.count()
    attention = page.locator("main section").first.inner_text()
    assert re.search(r"does not answer: [^\n]* – atv312@7", attention), attention
    assert re.search(r"tripped: 9 OCF[^\n]* – atv312@5", attention), attention
    tripped = page.locator("section.drive", has=page.get_by_role("heading", name="atv312@5", exact=True))
    # BBV51701: what ATV312HU15N4 says of itself.
    assert "ATV312HU15N4" in tripped.inner_text()
    assert page.locator("section.line svg").count() >= 31 + 31
    # A sheet for each drive, and a few before and after.
    assert 31 + 4 <= pages(page) <= 31 + 15, pages(page)


def daemon(page):
    assert page.locator("section.drive").count() == 1
    table = page.locator("table.parameters").first
    assert table.locator("thead th").all_inner_texts() == ["parameter", "name", "value", "factory"]
    # The simulator sets it up for the bus: LAC = L3 (BBV51701 p. 35: L1 from the factory).
    row = table.locator("tbody tr", has_text="LAC").locator("td").all_inner_texts()
    assert (row[0], row[2], row[3]) == ("LAC", "L3", "L1"), row
    assert pages(page) >= 3


def pages(page):
    printed = page.pdf(prefer_css_page_size=True)
    return len(re.findall(rb"/Type\s*/Page\b", printed))


def main(scene, file):
    asked, said = [], []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport=SHEET, java_script_enabled=True)
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda message: said.append(message.text))
        page.goto(f"file://{file}")
        assert asked == [f"file://{file}"], asked
        assert said == [], said
        assert page.evaluate("document.compatMode") == "CSS1Compat"
        assert page.locator("script, iframe, link, img, object").count() == 0
        # What the parser had to mend would stand elsewhere than it was written.
        written = open(file, encoding="utf-8").read()
        for tag in ["table", "tr", "td", "section", "svg", "h3"]:
            assert page.locator(tag).count() == len(re.findall(rf"<{tag}[ >]", written)), tag
        page.emulate_media(media="print", color_scheme="dark")
        assert page.evaluate("document.documentElement.scrollWidth") <= SHEET["width"]
        assert page.evaluate("getComputedStyle(document.documentElement).backgroundColor") == "rgb(255, 255, 255)"
        assert page.evaluate("getComputedStyle(document.querySelector('thead')).display") == "table-header-group"
        globals()[scene](page)
        browser.close()


main(*sys.argv[1:])
