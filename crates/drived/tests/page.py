"""Looks at the page in a headless Chromium: page.py SCENE URL [TOKEN …]. Ends with 0 when the scene is as it should be.

Waits for what is to be seen, never for a time. What a scene wants to happen to the drives it prints, a line each, as
`drived sim` takes it. A scene ends with the console looked at: no error, no request to anywhere else.
"""

import base64
import hashlib
import json
import re
import socket
import subprocess
import sys
import time
from urllib.parse import urlsplit

from playwright.sync_api import expect, sync_playwright

# A guard against waiting for ever, and longer than anything takes on a machine with much else to do; no measure.
PATIENCE_MS = 120_000
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
DESK = {"viewport": {"width": 1440, "height": 900}}


def happen(order):
    print(order, flush=True)


def loads(page, url):
    page.goto(url)
    expect(page.locator(".rows .row")).to_have_count(10)
    expect(page.locator("#connection")).to_have_attribute("data-connection", "live")
    expect(page.locator(".rows .row[data-quality=good]").first).to_be_visible()
    # With a number before it where alarms wait: the demonstration has some.
    assert re.fullmatch(r"(\([0-9]+\) )?drived", page.title()), page.title()
    page.locator(".rows .row a").first.click()
    expect(page.locator(".uplot")).to_have_count(2)
    page.locator("nav a", has_text="Lines").click()
    page.locator("main a").first.click()
    expect(page.locator("td.spread .p50").first).to_be_attached()
    exchanges = page.locator(".last tbody tr")
    expect(exchanges).to_have_count(100)
    page.get_by_role("button", name="Hold").click()
    expect(page.get_by_role("button", name="Go on")).to_be_visible()
    # Every row is a request of its slave, and what is held does not move.
    held = exchanges.all_inner_texts()
    for text in held:
        _, slave, request, *_ = text.split("\t")
        assert request.startswith(f"{int(slave.split()[0]):02X} "), text
    page.wait_for_timeout(1500)
    assert exchanges.all_inner_texts() == held


def trip(page, url, token):
    page.goto(url)
    log_in(page, token)
    rows = page.locator(".rows .row")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(3)
    happen("atv312@2 trip OLF")
    expect(rows.first).to_contain_text("pump 2")
    expect(rows.first).to_contain_text("OLF: motor overload")
    expect(rows.first).to_have_attribute("data-trouble", "severe")
    expect(page.locator("#alarms")).to_contain_text("pump 2")
    rows.first.locator("a").click()
    fault = page.locator(".fault")
    expect(fault.locator(".meaning")).to_have_text("motor overload")
    expect(fault).to_contain_text("check the load and ItH")
    expect(fault).to_contain_text("Before the trip")
    expect(page.locator(".why")).to_contain_text("A start would be refused now")
    expect(page.get_by_role("button", name="Start forward")).to_be_disabled()
    # What was measured before the trip is not how the motor is now, and is read seldom.
    frequency, speed = (page.locator(".big > div", has=page.get_by_text(name, exact=True)) for name in ["Frequency", "Speed"])
    expect(frequency).to_have_attribute("data-quality", "good")
    expect(speed).to_have_attribute("data-quality", "stale")
    expect(speed.locator(".since")).to_contain_text("old")
    page.locator("nav a").last.click()
    tripped = page.locator("table.events tr.in-trouble", has_text="pump 2").first
    expect(tripped).to_be_visible()
    # Who opens the page afterwards reads of it, and is not alarmed once more.
    page.reload()
    expect(tripped).to_be_visible()
    expect(page.locator("#alarms")).to_be_empty()


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


def phone(page, url):
    for view in ["", "#/alarms", "#/lines", "#/events", "#/?view=tiles", "drive", "line"]:
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
            expect(page.locator(f"main.view-{view[2:].split('?')[0] or 'overview'} h1")).to_be_attached()
        widths = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
        assert widths[0] <= widths[1], (view, widths)
        stop = page.locator("#stop").bounding_box()
        assert stop["y"] + stop["height"] <= 844 and stop["width"] > 300, (view, stop)
        # Nothing of the head is cut off, in the longer language and on a smaller phone neither.
        for width in [360, 390]:
            page.set_viewport_size({"width": width, "height": 844})
            ends = page.evaluate("[...document.querySelectorAll('.bar a, .bar button')].map(one => one.getBoundingClientRect()).filter(one => one.width).map(one => one.right)")
            assert max(ends) <= width, (view, width, ends)


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
    page.locator("nav a", has_text="Lines").click()
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
    account = page.locator("#stop-account")
    expect(account).to_contain_text("NOT KNOWN WHETHER THE STOP ARRIVED")
    expect(account).to_contain_text("Use the emergency stop. It is sent again, attempt")
    page.unroute("**/api/**")
    all_are_accounted_for(page)


def hung(page, url):
    """What swallows a request is given two seconds, then it is said and tried again."""
    page.goto(url)
    live(page)
    swallowed = []
    page.route("**/api/v1/stop*", lambda route: swallowed.append(route))
    page.locator("#stop").click()
    expect(page.locator("#stop-account")).to_contain_text("no answer from the daemon for")
    expect(page.locator("#stop-account")).to_contain_text("Use the emergency stop")
    page.unroute("**/api/v1/stop*")
    all_are_accounted_for(page)
    # It is one stop, however often it was sent.
    ids = {one.request.post_data_json["id"] for one in swallowed}
    assert len(ids) == 1, ids


def proxy(page, url):
    """What a proxy answers in the daemon's place is nobody's word about the motors."""
    page.goto(url)
    live(page)
    in_between = lambda route: route.fulfill(status=502, content_type="text/html", body="<html>Bad Gateway</html>")
    page.route("**/api/v1/stop*", in_between)
    page.locator("#stop").click()
    expect(page.locator("#stop-account")).to_contain_text("what stands between here and the daemon answered 502")
    page.unroute("**/api/v1/stop*")
    all_are_accounted_for(page)
    page.locator("#stop-account button").click()
    expect(page.locator("#stop-account")).to_be_hidden()

    # A start that the daemon took, of whose answer a proxy told nothing: it is found by its id.
    def carried(route):
        route.fetch()
        in_between(route)

    page.locator(".rows .row:not([data-trouble])", has_not_text="only read").first.locator("a").click()
    page.route("**/start?*", carried)
    page.get_by_role("button", name="Start forward").click()
    page.locator("dialog button.primary").click()
    expect(page.locator(".latest li").first).to_contain_text("confirmed at")
    # One that the daemon never saw is not known, and neither done nor refused.
    page.unroute("**/start?*")
    page.route("**/setpoint?*", in_between)
    page.locator(".setpoint input[type=text]").fill("20")
    page.locator(".setpoint button").click()
    expect(page.locator(".latest li").first).to_contain_text("not known: the daemon has no record of it")


def typed(page, url):
    """A setpoint is given as it was written, by the point or the comma of any language, and what is no number is not given."""
    page.goto(url)
    page.locator(".rows .row:not([data-trouble])", has_not_text="only read").first.locator("a").click()
    field, give = page.locator(".setpoint .pair input"), page.locator(".setpoint button")
    for text, hertz in [("0.5", 0.5), ("2,5", 2.5), ("37.5", 37.5), ("12,25", 12.25), (" 20 ", 20)]:
        field.press("Control+a")
        field.press_sequentially(text, delay=20)
        expect(field).to_have_value(text)
        with page.expect_request("**/setpoint?*") as sent:
            field.press("Enter")
        assert sent.value.post_data_json["setpoint"] == {"frequency_hz": hertz}, (text, sent.value.post_data)
    for text in ["2,5 Hz", "1.2.3", "-5", "1e1", "37.", "99.9", "x", ""]:
        field.fill(text)
        expect(give).to_be_disabled()
    field.fill("2;5")
    expect(page.locator(".setpoint .hint")).to_contain_text("A number is wanted here")
    # The slider and the field tell the same.
    page.locator(".setpoint input[type=range]").fill("31.5")
    expect(field).to_have_value("31.5")
    assert field.evaluate("field => field.checkValidity()"), "what was written before is forgotten"
    field.fill("8,5")
    expect(page.locator(".setpoint input[type=range]")).to_have_value("8.5")


