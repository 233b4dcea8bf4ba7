# SPDX-License-Identifier: MIT
"""Tests the page in a browser with the fake server."""
import os
import time

from acts import drag, holes, key, kSaveTable, mouse, open_gyro, pinch, rows_of, saved_file, saved_table, shown, span_of, swipe
from worlds import SCRIPT, StandIn


def overview(browser, world):
    browser.open(world.url)
    browser.wait("five tiles with a rate", lambda: len(browser.all(".tile")) == 5 and all("." in tile.text for tile in browser.all(".tile .big")))
    assert browser.text(".sum") == "3 gyros, 5 axes: 4 good, 1 caution", browser.text(".sum")
    words = {(tile.find_element("css selector", ".mark").text, tile.find_element("css selector", ".word").text) for tile in browser.all(".tile")}
    assert words == {("●", "good"), ("▲", "outside training range")}, words
    assert browser.run("return location.href.includes('secret')") is False, "the token is still in the address"
    assert len(browser.one(".spark-line").get_attribute("d")) > 1000
    browser.picture("overview", whole=True)


def difference_at_rest(browser, world):
    """The large number is the difference from the Earth rate, with the digits of its uncertainty; of a gyro that moves, the corrected rate."""
    tile = lambda name: next(tile for tile in browser.all(".tile") if tile.find_element("css selector", "h2").text == name)
    part = lambda name, selector: tile(name).find_element("css selector", selector).text
    assert [part("gyro1 z", selector) for selector in (".label", ".big", ".sd")] == ["difference from the Earth rate, at rest", "+0.004", "± 0.013"], tile("gyro1 z").text
    assert part("gyro1 z", ".corrected").startswith("8.4") and part("gyro1 z", ".note") == "corrected, last 10 min"
    assert part("gyro2 x", ".label") == "corrected, moving" and part("gyro2 x", ".big").startswith("8.4") and part("gyro2 x", ".corrected") == ""
    assert part("gyro3 z", ".monitor").startswith("holds: 31 days, 412 h at rest, -20 to 55 °C seen (20"), part("gyro3 z", ".monitor")
    open_gyro(browser, "gyro1")
    assert [browser.text(f".hero .{name}") for name in ("label", "big", "sd")] == ["difference from the Earth rate, at rest", "+0.004", "± 0.013"]
    assert browser.one(".cell.corrected").is_displayed() and not browser.one(".cell.monitor").is_displayed()
    browser.picture("at-rest")


def names_are_data(browser, world):
    open_gyro(browser)
    assert SCRIPT in browser.text(".cell.model"), browser.text(".cell.model")
    assert browser.run("return document.querySelectorAll('main script, main img, .events b').length") == 0
    assert "taken" not in browser.driver.title
    assert "<b>for a moment</b>" in browser.text(".events")
    browser.picture("gyro", whole=True)


def zoom_and_pan(browser, world):
    browser.wait("an hour", lambda: abs(span_of(browser) - 3600) < 1)
    drag(browser, 0.25, 0.5)
    browser.wait("a quarter of the hour", lambda: abs(span_of(browser) - 900) < 40)
    begin = float(shown(browser)[0])
    domains = browser.run("return [...document.querySelectorAll('.plot')].slice(0, 4).map(p => p.querySelector('.dygraph-axis-label-x')?.textContent)")
    assert len(set(domains)) == 1 and domains[0], f"the charts' times differ: {domains}"
    browser.wait("finer rows", lambda: "rows of 2.0 s" in browser.one(".chart").get_attribute("aria-label"))
    drag(browser, 0.2, 0.7, modifiers=8)
    browser.wait("a range that is half its length earlier", lambda: abs(float(shown(browser)[0]) - begin + 450) < 40)
    key(browser, "-")
    browser.wait("twice the range", lambda: abs(span_of(browser) - 1800) < 60)
    key(browser, "ArrowRight", modifiers=8)
    assert browser.one(".now").get_attribute("aria-pressed") == "false"
    key(browser, "l")
    browser.wait("the current time again", lambda: browser.one(".now").get_attribute("aria-pressed") == "true")


def cursor(browser, world):
    browser.wait("the current rows", lambda: "30 min until now" in browser.one(".chart").get_attribute("aria-label"))
    mouse(browser, "mouseMoved", 0.5)
    browser.wait("the time under the cursor", lambda: "UTC" in browser.text(".cursor-time"))
    value = browser.text(".chart .legend .value")
    assert abs(float(value) - 8.465) < 0.1, value
    browser.picture("cursor")
    before = browser.text(".cursor-time")
    key(browser, "ArrowLeft")
    assert browser.text(".cursor-time") < before
    assert "Applied bias" in browser.text("#spoken"), "found no values of the cursor for a screen reader"
    key(browser, "Escape")
    assert browser.run("return document.querySelector('.cursor').hidden")


