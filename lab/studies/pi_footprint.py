"""Measure what the extra ``hardware`` downloads on a Raspberry Pi 5.

Usage: ``.venv/bin/python -m lab.studies.pi_footprint``; needs the package index, and says so
where it cannot be reached. Nothing is installed.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from urllib.error import URLError
from urllib.request import Request, urlopen

LIMIT = 60.0  # Greatest download [MB]
PYTHON = "3.11"  # Of Raspberry Pi OS Bookworm
TAGS = [f"manylinux_2_{minor}_aarch64" for minor in range(17, 37)]
"""Wheels that its C library, 2.36, takes."""


def requirements() -> list[str]:
    """Return what the package and its extra ``hardware`` ask for."""
    path = Path(__file__).resolve().parents[2] / "pyproject.toml"
    project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
    return [*project["dependencies"], *project["optional-dependencies"]["hardware"]]


def resolve(wanted: list[str]) -> list[dict]:
    """Let pip choose the wheels for a Pi and return its report; empty where it cannot."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        words = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed"]
        words += ["--quiet", "--only-binary=:all:", "--target", folder, "--implementation", "cp"]
        words += ["--python-version", PYTHON, "--report", str(report)]
        for tag in [*TAGS, "manylinux2014_aarch64", "linux_aarch64"]:
            words += ["--platform", tag]
        done = subprocess.run([*words, *wanted], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print("pip cannot resolve: " + done.stderr.strip().split("\n")[-1])
            return []
        return json.loads(report.read_text(encoding="utf-8"))["install"]


def size_of(url: str) -> float:
    """Return how long a download is [MB]."""
    with urlopen(Request(url, method="HEAD"), timeout=30) as answer:
        return float(answer.headers["Content-Length"]) / 1e6


def main() -> int:
    """Print the wheels with their sizes, and whether the sum keeps to the limit."""
    wheels = resolve(requirements())
    if not wheels:
        return 0
    total = 0.0
    for item in sorted(wheels, key=lambda each: each["metadata"]["name"]):
        try:
            size = size_of(item["download_info"]["url"])
        except (URLError, KeyError, TypeError) as error:
            print(f"the index does not tell sizes: {error}")
            return 0
        total += size
        print(f"{item['metadata']['name']:24s} {item['metadata']['version']:12s} {size:6.1f} MB")
    print(f"{len(wheels)} wheels, {total:.1f} MB; at most {LIMIT:.0f} MB")
    return int(total > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
