#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Saves a screenshot of one axis. usage: picture.py URL GYRO AXIS SPAN_KEY FILE.png; SPAN_KEY: 4 (1 h), 5 (6 h) or 6 (24 h)"""
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
        browser.wait("the end of loading", lambda: not browser.text(".busy"), 30)
        browser.wait("a state", lambda: "connected" in browser.text("header"), 20)
        browser.picture(os.path.splitext(picture)[0])
    finally:
        browser.close()


if __name__ == "__main__":
    main()
