# SPDX-License-Identifier: BSD-3-Clause
"""A headless Chromium, driven by Selenium."""

import json
import shutil
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service


def find_driver():
    return shutil.which("chromedriver")


class Browser:
    """One page of a fixed size. WebGL is drawn by SwiftShader."""

    def __init__(self, driver, width=1280, height=800):
        options = webdriver.ChromeOptions()
        for argument in (
            "--headless",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--hide-scrollbars",
        ):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service(driver), options=options)
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def quit(self):
        self.driver.quit()

    def call(self, method, **parameters):
        return self.driver.execute_cdp_cmd(method, parameters)

    def open(self, url):
        self.driver.get("about:blank")
        self.problems()
        self.requests()
        self.driver.get(url)

    def problems(self):
        """What the page has complained of since the last time."""
        entries = self.driver.get_log("browser")
        return [entry["message"] for entry in entries if entry["level"] in ("SEVERE", "WARNING")]

    def requests(self):
        """Addresses that the page has asked for since the last time."""
        events = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        return [
            event["params"]["request"]["url"]
            for event in events
            if event["method"] == "Network.requestWillBeSent"
        ]

    def evaluate(self, expression):
        return self.driver.execute_script(f"return {expression}")

    def wait_for(self, expression, seconds=60):
        end = time.monotonic() + seconds
        while not self.evaluate(expression):
            if time.monotonic() > end:
                raise TimeoutError(f"the page never gets to: {expression}")
            time.sleep(0.05)

    def screenshot(self):
        """Bytes of a PNG file."""
        return self.driver.get_screenshot_as_png()

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x0, y0, x1, y1):
        self.mouse("mousePressed", x0, y0, button="left", buttons=1, clickCount=1)
        for i in range(1, 6):
            self.mouse("mouseMoved", x0 + (x1 - x0) * i / 5, y0 + (y1 - y0) * i / 5, buttons=1)
        self.mouse("mouseReleased", x1, y1, button="left", clickCount=1)
