#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures time and memory of the page in Debian's Chromium. A benchmark, not a test: it has no limits.

usage: figures.py [paint | work | memory | days | year] [--programs BUILD]
--programs: prismsim, prismd and prismweb of this build directory; default: the fake server (not for days and year)
paint: time from the request of the page until an hour of one gyro is drawn, and from the key "30 d" until 30 days are; five times each
work: CPU time of the renderer's main thread during one minute of a view of an hour, per task and per second
memory: heap and elements every five minutes: two hours with the programs, of which the first fills the charts; or one hour of data
from the fake server, at 20 times the speed, with full charts
days: with 30 days in prismd's log: time to build prismweb's minutes, their size, time of `range`, time from the key "30 d" until drawn,
and from a click on the button
year: the same with 365 days (5 GB in TMPDIR, 15 minutes), and of the key "365 d"; the log is simulated, as its header states
"""
import argparse
import asyncio
import functools
import json
import math
import time
import urllib.parse
import urllib.request

import aiohttp
from acts import key, open_gyro
from browser import Browser
from worlds import Real, StandIn

OBSERVE = """window.spent = []; new PerformanceObserver((list) => window.spent.push(...list.getEntries().map((e) => [e.name, e.startTime, e.duration])))
  .observe({type: "measure"})"""
DAYS = {"days": 30, "year": 365}  # of prismd's log
DRAWN = "return window.spent.filter((entry) => entry[0] === 'prism-drawn')[0]?.[2] ?? null"


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, math.ceil(share * len(values)) - 1)] if values else math.nan


def told(name, values):
    print(f"{name}: median {quantile(values, 0.5):.1f} ms, p95 {quantile(values, 0.95):.1f} ms, max {max(values):.1f} ms, n = {len(values)}")


def watch(browser):
    browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": OBSERVE})


def paint(browser, url, name, axis):
    watch(browser)
    browser.open(url)
    open_gyro(browser, name, axis)
    for what, digit in (("an hour", "4"), ("30 days", "8")):
        times = []
        for _ in range(5):
            browser.driver.refresh()  # at the address of the gyro, as a user would
            browser.wait("charts", lambda: browser.run(DRAWN), 20)
            if digit == "4":
                times.append(browser.run(DRAWN))
                continue
            times.append(thirty_days_drawn(browser))
        told(f"first paint, {what}", times)


async def traced(address, seconds):
    """Returns Chromium's trace events of this number of seconds."""
    with urllib.request.urlopen(f"http://{address}/json/version") as answer:
        url = json.load(answer)["webSocketDebuggerUrl"]
    events = []
    async with aiohttp.ClientSession() as session, session.ws_connect(url, max_msg_size=0) as ws:
        await ws.send_json({"id": 1, "method": "Tracing.start", "params": {"categories": "disabled-by-default-devtools.timeline", "transferMode": "ReportEvents"}})
        await asyncio.sleep(seconds)
        await ws.send_json({"id": 2, "method": "Tracing.end"})
        async for message in ws:
            said = json.loads(message.data)
            if said.get("method") == "Tracing.dataCollected":
                events += said["params"]["value"]
            if said.get("method") == "Tracing.tracingComplete":
                return events


def work(browser, url, name, axis, seconds=60):
    watch(browser)
    browser.open(url)
    open_gyro(browser, name, axis)
    time.sleep(3)
    browser.run("window.spent = []")
    events = asyncio.run(traced(browser.driver.capabilities["goog:chromeOptions"]["debuggerAddress"], seconds))
    mains = {(e["pid"], e["tid"]) for e in events if e["name"] == "thread_name" and e["args"]["name"] == "CrRendererMain"}
    tasks = [e for e in events if e["name"] == "RunTask" and e["ph"] == "X" and (e["pid"], e["tid"]) in mains]
    busiest = max({e["pid"] for e in tasks}, key=lambda pid: sum(e["dur"] for e in tasks if e["pid"] == pid))
    tasks = [(e["ts"] / 1e6, e["tdur"] / 1e3) for e in tasks if e["pid"] == busiest]
    told("main thread, tasks of at least 0.1 ms", [ms for _, ms in tasks if ms >= 0.1])
    sums = {}
    for at_s, ms in tasks:
        sums[int(at_s)] = sums.get(int(at_s), 0) + ms
    told("main thread, all tasks of a second", list(sums.values()))
    for entry in ("prism-chart", "prism-update"):
        told(f"{entry}, script", [ms for what, _, ms in browser.run("return window.spent") if what == entry])