def thirty_days(browser, world):
    for digit, what, span_s, text in ("8", "30 days", 2592000, "rows of 2 h"), ("9", "a year", 31536000, "365 d until now"), ("4", "an hour", 3600, "rows of 10 s"):
        key(browser, digit)
        browser.wait(what, lambda: abs(span_of(browser) - span_s) < 1 and text in browser.one(".chart").get_attribute("aria-label"))
        if digit == "8":
            rows = int(browser.one(".chart").get_attribute("aria-label").split(" rows")[0].split(", ")[-1])
            assert 300 < rows <= 600, rows
            browser.picture("thirty-days")


def long_view_is_built(browser, world):
    world.say("building 0.42")
    key(browser, "8")
    browser.wait("the progress", lambda: browser.text(".busy") == "Building the long view: 42 % of the log read.")
    browser.picture("building")
    world.say("building 0.77")
    browser.wait("an update of the progress", lambda: "77 %" in browser.text(".busy"), 15)
    world.say("building 1")
    browser.wait("the end of the progress", lambda: "log read" not in browser.text(".busy"), 15)
    world.say("problem periods.sqlite: No space left on device")
    key(browser, "7")
    browser.wait("why the long view is not stored", lambda: browser.text(".busy").startswith("Minutes and hours are not stored: periods.sqlite: No space left on device."))
    world.say("problem")
    browser.wait("the end of the problem", lambda: "stored" not in browser.text(".busy"), 15)


def disk_hangs(browser, world):
    world.say("disk hangs")
    key(browser, "7")
    browser.wait("the reason for missing rows", lambda: browser.text(".busy") == "rows: the disk has not answered for 5 s")
    assert not browser.one(f"[aria-label='{kSaveTable}']").is_enabled(), "the button could save the rows of another view"
    assert browser.run("return [...document.querySelectorAll('.plot')].every((plot) => !plot.dataset.empty)"), "pending rows shown as none"
    world.say("disk answers")
    week = lambda: span_of(browser) > 600000 and "rows of 30 min" in browser.one(".chart").get_attribute("aria-label")
    browser.wait("the rows after the disk recovers", lambda: week() and "disk" not in browser.text(".busy"), 15)
    key(browser, "4")
    browser.wait("an hour", lambda: "rows of 10 s" in browser.one(".chart").get_attribute("aria-label"))


def rejected_requests_are_repeated(browser, world):
    """The page repeats a request that it needs once per run of prismd until it succeeds."""
    world.say("refuse history events model")
    browser.driver.refresh()
    browser.wait("the live numbers", lambda: "." in browser.text(".hero .big"))
    time.sleep(1)
    assert not browser.all(".events li") and not browser.all(".gauge"), "the fake server rejected no request"
    browser.run("location.hash = '#/'")
    drawn = lambda: len(browser.one(".spark-line").get_attribute("d"))
    browser.wait("a tile", lambda: browser.all(".tile"))
    assert drawn() < 300, drawn()
    world.say("refuse")
    browser.wait("ten minutes on the spark line", lambda: drawn() > 1000, 12)
    open_gyro(browser)
    browser.wait("the events and the domain", lambda: browser.all(".events li") and browser.all(".gauge"))


def saved_files(browser, world):
    table = rows_of(saved_file(browser, kSaveTable, ".csv").decode())
    assert table == saved_table(browser), "the file differs from the rows of saved_table()"
    assert 350 < len(table) <= 361 and abs(float(table[-1]["mean_rate_deg_per_h"]) - 8.465) < 0.5, table[-1]


def dark_theme(browser, world):
    ground = "return getComputedStyle(document.body).backgroundColor"
    light = browser.run(ground)
    browser.theme("dark")
    browser.wait("the dark theme of the system", lambda: browser.run(ground) != light)
    browser.picture("night", whole=True)
    key(browser, "t")
    browser.wait("the light theme chosen by the key", lambda: browser.run(ground) == light)
    browser.driver.refresh()
    browser.wait("the light theme after a reload without the token", lambda: browser.run(ground) == light and browser.all(".numbers"))
    browser.run("localStorage.clear()")
    browser.theme("light")


