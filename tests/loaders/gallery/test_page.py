"""The page of a gallery in browsers, from a disk: filter, keys, play, compare."""

import json
import shutil
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

import pytest

from tests.browsers import BROWSERS, PATIENCE, opened
from tests.loaders.gallery.made import rows_of, write_rows

DRIVER = Path(__file__).with_name("driver.js")


class Report(BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.reports.put(json.loads(body))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *message):
        pass


@contextmanager
def listening():
    with ThreadingHTTPServer(("127.0.0.1", 0), Report) as server:
        server.reports = Queue()
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def rows(release):
    return {row["id"]: row for row in rows_of(release)}


@pytest.fixture(scope="module")
def driven(rows, tmp_path_factory):
    """Folder of a gallery with a page that uses itself."""
    site = tmp_path_factory.mktemp("site")
    write_rows(list(rows.values()), site)
    shutil.copy(DRIVER, site)
    page = site / "index.html"
    script = '<script src="driver.js"></script>\n</body>'
    page.write_text(page.read_text("utf-8").replace("</body>", script), "utf-8")
    return page


@pytest.fixture(scope="module", params=BROWSERS)
def found(request, driven, tmp_path_factory):
    """What the page has told after it was used."""
    home = tmp_path_factory.mktemp("home")
    with listening() as server:
        url = f"{driven.as_uri()}?port={server.server_port}"
        with opened(request.param(home, url), home):
            try:
                return server.reports.get(timeout=PATIENCE)
            except Empty:
                told = (home / "log").read_text("utf-8", "replace")[-2000:]
                pytest.fail(f"nothing in {PATIENCE:g} s; the browser says: {told}")


pytestmark = pytest.mark.slow


def test_nothing_goes_wrong(found):
    assert "error" not in found


def test_filters_show_what_is_asked_for(found, rows):
    assert found["all"] == list(rows)
    assert found["count"] == f"{len(rows)} samples"
    assert found["test"] == [k for k in rows if rows[k]["split"] == "test"]
    assert found["address"] == "#split=test"
    assert found["others"] == str(sum(r["split"] == "train" for r in rows.values()))
    assert found["sand"] == [k for k in rows if "sand" in rows[k]["materials"]]
    children = [k for k in found["sand"] if rows[k]["kind"] == "child"]
    assert found["sandChildren"] == children
    assert found["cleared"] == found["again"] == len(rows)


def test_range_and_text_show_what_is_asked_for(found, rows):
    assert found["moving"] == [k for k in rows if rows[k]["motion"] >= 0.3]
    assert found["searched"] == [k for k in found["moving"] if "p0002" in k]
    assert found["words"] == [k for k in rows if rows[k]["parent_id"]]


def test_keys_move_open_and_close(found, rows):
    assert found["searches"] == "search"
    assert (found["second"], found["last"]) == (list(rows)[1], list(rows)[-1])
    assert found["previews"] == 0
    assert found["opened"] == ["p0000-c0", True]
    assert found["focused"] == "p0000-c0-n00"


def test_sample_plays_stops_and_steps(found):
    assert found["paused"]
    assert found["time"] == "2.00 s, frame 4"
    assert found["timed"] == "2"
    assert found["title"] == "p0000-c0-n00 · MPMWorlds gallery"


def test_texts_are_those_of_the_sample(found, rows):
    row = rows["p0000-c0"]
    assert found["scene"] == row["scene"].rstrip()
    assert found["program"] == row["program"].rstrip()
    assert found["keys"] > 20
    assert found["keywords"] > 3


def test_lineage_and_difference_to_the_parent(found):
    assert found["lineage"][-2:] == ["p0000", "p0000-c0"]
    assert (found["removed"], found["added"]) == (["0.0", "-9.8"], ["1.0", "-7.0"])
    assert found["exact"] == "videos/p0000-c0.mp4"


def test_two_samples_play_in_time(found):
    assert found["beside"] == ["p0000-c0-n00", "p0000-c0"]
    assert found["apart"] < 0.2


def test_address_opens_a_sample_at_a_time(found):
    assert found["linked"] == [2.5, False]
