"""Opens the page in a headless Chromium as somebody who has never been there: first_look.py URL DRIVES [LATENCY_MS BYTES_A_SECOND].

Prints one line: after how many milliseconds the stop was usable, the first row had a fresh value, and every row was there; how many
bytes had come by then, and in how many requests. Over a far network it is Chromium that delays and slows down what comes: each
request by the whole latency, and the connection itself by nothing, which is one latency more on a real one."""

import sys

from playwright.sync_api import sync_playwright

NOTED = """
    window.noted = {};
    const note = name => { noted[name] ??= performance.now(); };
    let stop;
    Object.defineProperty(window, 'stopAll', { get: () => stop, set: value => { stop = value; note('stop'); } });
    const look = () => {
        if (document.querySelector('.rows .row[data-quality=good]')) note('value');
        if (document.querySelectorAll('.rows .row').length >= DRIVES) note('all');
        if (!noted.all) requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
"""

url, drives, *far = sys.argv[1:]
with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(120_000)
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    received, live = {"bytes": 0, "requests": 0}, set()

    def answered(event):
        received["requests"] += 1
        # What happens to the drives from then on is no part of the first look.
        if event["response"]["mimeType"] == "text/event-stream":
            live.add(event["requestId"])

    def came(event):
        if event["requestId"] not in live:
            received["bytes"] += max(event["encodedDataLength"], 0)

    session.on("Network.responseReceived", answered)
    session.on("Network.dataReceived", came)
    if far:
        latency, speed = map(float, far)
        session.send("Network.emulateNetworkConditions",
                     {"offline": False, "latency": latency, "downloadThroughput": speed, "uploadThroughput": speed})
    page.add_init_script(NOTED.replace("DRIVES", drives))
    page.goto(url, wait_until="commit")
    while page.evaluate("noted.all") is None:
        page.wait_for_timeout(50)
    noted = page.evaluate("noted")
    print(noted["stop"], noted["value"], noted["all"], received["bytes"], received["requests"], flush=True)
    browser.close()