def bare(page, url):
    """The document alone stops the motors, whatever else of the page comes late or never."""
    for file in ["app.js", "page.css", "api/v1/state"]:
        page.route(f"**/{file}", lambda route: None)
    page.goto(url, wait_until="commit")
    page.locator("#stop").click()
    all_are_accounted_for(page)


def tabs(page, url):
    """Six pages of one browser hold all connections that it has to one place; each can stop all the same."""
    pages = [page, *(page.context.new_page() for _ in range(5))]
    for one in pages:
        one.goto(url)
        live(one)
    for one in pages:
        one.locator("#stop").click()
        all_are_accounted_for(one)
        # It follows the events again afterwards.
        expect(one.locator("#connection")).to_have_attribute("data-connection", "live")


def questions(page, url, token):
    """No question stands before the stop, and none by which a motor may start stands after it."""
    page.goto(url)
    live(page)
    dialog, account, said = page.locator("dialog"), page.locator("#stop-account"), page.locator("#outcomes")
    page.locator("#login").click()
    stop_over_the_question(page)
    account.locator("button").click()
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    log_in(page, token)
    page.locator(".rows .row a").first.click()
    start = page.get_by_role("button", name="Start forward")
    start.click()
    stop_over_the_question(page)
    expect(dialog).to_have_count(0)
    expect(said).to_contain_text("Start forward: question closed, all drives are to stop.")
    account.locator("button").click()
    assert not page.evaluate("document.querySelector('main').inert")
    # A stop that comes by another door, of another drive and of this one.
    start.click()
    expect(dialog).to_be_visible()
    stop = lambda name: page.request.post(f"{url}api/v1/drives/{name}/stop?wait=2s", data={})
    name = page.locator("main h1").inner_text()
    assert stop(next(one for one in ["pump 1", "pump 2"] if one != name)).ok
    assert stop(name).ok
    expect(said).to_contain_text("Start forward: question closed, a stop came meanwhile.")
    expect(dialog).to_have_count(0)
    expect(said.locator("p", has_text="question closed, a stop came")).to_have_count(1)
    # One that is asked behind it is asked.
    start.click()
    expect(dialog).to_be_visible()
    assert stop(next(one for one in ["pump 1", "pump 2"] if one != name)).ok
    page.locator("dialog button.primary").click()
    expect(page.locator(".latest li").first).to_contain_text("confirmed at")


def stop_over_the_question(page):
    expect(page.locator("dialog")).to_be_visible()
    # What is behind the question cannot be reached, and the stop can.
    assert page.evaluate("document.querySelector('main').inert")
    page.locator("#stop").click()
    all_are_accounted_for(page)


def log_in(page, token):
    page.locator("#login").click()
    page.locator("dialog input").fill(token)
    page.locator("dialog button.primary").click()
    # It closes by itself when it has said that nothing was sent.
    expect(page.locator("dialog")).to_have_count(0)
    expect(page.locator("#connection")).to_have_attribute("data-connection", "live")
    assert page.evaluate("fetch('api/v1/state').then(answer => answer.json()).then(state => state.daemon.caller)") != "anonymous"


def scoped(page, url, token, token_of_one):
    """What somebody may not do is not offered to him, and a stop is everybody's who may stop."""
    orders = page.locator(".orders")
    start, stop = orders.get_by_role("button", name="Start forward"), orders.get_by_role("button", name="Stop", exact=True)
    group = page.get_by_label("Group")

    def drive(name):
        page.goto(f"{url}#/drive/{name}")
        expect(page.locator("main h1")).to_have_text(name)

    # To look and to stop is everybody's here.
    page.goto(url)
    live(page)
    group.select_option(index=1)
    expect(page.get_by_role("button", name="Stop group")).to_be_visible()
    expect(page.get_by_role("button", name="Start group")).to_be_hidden()
    drive("pump 1")
    expect(stop).to_be_visible()
    expect(start).to_be_hidden()
    expect(orders.locator(".setpoint")).to_be_hidden()
    expect(orders).to_contain_text("To command this drive, log in with a token that is for it.")
    # A token of all drives brings all buttons, and one of another drive those of that one.
    log_in(page, token)
    expect(start).to_be_visible()
    # The group is in the address of the overview.
    page.locator("nav a").first.click()
    expect(page.get_by_role("button", name="Start group")).to_be_visible()
    page.locator("#login").click()
    expect(page.locator("#login")).to_have_text("Log in")
    log_in(page, token_of_one)
    expect(page.get_by_role("button", name="Start group")).to_be_hidden()
    drive("pump 1")
    expect(stop).to_be_visible()
    expect(start).to_be_hidden()
    drive("pump 2")
    expect(start).to_be_enabled()
    page.locator("#stop").click()
    all_are_accounted_for(page)


def unread(page, url):
    """While the account of a stop cannot be read the page follows no events, and nothing on it is called live."""
    page.goto(url)
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(3)
    # So that something may become of the stop for as long as it takes.
    happen("atv312@2 cable cut")
    expect(page.locator(".rows .row[data-quality=stale]")).to_have_count(1)
    held = []
    page.route("**/api/v1/commands/*", lambda route: held.append(route))
    page.locator("#stop").click()
    account = page.locator("#stop-account")
    expect(account).to_contain_text("Its account cannot be read now: look at the drives.")
    connection = page.locator("#connection")
    expect(connection).to_have_attribute("data-connection", "resting")
    expect(page.locator(".rows .row[data-quality=stale]")).to_have_count(3)
    for row in range(3):
        expect(page.locator(".rows .row .age").nth(row)).to_contain_text("old")
    # It is followed again as soon as the account can be read, though the stop of one drive is open still.
    page.unroute("**/api/v1/commands/*")
    expect(connection).to_have_attribute("data-connection", "live")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(2)
    expect(account).not_to_contain_text("Its account cannot be read now")
    expect(account.locator("[data-count=confirmed]")).to_have_text("2")
    happen("atv312@2 cable join")
    all_are_accounted_for(page)


def restarted(page, url):
    """A daemon that was started anew knows nothing of a stop: that is said, and not that it is done."""
    page.goto(url)
    live(page)
    happen("line cut")
    gone = {"type": "about:blank", "title": "Not Found", "status": 404, "detail": "there is no such command any more"}
    page.route("**/api/v1/commands/*", lambda route: route.fulfill(status=404, content_type="application/problem+json", body=json.dumps(gone)))
    page.locator("#stop").click()
    account = page.locator("#stop-account")
    expect(account).to_contain_text("The daemon has no account of it any more, it may have been restarted: look at the drives.")
    expect(account).to_contain_text("Use the emergency stop.")
    expect(page.locator("#connection")).to_have_attribute("data-connection", "live")


def encrypted(page, url):
    """By TLS, with the one certificate that the browser is told of."""
    page.goto(url)
    live(page)
    assert page.evaluate("isSecureContext && location.protocol") == "https:"
    page.locator("#stop").click()
    all_are_accounted_for(page)