def times_in_fields_and_address(browser, world):
    """A range from the address or the two fields is in both, and in the text above the charts; the other axes' links have it."""
    fields = lambda: browser.run("return [...document.querySelectorAll('.times input')].map((field) => field.value)")
    fill = lambda texts: browser.run("""arguments[0].forEach((text, i) => {
      const field = document.querySelectorAll('.times input')[i]; field.value = text; field.dispatchEvent(new Event('change')); })""", texts)
    day = time.strftime("%Y-%m-%d", time.gmtime(time.time() - 2 * 86400))
    browser.run("location.hash = `#/gyro2/z?from=${arguments[0]}T10:00:00Z&to=${arguments[0]}T11:00:00Z`", day)
    browser.wait("the range of the address", lambda: fields() == [f"{day} 10:00:00", f"{day} 11:00:00"])
    assert browser.text(".period") == f"{day} 10:00:00 – 11:00:00 UTC", browser.text(".period")
    fill([f"{day} 08:30", f"{day}T09:00:00Z"])
    browser.wait("an address with the range of the fields", lambda: browser.run("return location.hash") == f"#/gyro2/z?from={day}T08:30:00Z&to={day}T09:00:00Z")
    browser.wait("its rows", lambda: "rows of 5.0 s" in (browser.one(".chart").get_attribute("aria-label") or ""))
    assert browser.run("return document.querySelectorAll('.trail a')[1].hash").endswith(f"x?from={day}T08:30:00Z&to={day}T09:00:00Z")
    browser.driver.refresh()
    browser.wait("the same after a reload", lambda: fields() == [f"{day} 08:30:00", f"{day} 09:00:00"])
    fill([f"{day} 10:00", f"{day} 9 o'clock"])
    browser.wait("what is wrong", lambda: browser.text(".busy").startswith(f'Found "{day} 10:00" to "{day} 9 o'))
    assert fields()[1] == f"{day} 9 o'clock", "the text to correct is gone"
    fill([f"{day} 10:00", "now"])
    browser.wait("two days until now", lambda: browser.one(".now").get_attribute("aria-pressed") == "true" and span_of(browser) > 86400 and fields()[1] == "now")
    key(browser, "4")
    browser.wait("an address without a range", lambda: browser.run("return location.hash") == "#/gyro2/z")


def several_curves_in_one_chart(browser, world):
    labels = lambda chart: [label.text for label in browser.all(f"[data-chart={chart}] .legend .label")]
    choose = lambda selector, value: browser.run("""const list = document.querySelector(arguments[0]);
      list.value = arguments[1]; list.dispatchEvent(new Event('change'))""", selector, value)
    browser.wait("the other axes", lambda: len(browser.all("[aria-label^=compare] option")) == 5)
    choose("[aria-label^=compare]", "gyro2 x")
    choose("[data-chart=rate] select", "temperature")
    browser.wait("its curves", lambda: labels("rate") == ["raw", "corrected", "gyro2 x", "T, °C"] and labels("bias") == ["bias", "gyro2 x"])
    value = lambda: browser.all("[data-chart=bias] .legend .value")[1].text
    browser.wait("its values", lambda: "±" in value())
    assert browser.all("[data-chart=rate] .dygraph-axis-label-y2") and not browser.all("[data-chart=bias] .dygraph-axis-label-y2")
    edges = browser.run("return ['rate', 'bias'].map((key) => [...document.querySelectorAll(`[data-chart=${key}] .dygraph-axis-label-x`)].at(-1).getBoundingClientRect().left)")
    assert max(edges) - min(edges) <= 1, f"equal times of the charts are not in one column: {edges}"
    browser.picture("several-curves", whole=True)
    assert browser.run("return location.hash") == "#/gyro2/z?with=gyro2%20x&rate=temperature"
    browser.driver.refresh()
    browser.wait("the curves of the address", lambda: labels("rate") == ["raw", "corrected", "gyro2 x", "T, °C"])
    choose("[aria-label^=compare]", "gyro2 x")
    choose("[data-chart=rate] select", "")
    browser.wait("the axis alone", lambda: labels("rate") == ["raw", "corrected"])


