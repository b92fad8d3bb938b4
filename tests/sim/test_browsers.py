"""Preview of a program and video of a release play in browsers, in their colours.

No driver of a browser is needed: a page that is served here plays the video, seeks in
it, and posts back what it sees.
"""

import json
import re
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

import cv2
import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import encode_mp4
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.browsers import BROWSERS, PATIENCE, opened
from tests.sim.scenes import BODY, FAN, JET, OBSTACLE, scene_data

FRAMES, PIXELS, RATE = 30, 128, 30
LOOKS = (0, 7, 20, FRAMES - 1)  # at frames
CLOSE = {  # mean difference of colours, of 255
    "webm": 3.0,  # the preview that a program writes, which is lossy
    "mp4": 1.0,  # the exact video of a release; browsers smooth its colours a little
}
PAGE = Path(__file__).with_name("player.html")


@dataclass(frozen=True)
class Clip:
    """Videos by their suffix, and the frames of their program."""

    videos: dict[str, bytes]
    frames: np.ndarray


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Videos of a body, an obstacle, a fan and a jet; most of it moves."""
    folder = tmp_path_factory.mktemp("clip")
    data = scene_data(BODY, OBSTACLE, FAN, JET, frames=FRAMES, pixels=PIXELS)
    program = link(Scene.from_data(data))
    (folder / "program.py").write_text(program, "utf-8")
    command = [sys.executable, "program.py", "out.webm"]
    subprocess.run(command, cwd=folder, check=True, timeout=120)
    preview, frames = (folder / "out.webm").read_bytes(), run(program).expect()
    return Clip({"webm": preview, "mp4": encode_mp4(frames, RATE)}, frames)


class Site(ThreadingHTTPServer):
    """Serves the page and a video, and keeps what the page posts."""

    def __init__(self, video, suffix):
        super().__init__(("127.0.0.1", 0), Visit)
        page = "text/html", PAGE.read_bytes()
        self.files = {"/page": page, "/video": (f"video/{suffix}", video)}
        self.posts = Queue()


class Visit(BaseHTTPRequestHandler):
    """One request; parts of a file are served, since browsers seek by them."""

    def do_GET(self):
        kind, data = self.server.files.get(self.path.partition("?")[0], (None, b""))
        part = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        start, stop = 0, len(data)
        if part:
            start, stop = int(part[1]), int(part[2] or stop - 1) + 1
        self.send_response(404 if kind is None else 206 if part else 200)
        self.send_header("Content-Type", kind or "text/plain")
        self.send_header("Accept-Ranges", "bytes")
        if part:
            self.send_header("Content-Range", f"bytes {start}-{stop - 1}/{len(data)}")
        self.send_header("Content-Length", str(len(data[start:stop])))
        self.end_headers()
        self.wfile.write(data[start:stop])

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.posts.put((self.path.strip("/"), body))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *message):
        pass


@contextmanager
def served(video, suffix):
    with Site(video, suffix) as site:
        thread = Thread(target=site.serve_forever)
        thread.start()
        try:
            yield site
        finally:
            site.shutdown()
            thread.join()


def watch(video, suffix, command_for, home):
    """What the page reports, and the pictures that it saw."""
    pictures = []
    with served(video, suffix) as site:
        times = ",".join(f"{(n + 0.5) / RATE:.4f}" for n in LOOKS)
        url = f"http://127.0.0.1:{site.server_port}/page?{times}"
        with opened(command_for(home, url), home):
            while True:
                try:
                    path, body = site.posts.get(timeout=PATIENCE)
                except Empty:
                    told = (home / "log").read_text("utf-8", "replace")[-2000:]
                    pytest.fail(f"nothing in {PATIENCE:g} s; the browser says: {told}")
                if path == "report":
                    return json.loads(body), pictures
                pictures.append(
                    cv2.imdecode(np.frombuffer(body, np.uint8), 1)[..., ::-1]
                )


@pytest.mark.slow
@pytest.mark.parametrize("command_for", BROWSERS)
@pytest.mark.parametrize("suffix", CLOSE)
def test_video_plays_in_its_colours(suffix, command_for, clip, tmp_path):
    report, pictures = watch(clip.videos[suffix], suffix, command_for, tmp_path)
    duration = report.pop("duration", 0.0)
    assert report == {"width": PIXELS, "height": PIXELS}
    assert duration == pytest.approx(FRAMES / RATE, abs=1.5 / RATE)
    for n, picture in zip(LOOKS, pictures, strict=True):
        difference = np.abs(clip.frames.astype(int) - picture).mean(axis=(1, 2, 3))
        assert difference[n] < CLOSE[suffix], f"frame {n}"
        assert abs(int(difference.argmin()) - n) <= 1, f"frame {n}"
