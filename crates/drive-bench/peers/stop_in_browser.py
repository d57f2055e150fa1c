"""Shows the page in a headless Chromium and presses its stop: stop_in_browser.py URL. Says "ready" when it is shown.

For each line on the standard input, "pointer" or "key", it presses so and says the browser's own time of the event, in milliseconds since
1970, and how many have passed from then until the answer was whole that the daemon has taken the stop; or "never" after five seconds. Both
times are of one clock of the browser. An answer to what was sent before the press is not an answer to it: after a "never" the page goes on to send that
stop, and it may be taken at any time."""

import sys

from playwright.sync_api import sync_playwright

MEASURE = """() => {
    window.measured = new Promise(resolve => {
        let pressed;
        const note = event => { if (event.type === 'pointerdown' || event.code === 'KeyS') pressed ??= event.timeStamp; };
        const over = wait => {
            for (const kind of ['pointerdown', 'keydown']) removeEventListener(kind, note, true);
            seen.disconnect();
            clearTimeout(late);
            resolve(wait);
        };
        const seen = new PerformanceObserver(list => {
            const taken = list.getEntries().find(one => one.startTime >= pressed && /api.v1.stop/.test(one.name) && [200, 202].includes(one.responseStatus));
            if (taken) over([performance.timeOrigin + pressed, taken.responseEnd - pressed]);
        });
        const late = setTimeout(() => over(null), 5_000);
        for (const kind of ['pointerdown', 'keydown']) addEventListener(kind, note, true);
        seen.observe({ type: 'resource' });
    });
}"""

with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
    page = browser.new_page()
    page.goto(sys.argv[1])
    page.wait_for_selector("#connection[data-connection=live]")
    box = page.locator("#stop").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    print("ready", flush=True)
    for line in sys.stdin:
        page.evaluate(MEASURE)
        if line.strip() == "key":
            page.keyboard.press("Control+Shift+S")
        else:
            page.mouse.down()
            page.mouse.up()
        taken = page.evaluate("window.measured")
        print("never" if taken is None else "%f %f" % tuple(taken), flush=True)
    browser.close()