def long_group(page, url):
    page.goto(url)
    live(page)
    page.get_by_label("Group").select_option(index=1)
    expect(page.get_by_role("button", name="Stop group")).to_be_visible()
    widths = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert widths[0] <= widths[1], widths
    stop = page.locator("#stop").bounding_box()
    assert stop["y"] + stop["height"] <= 844 and stop["x"] + stop["width"] <= 390, stop
    # Of three pumps one is only read: nothing is sent to it, and it is told by its name.
    page.locator("#stop").click()
    account = page.locator("#stop-account")
    expect(account.locator("[data-count=confirmed]")).to_have_text("2")
    expect(account.locator("[data-count=pending]")).to_have_text("0")
    expect(account.locator("[data-count=refused]")).to_have_text("1")
    expect(account.locator(".head")).to_have_text(re.compile(r"^Taken by the daemon at [0-9:]+\s\S+ for 2 drives$"))
    expect(account.locator(".left")).to_have_text("only read, not stopped: pump 3")


def dead(page, url):
    """A stop of drives that do not answer is told of each as what it is, in the account and in every row."""
    page.goto(url)
    live(page)
    undriven = page.locator("[data-filter=undriven_drives]")
    expect(undriven).to_have_text("Not driven 3")
    happen("line cut")
    page.locator("#stop").click()
    account = page.locator("#stop-account")
    expect(account).to_contain_text("STOP NOT CONFIRMED by 3 drives: their motors may turn")
    expect(account).to_contain_text("Use the emergency stop.")
    expect(account.locator("[data-count=not_reachable]")).to_have_text("3")
    expect(account).to_contain_text("not reachable: pump 1, pump 2, pump 3")
    rows = page.locator(".rows .row")
    for row in range(3):
        expect(rows.nth(row)).to_contain_text("STOP NOT CONFIRMED, the motor may turn")
    # Nor is a drive told undriven of which nobody knows.
    expect(undriven).to_have_text("Not driven 0")
    happen("line join")
    all_are_accounted_for(page)
    expect(undriven).to_have_text("Not driven 3")


def clocks(page, url):
    """The trend is the daemon's record by the daemon's clock, whatever the browser's says and however long it was away."""
    page.add_init_script("const now = Date.now; Date.now = () => now() + 180_000;")
    page.goto(url)
    live(page)
    page.goto(f"{url}#/drive/pump 1")
    expect(page.locator(".uplot")).to_have_count(2)
    page.locator(".trend summary").click()
    row = page.locator(".trend details tbody tr").first
    expect(row).to_be_visible()
    hour, minute, second = (int(part) for part in row.locator("td").first.inner_text().split("\xa0")[0].split(":"))
    told = hour * 3600 + minute * 60 + second
    true = time.localtime()
    off = (true.tm_hour * 3600 + true.tm_min * 60 + true.tm_sec - told) % 86_400
    assert off < 90, f"the newest sample is {off} s old"
    # What was recorded while nobody read is read afterwards: no gap, and nothing made up.
    page.route("**/history*", lambda route: route.abort())
    begins = page.request.get(f"{url}api/v1/drives/pump%201/history").json()["time_unix_ms"][-1]
    while page.request.get(f"{url}api/v1/drives/pump%201/history?since_unix_ms={begins}").json()["time_unix_ms"][10:] == []:
        time.sleep(0.2)
    with page.expect_response("**/history?since*") as answer:
        page.unroute("**/history*")
    recorded = answer.value.json()
    assert recorded["time_unix_ms"][0] <= begins + 1_000, (begins, recorded)
    assert len(recorded["time_unix_ms"]) > 10, len(recorded["time_unix_ms"])
    # The setpoint is the one that the drive follows, also where this daemon has given it none: another master of the line has
    # written LFR, 40.0 Hz, and the three steps of CMD.
    for word in ["0x2136 0190h", "0x2135 0006h", "0x2135 0007h", "0x2135 000Fh"]:
        happen(f"atv312@1 master {word}")
    big = lambda name: page.locator(".big > div", has=page.get_by_text(name, exact=True)).locator(".number")
    expect(big("Frequency")).to_contain_text("40.0 Hz")
    expect(big("Setpoint")).to_have_text("40.0 Hz")
    expect(page.locator(".setpoint input[type=range]")).to_have_value("40")
    page.locator("nav a").first.click()
    expect(page.locator(".rows .row", has_text="pump 1")).to_contain_text("of 40.0 Hz")


def axe(page, url, token):
    """The rules of axe-core for people who do not see, hear or point as others do: none is broken in any view."""
    from axe_playwright_python.sync_playwright import Axe

    page.goto(url)
    live(page)
    drive = page.locator(".rows .row a").first.get_attribute("href")
    page.goto(f"{url}#/lines")
    line = page.locator("main a").first.get_attribute("href")
    views = {"overview": "#/", "alarms": "#/alarms", "lines": "#/lines", "events": "#/events", "drive": drive, "line": line,
             "setup": "#/setup", "past": "#/past", "at": "#/at/2026-11-21T03:12"}
    # One alarm that waits, so that there is something to be seen.
    happen("atv312@2 trip OLF")
    expect(page.locator("nav a .count")).to_have_text("1")
    for name, view in views.items():
        page.goto(url + view)
        expect(page.locator(f"main.view-{name} h1")).to_be_attached()
        judged(Axe(), page, name)
    log_in(page, token)
    page.goto(f"{url}#/?view=tiles")
    expect(page.locator(".card").first).to_be_visible()
    judged(Axe(), page, "tiles")
    page.goto(f"{url}#/")
    page.locator(".rows .row .select input").first.check()
    judged(Axe(), page, "a selection")
    page.goto(f"{url}#/alarms")
    page.locator("[data-act=acknowledge]").click()
    expect(page.locator("dialog")).to_be_visible()
    judged(Axe(), page, "a note")
    page.keyboard.press("Escape")
    page.goto(url + drive)
    page.locator(".orders > .pair button").first.click()
    expect(page.locator("dialog")).to_be_visible()
    judged(Axe(), page, "a question")
    page.locator("#stop").click()
    all_are_accounted_for(page)
    judged(Axe(), page, "the account of a stop that closed a question")
    # As it is when nothing comes, and when a stop cannot be told.
    page.route("**/api/v1/stop*", lambda route: None)
    page.locator("#stop").click()
    expect(page.locator("#connection")).to_have_attribute("data-connection", "resting")
    expect(page.locator("#stop-account.alarm")).to_be_visible()
    judged(Axe(), page, "a stop that did not arrive")
    page.unroute("**/api/v1/stop*")
    all_are_accounted_for(page)
    page.locator("#login").click()
    expect(page.locator("#login")).to_have_text(re.compile("Log in|S’identifier"))
    page.locator("#login").click()
    expect(page.locator("dialog")).to_be_visible()
    judged(Axe(), page, "the login")


def judged(axe, page, name):
    broken = axe.run(page).response["violations"]
    assert not broken, [(name, rule["id"], rule["help"], rule["nodes"][0]["html"]) for rule in broken]


def live(page):
    expect(page.locator("#connection")).to_have_attribute("data-connection", "live")
    expect(page.locator(".rows .row[data-quality=good]").first).to_be_visible()


def all_are_accounted_for(page):
    done = re.compile("drives have confirmed the stop|variateurs ont confirmé l’arrêt")
    expect(page.locator("#stop-account")).to_contain_text(done)
    expect(page.locator("#stop-account [data-count=pending]")).to_have_text("0")


