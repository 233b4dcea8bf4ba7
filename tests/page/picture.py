#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A picture of one gyro's page as it stands. usage: picture.py URL NAME AXIS KEY-OF-THE-SPAN FILE.png"""
import os
import sys

from acts import key, open_gyro, span_of
from browser import Browser

SPAN_S = {"4": 3600, "5": 6 * 3600, "6": 24 * 3600}


def main():
    url, name, axis, span, file = sys.argv[1:]
    folder, picture = os.path.split(os.path.abspath(file))
    browser = Browser(1280, 900, pictures=folder)
    try:
        browser.open(url)
        open_gyro(browser, name, axis)
        browser.wait("charts", lambda: browser.all(".chart"), 20)
        key(browser, span)
        browser.wait("the span", lambda: span_of(browser) >= 0.9 * SPAN_S[span], 20)
        browser.wait("that nothing is under way", lambda: not browser.text(".busy"), 30)
        browser.wait("a state", lambda: "connected" in browser.text("header"), 20)
        browser.picture(os.path.splitext(picture)[0])
    finally:
        browser.close()


if __name__ == "__main__":
    main()
