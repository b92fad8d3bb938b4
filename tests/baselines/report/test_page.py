"""The page works from a disk, in a browser; the whole folder is the same every time."""

import json
import os
import re
import shutil
import signal
import subprocess
from http.server import BaseHTTPRequestHandler, HTTPServer
from queue import Queue
from threading import Thread
from urllib.parse import unquote

import numpy as np
import pytest

from mpmworlds.baselines.report.write import write_report
from mpmworlds.sim.run.encode import decode_mp4

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
    None,
)
PATIENCE = 240.0  # seconds for a browser to start and to play for a second
# Sorts a table, steps the clips, plays them to the end, and tells what it sees. A page
# from a disk may not read what another server answers, but it may ask.
PROBE = """
<script>
const told = {errors: []};
window.onerror = (message) => { told.errors.push(message); };

const until = (holds) => new Promise((done) => {
  const waiting = setInterval(() => {
    if (holds()) { clearInterval(waiting); done(); }
  }, 50);
});

async function look() {
  await until(() => videos().length === 3 && videos().every((v) => v.readyState >= 2));
  const table = document.querySelector("#table table");
  const column = 6; // mIoU
  const values = () => [...table.tBodies[0].rows].slice(1)
    .map((row) => parseFloat(row.cells[column].textContent));
  const button = table.tHead.rows[0].cells[column].querySelector("button");
  button.click();
  told.ascending = values();
  button.click();
  told.descending = values();
  seek(1);
  await until(() => videos().every((video) => !video.seeking));
  told.videos = videos().map((video) => [video.currentTime, video.videoWidth]);
  told.time = document.getElementById("time").value;
  told.cursor = document.querySelector("#curve .cursor").getAttribute("x1") !== null;
  told.figures = document.querySelectorAll("#figures img").length;
  seek(0);
  document.getElementById("play").click();
  told.playing = document.getElementById("play").textContent;
  await until(() => state.started === null);
  told.ended = state.frame;
  told.paused = videos().map((video) => video.paused);
}

look().catch((error) => told.errors.push(String(error))).then(() => {
  new Image().src = "SERVER?" + encodeURIComponent(JSON.stringify(told));
});
</script>
</body>
"""


class Listener(HTTPServer):
    """Keeps what is asked of it."""

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Heard)
        self.heard = Queue()


class Heard(BaseHTTPRequestHandler):
    """One request."""

    def do_GET(self):
        self.server.heard.put(unquote(self.path.partition("?")[2]))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *message):
        pass


def told_by(command, listener):
    """What a page that is opened with a command tells."""
    Thread(target=listener.serve_forever, daemon=True).start()
    browser = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        return json.loads(listener.heard.get(timeout=PATIENCE))
    finally:
        os.killpg(browser.pid, signal.SIGKILL)
        browser.wait()
        listener.shutdown()


def files_of(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.slow
def test_same_results_give_the_same_bytes(clip_report, clip_folders, release, tmp_path):
    again = [str(folder) for folder in reversed(clip_folders)]
    write_report(again, tmp_path / "again", release)
    first, second = files_of(clip_report), files_of(tmp_path / "again")
    assert first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []


def test_figures_are_png_and_svg_without_a_date(clip_report):
    names = {path.name for path in (clip_report / "figures").iterdir()}
    stems = {name.rpartition(".")[0] for name in names}
    kinds = ("heat", "wmae", "collapsed", "curves", "families")
    assert stems == {f"tiny-test-{kind}" for kind in kinds}
    assert names == {f"{stem}.{form}" for stem in stems for form in ("png", "svg")}
    for path in (clip_report / "figures").glob("*.svg"):
        assert "dc:date" not in path.read_text()


def test_clips_are_the_reference_the_prediction_and_their_difference(
    clip_report, corpus
):
    folder = clip_report / "clips/tiny-test/0001"
    truth = corpus.frames["p0002"][6:]
    clips = [
        decode_mp4((folder / name).read_bytes())
        for name in ("reference.mp4", "02.mp4", "02-difference.mp4")
    ]
    mirrored = truth[:, :, ::-1]
    apart = np.abs(truth.astype(int) - mirrored)
    for clip, expected in zip(clips, (truth, mirrored, apart), strict=True):
        assert clip.shape == expected.shape
        # Chroma of half the resolution blurs outlines, and crf 18 a little more.
        assert np.abs(clip.astype(int) - expected).mean() < 6


def test_page_needs_nothing_from_elsewhere(clip_report):
    for name in ("index.html", "report.css", "report.js", "samples.js"):
        text = (clip_report / name).read_text()
        assert "fetch(" not in text
        assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)", text) == []


def test_clip_that_is_no_video_is_named(clip_folders, release, tmp_path):
    folder = tmp_path / "mirror"
    shutil.copytree(clip_folders[1], folder)
    (folder / "clips" / "p0002.mp4").write_bytes(b"no video")
    with pytest.raises(ValueError, match=r"p0002\.mp4: 8 bytes hold no decodable"):
        write_report([str(folder)], tmp_path / "out", release)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium on PATH")
def test_page_sorts_and_plays_in_sync_from_a_disk(clip_report, tmp_path):
    page = tmp_path / "page"
    shutil.copytree(clip_report, page)
    with Listener() as listener:
        server = f"http://127.0.0.1:{listener.server_port}/"
        text = (page / "index.html").read_text()
        text = text.replace("</body>\n", PROBE.replace("SERVER", server))
        (page / "probe.html").write_text(text)
        command = [
            *(CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu"),
            *(f"--user-data-dir={tmp_path / 'profile'}", "--no-first-run"),
            (page / "probe.html").as_uri(),
        ]
        told = told_by(command, listener)
    assert told["errors"] == []
    assert told["ascending"] == [0.5, 0.75]
    assert told["descending"] == [0.75, 0.5]
    # Reference, prediction and difference stand at the middle of frame 1 of a
    # continuation at 2 frames per second, after a prefix of 6 frames.
    assert told["videos"] == [[pytest.approx(1.5 / 2), 64]] * 3
    assert told["time"] == "3.50 s, frame 7"
    assert told["cursor"]
    assert told["figures"] == 5
    assert told["playing"] == "pause"
    assert told["ended"] == 1
    assert told["paused"] == [True] * 3