def many(page, url):
    page.goto(url)
    expect(page.locator(".rows .row")).to_have_count(200)
    search = page.get_by_role("searchbox")
    search.fill("drive 137")
    expect(page.locator(".rows .row")).to_have_count(1)
    # In any order; a number is a whole one, and a letter a whole word where it is one: line l3 has drives 76 to 100.
    search.fill("137 drive")
    expect(page.locator(".rows .row")).to_have_count(1)
    search.fill("l 3 drive 80")
    expect(page.locator(".rows .row")).to_have_count(1)
    # It stands in the address, and is there after a reload.
    assert "search=l+3+drive+80" in page.url, page.url
    page.reload()
    expect(page.locator(".rows .row")).to_have_count(1)
    expect(search).to_have_value("l 3 drive 80")
    search.fill("")
    expect(page.locator(".rows .row")).to_have_count(200)
    # By any value, both ways, in the address too.
    page.locator(".row.head .drive button").click()
    expect(page.locator(".row.head .drive")).to_have_attribute("aria-sort", "ascending")
    expect(page.locator(".rows .row a").first).to_have_text("drive 1")
    page.locator(".row.head .drive button").click()
    expect(page.locator(".rows .row a").first).to_have_text("drive 200")
    assert page.url.endswith("#/?sort=-drive"), page.url
    # Back leads to the same place of it, with the row that was opened.
    row = page.locator(".rows .row", has=page.get_by_role("link", name="drive 61", exact=True))
    row.scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    above = row.bounding_box()["y"]
    row.locator("a").click()
    expect(page.locator("main h1")).to_have_text("drive 61")
    page.go_back()
    expect(page.locator(".rows .row a").first).to_have_text("drive 200")
    until(page, "document.activeElement.textContent === 'drive 61'")
    assert abs(row.bounding_box()["y"] - above) < 3, (row.bounding_box(), above)
    # A lone % is no blank page, and the skip link leaves no drive.
    page.goto(f"{url}#/drive/50%")
    expect(page.locator("main")).to_contain_text("There is no drive of that name.")
    page.goto(f"{url}#/drive/drive 61")
    expect(page.locator("main h1")).to_have_text("drive 61")
    page.locator(".skip").focus()
    page.keyboard.press("Enter")
    expect(page.locator("main")).to_be_focused()
    expect(page.locator("main h1")).to_have_text("drive 61")


def folded(page, url, token):
    """A cable is one row with its cause, and what it has left at all drives is put right by three clicks, told of each by its name."""
    page.goto(url)
    log_in(page, token)
    rows, fold = page.locator(".rows .row"), page.locator(".fold")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(6)
    happen("line cut")
    expect(fold).to_have_count(1)
    expect(fold).to_contain_text("6 drives of line north")
    expect(fold).to_contain_text(re.compile("line north: (no drive of the line answers|the port of the line is away)"))
    expect(fold).to_contain_text("6 × does not answer")
    expect(rows).to_have_count(0)
    fold.get_by_role("button", name="Show them").click()
    expect(rows).to_have_count(6)
    fold.get_by_role("button", name="Fold them").click()
    page.locator("nav a", has_text="Alarms").click()
    expect(page.locator(".alarms li")).to_have_count(1)
    expect(page.locator(".alarms li summary")).to_have_text("6 drives follow from it")
    page.locator("nav a", has_text="Drives").click()
    happen("line join")
    expect(page.locator(".rows .row[data-quality=good]")).to_have_count(6)
    # Before a drive that has come back is known to be the same, a reset of it is refused.
    while not all(drive["identity"]["check"] == "same" for drive in page.request.get(f"{url}api/v1/drives").json()):
        time.sleep(0.2)
    for drive in range(1, 7):
        happen(f"atv312@{drive} trip SLF")
    expect(fold).to_contain_text("6 × tripped: 5 SLF")
    clicks = [fold.locator("input"), page.locator(".selection [data-order=reset]"), page.locator("dialog button.primary")]
    for click in clicks:
        click.click()
    several = page.locator(".several")
    expect(several.locator("dl")).to_contain_text("confirmed: 6")
    expect(several.locator("dd")).to_have_text(", ".join(f"pump {number}" for number in range(1, 7)))
    expect(fold).to_have_count(0)
    # They stay chosen: a start and a stop of the same, and a setpoint within what all of them may be given.
    selection = page.locator(".selection")
    selection.get_by_role("button", name="Setpoint of 6…").click()
    page.locator("dialog input").fill("30")
    page.locator("dialog button.primary").click()
    expect(several.locator("dl")).to_contain_text("confirmed: 6")
    # A question of another setpoint would be withdrawn when it comes to show.
    expect(page.locator(".rows .row", has_text="of 30.0 Hz")).to_have_count(6)
    selection.get_by_role("button", name="Start 6").click()
    page.locator("dialog button.primary").click()
    expect(page.locator(".rows .row[data-state=running]")).to_have_count(6)
    selection.get_by_role("button", name="Stop 6").click()
    expect(page.locator(".rows .row[data-state=running]")).to_have_count(0)
    expect(several.locator("dl")).to_contain_text("confirmed: 6")


def alarms(page, url, token):
    """An alarm has its life on the page: it calls, is acknowledged with a note, shelved and taken back, and says who did it."""
    page.goto(f"{url}#/alarms")
    expect(page.get_by_text("No alarm.")).to_be_visible()
    expect(page.locator("link[rel=icon]")).to_have_attribute("href", "icon.svg")
    happen("atv312@2 trip OLF")
    expect(page).to_have_title("(1) Alarms – drived")
    expect(page.locator("link[rel=icon]")).to_have_attribute("href", "icon_alarm.svg")
    one = page.locator(".alarms li")
    expect(one).to_have_attribute("data-life", "unacknowledged")
    expect(one.locator("h2")).to_have_text("pump 2: tripped: 17 OLF: motor overload")
    # Since when: no time before now, whatever the clocks say.
    expect(one).not_to_contain_text("-")
    # Who may only look is offered nothing.
    expect(one.locator("button")).to_have_count(0)
    log_in(page, token)
    one.get_by_role("button", name="Shelve").click()
    page.locator("dialog button.primary").click()
    # Whoever shelves says why.
    expect(page.locator("dialog")).to_be_visible()
    page.locator("dialog textarea").fill("the fitter is on his way")
    page.locator("dialog select").select_option("60")
    page.locator("dialog button.primary").click()
    expect(one).to_have_attribute("data-life", "shelved")
    expect(one).to_contain_text("shelved by operator until")
    expect(one).to_contain_text("the fitter is on his way")
    expect(page).to_have_title("Alarms – drived")
    one.get_by_role("button", name="Take back").click()
    expect(one).to_have_attribute("data-life", "unacknowledged")
    one.get_by_role("button", name="Acknowledge").click()
    page.locator("dialog textarea").fill("belt slips")
    page.locator("dialog button.primary").click()
    expect(one).to_have_attribute("data-life", "acknowledged")
    page.reload()
    expect(one).to_contain_text("acknowledged by operator")
    expect(one).to_contain_text("belt slips")
    expect(page).to_have_title("Alarms – drived")
    page.locator("[data-filter=alarms_waiting]").click()
    expect(one).to_have_count(0)
    assert page.url.endswith("#/alarms?filter=alarms_waiting"), page.url
    # It is over when it is so no more, because somebody has taken note of it.
    page.locator("[data-filter=all]").click()
    answer = page.evaluate("fetch('api/v1/drives/pump%202/reset?wait=10s', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: '{}'}).then(answer => answer.status)")
    assert answer == 200, answer
    expect(one).to_have_count(0)


def somebody(page, url, token, other):
    """What somebody else has set is said when it comes, and who set it stands beside the value."""
    page.goto(url)
    log_in(page, token)
    live(page)
    page.goto(f"{url}#/drive/pump 2")
    expect(page.locator("main h1")).to_have_text("pump 2")
    expect(page.locator(".freshness")).to_have_text("live")
    give = page.request.post(f"{url}api/v1/drives/pump%202/setpoint?wait=5s", headers={"Authorization": f"Bearer {other}"}, data={"setpoint": {"frequency_hz": 27.5}})
    assert give.ok, give.text()
    expect(page.locator("#outcomes")).to_contain_text("pump 2: second set 27.5 Hz")
    given = page.locator(".big > div", has=page.get_by_text("Setpoint", exact=True))
    expect(given).to_contain_text("27.5 Hz")
    expect(given).to_contain_text(re.compile(r"by second, [0-9:]+\sUTC"))
    page.locator("nav a").first.click()
    expect(page.locator(".rows .row", has_text="pump 2")).to_contain_text("of 27.5 Hz · second")


