# SPDX-License-Identifier: BSD-3-Clause
"""Takes a still of a page that `fcl_fibers view` has written, in a headless Chromium, and prints
what the page counts. Several pages stand side by side. The keys are those of docs/program.md."""

import argparse
import io
import sys
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[2] / "tests/tools"))
from browser import Browser, find_driver  # noqa: E402

VIEWER = "document.querySelector('.fiber-viewer')"
GAP = 4  # pixels between pages
MOST_BYTES = 250_000  # a picture that is larger gets fewer colours


def taken(address, width, height):
    page, _, keys = address.partition("#")
    browser = Browser(find_driver(), width, height)
    try:
        browser.open(f"{Path(page).resolve().as_uri()}#bare=1&{keys}")
        browser.wait_for(f"{VIEWER}.dataset.state === 'drawn'")
        print(browser.evaluate(f"{VIEWER}.querySelector('.counts').textContent"))
        return Image.open(io.BytesIO(browser.screenshot())).convert("RGB")
    finally:
        browser.quit()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="+", metavar="PAGE.html[#keys]")
    parser.add_argument("out", metavar="OUT.png")
    parser.add_argument("--width", type=int, default=1200, help="of all pages together, in pixels")
    parser.add_argument("--height", type=int, default=750, help="in pixels")
    given = parser.parse_args()
    count = len(given.pages)
    width = (given.width - GAP * (count - 1)) // count
    still = Image.new("RGB", (count * (width + GAP) - GAP, given.height), "#4a515f")
    for i, page in enumerate(given.pages):
        still.paste(taken(page, width, given.height), (i * (width + GAP), 0))
    # Other methods lose the colours of what is small.
    method = Image.Quantize.LIBIMAGEQUANT
    for colours in (256, 128):
        still.quantize(colours, method=method).save(given.out, optimize=True)
        if Path(given.out).stat().st_size < MOST_BYTES:
            break


if __name__ == "__main__":
    main()
