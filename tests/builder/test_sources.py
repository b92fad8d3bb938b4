"""The pipeline notices what decides bytes, and nothing else."""

import json

import pytest

from mpmworlds.builder.sources import code_of, sources_text

SOURCE = '''"""Doc."""
A = "# no comment"  # a comment

# another
TEXT = """
# of the text

"""
def f(x):
    # inside
    return x + 1
'''


@pytest.fixture
def tree(tmp_path):
    for name in ("sim/run/a.py", "sim/program/b.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(SOURCE)
    return tmp_path


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  # a comment", ""),
        ("# another", "# a word more\n# and a line"),
        ("    # inside\n", ""),
        ("\n# another", "\n\n\n# another"),
    ],
)
def test_comments_and_empty_lines_decide_nothing(old, new):
    assert SOURCE.count(old) == 1
    assert code_of(SOURCE.replace(old, new)) == code_of(SOURCE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x + 1", "x + 2"),
        ("# no comment", "# a comment"),
        ("# of the text", "# of a text"),
        ("# of the text\n\n", "# of the text\n"),
        ("    return", "        return"),
    ],
)
def test_code_and_texts_decide(old, new):
    assert SOURCE.count(old) == 1
    assert code_of(SOURCE.replace(old, new)) != code_of(SOURCE)


def test_what_the_linker_pastes_is_kept_with_its_comments(tree):
    before = json.loads(sources_text(tree, "sim"))
    for name in before:
        path = tree / name
        path.write_text(path.read_text().replace("# inside", "# within"))
    after = json.loads(sources_text(tree, "sim"))
    changed = [name for name in before if before[name] != after[name]]
    assert changed == ["sim/program/b.py"]


def test_notes_and_byte_code_do_not_count(tree):
    before = sources_text(tree, "sim")
    (tree / "sim/notes.md").write_text("a note")
    (tree / "sim/__pycache__").mkdir()
    (tree / "sim/__pycache__/a.pyc").write_bytes(b"code")
    assert sources_text(tree, "sim") == before
    (tree / "sim/new.py").write_text("")
    assert sources_text(tree, "sim") != before