def as_shown(page, url, token, chief, config):
    """A question is withdrawn when it is not as it was shown any more, and what it has shown is what is done, or nothing."""
    page.goto(url)
    log_in(page, token)
    live(page)
    dialog, said, latest = page.locator("dialog"), page.locator("#outcomes"), page.locator(".latest li")
    start = page.get_by_role("button", name="Start forward")
    group = page.get_by_label("Group", exact=True)

    def ask(path, body, by=token):
        answer = page.request.post(f"{url}api/v1/{path}", headers={"Authorization": f"Bearer {by}"}, data=body)
        assert answer.ok, answer.text()

    def give(hertz, name="pump 1"):
        ask(f"drives/{name}/setpoint?wait=5s", {"setpoint": {"frequency_hz": hertz}})

    def all_stand():
        drives = page.request.get(f"{url}api/v1/drives").json()
        assert len(drives) == 3 and not any(one["started_here"] or one["status"]["output_frequency_hz"] for one in drives), drives

    give(20)
    page.goto(f"{url}#/drive/pump 1")
    setpoint = page.locator(".big > div", has=page.get_by_text("Setpoint", exact=True))
    expect(setpoint).to_contain_text("20.0 Hz")
    start.click()
    expect(dialog).to_contain_text("pump 1: start forward at 20.0 Hz?")
    give(45)
    expect(said).to_contain_text("Start forward: question closed: the setpoint of pump 1 is 45.0 Hz now.")
    expect(dialog).to_have_count(0)

    # Who is about to start it did not see that another one has.
    start.click()
    expect(dialog).to_contain_text("at 45.0 Hz?")
    ask("drives/pump 1/start?wait=5s", {"direction": "reverse"})
    expect(said).to_contain_text("Start forward: question closed: pump 1 is driven in reverse now.")
    expect(dialog).to_have_count(0)
    ask("drives/pump 1/stop?wait=5s", {})
    expect(page.locator(".drive-head .state b")).to_have_text("Ready")

    # What the browser cannot know yet is judged where the drive is commanded.
    def meanwhile(route):
        give(30)
        route.continue_()

    page.route("**/api/v1/drives/*/start*", meanwhile, times=1)
    start.click()
    expect(dialog).to_contain_text("at 45.0 Hz?")
    dialog.locator("button.primary").click()
    expect(latest.first).to_contain_text("it is not as it was shown: the setpoint of pump 1 is 30.00 Hz now")
    all_stand()

    # The names of two drives are exchanged.
    expect(setpoint).to_contain_text("30.0 Hz")
    start.click()
    expect(dialog).to_contain_text("at 30.0 Hz?")
    with open(config, encoding="utf-8") as file:
        text = file.read()
    head, several = text.split("[[drives]]")
    own = lambda slave, name: "[[drives]]" + several.replace("atv312@1-3", f"atv312@{slave}").replace("pump {}", f"pump {name}").split("[groups]")[0]
    with open(config, "w", encoding="utf-8") as file:
        file.write(head + own(1, 2) + own(2, 1) + own(3, 3) + "[groups]" + several.split("[groups]")[1])
    ask("reload", {}, chief)
    expect(said).to_contain_text("Start forward: question closed: the drive that was called pump 1 is called pump 2 now.")
    expect(dialog).to_have_count(0)
    expect(said).to_contain_text("pump 1 is the name of another drive now")

    # A start by the question that stands is one, at what it has said.
    expect(page.locator(".freshness")).to_have_text("live")
    give(25)
    expect(setpoint).to_contain_text("25.0 Hz")
    start.click()
    expect(dialog).to_contain_text("at 25.0 Hz?")
    dialog.locator("button.primary").click()
    expect(latest.first).to_contain_text("confirmed at")
    page.locator(".orders").get_by_role("button", name="Stop", exact=True).click()
    expect(latest.first).to_contain_text("confirmed at")
    expect(page.locator(".drive-head .state b")).to_have_text("Ready")

    # Those of a group are named with the setpoints at which they start.
    page.goto(url)
    live(page)
    for name in ["pump 2", "pump 3"]:
        give(20, name)
    group.select_option(index=1)
    expect(page.locator(".rows .row", has_text="pump 3")).to_contain_text("of 20.0 Hz")
    page.get_by_role("button", name="Start group").click()
    expect(dialog).to_contain_text("pump 3 (20.0 Hz)")
    give(21, "pump 3")
    expect(said).to_contain_text("Start group: question closed: the setpoint of pump 3 is 21.0 Hz now.")
    expect(dialog).to_have_count(0)
    all_stand()


def zones(page, url):
    """Every time is the daemon's, in its zone and with it, whatever zone the browser is in."""
    page.goto(f"{url}#/events")
    zone = page.evaluate("fetch('api/v1/state').then(answer => answer.json()).then(state => state.daemon.zone)")
    first = page.locator("table.events tbody td").first
    expect(first).to_contain_text("UTC")
    told = first.inner_text()
    now = page.evaluate("zone => new Intl.DateTimeFormat('en-GB', {timeZone: zone, hour: '2-digit', hourCycle: 'h23'}).format(new Date())", zone)
    there = page.evaluate("new Intl.DateTimeFormat('en-GB', {hour: '2-digit', hourCycle: 'h23'}).format(new Date())")
    assert there != now, "the browser is meant to be elsewhere"
    assert told.startswith(f"{now}:") or told.split(":")[1] in ("59", "00"), (told, now)


def touched(page, url, token):
    """Every view is whole in both languages on a phone, a tablet and a desk, and what is touched is as high as a thumb."""
    page.goto(url)
    log_in(page, token)
    happen("atv312@2 trip OLF")
    expect(page.locator("nav a .count")).to_have_text("1")
    for _ in ["en", "fr"]:
        for width in [1440, 1024, 390]:
            page.set_viewport_size({"width": width, "height": 844})
            for view in ["#/", "#/?view=tiles", "#/alarms", "#/lines", "#/events", "#/drive/pump 2", "#/line/north", "#/setup", "#/past", "#/at/2026-11-21T03:12"]:
                page.goto(url + view)
                expect(page.locator("main h1")).to_be_attached()
                # The view is there when something of it is.
                until(page, "document.querySelector('main').childElementCount > 1")
                widths = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
                assert widths[0] <= widths[1], (view, width, widths)
                low = page.evaluate("""[...document.querySelectorAll('button, select, nav a, input:not([type=checkbox], [type=range])')]
                    .filter(one => one.checkVisibility() && one.getBoundingClientRect().height)
                    .map(one => [one.textContent || one.tagName, one.getBoundingClientRect().height]).filter(([, height]) => height < 43.9)""")
                assert not low, (view, width, low)
                ends = page.evaluate("[...document.querySelectorAll('.bar a, .bar button')].map(one => one.getBoundingClientRect()).filter(one => one.width).map(one => one.right)")
                stop = page.locator("#stop").bounding_box()
                assert max(ends) <= (width if width < 700 else stop["x"]), (view, width, ends, stop)
        page.locator("#language").click()


