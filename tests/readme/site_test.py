#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether a window of usual width shows each table and each line of code of the site whole.

    docs/build.sh && tests/readme/site_test.py [FOLDER]    FOLDER gets a picture of each page
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "build" / "site"
sys.path.insert(0, str(ROOT / "tests" / "tools"))

from browser import Browser, find_driver  # noqa: E402

WIDTHS = (1300, 1400)
# The first words of what is cut off, or under the button that copies.
CUT_OFF = """(() => {
  const found = [];
  const words = (e) => e.innerText.replace(/\\s+/g, " ").slice(0, 60);
  const tell = (kind, e) => found.push(`${kind} "${words(e)}"`);
  for (const table of document.querySelectorAll("article table")) {
    const box = table.closest(".table-wrapper") || table.parentElement;
    if (box.scrollWidth > box.clientWidth + 1) tell("the table", table);
  }
  for (const pre of document.querySelectorAll("article pre")) {
    if (pre.scrollWidth > pre.clientWidth + 1) tell("the code", pre);
    const button = pre.parentElement.querySelector(".copybtn");
    if (!button) continue;
    const range = document.createRange(), b = button.getBoundingClientRect();
    range.selectNodeContents(pre);
    const covered = (r) => r.right > b.left && r.left < b.right && r.top + 1 < b.bottom;
    if ([...range.getClientRects()].some(covered)) tell("the button covers", pre);
  }
  return found;
})()"""


def main():
    pages = [SITE / "index.html", SITE / "CONTRIBUTING.html", *sorted(SITE.glob("docs/**/*.html"))]
    errors = []
    for width in WIDTHS:
        browser = Browser(find_driver(), width, 4000)
        for page in pages:
            name = page.relative_to(SITE)
            browser.driver.get(page.as_uri())
            errors += [f"{name}, {width} px: {what}" for what in browser.evaluate(CUT_OFF)]
            if len(sys.argv) > 1:
                picture = Path(sys.argv[1]) / f"{width}_{'_'.join(name.parts)}.png"
                picture.write_bytes(browser.screenshot())
        browser.quit()
    print("\n".join(errors) or f"{len(pages)} pages show all tables and code")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
