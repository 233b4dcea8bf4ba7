# SPDX-License-Identifier: MIT
"""Headless Chromium (Debian's) for the tests of the page: waiting for conditions, console messages, screenshots."""
import os
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

QUIET = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars", "--enable-precise-memory-info"]


class Browser:
    """A separate Chromium with an empty profile, which close() deletes."""

    def __init__(self, width=1600, height=1000, dark=False, pictures=None):
        self.profile = tempfile.TemporaryDirectory(prefix="prism-chromium.", ignore_cleanup_errors=True)
        options = webdriver.ChromeOptions()
        for argument in [*QUIET, f"--user-data-dir={self.profile.name}", f"--window-size={width},{height}"]:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        # of dygraphs, while a view is drawn from points of the last one
        self.pictures, self.allowed, self.said = pictures, [" points out of X bounds", " points out of Y bounds"], []
        self.files = os.path.join(self.profile.name, "files")
        os.makedirs(self.files, exist_ok=True)
        self.driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": self.files})
        self.size(width, height)
        self.theme("dark" if dark else "light")

    def size(self, width, height):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})

    def fingers(self, on):
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": on, "maxTouchPoints": 2} if on else {"enabled": False})

    def theme(self, scheme):
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})

    def open(self, url):
        self.driver.get(url)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def one(self, selector):
        found = self.all(selector)
        assert found, f"found no element {selector}"
        return found[0]

    def text(self, selector):
        """Returns the text in the document, without the effects of styles; empty if there is no such element."""
        return self.run("return document.querySelector(arguments[0])?.textContent ?? ''", selector)

    def wait(self, what, condition, seconds=10):
        """Waits until condition() is true and returns its value. The error message names `what`."""
        deadline = time.monotonic() + seconds + 60  # `seconds` are enough on an idle machine
        while True:
            found = condition()
            if found:
                return found
            assert time.monotonic() < deadline, f"not within {seconds} s: {what}; the page: {self.text('main')!r:.600}"
            time.sleep(0.05)

    def picture(self, name, whole=False):
        if not self.pictures:
            return
        os.makedirs(self.pictures, exist_ok=True)
        if whole:
            size = self.run("return [innerWidth, document.documentElement.scrollHeight, innerHeight]")
            self.size(size[0], size[1])
            time.sleep(0.6)
        self.driver.save_screenshot(os.path.join(self.pictures, f"{name}.png"))
        if whole:
            self.size(size[0], size[2])

    def complaints(self):
        """Returns the console messages, except those that the tests expect (self.allowed)."""
        self.said += [entry["message"] for entry in self.driver.get_log("browser")]
        return [text for text in self.said if not any(part in text for part in self.allowed)]

    def close(self):
        self.driver.quit()
        self.profile.cleanup()
