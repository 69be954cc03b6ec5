"""Pages in a real browser: Chromium without a window, driven by its command line alone."""

import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

WIDTHS = (1280, 400)  # [px] a desk and a phone
LEAST_LETTER = 8.0  # [px] smaller letters are guessed, not read
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
PATIENCE = 120  # [s] it takes two; a busy machine takes longer
MEASURE = """
<!DOCTYPE html><html><body><pre id="seen"></pre><script>
const pages = PAGES, widths = WIDTHS, seen = [];
function look(page, width) {
  return new Promise(done => {
    const frame = document.createElement("iframe");
    frame.style.width = width + "px"; frame.style.height = "900px"; frame.style.border = "0";
    frame.onload = () => {
      const inside = frame.contentDocument, drawings = [...inside.querySelectorAll("svg")];
      const letters = drawings.flatMap(drawing => {
        const scale = drawing.getBoundingClientRect().width / drawing.viewBox.baseVal.width;
        return [...drawing.querySelectorAll("text")].map(
          text => scale * parseFloat(frame.contentWindow.getComputedStyle(text).fontSize));
      });
      seen.push({
        page: page, width: width, needed: inside.documentElement.scrollWidth,
        height: inside.documentElement.scrollHeight, letter: Math.min(...letters),
        drawings: drawings.map(drawing => drawing.getBoundingClientRect().width),
        loaded: frame.contentWindow.performance.getEntriesByType("resource").map(r => r.name),
      });
      frame.remove(); done();
    };
    frame.src = page; document.body.appendChild(frame);
  });
}
(async () => {
  for (const page of pages) for (const width of widths) await look(page, width);
  document.getElementById("seen").textContent = JSON.stringify(seen);
})();
</script></body></html>
"""


@dataclass(frozen=True, kw_only=True)
class View:
    """What a browser made of one page at one width."""

    page: str
    width: int  # Room that it had [px]
    needed: int  # Width that it took [px]; more than it had makes a reader scroll sideways
    height: int  # [px]
    letter: float  # Smallest letters in its drawings [px]
    drawings: list[float]  # Width of each drawing [px]
    loaded: list[str]  # Addresses of everything that it loaded besides itself


def find_browser() -> str | None:
    """Return the program, if there is one here."""
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


def look_at(
    browser: str, folder: Path, pages: Sequence[str], widths: Sequence[int]
) -> tuple[list[View], list[str]]:
    """Open pages of a folder at some widths; return what was seen, and the console's messages."""
    text = MEASURE.replace("PAGES", json.dumps(list(pages)))
    measure = folder / "measure.html"
    measure.write_text(text.replace("WIDTHS", json.dumps(list(widths))), encoding="utf-8")
    said, console = opened(browser, measure, folder / "profile")
    (found,) = re.findall(r'<pre id="seen">(.*?)</pre>', said, re.DOTALL)
    return [View(**entry) for entry in json.loads(found.replace("&amp;", "&"))], console


def opened(browser: str, page: Path, profile: Path) -> tuple[str, list[str]]:
    """Open a page from the disk; return what its scripts made of it, and the console's messages."""
    run = subprocess.run(
        [
            browser,
            "--headless",
            "--no-sandbox",  # containers have no user namespaces
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--host-resolver-rules=MAP * ~NOTFOUND",  # no name leads anywhere
            "--allow-file-access-from-files",  # the page may look into its frames
            f"--user-data-dir={profile}",
            "--window-size=1400,1000",
            "--virtual-time-budget=20000",
            "--enable-logging=stderr",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    return run.stdout, [line for line in run.stderr.splitlines() if ":CONSOLE" in line]
