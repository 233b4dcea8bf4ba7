# SPDX-License-Identifier: MIT
"""The page before the real programs: a simulated gyro that is unplugged while somebody looks, a prismd and a prismweb that are killed."""
import signal
import time

from worlds import SCRIPT

STRUCK = "return getComputedStyle(document.querySelector('.hero .big')).textDecorationLine === 'line-through'"


def live(browser, world):
    browser.open(world.url)
    browser.wait("a tile that is good", lambda: browser.all(".tile.good:not(.old)"), 30)
    assert browser.text(".tile .word") == "good" and browser.text(".tile h2") == "gyro1 z"
    first = browser.text(".tile .big")
    browser.wait("a rate that moves", lambda: browser.text(".tile .big") != first, 4)
    browser.picture("real-overview")


def look(browser, world):
    browser.one(".tile").click()
    assert browser.text(".hero h1") == "gyro1 z"
    browser.wait("the model's name, as text", lambda: SCRIPT in browser.text(".cell.model"))
    assert "taken" not in browser.driver.title and browser.run("return document.querySelectorAll('main script, main img').length") == 0
    assert abs(float(browser.text(".hero .big")) - 8.465) < 1, browser.text(".hero .big")
    browser.wait("the domain of the model", lambda: "trained" in browser.text(".gauges"))
    browser.wait("events of prismd", lambda: "receiving" in browser.text(".events"))
    browser.wait("the line's health", lambda: "921\u2009600 baud" in browser.text(".line"))
    browser.picture("real-gyro", whole=True)


def unplugged(browser, world):
    world.unplug()
    begin = time.monotonic()
    browser.wait("the values struck", lambda: browser.run(STRUCK), 4)
    told_s = time.monotonic() - begin
    assert browser.one(".hero .word").text in ("connecting", "silent", "lost", "absent", "no_data"), browser.one(".hero .word").text
    browser.wait("the event", lambda: browser.all(".events .care, .events .bad"), 4)
    assert "old" in browser.text(".hero .age")
    assert "gyro1" in browser.driver.title
    browser.picture("real-unplugged")
    time.sleep(3)
    assert browser.run(STRUCK), "an unplugged gyro shows its numbers as if they were live"
    world.plug()
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 30)
    print(f"        told {told_s:.1f} s after the plug was pulled")


def prismd_restarted(browser, world):
    world.end("prismd")
    begin = time.monotonic()
    browser.wait("the values struck", lambda: browser.run(STRUCK), 4)
    assert browser.one(".hero .word").text == "prismd is gone", browser.one(".hero .word").text
    print(f"        told {time.monotonic() - begin:.1f} s after prismd was killed")
    browser.picture("real-prismd-gone")
    world.start_prismd()
    browser.wait("good again", lambda: browser.all(".numbers.good:not(.old)"), 30)


def prismweb_restarted(browser, world):
    port = int(world.url.split(":")[2].split("/")[0])
    browser.allowed.append("WebSocket connection to")  # the browser's own word on a connection that is refused
    world.end("prismweb", signal.SIGTERM)
    browser.wait("the alarm", lambda: browser.one(".alarm").is_displayed(), 3)
    assert "prismweb" in browser.text(".alarm") and browser.run(STRUCK)
    browser.picture("real-cut")
    world.url = world.start_prismweb(port)
    browser.wait("a word on the token, which is another one", lambda: "refused this page" in browser.text(".alarm"), 15)
    browser.open(world.url)
    browser.wait("good again", lambda: browser.all(".tile.good:not(.old)"), 15)


TESTS = [live, look, unplugged, prismd_restarted, prismweb_restarted]