def pairs(page, url):
    """Served with drives that are troubled twice, each with its worst trouble in the words of the fleet."""
    page.goto(url + "pairs.json")
    told = page.evaluate("""async () => {
        // The document's own script says the language before any module.
        document.documentElement.lang = 'en';
        const [{ trouble }, { stateWord }] = [await import('/trouble.js'), await import('/words.js')];
        const pairs = await (await fetch('/pairs.json')).json();
        return pairs.map(({ drive, worst, rank, shows }) => {
            const told = trouble(drive);
            return [[told.text, told.rank, stateWord(drive).toLowerCase()], [worst, rank, shows]];
        });
    }""")
    assert len(told) > 180, len(told)
    for page_says, fleet_says in told:
        assert page_says == fleet_says, (page_says, fleet_says)
    # In French no such word is left; names, codes, numbers and the manuals' mnemonics are the same in both.
    french = page.evaluate("""async () => {
        const [{ switchLanguage }, { trouble }, { knowLanguage }] = [await import('/texts.js'), await import('/trouble.js'), await import('/told.js')];
        switchLanguage();
        await knowLanguage();
        const pairs = await (await fetch('/pairs.json')).json();
        return pairs.map(({ drive }) => trouble(drive).text);
    }""")
    left = re.compile(r"\b(of|instead|sent|stop|panel|terminals|times|current|ramp|repeated|today)\b")
    assert not [text for text in french if left.search(text)], sorted({text for text in french if left.search(text)})


def until(page, true):
    """Waits until this becomes true, which may be a promise. What Playwright would ask again by itself the page's own policy forbids."""
    end = time.monotonic() + PATIENCE_MS / 1000
    while not page.evaluate(true):
        assert time.monotonic() < end, true
        page.wait_for_timeout(200)


def several(page, url, token):
    """Whom a command for several means is named before it is sent; it expires, and a stop that nobody has heard is sent again under its one id."""
    page.goto(url)
    log_in(page, token)
    live(page)
    sent = []
    page.on("request", lambda request: request.method == "POST" and sent.append((urlsplit(request.url).path, json.loads(request.post_data or "{}"))))
    page.get_by_label("Select all that are shown").check()
    page.locator(".selection").get_by_role("button", name="Start 3").click()
    dialog = page.locator("dialog")
    expect(dialog).to_contain_text(re.compile(r"These are: pump 1 \([0-9.]+\sHz\), pump 2 \([0-9.]+\sHz\), pump 3 \([0-9.]+\sHz\)\."))
    # A no is no command.
    dialog.get_by_role("button", name="Cancel").click()
    assert not sent, sent
    page.get_by_label("Select pump 2").uncheck()
    page.locator(".selection").get_by_role("button", name="Start 2").click()
    expect(dialog).to_contain_text(re.compile(r"These are: pump 1 \([0-9.]+\sHz\), pump 3 \([0-9.]+\sHz\)\."))
    dialog.locator("button.primary").click()
    expect(page.locator(".several")).to_contain_text("pump 1, pump 3")
    path, body = sent[-1]
    assert path.endswith("/selected/start") and body["drives"] == ["pump 1", "pump 3"] and 0 < body["expires_in_ms"] <= 10_000, sent
    for name in ["pump 1", "pump 3"]:
        expect(page.locator(f".rows .row[data-name='{name}']")).to_have_attribute("data-state", "running")
    # A group's start is one for those who were named, and expires too.
    page.get_by_label("Group", exact=True).select_option(index=1)
    page.get_by_role("button", name="Start group").click()
    expect(dialog).to_contain_text("Start the 3 drives of the group")
    dialog.locator("button.primary").click()
    expect(page.locator(".rows .row[data-name='pump 2']")).to_have_attribute("data-state", "running")
    path, body = next((path, body) for path, body in reversed(sent) if path.endswith("/start"))
    assert "/groups/" in path and 0 < body["expires_in_ms"] <= 10_000, (path, body)
    # Two of its stops are swallowed on the way.
    stops = []

    def swallow(route):
        stops.append(json.loads(route.request.post_data))
        return route.abort() if len(stops) < 3 else route.continue_()

    page.route("**/api/v1/groups/*/stop*", swallow)
    page.get_by_role("button", name="Stop group").click()
    expect(page.locator("#outcomes")).to_contain_text("The stop is sent again, attempt 3")
    for name in ["pump 1", "pump 2", "pump 3"]:
        expect(page.locator(f".rows .row[data-name='{name}']")).to_have_attribute("data-state", "ready")
    expect(page.locator("#outcomes")).to_contain_text("confirmed")
    assert len(stops) == 3 and len({one["id"] for one in stops}) == 1, stops


class Hand:
    """Who uses the page: by clicks, or by the keyboard alone. What he does is counted."""

    def __init__(self, page, keys):
        self.page, self.keys, self.done, self.began = page, keys, 0, time.monotonic()

    def press(self, one):
        expect(one).to_be_enabled()
        self.done += 1
        if not self.keys:
            return one.click()
        self.reach(one)
        kind = one.evaluate("one => one.type")
        self.page.keyboard.press("Space" if kind in ("checkbox", "radio") else "Enter")

    def write(self, one, text):
        self.done += 1
        if not self.keys:
            return one.fill(text)
        self.reach(one)
        self.page.keyboard.press("ControlOrMeta+a")
        self.page.keyboard.type(text)

    def reach(self, one):
        """Goes there by Tab, however far it is; a radio button that is not chosen by an arrow from the chosen one."""
        for _ in range(200):
            if one.evaluate("one => one === document.activeElement"):
                return
            group = one.evaluate("one => one.type === 'radio' && document.activeElement?.name === one.name")
            self.page.keyboard.press("ArrowDown" if group else "Tab")
        raise AssertionError(f"no key reaches {one}")


