# SPDX-License-Identifier: MIT
"""Tests a report of prismcal in a browser, opened as a file: charts on the screen, drawings in print and without scripts.

usage: report_tests.py PICTURES_DIRECTORY BUILD_DIRECTORY
"""
import os
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
from browser import Browser
from worlds import ROOT

SHOWN = "return [...document.querySelectorAll(arguments[0])].filter((e) => e.getClientRects().length > 0).length"
CHARTED = "return document.querySelectorAll('figure.charted').length"


def make_report(folder, programs):
    """Makes a report of two simulated recordings whose directory names contain markup; returns its URL."""
    with open(os.path.join(ROOT, "config/frames/trplg.json")) as file:
        frames = file.read().replace('"rate_hz": 200', '"rate_hz": 2')
    with open(f"{folder}/frames.json", "w") as file:
        file.write(frames)
    with open(f"{folder}/gyro.json", "w") as file:
        file.write('{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}')
    steps = []
    for seed in "1", "2":
        steps.append(("tools/prismsim/prismsim", "--profile", "paper", "--hours", "12", "--frames", "frames.json", "--seed", seed, "--out", f"{seed}.pcap"))
        steps.append(("daemon/prismd", "gyro.json", "--replay", f"{seed}.pcap", "--out", f"<i>cycle{seed}"))
    steps.append(("tools/prismcal/prismcal", "report", "<i>cycle1", "<i>cycle2", "--models", "ladder", "--out", "report"))
    for program, *arguments in steps:
        done = subprocess.run([os.path.join(programs, program), *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        assert done.returncode == 0, f"{program}: {done.stderr}"
    return f"file://{folder}/report/report.html"


def scroll_through(browser):
    for top in range(0, browser.run("return document.documentElement.scrollHeight"), 600):
        browser.run("scrollTo(0, arguments[0])", top)
        time.sleep(0.1)


def charts(browser, url):
    browser.open(url)
    figures = len(browser.all("figure"))
    browser.one("figure").location_once_scrolled_into_view
    browser.wait("the first charts", lambda: browser.run(CHARTED) > 0)
    assert browser.run(CHARTED) < figures / 2, "found charts that were drawn far outside the screen"
    scroll_through(browser)
    browser.wait("all charts", lambda: browser.run(CHARTED) == figures)
    assert browser.run(SHOWN, "figure > svg") == 0 and browser.run(SHOWN, ".charts canvas") > figures
    assert "<i>cycle2" in browser.text("#r1_bias figcaption") and not browser.all("figcaption i"), browser.text("#r1_bias figcaption")
    assert browser.run("return performance.getEntriesByType('resource').length") == 0, "the report loaded another file"
    browser.picture("report", whole=True)


def labels(browser, figure):
    """Returns the x labels of each panel of a figure."""
    return browser.run("""return [...document.querySelectorAll(`#${arguments[0]} .panel`)].map(
      (panel) => [...panel.querySelectorAll(".dygraph-axis-label-x")].map((label) => label.textContent).join(" "))""", figure)


def mouse(browser, kind, part, figure, buttons=0, clicks=1):
    left, width, top = browser.run("const p = document.querySelector(`#${arguments[0]} .plot`).getBoundingClientRect(); return [p.left + 74, p.width - 90, p.top + 60]", figure)
    browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": left + part * width, "y": top, "button": "none" if kind == "mouseMoved" and not buttons else "left",
                                                               "buttons": buttons, "clickCount": clicks})


def values_and_zoom(browser, url):
    figure = "recording0_record"
    browser.run("document.getElementById(arguments[0]).scrollIntoView()", figure)
    mouse(browser, "mouseMoved", 0.5, figure)
    values = lambda: browser.run("return [...document.querySelectorAll(`#${arguments[0]} .value`)].map((value) => value.textContent)", figure)
    browser.wait("a value in every panel", lambda: all(values()) and len(values()) >= 3)
    hours = float(browser.text(f"#{figure} .at").removeprefix("at "))
    assert 5 < hours < 7, hours
    before = labels(browser, figure)
    mouse(browser, "mousePressed", 0.25, figure, 1)
    for part in (0.3, 0.4, 0.5):
        mouse(browser, "mouseMoved", part, figure, 1)
    mouse(browser, "mouseReleased", 0.5, figure)
    browser.wait("every panel from 3 h to 6 h", lambda: len(set(labels(browser, figure))) == 1 and labels(browser, figure) != before and labels(browser, figure)[0].split()[-1] in ("5.5", "6.0", "6"))
    browser.picture("report-zoomed")
    for clicks in (1, 2):
        mouse(browser, "mousePressed", 0.5, figure, 1, clicks)
        mouse(browser, "mouseReleased", 0.5, figure, 0, clicks)
    browser.wait("the complete range again", lambda: labels(browser, figure) == before)


def print_layout(browser, url):
    figures = len(browser.all("figure"))
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert browser.run(SHOWN, "figure > svg") == figures and browser.run(SHOWN, ".charts canvas") == 0
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def dark_theme_and_phone(browser, url):
    browser.theme("dark")
    browser.picture("report-night")
    browser.size(380, 800)
    browser.open(url)
    scroll_through(browser)
    wide = browser.run("return [...document.querySelectorAll('.charts')].filter((e) => e.scrollWidth > innerWidth).length")
    assert wide == 0, f"{wide} charts are wider than a phone"
    browser.run("document.getElementById('r1_bias').scrollIntoView()")
    browser.picture("report-phone")
    browser.size(1280, 1000)
    browser.theme("light")


def without_scripts(browser, url):
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    browser.open(url)
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert browser.run(SHOWN, "figure > svg") == len(browser.all("figure")) and browser.run(CHARTED) == 0


def main(pictures, programs):
    with tempfile.TemporaryDirectory(prefix="prism-report.") as folder:
        url = make_report(folder, os.path.abspath(programs))
        browser = Browser(1280, 1000, pictures=pictures)
        try:
            for test in (charts, values_and_zoom, print_layout, dark_theme_and_phone, without_scripts):
                test(browser, url)
                assert not browser.complaints(), browser.complaints()
                print(f"ok      {test.__name__}", flush=True)
        finally:
            browser.close()


main(*sys.argv[1:])
