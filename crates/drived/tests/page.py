"""Looks at the page in a headless Chromium: page.py SCENE URL. Ends with 0 when the scene is as it should be.

Waits for what is to be seen, never for a time. What a scene wants to happen to the drives it prints, a line each, as
`drived sim` takes it. A scene ends with the console looked at: no error, no request to anywhere else.
"""

import re
import socket
import sys
import time
from urllib.parse import urlsplit

from playwright.sync_api import expect, sync_playwright

PATIENCE_MS = 30_000
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
DESK = {"viewport": {"width": 1440, "height": 900}}


def happen(order):
    print(order, flush=True)


def loads(page, url):
    page.goto(url)
    expect(page.locator(".rows .row")).to_have_count(10)
    expect(page.locator("#connection")).to_have_attribute("data-connection", "live")
    expect(page.locator(".rows .row[data-quality=good]").first).to_be_visible()
    assert page.title() == "drived"
    page.locator(".rows .row a").first.click()
    expect(page.locator(".uplot")).to_have_count(2)
    page.locator("nav a").nth(1).click()
    page.locator("main a").first.click()
    expect(page.locator("td.spread .p50").first).to_be_attached()
    exchanges = page.locator(".last tbody tr")
    expect(exchanges).to_have_count(100)
    # A read of holding registers, and its answer by the same slave.
    slave = int(exchanges.first.locator("td").nth(1).inner_text().split()[0])
    expect(exchanges.first.locator("td").nth(2)).to_have_text(re.compile(f"^{slave:02X} (03|04) "))
    page.get_by_role("button", name="Hold").click()
    expect(page.get_by_role("button", name="Go on")).to_be_visible()


def trip(page, url):
    page.goto(url)
    rows = page.locator(".rows .row")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(3)
    happen("atv312@2 trip OLF")
    expect(rows.first).to_contain_text("pump 2")
    expect(rows.first).to_contain_text("OLF motor overload")
    expect(rows.first).to_have_attribute("data-trouble", "severe")
    expect(page.locator("#alarms")).to_contain_text("pump 2")
    rows.first.locator("a").click()
    fault = page.locator(".fault")
    expect(fault.locator(".meaning")).to_have_text("motor overload")
    expect(fault).to_contain_text("check the load and ItH")
    expect(fault).to_contain_text("Before the trip")
    expect(page.locator(".why")).to_contain_text("A start would be refused now")
    expect(page.get_by_role("button", name="Start forward")).to_be_disabled()
    page.locator("nav a").last.click()
    expect(page.locator("table.events tr.in-trouble").first).to_contain_text("pump 2")


def stop_all(page, url):
    page.goto(url)
    expect(page.locator(".rows .row")).to_have_count(10)
    page.keyboard.press("Control+Shift+S")
    account = page.locator("#stop-account")
    # It is said before the daemon has answered.
    expect(account).to_be_visible()
    expect(account.locator("[data-count=pending]")).to_have_text("0")
    counts = [int(count) for count in account.locator("[data-count]").all_text_contents()]
    assert sum(counts) == 10, counts
    page.locator("nav a").last.click()
    commands = page.locator("table.events tbody tr", has_text="anonymous")
    expect(commands).to_have_count(1)
    # Who opens the page afterwards is told of it too.
    page.reload()
    expect(commands).to_have_count(1)
    expect(page.locator("#alarms")).to_be_empty()


def phone(page, url):
    for view in ["", "#/lines", "#/events", "drive", "line"]:
        if view == "drive":
            page.goto(url)
            page.locator(".rows .row a").first.click()
            expect(page.locator(".uplot")).to_have_count(2)
        elif view == "line":
            page.goto(f"{url}#/lines")
            page.locator("main a").first.click()
            expect(page.locator("td.spread .p50").first).to_be_attached()
        else:
            page.goto(url + view)
            expect(page.locator("main h1")).to_be_attached()
        widths = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
        assert widths[0] <= widths[1], (view, widths)
        stop = page.locator("#stop").bounding_box()
        assert stop["y"] + stop["height"] <= 844 and stop["width"] > 300, (view, stop)


def french(page, url):
    page.goto(url)
    expect(page.locator("#stop")).to_contain_text("ARRÊT GÉNÉRAL")
    expect(page.locator("html")).to_have_attribute("lang", "fr")
    expect(page.locator(".row.head")).to_contain_text("Fréquence")
    expect(page.locator(".rows")).to_contain_text("Hz sur ")
    page.locator("#language").click()
    expect(page.locator("#stop")).to_contain_text("STOP ALL")
    expect(page.locator(".row.head")).to_contain_text("Frequency")


def cable(page, url):
    page.goto(url)
    rows = page.locator(".rows .row")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(3)
    page.locator("nav a").nth(1).click()
    page.locator("main a").first.click()
    happen("line cut")
    expect(page.locator(".last tbody tr").first).to_contain_text("no answer")
    expect(page.locator("table").first).to_contain_text(re.compile("off-line, only probed: [0-9]+ probes, the next in "))
    page.locator("nav a").first.click()
    expect(page.locator(".rows .row[data-quality=stale]")).to_have_count(3)
    expect(rows.first.locator(".age")).to_contain_text("old")
    style = rows.first.locator(".number").first.evaluate("element => getComputedStyle(element).fontStyle")
    assert style == "italic", style
    expect(page.locator(".tile")).to_contain_text("0 of 3 drives")
    happen("line join")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(3)


def away(page, url):
    page.goto(url)
    expect(page.locator(".rows .row[data-quality=good]").first).to_be_visible()
    page.route("**/api/**", lambda route: route.abort())
    page.locator("#stop").click()
    expect(page.locator("#stop-account")).to_contain_text("STOP NOT SENT")
    page.unroute("**/api/**")
    expect(page.locator("#stop-account")).not_to_contain_text("STOP NOT SENT")
    expect(page.locator("#stop-account [data-count=pending]")).to_have_text("0")


def many(page, url):
    page.goto(url)
    expect(page.locator(".rows .row")).to_have_count(200)
    page.get_by_role("searchbox").fill("drive 137")
    expect(page.locator(".rows .row")).to_have_count(1)


SCENES = {
    "loads": (loads, DESK), "trip": (trip, DESK), "stop_all": (stop_all, DESK), "phone": (phone, PHONE),
    "french": (french, PHONE | {"locale": "fr-FR"}), "cable": (cable, DESK), "away": (away, DESK), "many": (many, DESK),
}


def wait_for(url):
    """Waits until somebody listens: the program has just been started."""
    address = urlsplit(url)
    end = time.monotonic() + PATIENCE_MS / 1000
    while True:
        try:
            return socket.create_connection((address.hostname, address.port)).close()
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.02)


def main(name, url):
    scene, context = SCENES[name]
    wait_for(url)
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_context(**({"locale": "en-GB"} | context)).new_page()
        page.set_default_timeout(PATIENCE_MS)
        expect.set_options(timeout=PATIENCE_MS)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: message.type == "error" and complaints.append(message.text))
        page.on("request", lambda request: request.url.startswith((url, "blob:")) or complaints.append(request.url))
        scene(page, url)
        browser.close()
    # A request that a scene cuts off by itself is told in the console.
    wrong = [one for one in complaints if name != "away" or "ERR_FAILED" not in one]
    assert not wrong, wrong


main(*sys.argv[1:])
