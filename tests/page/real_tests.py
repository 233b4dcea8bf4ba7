# SPDX-License-Identifier: MIT
"""Tests the page with the real programs: a simulated gyro is unplugged, prismd is killed, prismweb is stalled and restarted."""
import csv
import glob
import os
import signal
import time

from acts import holes, open_gyro, saved_table
from browser import Browser
from worlds import SCRIPT

STRUCK = "return getComputedStyle(document.querySelector('.hero .big')).textDecorationLine === 'line-through'"


def live_overview(browser, world):
    browser.open(world.url)
    browser.wait("a good tile", lambda: browser.all(".tile.good:not(.old)"), 30)
    assert browser.text(".tile .word") == "good" and browser.text(".tile h2") == "gyro1 z"
    first = browser.text(".tile .big")
    browser.wait("a new rate", lambda: browser.text(".tile .big") != first, 4)
    browser.picture("real-overview")


def gyro_view(browser, world):
    browser.one(".tile").click()
    browser.wait("the gyro", lambda: browser.text(".hero h1") == "gyro1 z")
    browser.wait("the model's name, as text", lambda: SCRIPT in browser.text(".cell.model"))
    assert "taken" not in browser.driver.title and browser.run("return document.querySelectorAll('main script, main img').length") == 0
    rate = browser.text(".cell.corrected .value") or browser.text(".hero .big")
    assert abs(float(rate.split()[0]) - 8.465) < 1, rate
    browser.wait("the domain of the model", lambda: "trained" in browser.text(".gauges"))
    browser.wait("events of prismd", lambda: "receiving" in browser.text(".events"))
    browser.wait("line health", lambda: "921\u2009600 baud" in browser.text(".line"))
    browser.picture("real-gyro", whole=True)


def rows_of_log(browser, world):
    """The charts show the rows that prismd wrote."""
    browser.one(".spans button").click()
    browser.wait("a minute with rows of 1 s", lambda: "rows of 1.0 s" in browser.one(".chart").get_attribute("aria-label"))
    time.sleep(2)
    log = {}
    for path in glob.glob(world.path + "/log/*.csv"):
        with open(path) as file:
            log.update({row["time_s"]: row for row in csv.DictReader(line for line in file if not line.startswith("#"))})
    table = [row for row in saved_table(browser) if row["time_s"] in log]
    assert len(table) >= 10, (len(table), len(log))
    for row in table:
        for name in ("rate_deg_per_h", "corrected_deg_per_h", "bias_deg_per_h"):
            found, expected = row["mean_" + name], log[row["time_s"]][name]
            assert found == expected == "" or abs(float(found) - float(expected)) < 2e-6, (name, row["time_s"], found, expected)
    browser.picture("real-rows", whole=True)


def unplugged(browser, world):
    world.unplug()
    begin = time.monotonic()
    browser.wait("crossed-out values", lambda: browser.run(STRUCK), 4)
    told_s = time.monotonic() - begin
    assert browser.one(".hero .word").text in ("unplugged", "silent", "no data"), browser.one(".hero .word").text
    browser.wait("the event", lambda: browser.all(".events .care, .events .bad"), 4)
    assert "old" in browser.text(".hero .age")
    assert "gyro1" in browser.driver.title
    browser.picture("real-unplugged")
    time.sleep(3)
    assert browser.run(STRUCK), "found values of an unplugged gyro that are not crossed out"
    world.plug()
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 30)
    print(f"        shown {told_s:.1f} s after unplugging")


def prismd_restarted(browser, world):
    world.end("prismd")
    begin = time.monotonic()
    browser.wait("crossed-out values", lambda: browser.run(STRUCK), 4)
    assert browser.one(".hero .word").text == "prismd stopped", browser.one(".hero .word").text
    print(f"        shown {time.monotonic() - begin:.1f} s after prismd was killed")
    browser.picture("real-prismd-gone")
    world.start_prismd()
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 30)
    world.end("prismd", signal.SIGTERM)
    browser.wait("crossed-out values", lambda: browser.run(STRUCK), 4)
    time.sleep(1.5)
    last = [browser.text(f".{name}") for name in ("hero .big", "cell.raw .value", "cell.temperature .value")]
    assert all("." in text for text in last), f"found {last}, expected the values before prismd's last, incomplete second"
    world.start_prismd()
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 30)


