"""Measure a gallery of 10,000 samples in headless Chromium, opened from the disk.

    python -m benchmarks.gallery --chromium chromium

The index is of the first rows of the corpus, as they are; their posters and previews
are a few that are linked again and again, each under a name of its own, so that a
browser reads and decodes each anew. benchmarks/gallery.md has what it has printed.
"""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.loaders.gallery.index import index_of
from mpmworlds.loaders.gallery.site import Site
from mpmworlds.sim.run.preview import encode_preview, poster
from mpmworlds.sim.scene.palette import PALETTE, rgb

DISTINCT = 24
EMPTY = """<!doctype html><title>empty</title><p>nothing</p><script>
requestAnimationFrame(() => requestAnimationFrame(() => fetch(
  `http://127.0.0.1:${/port=(\\d+)/.exec(location.search)[1]}/`, { method: "POST",
  mode: "no-cors", body: JSON.stringify({ painted: performance.now() }) })));
</script>
"""
QUIET = ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run")
WINDOW = "--window-size=1400,900"


def made_up(out: Path, count: int) -> None:
    """Write a gallery of the first rows of the corpus, with pictures of none."""
    rows = read_table(recorded_manifest("full")).slice(0, count).to_pylist()
    shown = [
        (poster(clip), encode_preview(clip, 15)) for clip in map(_clip, range(DISTINCT))
    ]
    names: dict[str, set[str]] = {}
    with Site(out) as site:
        (out / "previews").mkdir(parents=True)
        for number, row in enumerate(rows):
            for suffix, data in zip(
                ("png", "mp4"), shown[number % DISTINCT], strict=True
            ):
                path = out / f"previews/{number % DISTINCT}.{suffix}"
                if not path.exists():
                    path.write_bytes(data)
                os.link(path, out / f"previews/{row['id']}.{suffix}")
            names[row["id"]] = {f"previews/{row['id']}.{s}" for s in ("png", "mp4")}
        for name in names:
            site.complete(name, "made up")
        site.finish(index_of(rows, f"{count} samples", exact=False), names)


def _clip(seed: int) -> np.ndarray:
    """Discs that drift, as large and as many-coloured as a real frame."""
    rng = np.random.default_rng(seed)
    colors = np.array([rgb(color) for color in PALETTE.values()], np.uint8)
    rows, columns = np.mgrid[:256, :256]
    frames = np.zeros((150, 256, 256, 3), np.uint8)
    for color in colors[rng.permutation(len(colors))[:4]]:
        x, y, u, v = rng.uniform([30, 30, -1, -1], [226, 226, 1, 1])
        for t, frame in enumerate(frames):
            near = (columns - x - u * t) ** 2 + (rows - y - v * t) ** 2 < 900
            frame[near] = color
    return frames


class _Report(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.found = json.loads(body)  # type: ignore[attr-defined]
        self.send_response(204)
        self.end_headers()

    def log_message(self, *message: Any) -> None:
        """Keep the output clean."""


def measured(page: Path, chromium: str) -> dict[str, float]:
    """What a fresh browser reports of a page that measures itself."""
    with (
        HTTPServer(("127.0.0.1", 0), _Report) as server,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home,
    ):
        server.timeout = 120
        url = f"{page.as_uri()}?port={server.server_port}"
        command = [chromium, *QUIET, WINDOW, f"--user-data-dir={home}", url]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as browser:
            server.handle_request()
            browser.terminate()
        return dict(server.found)  # type: ignore[attr-defined]


def main() -> None:
    """Print a table of medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chromium", default="chromium", help="the browser")
    parser.add_argument("--count", type=int, default=10_000, help="samples")
    parser.add_argument("--rounds", type=int, default=5, help="fresh browsers")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "site"
        made_up(out, options.count)
        page, script = out / "index.html", Path(__file__).with_name("measure.js")
        (out / "measure.js").write_bytes(script.read_bytes())
        text = page.read_text("utf-8")
        tag = '<script src="measure.js"></script></body>'
        page.write_text(text.replace("</body>", tag), "utf-8")
        (out / "empty.html").write_text(EMPTY)
        found = []
        for _ in range(options.rounds):
            empty = measured(out / "empty.html", options.chromium)
            found.append({"a page with nothing on it": empty["painted"]})
            found[-1] |= measured(page, options.chromium)
        sizes = {name: (out / name).stat().st_size for name in ("data.js", "words.js")}
    print(f"| of {options.count:,} samples | median | largest |\n|---|---:|---:|")
    for name in found[0]:
        values = [some[name] for some in found]
        print(f"| {name} | {statistics.median(values):.0f} | {max(values):.0f} |")
    for name, size in sizes.items():
        print(f"| {name} [kB] | {size / 1e3:.0f} | |")


if __name__ == "__main__":
    main()