def charts_of_what_is_measured(browser, world):
    """A gyro without UHFO has neither a chart nor a value of it; a further sensor has a chart."""
    shown_charts = lambda: browser.run("return [...document.querySelectorAll('.chart')].filter((one) => one.offsetHeight).map((one) => one.dataset.chart).join()")
    open_gyro(browser, "gyro3")
    browser.wait("the chart of the thermometer", lambda: shown_charts() == "rate,bias,temperature,slope,sensors.room.t,line")
    assert browser.text("[data-chart='sensors.room.t'] h3") == "room.t °C", browser.text("[data-chart='sensors.room.t'] h3")
    browser.wait("its value", lambda: float(browser.text("[data-chart='sensors.room.t'] .value").split(" ")[0].replace("–", "nan")) > 0)
    browser.wait("its gauge, none of the UHFO", lambda: not browser.one(".cell.uhfo").is_displayed() and "room.t" in browser.text(".gauges"))
    browser.picture("sensor", whole=True)
    open_gyro(browser)
    browser.wait("the UHFO", lambda: shown_charts() == "rate,bias,temperature,slope,uhfo,line")
    browser.wait("its gauge", lambda: browser.one(".cell.uhfo").is_displayed())


def vertical_zoom(browser, world):
    """A drag up or down enlarges the values of its chart, until "fit" or a double-click."""
    scale = lambda: browser.run("return [...document.querySelectorAll('[data-chart=rate] .dygraph-axis-label-y')].map((label) => Number(label.textContent))")
    browser.wait("a scale", lambda: len(scale()) >= 2)
    height = lambda: max(scale()) - min(scale())
    before = height()
    drag(browser, 0.5, 0.5, down=60)
    browser.wait("a finer scale", lambda: len(scale()) >= 2 and height() < 0.6 * before)
    assert abs(span_of(browser) - 3600) < 1
    finer = height()  # `before` may be that of the gyro seen before
    browser.one("[data-chart=rate] .auto").click()
    browser.wait("the scale of all values", lambda: len(scale()) >= 2 and height() > 1.3 * finer)


def hover_moves_nothing(browser, world):
    places = "return [...document.querySelectorAll('.chart, .panel, .tools, .plot')].map((part) => { const box = part.getBoundingClientRect(); return [box.left, box.top, box.width, box.height].join(); })"
    for width in 1920, 1280, 390:
        browser.size(width, 900)
        key(browser, "6")
        browser.wait("a day with bands", lambda: "1 d until now" in browser.one(".chart").get_attribute("aria-label"))
        before = browser.run(places)
        for part in 0.2, 0.5, 0.8:
            mouse(browser, "mouseMoved", part)
            browser.wait("the cursor", lambda: "UTC" in browser.text(".cursor-time"))
            assert browser.run(places) == before, f"the cursor moved the page at {width} px"
        key(browser, "l")
    key(browser, "4")
    browser.size(1600, 1000)


def labels_have_room(browser, world):
    """At 1920 px no label has two lines, and the labels of the scales are in the panel of the charts."""
    browser.size(1920, 1080)
    browser.wait("an hour", lambda: "1 h until now" in browser.one(".chart").get_attribute("aria-label"))
    wrapped = browser.run("return [...document.querySelectorAll('dt, .label, h2, h3, button, .note, .tools label')].filter((e) => e.getClientRects().length && e.offsetHeight > 34).map((e) => e.textContent)")
    assert not wrapped, wrapped
    outside = browser.run("""const panel = document.querySelector('.strips').getBoundingClientRect();
      return [...document.querySelectorAll('.dygraph-axis-label')].filter((e) => { const box = e.getBoundingClientRect();
        return box.left < panel.left || box.right > panel.right || box.top < panel.top || box.bottom > panel.bottom; }).map((e) => e.textContent)""")
    assert not outside, outside
    browser.size(1600, 1000)


def printed(browser, world):
    """Print shows all charts, in light colours and in the width of a sheet, also those that were not on the screen."""
    browser.size(1280, 500)
    browser.theme("dark")
    browser.driver.refresh()
    browser.wait("charts", lambda: "rows of" in (browser.text(".chart") and browser.one(".chart").get_attribute("aria-label") or ""))
    browser.run("""addEventListener('beforeprint', () => { const charts = [...document.querySelectorAll('.chart')];
      window.seen = [document.documentElement.dataset.theme, document.querySelector('.strips').offsetWidth, charts.filter((one) => one.querySelector('canvas')).length]; })""")
    browser.driver.execute_cdp_cmd("Page.printToPDF", {})
    assert browser.run("return window.seen") == ["light", 690, 6], browser.run("return window.seen")
    browser.wait("the dark theme again", lambda: browser.run("return document.documentElement.dataset.theme") == "dark" and not browser.all(".printed"))
    browser.theme("light")
    browser.size(1600, 1000)


