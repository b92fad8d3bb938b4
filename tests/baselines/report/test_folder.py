"""The folder of a report holds this report alone, beside what is not the report's."""

from mpmworlds.baselines.report.folder import LIST, Folder
from mpmworlds.baselines.report.write import write_report


def names_in(root):
    found = (path for path in root.rglob("*") if path.is_file())
    return {path.relative_to(root).as_posix() for path in found} - {LIST}


def written(root, *names):
    folder = Folder(root)
    for name in names:
        folder.write(name, name.encode())
    return folder


def test_earlier_files_go_and_those_of_others_stay(tmp_path):
    written(tmp_path, "page.html", "clips/old/1.mp4", "clips/both/1.mp4").finish()
    (tmp_path / "clips/both/mine.mp4").write_bytes(b"mine")
    (tmp_path / "notes.txt").write_bytes(b"mine")
    written(tmp_path, "page.html", "clips/new/1.mp4").finish()
    assert names_in(tmp_path) == {
        *("page.html", "clips/new/1.mp4", "clips/both/mine.mp4", "notes.txt")
    }
    assert not (tmp_path / "clips/old").exists()


def test_what_a_stopped_report_has_written_goes_too(tmp_path):
    written(tmp_path, "clips/1.mp4").finish()
    written(tmp_path, "clips/2.mp4")  # and stops there
    written(tmp_path, "page.html").finish()
    assert names_in(tmp_path) == {"page.html"}


def test_list_that_leads_elsewhere_removes_nothing(tmp_path):
    root, other = tmp_path / "report", tmp_path / "other.txt"
    root.mkdir()
    other.write_bytes(b"of another")
    (root / LIST).write_text(f"../other.txt\n{other}\n\n")
    written(root, "page.html").finish()
    assert other.read_bytes() == b"of another"


def test_nothing_is_made_before_the_first_file(tmp_path):
    Folder(tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_second_report_leaves_no_clip_or_figure_of_the_first(
    clip_folders, folders, release, tmp_path, monkeypatch
):
    out = tmp_path / "out"
    draw = lambda *_: None  # noqa: E731
    monkeypatch.setattr(
        "mpmworlds.baselines.report.write.render", lambda _: {"svg": b""}
    )
    figure = [("first", "", draw)]
    monkeypatch.setattr("mpmworlds.baselines.report.write.drawn", lambda *_: figure)
    write_report([str(folder) for folder in clip_folders], out, release)
    assert (out / "figures/tiny-test-first.svg").is_file()
    assert (out / "clips/tiny-test/0001/02.mp4").is_file()
    (out / "figures/mine.png").write_bytes(b"mine")
    monkeypatch.setattr("mpmworlds.baselines.report.write.drawn", lambda *_: ())
    write_report([str(folder) for folder in folders], out)
    assert list(out.glob("clips/**/*.mp4")) == []
    assert [path.name for path in (out / "figures").iterdir()] == ["mine.png"]
    assert len(list(out.glob("samples/tiny-test/*.js"))) == 4


def test_how_far_it_is_can_be_seen(command, clip_folders, release, tmp_path):
    out = ["--out", tmp_path / "out", "--release", release]
    status, told, err = command("report", *clip_folders, *out)
    assert (status, "index.html: written" in told) == (0, True)
    for part in ("clips of tiny/test", "figures of tiny/test"):
        assert f"{part}: 100%" in err
