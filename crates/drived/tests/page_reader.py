"""Reads off the page in a headless Chromium what it shows: page_reader.py URL. It says `ready` when the page is live, then answers each
line on its stdin by a line of JSON:

    rows           the rows of the overview: the text of each cell, and whether it is shown as one of now, by the drive's name
    drive NAME     what the page of a drive shows: its large values and its measurements, as they stand beside their names
    unseen NAME    what its file cannot tell of a drive, in English and in French, and the registers of its list of parameters
    alarms         the alarms, as they are shown on a screen and on a phone: title, state, who has done what

It ends with 0 when its stdin does, and nothing was complained of in the console."""

import json
import sys

from playwright.sync_api import expect, sync_playwright

# A guard against waiting for ever, and longer than anything takes on a machine with much else to do; no measure.
PATIENCE_MS = 120_000
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
DESK = {"viewport": {"width": 1440, "height": 900}}

ROWS = """() => Object.fromEntries([...document.querySelectorAll('.rows .row')].map(row => [row.dataset.name, {
    quality: row.dataset.quality, state: row.querySelector('.state b').innerText,
    frequency: row.querySelector('.frequency .number').innerText, current: row.querySelector('.current .number').innerText,
    age: row.querySelector('.age').innerText }]))"""
# What is beside its name, whatever the order; what is not shown is not read.
PAIRS = """() => Object.fromEntries([...document.querySelectorAll('.big > div, .tables dl.pairs')].flatMap(list => {
    const texts = [...list.querySelectorAll('dt')].map(one => [one.textContent, one.nextElementSibling.innerText]);
    return texts; }))"""
# Of each sentence the language that it is marked with, where that is not the page's.
UNSEEN = """() => [...document.querySelectorAll('details.panel:not([hidden])')].map(one => ({ title: one.querySelector('summary').textContent,
    said: [...one.querySelectorAll('li')].map(li => li.textContent), marked: [...one.querySelectorAll('li')].map(li => li.lang) }))"""
REGISTERS = """() => [...document.querySelectorAll('.wide-panel details[open] tbody th')].map(one => one.textContent)"""
ALARMS = """() => [...document.querySelectorAll('.alarms li')].filter(one => one.checkVisibility()).map(one => ({
    title: one.querySelector('h2').innerText, state: one.querySelector('.life').innerText, text: one.innerText,
    isWhole: one.getBoundingClientRect().right <= innerWidth && document.documentElement.scrollWidth <= innerWidth }))"""


def main(url):
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"], timeout=PATIENCE_MS)

        def opened(context, view, locale="en-GB", late=None):
            page = browser.new_context(locale=locale, **context).new_page()
            # The French of the daemon's sentences comes when it is let.
            if late is not None:
                page.route("**/sentences_fr.js*", lambda asked: late.append(asked))
            page.set_default_timeout(PATIENCE_MS)
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("console", lambda message: message.type == "error" and complaints.append(message.text))
            page.goto(url + view)
            expect(page.locator("#connection")).to_have_attribute("data-connection", "live", timeout=PATIENCE_MS)
            return page

        overview, desk, phone = opened(DESK, "#/"), opened(DESK, "#/alarms"), opened(PHONE, "#/alarms")
        print("ready", flush=True)
        for line in sys.stdin:
            match line.strip().split(" ", 1):
                case ["rows"]:
                    said = overview.evaluate(ROWS)
                case ["alarms"]:
                    if not desk.url.endswith("#/alarms"):
                        desk.goto(f"{url}#/alarms")
                        expect(desk.locator("main.view-alarms h1")).to_be_attached(timeout=PATIENCE_MS)
                    said = {"desk": desk.evaluate(ALARMS), "phone": phone.evaluate(ALARMS)}
                case ["unseen", name]:
                    said = {}
                    for locale in ("en-GB", "fr-FR"):
                        late = []
                        page = opened(DESK, f"#/drive/{name}", locale, late)
                        expect(page.locator("details.panel:not([hidden]) li").first).to_be_attached(timeout=PATIENCE_MS)
                        for asked in late:
                            asked.continue_()
                        expect(page.locator("details.panel li[lang]")).to_have_count(0, timeout=PATIENCE_MS)
                        page.locator(".wide-panel details").last.locator("summary").click()
                        expect(page.locator(".wide-panel details[open] tbody th").first).to_be_visible(timeout=PATIENCE_MS)
                        said[locale[:2]] = {"unseen": page.evaluate(UNSEEN), "registers": page.evaluate(REGISTERS)}
                        page.close()
                case ["drive", name]:
                    desk.goto(f"{url}#/drive/{name}")
                    expect(desk.locator("main h1")).to_have_text(name, timeout=PATIENCE_MS)
                    said = desk.evaluate(PAIRS)
            print(json.dumps(said), flush=True)
        browser.close()
    assert not complaints, complaints


main(*sys.argv[1:])