def prismd_stopped(browser, world):
    browser.run("location.hash = '#/'")
    world.say("gone gyro1")
    stopped = lambda tile: "gyro1" in tile.text and "prismd stopped" in tile.text  # a late server makes tiles red too
    tile = browser.wait("gyro1 to check", lambda: "1 to check" in browser.text(".sum") and next(filter(stopped, browser.all(".tile.bad.old")), None))
    struck = "return [...arguments[0].querySelectorAll('.value:not(.model, .monitor)')].map(v => getComputedStyle(v).textDecorationLine)"
    browser.wait("crossed-out values", lambda: set(browser.run(struck, tile)) == {"line-through"})
    browser.picture("gone")
    world.say("back gyro1")
    browser.wait("current values of gyro1", lambda: not browser.all(".tile.old"))


def server_stalls(browser, world):
    open_gyro(browser)
    world.say("freeze")
    browser.wait("the alarm", lambda: browser.one(".alarm").is_displayed(), 9)
    assert "does not respond" in browser.text(".alarm"), browser.text(".alarm")
    line = "return getComputedStyle(document.querySelector('.hero .big')).textDecorationLine"
    browser.wait("crossed-out values", lambda: browser.run(line) == "line-through", 2)
    browser.picture("frozen")
    world.say("go")
    browser.wait("the end of the alarm", lambda: not browser.one(".alarm").is_displayed() and not browser.all(".numbers.old"), 15)


def no_instance_runs(browser, world):
    """Without running instances there are no notifications: the page probes the server and shows no alarm if it responds."""
    browser.run("location.hash = '#/'")
    for name in "gyro1", "gyro2", "gyro3":
        world.say(f"stopped {name}")
    browser.wait("all stopped", lambda: [tile.text for tile in browser.all(".tile .word")] == ["stopped"] * 5)
    browser.run("window.alarms = 0; new MutationObserver(() => window.alarms++).observe(document.querySelector('#alarm'), {attributes: true})")
    time.sleep(12)
    assert browser.run("return window.alarms") == 0, "found an alarm although the server responds"
    for name in "gyro1", "gyro2", "gyro3":
        world.say(f"back {name}")
    browser.wait("current values of all gyros", lambda: not browser.all(".tile.old"))


def computer_slept(browser, world):
    """A computer that slept is detected by its wall clock. Simulated by a changed Date.now while the server is stalled."""
    open_gyro(browser)
    clock = "return new Date().toISOString().slice(11, 16)"
    first = browser.run(clock)
    world.say("freeze")
    time.sleep(1)
    # the last message came in one of these two minutes
    heard = [f"since {minute}" for minute in (first, browser.run(clock))]
    browser.run("window.awake = Date.now; Date.now = () => window.awake() + 8 * 3600 * 1000")
    browser.wait("the alarm about the sleep", lambda: "asleep" in browser.text(".alarm"))
    assert browser.one(".alarm").is_displayed() and any(since in browser.text(".alarm") for since in heard), (heard, browser.text(".alarm"))
    browser.wait("an age of eight hours", lambda: browser.text(".hero .age").startswith("8 h"))
    browser.run("Date.now = window.awake")
    world.say("go")
    browser.wait("the end of the alarm", lambda: not browser.one(".alarm").is_displayed() and not browser.all(".numbers.old"), 15)


def hidden_tab(browser, world):
    """A hidden tab gets no animation frames; its title is still updated."""
    browser.run("window.frame = window.requestAnimationFrame; window.requestAnimationFrame = () => 1")
    world.say("gone gyro1")
    browser.wait("a title with gyro1", lambda: browser.driver.title == "\u25a0 gyro1 \u2013 prism", 3)
    assert browser.text("#spoken") == "to check: gyro1"
    world.say("back gyro1")
    browser.wait("the normal title", lambda: browser.driver.title == "prism", 5)
    assert browser.text("#spoken") != "all gyros are good", "all gyros are reported as good although an axis is extrapolating"
    browser.driver.refresh()
    browser.wait("the gyro", lambda: browser.all(".numbers:not(.old)"))