def last_row_of_the_log(browser, world):
    """A gyro without a row since prismd started shows the time of the log's last row."""
    world.end("prismd", signal.SIGTERM)
    world.unplug()
    world.start_prismd()
    browser.run("location.hash = '#/'")
    browser.driver.refresh()
    browser.wait("the time of the last row", lambda: browser.text(".tile .age").startswith("last row of 20"), 20)
    assert browser.text(".tile .word") == "unplugged" and browser.text(".tile .big") == "–", browser.text(".tile")
    browser.picture("real-last-row")
    world.plug()
    browser.wait("a good tile", lambda: browser.all(".tile.good:not(.old)"), 30)
    open_gyro(browser, "gyro1", "z")
    browser.one(".spans button").click()


def prismweb_stalls(browser, world):
    """The page shows an alarm, and afterwards fills the gap in its charts from `range`."""
    browser.allowed.append("WebSocket")  # the browser's message about the closed connection
    world.children["prismweb"].send_signal(signal.SIGSTOP)
    browser.wait("the alarm", lambda: browser.one(".alarm").is_displayed(), 9)
    assert "does not respond" in browser.text(".alarm"), browser.text(".alarm")
    browser.wait("crossed-out values", lambda: browser.run(STRUCK), 2)
    time.sleep(3)
    world.children["prismweb"].send_signal(signal.SIGCONT)
    browser.wait("the end of the alarm", lambda: not browser.one(".alarm").is_displayed(), 20)
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 15)
    browser.wait("the last 15 rows without a gap", lambda: holes(saved_table(browser)[-15:]) == [], 20)


def prismweb_restarted(browser, world):
    port = int(world.url.split(":")[2].split("/")[0])
    world.end("prismweb", signal.SIGTERM)
    browser.wait("the alarm", lambda: browser.one(".alarm").is_displayed(), 3)
    assert "prismweb" in browser.text(".alarm"), browser.text(".alarm")
    browser.wait("crossed-out values", lambda: browser.run(STRUCK), 2)
    browser.picture("real-cut")
    world.url = world.start_prismweb(port)
    browser.wait("good again with the stored cookie", lambda: browser.all(".numbers.good:not(.old)"), 15)
    world.end("prismweb", signal.SIGTERM)
    os.unlink(f"{world.path}/prismweb-{port}.token")
    world.url = world.start_prismweb(port)
    browser.wait("the alarm about the deleted token", lambda: "rejected this page" in browser.text(".alarm"), 15)
    browser.open(world.url)
    browser.wait("good again", lambda: browser.all(".tile.good:not(.old)"), 15)
    assert browser.run("return location.href + document.cookie + JSON.stringify({...sessionStorage})").find(world.url.split("=")[1]) < 0, "the token is still in the page"


def used_address_is_rejected(browser, world):
    """Another browser cannot use an address that was already opened, e.g. from a history."""
    other = Browser()
    try:
        other.open(world.url)
        other.wait("the rejection", lambda: "rejected this page" in other.text(".alarm"), 15)
        assert not other.all(".tile")
    finally:
        other.close()


def three_axes(browser, world):
    """Each axis has a tile and charts. An axis that its device marks as invalid is red and has no number; the others are unchanged."""
    browser.open(world.url)
    tiles = lambda: {tile.find_element("css selector", "h2").text: tile for tile in browser.all(".tile")}
    browser.wait("three tiles with a rate", lambda: sorted(tiles()) == ["gyro1 x", "gyro1 y", "gyro1 z"] and all("." in tile.text for tile in tiles().values()))
    browser.wait("a red tile of y", lambda: "bad" in tiles()["gyro1 y"].get_attribute("class"), 30)
    browser.wait("a tile of y without a number", lambda: "." not in tiles()["gyro1 y"].find_element("css selector", ".big").text)
    for name in ("gyro1 x", "gyro1 z"):
        assert "bad" not in tiles()[name].get_attribute("class") and "." in tiles()[name].find_element("css selector", ".big").text, tiles()[name].text
    browser.picture("real-axes")
    tiles()["gyro1 y"].click()
    browser.wait("the axis", lambda: browser.text(".hero h1") == "gyro1 y")
    browser.wait("earlier rows", lambda: "rows of" in browser.one(".chart").get_attribute("aria-label"))
    browser.picture("real-axis-invalid", whole=True)
    open_gyro(browser, "gyro1", "z")
    browser.wait("a rate of z", lambda: "." in browser.text(".hero .big"))


TESTS = [live_overview, gyro_view, rows_of_log, unplugged, prismd_restarted, last_row_of_the_log, prismweb_stalls, prismweb_restarted, used_address_is_rejected]
AXES_TESTS = [three_axes]
