"""The page works from a disk, in a browser; the whole folder is the same every time."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from mpmworlds.baselines.report.write import write_report
from mpmworlds.sim.run.encode import decode_mp4

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
    None,
)
# Sorts the table of scores, steps the clips, and says what it sees.
PROBE = """
<pre id="told"></pre>
<script>
const told = {errors: []};
window.onerror = (message) => { told.errors.push(message); };
setTimeout(() => {
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
  setTimeout(() => {
    told.videos = videos().map((video) => [video.currentTime, video.videoWidth]);
    told.time = document.getElementById("time").value;
    told.cursor = document.querySelector("#curve .cursor").getAttribute("x1") !== null;
    told.figures = document.querySelectorAll("#figures img").length;
    document.getElementById("told").textContent = JSON.stringify(told);
  }, 1500);
}, 1500);
</script>
</body>
"""


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
    text = (page / "index.html").read_text().replace("</body>\n", PROBE)
    (page / "probe.html").write_text(text)
    done = subprocess.run(
        [
            *(CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu"),
            *(f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"),
            *("--virtual-time-budget=8000", (page / "probe.html").as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    found = re.search(r'<pre id="told">(.+?)</pre>', done.stdout)
    assert found, done.stdout[-2000:] + done.stderr[-2000:]
    told = json.loads(found[1])
    assert told["errors"] == []
    assert told["ascending"] == [0.5, 0.75]
    assert told["descending"] == [0.75, 0.5]
    # Reference, prediction and difference stand at the middle of frame 1.
    assert told["videos"] == [[pytest.approx(0.1), 64]] * 3
    assert told["time"] == "2.60 s, frame 39"
    assert told["cursor"]
    assert told["figures"] == 5