def time_goes_back(browser, world):
    """If the data's time goes back (device clock restarted, host clock set back), the charts show the new rows."""
    open_gyro(browser)
    key(browser, "1")
    browser.wait("a minute", lambda: "1 min until now" in browser.one(".chart").get_attribute("aria-label"))
    world.say("shift -3600")
    begin = time.time()
    browser.wait("rows an hour ago", lambda: abs(float(saved_table(browser)[-1]["time_s"]) - time.time() + 3600) < 4, 5)
    browser.wait("charts that end an hour ago", lambda: abs(float(shown(browser)[1]) - time.time() + 3600) < 4, 5 - (time.time() - begin))
    browser.wait("a minute of these rows", lambda: len(saved_table(browser)) > 50, 5)
    world.say("shift 3600")
    browser.wait("current rows", lambda: abs(float(saved_table(browser)[-1]["time_s"]) - time.time()) < 4, 8)


def no_gaps(browser, world):
    """If the response to `range` is late and the viewer's clock is slow, there is no gap between its rows and the live ones."""
    world.say("range delay 3")
    slow = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "const now = Date.now; Date.now = () => now() - 3000"})
    browser.driver.refresh()
    browser.wait("the buttons for the time range", lambda: browser.all(".spans button"))
    key(browser, "1")
    browser.wait("a minute", lambda: "1 min until now" in (browser.one(".chart").get_attribute("aria-label") or ""), 15)
    world.say("range delay 0")
    time.sleep(5)
    table = saved_table(browser)[-30:]
    assert len(table) == 30 and holes(table) == [], holes(table)
    assert time.time() - float(table[-1]["time_s"]) < 5, table[-1]
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", slow)
    browser.run("location.hash = '#/'")
    open_gyro(browser)
    browser.driver.refresh()
    browser.wait("an hour", lambda: "1 h until now" in (browser.text(".chart") and browser.one(".chart").get_attribute("aria-label") or ""), 15)


def cursor_leaves(browser, world):
    """The values next to the charts are those at the cursor; they disappear with it."""
    key(browser, "1")
    browser.wait("a minute", lambda: "1 min until now" in browser.one(".chart").get_attribute("aria-label"))
    mouse(browser, "mouseMoved", 0.1)
    browser.wait("a cursor", lambda: browser.text(".cursor-time"))
    no_cursor = lambda: browser.text(".cursor-time") == "" and browser.run("return document.querySelector('.cursor').hidden")
    browser.wait("the end of the cursor when its time leaves the charts", no_cursor, 12)
    key(browser, "ArrowLeft")
    assert browser.text(".cursor-time")
    key(browser, "l")
    assert browser.text(".cursor-time") == "" and not browser.all(".strips.pointed")
    key(browser, "4")
    browser.wait("an hour", lambda: "1 h until now" in browser.one(".chart").get_attribute("aria-label"))


def addresses(browser, world):
    """An address with an unknown name shows all gyros until the name exists. The view stays if its gyro stops or is restarted."""
    title = lambda: browser.text(".hero h1")
    for wrong in "#/gyro2/unknown", "#/unknown/z", "#/%E0%A4%A", "#/gyro2/%":
        browser.run("location.hash = arguments[0]", wrong)
        browser.wait("tiles", lambda: len(browser.all(".tile")) == 5)
        assert not browser.all(".numbers"), wrong
    world.say("leave gyro3")
    browser.wait("four tiles", lambda: len(browser.all(".tile")) == 4)
    browser.run("location.hash = '#/gyro3/z'")
    world.say("back gyro3")
    browser.wait("the gyro of the address", lambda: title() == "gyro3 z" and not browser.all(".numbers.old"))
    world.say("leave gyro3")
    browser.wait("a stopped gyro3", lambda: browser.text(".hero .word") == "prismd stopped")
    world.say("back gyro3")
    browser.wait("current values of gyro3", lambda: not browser.all(".numbers.old"))
    first = browser.text(".hero .big")
    browser.wait("a new rate", lambda: browser.text(".hero .big") != first, 4)
    browser.run("document.querySelector('.skip').click()")
    assert browser.run("return [location.hash, document.activeElement.id]") == ["#/gyro3/z", "main"]
    browser.run("location.hash = '#elsewhere'")
    time.sleep(0.2)
    assert title() == "gyro3 z"
    browser.run("scrollTo(0, 500); location.hash = '#/gyro2/x'")
    browser.wait("another gyro", lambda: title() == "gyro2 x")
    assert browser.run("return [scrollY, document.activeElement.id]") == [0, "main"]


