#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Saves a screenshot of the page: a week of a simulated gyro, which is then at rest for eleven minutes, until its difference from the
Earth rate is known. usage: picture.py BUILD MODEL FILE.png"""
import os
import shutil
import sys

from browser import Browser
from worlds import Real


class Week(Real):
    """A gyro with a given model and a week in its log."""

    def __init__(self, programs, model):
        self.model = model
        super().__init__(programs, days=7)
        self.url = self.start_prismweb()

    def train(self):
        self.write_frames()
        shutil.copy(self.model, os.path.join(self.path, "model.json"))


def main():
    programs, model, file = sys.argv[1:]
    folder, picture = os.path.split(os.path.abspath(file))
    world = Week(programs, model)
    browser = Browser(1280, 800, pictures=folder)
    try:
        browser.open(world.url)
        browser.wait("the gyro", lambda: browser.all(".tile"), 20)
        browser.run("location.hash = '#/gyro1/z?last=604800&rate=temperature'")
        browser.wait("the difference", lambda: "Earth rate" in (browser.text(".hero .label") or ""), 900)
        browser.wait("the end of loading", lambda: not browser.text(".busy") and "rows of 30 min" in browser.one(".chart").get_attribute("aria-label"), 60)
        browser.picture(os.path.splitext(picture)[0])
    finally:
        browser.close()
        world.close()


if __name__ == "__main__":
    main()
