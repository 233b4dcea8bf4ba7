# SPDX-License-Identifier: MIT
"""User actions on the page (mouse, touch, keys, saving), and the data that the charts show."""
import csv
import glob
import os


def place(browser, part):
    """Returns a point in the first chart's plot, in pixels of the page. `part`: 0 is the left edge, 1 the right edge."""
    left, width, top = browser.run("const p=document.querySelector('.plot').getBoundingClientRect(); return [p.left+78, p.width-106, p.top+60]")
    return left + part * width, top


def mouse(browser, kind, part, modifiers=0, buttons=0, down=0):
    x, y = place(browser, part)
    y += down
    browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left" if buttons or kind == "mouseReleased" else "none",
                                                               "buttons": buttons, "modifiers": modifiers, "clickCount": 1})


def drag(browser, begin, end, modifiers=0, down=0):
    mouse(browser, "mousePressed", begin, modifiers, 1)
    for step in range(1, 6):
        mouse(browser, "mouseMoved", begin + (end - begin) * step / 5, modifiers, 1, down * step / 5)
    mouse(browser, "mouseReleased", end, modifiers, down=down)


def touch(browser, kind, *points):
    browser.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]})


def slide(browser, begins, ends):
    """Moves one or more fingers from the points `begins` to the points `ends`, in pixels of the page."""
    between = lambda part: [tuple(a + (b - a) * part for a, b in zip(begin, end)) for begin, end in zip(begins, ends)]
    touch(browser, "touchStart", *begins)
    for step in range(1, 11):
        touch(browser, "touchMove", *between(step / 10))
    touch(browser, "touchEnd")


def swipe(browser, begin, end, down=0):
    (x, y), (x_end, _) = place(browser, begin), place(browser, end)
    slide(browser, [(x, y)], [(x_end, y + down)])


def pinch(browser, left, right, left_end, right_end):
    slide(browser, [place(browser, left), place(browser, right)], [place(browser, left_end), place(browser, right_end)])


def shown(browser):
    """Returns begin and end of the charts' time range, in seconds, as text."""
    return [browser.one(".strips").get_attribute(name) or "nan" for name in ("data-from", "data-to")]


def span_of(browser):
    begin, end = map(float, shown(browser))
    return end - begin


def open_gyro(browser, name="gyro2", axis="z"):
    browser.run("location.hash = `#/${arguments[0]}/${arguments[1]}`", name, axis)
    browser.wait("charts with rows", lambda: "rows of" in (browser.one(".chart").get_attribute("aria-label") or ""))


def key(browser, text, modifiers=0):
    codes = {"ArrowLeft": 37, "ArrowRight": 39, "Escape": 27, "Enter": 13, "Tab": 9}
    more = {"windowsVirtualKeyCode": codes[text]} if text in codes else {"text": text}
    if text == "Enter":
        more["text"] = "\r"
    for kind in ("keyDown", "keyUp"):
        browser.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": text, "modifiers": modifiers, **(more if kind == "keyDown" else {})})


def holes(table):
    """Returns the times of the rows after which seconds are missing."""
    times = [float(row["time_s"]) for row in table]
    return [before for before, after in zip(times, times[1:]) if after - before > 1]


kSaveTable = "save the charts\\' rows as a table"


def click_when_enabled(browser, label, script):
    """Runs a script with the button `label` as `button`, when it is enabled; returns its result. One script tests and clicks: a view
    that reloads in between would disable the button."""
    find = "const button = document.querySelector(arguments[0]); if (!button || button.disabled) return null; "
    return browser.wait(f"the button {label}", lambda: browser.run(find + script, f"[aria-label='{label}']"))


def saved_file(browser, label, ending):
    """Returns the bytes that the button `label` saves. Waits for content, because Chromium first creates an empty file."""
    pattern = os.path.join(browser.files, "*" + ending)
    for old in glob.glob(pattern):
        os.remove(old)
    click_when_enabled(browser, label, "button.click(); return true")
    path = browser.wait("a saved file", lambda: next(filter(os.path.getsize, glob.glob(pattern)), None))
    with open(path, "rb") as file:
        return file.read()


def rows_of(text):
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def saved_table(browser):
    """Returns the rows that the button CSV saves, taken from the page: Chromium loses some of many downloads in a row."""
    script = ("const create = URL.createObjectURL; let saved; URL.createObjectURL = (blob) => { saved = blob; return ''; }; "
              "HTMLAnchorElement.prototype.click = () => {}; button.click(); "
              "URL.createObjectURL = create; delete HTMLAnchorElement.prototype.click; return saved.text()")
    return rows_of(click_when_enabled(browser, kSaveTable, script))