def no_data_for_hours(browser, world):
    world.say("silent gyro1")
    browser.open("about:blank")
    browser.open(world.url)
    tile = browser.wait("an old tile of gyro1", lambda: next((tile for tile in browser.all(".tile.bad.old") if "gyro1" in tile.text), None))
    browser.wait("its age", lambda: tile.find_element("css selector", ".age").text == "2 h old")
    assert tile.find_element("css selector", ".note").text == "corrected, last 10 min received" and "2 h old" in tile.get_attribute("aria-label")
    assert "8.4" in browser.one(".tile:not(.old)").get_attribute("aria-label")
    open_gyro(browser, "gyro1")
    browser.wait("empty charts with a way to the last rows", lambda: browser.one(".strip-head .auto").is_displayed() and browser.one(".plot").get_attribute("data-empty"))
    assert browser.text(".strip-head .auto").startswith("show the last rows, until 20"), browser.text(".strip-head .auto")
    browser.one(".strip-head .auto").click()
    browser.wait("its last hour", lambda: len(saved_table(browser)) > 300 and not browser.one(".strip-head .auto").is_displayed())
    browser.run("location.hash = '#/'")
    world.say("back gyro1")
    browser.wait("current values of gyro1", lambda: not browser.all(".tile.old"))


def keyboard(browser, world):
    browser.run("location.hash = '#/'; document.activeElement.blur()")
    browser.wait("tiles", lambda: browser.all(".tile"))
    for _ in range(12):
        key(browser, "Tab")
        if browser.run("return document.activeElement.className").startswith("tile"):
            break
    assert "axis" in browser.run("return document.activeElement.getAttribute('aria-label')")
    assert browser.run("return getComputedStyle(document.activeElement).outlineStyle") == "solid", "the focus is not visible"
    key(browser, "Enter")
    browser.wait("the gyro", lambda: browser.all(".numbers"))
    nameless = browser.run("""return [...document.querySelectorAll("button, a, [role=img], [role=group]")].filter(
      (e) => !(e.getAttribute("aria-label") || e.textContent.trim())).map((e) => e.outerHTML)""")
    assert not nameless, nameless
    key(browser, "Escape")
    browser.wait("the overview", lambda: browser.all(".tile"))


def narrow_windows(browser, world):
    """Bias and sd are on one line at every width, and a long problem leaves room for them."""
    open_gyro(browser)
    for width in 1280, 1024, 380:
        browser.size(width, 800)
        browser.run("document.querySelector('.cell.bias .value').textContent = '\u2212' + '0.03496 \u00b1 0.00245'")
        lines = browser.run("const dd = document.querySelector('.cell.bias dd'); return [dd.offsetHeight, dd.scrollWidth - dd.clientWidth]")
        assert lines[0] < 30 and lines[1] <= 0, (width, lines)
        outside = browser.run("""document.querySelector('.hero .why').textContent = 'a thermometer is constant '.repeat(20);
          return Math.max(...[...document.querySelectorAll('.cell')].map((cell) => cell.getBoundingClientRect().right)) - document.querySelector('.gyro').getBoundingClientRect().right""")
        assert outside <= 0, f"a long problem moves the values off the page by {outside} px at {width} px"
    browser.size(1600, 1000)
    browser.run("location.hash = '#/'")


def phone(browser, world):
    browser.size(380, 800)
    browser.driver.refresh()
    browser.wait("tiles", lambda: len(browser.all(".tile")) == 5 and "." in browser.text(".tile .big"))
    assert browser.run("return document.documentElement.scrollWidth") == 380
    browser.picture("phone-overview", whole=True)
    browser.size(390, 844)
    open_gyro(browser)
    bottom = browser.run("return document.querySelector('.plot').getBoundingClientRect().bottom")
    assert bottom < 664, f"the first chart ends at {bottom} px, below the first screen of a phone"
    browser.size(380, 800)
    assert browser.run("return document.documentElement.scrollWidth") == 380
    small = browser.run("return [...document.querySelectorAll('.tools button')].filter((b) => b.offsetHeight < 36 || b.offsetWidth < 30).map((b) => b.textContent)")
    assert not small, f"buttons too small for touch: {small}"
    browser.picture("phone-gyro", whole=True)
    browser.size(1600, 1000)