def first_hour(page, url, link, port, keys=False):
    """From a daemon without a drive to a motor that turns, and nothing is started, or written, before it is asked for."""
    from axe_playwright_python.sync_playwright import Axe

    hand = Hand(page, keys)
    page.goto(url)
    expect(page.locator(".nothing")).to_contain_text("No drive is configured yet")
    judged(Axe(), page, "without drives")
    # Whoever is not known may look, and is told how he becomes known.
    hand.press(page.locator(".nothing a"))
    expect(page.locator("main")).to_contain_text("drived token link NAME --role engineer")
    expect(page.get_by_role("button", name="Scan", exact=True)).to_be_hidden()
    page.goto(link)
    expect(page.locator("#connection")).to_contain_text("anna")
    assert link.rsplit("/", 1)[1] not in page.url, page.url
    form = page.locator("section.setup form").first
    if keys:
        hand.reach(form.locator("input[type=radio]").last)
        page.keyboard.press("Space")
    else:
        hand.press(form.locator("input[type=radio]").last)
    hand.write(form.locator("input[type=text]"), port)
    judged(Axe(), page, "which port")
    hand.press(page.get_by_role("button", name="Scan", exact=True))
    expect(page.locator("progress")).to_be_visible()
    judged(Axe(), page, "a scan")
    expect(page.locator("main")).to_contain_text("every address was asked. Found: 3")
    finds = page.locator(".finds .find")
    expect(finds).to_have_count(3)
    expect(finds.first).to_contain_text("by its own words")
    # Whom no register tells is told by his nameplate.
    stranger = finds.nth(1)
    expect(stranger).to_contain_text("see its nameplate")
    expect(stranger.locator("input[type=checkbox]")).not_to_be_checked()
    hand.done += 1
    if keys:
        hand.reach(stranger.locator("select"))
        page.keyboard.type("wj200")
    else:
        stranger.locator("select").select_option("wj200")
    expect(stranger.locator("select")).to_have_value("wj200")
    expect(stranger.locator("input[type=checkbox]")).to_be_checked()
    # Whose registers look like those of one family is taken for it, and that is said.
    expect(finds.nth(2)).to_contain_text("a guess by its registers")
    expect(finds.nth(2).locator("select")).to_have_value("goodrive")
    judged(Axe(), page, "who answers")
    for at, name in enumerate(["pump", "fan", "blower"]):
        hand.write(finds.nth(at).locator("input[type=text]"), name)
    hand.press(page.get_by_role("button", name="Watch these drives"))
    added = page.locator(".added .find")
    expect(added).to_have_count(3)
    pump = page.locator(".added .find[data-name=pump]")
    expect(pump).to_have_attribute("data-quality", "good")
    expect(pump).to_contain_text("Read only")
    # What is only read takes no command, whoever asks.
    refused = page.evaluate("""fetch('api/v1/drives/pump/start', { method: 'POST', headers: { 'Content-Type': 'application/json' },
        body: '{"direction": "forward"}' }).then(answer => answer.json())""")
    assert refused.get("outcome") == "refused", refused
    hand.press(pump.get_by_role("button"))
    hand.press(page.locator("dialog button.primary"))
    expect(pump).to_contain_text("Takes commands")
    expect(page.locator(".added .find[data-name=fan]")).to_contain_text("Read only")
    judged(Axe(), page, "added drives")
    hand.press(pump.locator("a"))
    hand.write(page.locator(".orders input[type=number], .orders input[type=text]").first, "25")
    hand.press(page.get_by_role("button", name="Set", exact=True))
    expect(page.locator(".big")).to_contain_text("25.0\u00a0Hz")
    hand.press(page.get_by_role("button", name="Start forward"))
    hand.press(page.locator("dialog button.primary"))
    expect(page.locator(".drive-head")).to_have_attribute("data-state", "running")
    until(page, "parseFloat(document.querySelector('.big dd').textContent) >= 24.9")
    print(f"first hour: {time.monotonic() - hand.began:.0f} s, {hand.done} clicks and fields{' by keys alone' if keys else ''}", file=sys.stderr)
    # The link was good once.
    other = page.context.browser.new_context().new_page()
    other.goto(link)
    expect(other.locator("main")).to_contain_text("not good any more")
    other.context.close()
    # Whoever comes back finds what was done; no other is asked by it.
    page.goto(url + "#/setup")
    expect(page.locator(".added .find")).to_have_count(3)
    # Whoever runs goes on undisturbed by what becomes of others.
    read = "fetch('api/v1/drives/pump').then(answer => answer.json())"
    before = page.evaluate(read)
    fan = page.locator(".added .find[data-name=fan]")
    hand.press(fan.get_by_role("button"))
    hand.press(page.locator("dialog button.primary"))
    expect(fan).to_contain_text("Takes commands")
    hand.press(fan.get_by_role("button"))
    hand.press(page.locator("dialog button.primary"))
    expect(fan).to_contain_text("Read only")
    after = page.evaluate(read)
    assert before["status"]["state"] == after["status"]["state"] == "running", after
    assert before["counters"]["lost"] == after["counters"]["lost"], after
    assert after["counters"]["polls"] >= before["counters"]["polls"], after
    until(page, f"{read}.then(drive => drive.counters.polls > {before['counters']['polls']})")
    guesses(page, hand)
    changed_by_hand(page, hand)
    # A drive that runs by a command of ours is not let out of reach.
    hand.press(page.locator(".added .find[data-name=pump]").get_by_role("button"))
    hand.press(page.locator("dialog button.primary"))
    expect(page.locator(".said")).to_contain_text("Stop it first")


def guesses(page, hand):
    """What is a guess is told as one in its row, and again where control is taken."""
    from axe_playwright_python.sync_playwright import Axe

    rows = {name: page.locator(f".added .find[data-name={name}]") for name in ["pump", "fan", "blower"]}
    expect(rows["blower"]).to_contain_text("taken for goodrive")
    expect(rows["fan"]).to_contain_text("taken for wj200")
    expect(rows["pump"]).not_to_contain_text("taken for")
    hand.press(rows["blower"].get_by_role("button"))
    expect(page.locator("dialog")).to_contain_text("Compare its nameplate first")
    judged(Axe(), page, "control of a guess")
    hand.press(page.get_by_role("button", name="Cancel"))
    expect(rows["blower"]).to_contain_text("Read only")


def changed_by_hand(page, hand):
    """What a person writes into the file holds when he says so, and whoever is not there any more shows no value of before."""
    file = page.evaluate("fetch('api/v1/setup').then(answer => answer.json()).then(told => told.file)")
    reload = "fetch('api/v1/reload', { method: 'POST', headers: { 'Content-Type': 'application/json' } }).then(answer => answer.status)"
    fan, blower = (page.locator(f".added .find[data-name={name}]") for name in ["fan", "blower"])
    with open(file, encoding="utf-8") as there:
        text = there.read()

    def write(entry, change):
        """The file with another entry of this drive."""
        entries = text.split("[[drives]]")
        entries = [change(one) if f'name = "{entry}"' in one else one for one in entries]
        with open(file, "w", encoding="utf-8") as there:
            there.write("[[drives]]".join(one for one in entries if one))

    write("fan", lambda one: one.replace("control = false", "control = true"))
    hand.press(blower.get_by_role("button"))
    hand.press(page.locator("dialog button.primary"))
    expect(page.locator(".said")).to_contain_text("fan has other settings")
    expect(blower).to_contain_text("Read only")
    expect(fan).to_contain_text("Read only")
    assert page.evaluate(reload) == 200
    expect(fan).to_contain_text("Takes commands")
    # For as long as the page has not heard who is there, a row of whoever has gone stands, and nothing in it.
    told = page.evaluate("fetch('api/v1/setup').then(answer => answer.text())")
    page.route("**/api/v1/setup", lambda route: route.fulfill(content_type="application/json", body=told))
    write("blower", lambda one: "")
    assert page.evaluate(reload) == 200
    expect(blower).to_contain_text("not there any more")
    expect(blower.locator(".number")).to_be_empty()
    expect(blower.locator(".age")).to_be_empty()
    assert blower.get_attribute("data-quality") is None and blower.get_attribute("data-state") is None
    page.unroute("**/api/v1/setup")
    with open(file, "w", encoding="utf-8") as there:
        there.write(text)
    assert page.evaluate(reload) == 200
    expect(blower).to_have_attribute("data-quality", "good")
    expect(fan).to_contain_text("Read only")


def first_hour_keys(page, url, link, port):
    first_hour(page, url, link, port, keys=True)


