# SPDX-License-Identifier: MIT
"""Opens the reports of all hostile gyros and the live page in Chromium: no text may become markup."""
import json
import os
import sys

SOURCE, DIR, URL = sys.argv[1:4]
sys.path.insert(0, os.path.join(SOURCE, "tests", "page"))
from browser import Browser  # noqa: E402

UNTOUCHED = "return document.title === 'pwned' || document.querySelector('[onerror],[onmouseover],img[src=x]') !== null"


def main():
    made = json.load(open(f"{DIR}/made.json"))
    browser = Browser()
    try:
        for gyro in made:
            browser.open(f"file://{gyro['home']}/report/report.html")
            assert not browser.run(UNTOUCHED), f"{gyro['text']!r} became markup in the report"
            assert gyro["text"] in browser.run("return document.body.textContent"), f"{gyro['text']!r} is not in the report"
        browser.open(URL)
        names = [gyro["instance"] for gyro in made]
        browser.wait("all gyros on the page", lambda: all(name in browser.run("return document.body.textContent") for name in names), 30)
        assert not browser.run(UNTOUCHED), "a name became markup in the page"
    finally:
        browser.close() if hasattr(browser, "close") else browser.driver.quit()
    print(f"{len(made)} reports and the page")


main()