def touch_gestures(browser, world):
    browser.size(380, 800)
    browser.fingers(True)
    open_gyro(browser)
    browser.wait("an hour", lambda: abs(span_of(browser) - 3600) < 1)
    browser.run("document.querySelector('.plot').scrollIntoView({block: 'center'})")
    end = float(shown(browser)[1])
    swipe(browser, 0.2, 0.7)
    browser.wait("half an hour earlier", lambda: abs(float(shown(browser)[1]) - end + 1800) < 300 and abs(span_of(browser) - 3600) < 1)
    pinch(browser, 0.45, 0.55, 0.2, 0.8)
    browser.wait("a sixth of the range", lambda: abs(span_of(browser) - 600) < 150)
    before = browser.run("return scrollY")
    swipe(browser, 0.5, 0.5, down=-200)
    browser.wait("a scrolled page", lambda: browser.run("return scrollY") > before + 100)
    assert abs(span_of(browser) - 600) < 150, "scrolling the page by touch changed the charts"
    key(browser, "l")
    key(browser, "4")
    browser.fingers(False)
    browser.size(1600, 1000)


def many_gyros(browser, world):
    """More than eight axes are a table of one screen, which can be sorted and filtered. It has its own fake server."""
    many = StandIn("--gyros", "48")
    try:
        browser.open(many.url)
        browser.size(1920, 1080)
        names = lambda: [name.text for name in browser.all("tbody th")]
        browser.wait("fifty rows with rates", lambda: len(names()) == 50 and all("±" in cell.text for cell in browser.all("tbody td:nth-child(4)")), 20)
        assert [cell.text for cell in browser.all("tbody td:nth-child(3)")][:2] == ["+0.004 ± 0.013", "–"]
        assert names()[:4] == ["gyro1 z", "gyro2 x", "gyro2 y", "gyro2 z"] and names()[-1] == "gyro48 z", names()
        assert browser.run("return document.documentElement.scrollHeight") <= 1080, "fifty axes are not on one screen"
        browser.picture("table")
        head = lambda text: next(button for button in browser.all("thead button") if button.text.startswith(text)).click()
        head("state")
        assert names()[0] == "gyro2 z", names()[0]
        head("name")
        head("name")
        assert names()[0] == "gyro48 z" and browser.one("thead th").get_attribute("aria-sort") == "descending"
        browser.one("input[type=search]").send_keys("gyro2 ")
        browser.wait("three rows", lambda: names() == ["gyro2 z", "gyro2 y", "gyro2 x"])
        browser.one("tbody a").click()
        browser.wait("the axis", lambda: browser.text(".hero h1") == "gyro2 z")
        browser.driver.back()
        browser.wait("the table as it was", lambda: len(names()) == 3)
    finally:
        many.close()
    browser.size(1600, 1000)
    browser.allowed.append("WebSocket")  # the closed server
    browser.open(world.url)
    browser.wait("tiles", lambda: len(browser.all(".tile")) == 5)


def large_screen(browser, world):
    browser.size(2560, 1440)
    browser.run("location.hash = '#/'")
    browser.wait("tiles", lambda: len(browser.all(".tile")) == 5)
    time.sleep(0.5)
    browser.picture("wall")
    browser.size(1600, 1000)


def wrong_token(browser, world):
    kept = browser.run("return document.cookie + JSON.stringify({...sessionStorage}) + JSON.stringify({...localStorage})")
    assert "secret" not in kept and "session" not in kept, f"a script can read the token or the cookie: {kept}"
    browser.allowed.append("/session")  # the browser's message about the wrong token
    browser.driver.delete_all_cookies()
    browser.open("about:blank")
    browser.open(world.url.replace("secret", "wrong"))
    browser.wait("the rejection", lambda: "rejected" in browser.text(".alarm"))
    browser.open("about:blank")
    browser.open(world.url)
    browser.wait("tiles", lambda: len(browser.all(".tile")) == 5)


def console_messages_are_found(browser, world):
    """complaints() returns a violation of the content security policy; the other tests rely on it."""
    before = len(browser.complaints())
    browser.run("document.body.setAttribute('style', 'color: red')")
    browser.wait("a console message", lambda: len(browser.complaints()) == before + 1)
    browser.said.pop()


TESTS = [overview, difference_at_rest, names_are_data, zoom_and_pan, cursor, thirty_days, long_view_is_built, disk_hangs, rejected_requests_are_repeated,
         saved_files, times_in_fields_and_address, several_curves_in_one_chart, charts_of_what_is_measured, vertical_zoom, hover_moves_nothing, labels_have_room,
         dark_theme, printed, prismd_stopped, server_stalls, no_instance_runs, computer_slept, hidden_tab, time_goes_back, no_gaps,
         cursor_leaves, addresses, no_data_for_hours, keyboard, narrow_windows, phone, touch_gestures, many_gyros, large_screen, wrong_token,
         console_messages_are_found]