def memory(browser, url, name, axis, speed, minutes):
    browser.open(url)
    open_gyro(browser, name, axis)
    browser.driver.execute_cdp_cmd("Performance.enable", {})
    for minute in range(0, minutes + 1, 5):
        browser.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        metrics = {m["name"]: m["value"] for m in browser.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]}
        print(f"{minute:3} min of rows: heap {metrics['JSHeapUsedSize'] / 2**20:.2f} MiB, {metrics['Nodes']:.0f} nodes, {metrics['JSEventListeners']:.0f} listeners", flush=True)
        if minute < minutes:
            time.sleep(300 / speed)


def span_drawn(browser, span, act):
    """Returns the time from the key or click of act() until the rows of a span, as "30 d", are drawn, in ms."""
    browser.run("""window.spent = []; delete window.begin;
      for (const type of ["keydown", "click"]) addEventListener(type, (event) => { window.begin ??= event.timeStamp; }, {capture: true, once: true})""")
    act()
    drawn = lambda: f"{span} until" in browser.one(".chart").get_attribute("aria-label") and browser.run("return window.spent.filter((e) => e[0] === 'prism-drawn').at(-1)?.[2] ?? null")
    browser.wait(span, drawn, 60)
    return drawn() - browser.run("return window.begin")


def thirty_days_drawn(browser):
    return span_drawn(browser, "30 d", lambda: key(browser, "8"))


def click_span(browser, name):
    next(button for button in browser.all(".spans button") if button.text == name).click()


def ranges(world, days):
    """Prints the time of `range` over these days, from hours and from minutes."""
    port = urllib.parse.urlsplit(world.url).port
    with open(f"{world.path}/prismweb-{port}.token") as file:
        header = {"Authorization": f"Bearer {file.read().strip()}"}
    for source, points in (("hours", 1000), ("minutes", 5000)) if days == 30 else (("hours", 600), ("hours", 5000)):
        times = []
        for _ in range(20):
            begin = time.monotonic()
            with urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{port}/api/gyro1/range?seconds={86400 * days}&points={points}", headers=header)) as answer:
                found = json.load(answer)
            times.append(1000 * (time.monotonic() - begin))
        assert found["source"] == source, found["source"]
        told(f"range of {days} days, {len(found['rows'])} steps of {source}", times)


def days(browser, world, count):
    begin = time.monotonic()
    world.url = world.start_prismweb()
    watch(browser)
    browser.open(world.url)
    open_gyro(browser, "gyro1", "z")
    key(browser, "8" if count == 30 else "9")
    said = {browser.wait("the progress", lambda: browser.text(".busy"))}
    while "log read" in (browser.text(".busy") or ""):
        said.add(browser.text(".busy"))
        time.sleep(0.2)
    print(f"minutes of {world.rows()} rows: built after {time.monotonic() - begin:.1f} s, {world.stored_bytes() / 1024:.0f} KiB; "
          f"the page showed {len(said)} progress texts")
    ranges(world, count)
    for span, digit in [("30 d", "8"), ("365 d", "9")] if count == 365 else [("30 d", "8")]:
        for name, act in [("key", lambda: key(browser, digit)), ("click", lambda: click_span(browser, span))]:
            times = []
            for _ in range(5):
                browser.driver.refresh()
                browser.wait("charts", lambda: browser.run(DRAWN), 60)
                times.append(span_drawn(browser, span, act))
            told(f"{span} with the programs, {name}: {browser.one('.chart').get_attribute('aria-label').split(', ')[-1]}", times)


def hour_of_rows(programs):
    """Starts the real programs; returns when prismd's log has an hour of rows. The gyro keeps running."""
    world = Real(programs, hurry=True)
    while world.rows() < 3700:
        time.sleep(0.5)
    return world


def world_of(what, programs):
    if not programs:
        return StandIn("--speed", "20" if what == "memory" else "1")
    if what in DAYS:
        return Real(programs, days=DAYS[what])
    return Real(programs) if what == "memory" else hour_of_rows(programs)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", nargs="?", choices=["paint", "work", "memory", *DAYS])
    parser.add_argument("--programs")
    options = parser.parse_args()
    for what in [options.what] if options.what else ["paint", "work", "memory"]:
        world = world_of(what, options.programs)
        browser = Browser()
        try:
            if what in DAYS:
                days(browser, world, DAYS[what])
                continue
            act = {"paint": paint, "work": work, "memory": functools.partial(memory, **({"speed": 1, "minutes": 120} if options.programs else {"speed": 20, "minutes": 60}))}[what]
            act(browser, world.url, "gyro1" if options.programs else "gyro2", "z")
        finally:
            browser.close()
            world.close()


if __name__ == "__main__":
    main()
