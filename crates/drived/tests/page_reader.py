"""Reads off the page in a headless Chromium what it shows: page_reader.py URL. It says `ready` when the page is live, then answers each
line on its stdin by a line of JSON:

    rows           the rows of the overview: the text of each cell, and whether it is shown as one of now, by the drive's name
    drive NAME     what the page of a drive shows: its large values and its measurements, as they stand beside their names
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
ALARMS = """() => [...document.querySelectorAll('.alarms li')].filter(one => one.checkVisibility()).map(one => ({
    title: one.querySelector('h2').innerText, state: one.querySelector('.life').innerText, text: one.innerText,
    isWhole: one.getBoundingClientRect().right <= innerWidth && document.documentElement.scrollWidth <= innerWidth }))"""


def main(url):
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"], timeout=PATIENCE_MS)

        def opened(context, view):
            page = browser.new_context(locale="en-GB", **context).new_page()
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
                case ["drive", name]:
                    desk.goto(f"{url}#/drive/{name}")
                    expect(desk.locator("main h1")).to_have_text(name, timeout=PATIENCE_MS)
                    said = desk.evaluate(PAIRS)
            print(json.dumps(said), flush=True)
        browser.close()
    assert not complaints, complaints


main(*sys.argv[1:])