def past(page, url, token):
    """What the history holds: drawn with its gaps, at a moment, and as a journal; nothing is told that was not known."""
    from axe_playwright_python.sync_playwright import Axe

    page.goto(url)
    log_in(page, token)
    live(page)
    happen("atv312@2 trip OLF")
    expect(page.locator(".rows .row").first).to_contain_text("OLF")
    tripped = page.evaluate("fetch('api/v1/state').then(answer => answer.json()).then(state => state.time_unix_ms)")
    # What happened is written within half a second, and values once a minute.
    around = f"from_unix_ms={tripped - 600000}&to_unix_ms={tripped + 600000}"
    until(page, f"""fetch('api/v1/history/records?{around}').then(answer => answer.json())
        .then(told => told.records.some(one => one.what === 'tripped'))""")
    page.goto(f"{url}#/events")
    page.get_by_role("link", name="Long trends").click()
    expect(page.locator("main.view-past h1")).to_be_attached()
    expect(page.locator(".uplot")).to_have_count(1)
    for name in ["pump 2", "pump 3"]:
        page.get_by_label(name, exact=True).check()
    # Values are written once a minute: until then nothing is told of them.
    expect(page.locator("main")).to_contain_text("is not here yet")
    until(page, f"""fetch('api/v1/history/curves?drive=pump%202&value=output_frequency_hz&{around}&every_ms=60000')
        .then(answer => answer.json()).then(told => told.curves.some(one => one.known.some(Boolean)))""")
    page.get_by_role("button", name="Until now").click()
    expect(page.locator("main")).to_contain_text("pump 2: known for")
    judged(Axe(), page, "long trends")
    page.get_by_role("button", name="Hour", exact=True).click()
    expect(page.get_by_role("button", name="Hour", exact=True)).to_have_attribute("aria-pressed", "true")
    address = page.url
    assert "from=" in address and "drives=" in address, address
    page.reload()
    expect(page.get_by_label("pump 3", exact=True)).to_be_checked()
    expect(page.locator(".uplot")).to_have_count(1)
    # A drag zooms in, and a click leads to the moment.
    over = page.locator(".u-over").bounding_box()
    middle = over["y"] + over["height"] / 2
    page.mouse.move(over["x"] + over["width"] * .5, middle)
    page.mouse.down()
    page.mouse.move(over["x"] + over["width"] * .95, middle, steps=5)
    page.mouse.up()
    expect(page.get_by_role("button", name="Hour", exact=True)).to_have_attribute("aria-pressed", "false")
    page.locator(".u-over").click()
    page.get_by_role("link", name="What happened at").click()
    expect(page.locator("main.view-at h1")).to_be_attached()
    # The minute of the trip: the trip with its drive, how all were, and why.
    wall = page.evaluate("""at => new Date(at).toISOString().slice(0, 16) + 'Z'""", tripped)
    page.goto(f"{url}#/at/{wall}")
    row = page.locator("table.events tr.in-trouble", has_text="Tripped")
    expect(row.first).to_contain_text("pump 2")
    expect(page.locator("main.view-at table").first).to_contain_text("pump 3")
    page.get_by_role("button", name="Why: pump 2 at this moment").click()
    expect(page.locator(".story")).to_contain_text("OLF")
    judged(Axe(), page, "a moment")
    # Before there was a daemon nothing is known, and nothing is told.
    page.goto(f"{url}#/at/2001-01-01T00:00")
    expect(page.locator("main")).to_contain_text("Nothing is recorded of these ten minutes.")
    page.goto(f"{url}#/events")
    page.get_by_role("button", name="Older, from the history").click()
    expect(page.locator("main")).to_contain_text("The history holds nothing older.")
    judged(Axe(), page, "the journal")


def mouse(page, url):
    """With a mouse the stop is wider, by its keys: on no width does it hide what stands beside it."""
    page.goto(url)
    for width in [1440, 1280, 1024, 800]:
        page.set_viewport_size({"width": width, "height": 844})
        ends = page.evaluate("[...document.querySelectorAll('.bar a, .bar button')].map(one => one.getBoundingClientRect()).filter(one => one.width).map(one => one.right)")
        stop = page.locator("#stop").bounding_box()
        assert max(ends) <= stop["x"], (width, ends, stop)


def autumn(page, url):
    """The hour that comes twice when the clock is put back, wherever the daemon is."""
    # The daemon's zone is what it says it is.
    def paris(route):
        answer = route.fetch()
        state = answer.json()
        state["daemon"]["zone"] = "Europe/Paris"
        route.fulfill(response=answer, json=state)

    page.route("**/api/v1/state", paris)
    page.goto(f"{url}#/at/2026-10-25T02:30")
    expect(page.locator("main")).to_contain_text("This time came twice")
    which = page.locator("main p.chips a.button", has_text="UTC")
    # tzdata: Europe/Paris left UTC+2 at 2026-10-25 01:00 UTC.
    assert [text.replace("\u00a0", " ")[-5:] for text in which.all_inner_texts()] == ["UTC+2", "UTC+1"], which.all_inner_texts()
    asked = []
    page.on("request", lambda request: "moment" in request.url and asked.append(request.url))
    which.nth(1).click()
    expect(page.locator("main h1")).to_contain_text("UTC+1")
    assert asked and asked[-1].endswith("at_unix_ms=1792891800000"), asked
    page.goto(f"{url}#/at/2026-03-29T02:30")
    expect(page.locator("main")).to_contain_text("This time did not exist")
    page.goto(f"{url}#/at/never")
    expect(page.locator("main")).to_contain_text("is no time")
    page.goto(f"{url}#/past?from=2026-10-24T12:00&to=2026-10-25T12:00")
    expect(page.locator("main")).to_contain_text("the clock was put back")


SCENES = {
    "first_hour": (first_hour, DESK | {"bypass_csp": True}), "first_hour_keys": (first_hour_keys, DESK | {"bypass_csp": True}),
    "mouse": (mouse, DESK | {"locale": "fr-FR"}), "several": (several, DESK), "past": (past, DESK | {"bypass_csp": True}), "autumn": (autumn, DESK),
    "pairs": (pairs, DESK), "folded": (folded, DESK), "alarms": (alarms, DESK), "somebody": (somebody, DESK), "as_shown": (as_shown, DESK),
    "zones": (zones, DESK | {"timezone_id": "Pacific/Kiritimati"}), "touched": (touched, PHONE | {"is_mobile": False}),
    "loads": (loads, DESK), "trip": (trip, DESK), "stop_all": (stop_all, DESK), "phone": (phone, PHONE),
    "phone_french": (phone, PHONE | {"locale": "fr-FR"}),
    "french": (french, PHONE | {"locale": "fr-FR"}), "cable": (cable, DESK), "away": (away, DESK), "many": (many, DESK), "hung": (hung, DESK), "proxy": (proxy, DESK), "typed": (typed, DESK), "bare": (bare, DESK),
    "tabs": (tabs, DESK), "questions": (questions, PHONE), "long_group": (long_group, PHONE), "dead": (dead, DESK),
    "scoped": (scoped, DESK), "unread": (unread, DESK), "restarted": (restarted, DESK), "encrypted": (encrypted, DESK), "clocks": (clocks, DESK), "axe": (axe, DESK | {"bypass_csp": True}),
    "axe_dark": (axe, PHONE | {"bypass_csp": True, "color_scheme": "dark", "locale": "fr-FR"}),
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


def key_of(url):
    """The key of the server's certificate, as Chromium wants it to be named that is to trust it."""
    at = urlsplit(url).netloc
    connect = f"openssl s_client -connect {at} </dev/null 2>/dev/null | openssl x509 -pubkey -noout | openssl pkey -pubin -outform der"
    key = subprocess.run(["sh", "-c", connect], stdout=subprocess.PIPE, check=True).stdout
    return base64.b64encode(hashlib.sha256(key).digest()).decode()


def main(name, url, *tokens):
    scene, context = SCENES[name]
    wait_for(url)
    trusts = [f"--ignore-certificate-errors-spki-list={key_of(url)}"] if url.startswith("https:") else []
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox", *trusts], timeout=PATIENCE_MS)
        page = browser.new_context(**({"locale": "en-GB"} | context)).new_page()
        page.set_default_timeout(PATIENCE_MS)
        expect.set_options(timeout=PATIENCE_MS)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: message.type == "error" and complaints.append(message.text))
        page.on("request", lambda request: request.url.startswith((url, "blob:")) or complaints.append(request.url))
        scene(page, url, *tokens)
        browser.close()
    # A request that a scene cuts off by itself is told in the console.
    cut = {"restarted": "status of 404", "away": "ERR_FAILED", "clocks": "ERR_FAILED", "proxy": "status of",
           # What is refused there is refused on purpose.
           "as_shown": "status of 409", "several": "ERR_FAILED", "first_hour": "status of 4", "first_hour_keys": "status of 4"}.get(name)
    wrong = [one for one in complaints if not cut or cut not in one]
    assert not wrong, wrong


main(*sys.argv[1:])
