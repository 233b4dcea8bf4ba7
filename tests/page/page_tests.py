#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests the page in Debian's Chromium. usage: page_tests.py PICTURES_DIRECTORY BUILD_DIRECTORY"""
import sys
import time
import traceback

sys.dont_write_bytecode = True
import real_tests
import stand_in_tests
from browser import Browser
from worlds import SCRIPT, Real, RealAxes, StandIn


def run(tests, world, browser):
    failed = 0
    for test in tests:
        begin = time.monotonic()
        try:
            test(browser, world)
            complaints = browser.complaints()
            assert not complaints, f"unexpected console messages: {complaints}"
            print(f"ok      {test.__name__} ({time.monotonic() - begin:.1f} s)", flush=True)
        except Exception:
            failed += 1
            browser.picture(f"failed-{test.__name__}")
            print(f"FAILED  {test.__name__}\n{traceback.format_exc(limit=-2)}", flush=True)
            browser.said.clear()
    return failed


def main(pictures, programs):
    failed = 0
    worlds = [(lambda: StandIn("--name", SCRIPT), stand_in_tests.TESTS),
              (lambda: RealAxes(programs, valid_s=10), real_tests.AXES_TESTS),
              (lambda: Real(programs), real_tests.TESTS)]
    for make, tests in worlds:
        world = make()
        try:
            browser = Browser(pictures=pictures)
            try:
                failed += run(tests, world, browser)
            finally:
                browser.close()
        finally:
            world.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
