"""A transcript keeps every whole line, whatever happens, and nothing that is torn."""

import pytest

from mpmworlds.builder.llm.transcript import Exchange, Transcript, TranscriptError


def exchange(key, text="Grün \ud800"):
    reply = {"choices": [{"message": {"content": text}}]}
    return Exchange(key, {"n": 1}, reply, retries=2)


def filled(path, *keys):
    with Transcript(path) as transcript:
        for key in keys:
            transcript.append(exchange(key))
    return path


def test_exchanges_are_there_when_it_is_opened_again(tmp_path):
    path = filled(tmp_path / "a" / "t.jsonl", "k0", "k1")
    filled(path, "k2")
    with Transcript(path) as transcript:
        assert len(transcript) == 3
        assert [transcript.get(f"k{i}") for i in range(3)] == [
            exchange(f"k{i}") for i in range(3)
        ]
        assert transcript.get("k3") is None
    assert len(path.read_bytes().splitlines()) == 3


@pytest.mark.parametrize("kept", [1, 40, -1])
def test_torn_last_line_is_dropped_and_can_be_written_anew(kept, tmp_path, caplog):
    path = filled(tmp_path / "t.jsonl", "k0", "k1")
    whole = path.read_bytes()
    first, second = whole.splitlines(keepends=True)
    path.write_bytes(first + second[:kept])
    with Transcript(path) as transcript:
        assert transcript.get("k0") == exchange("k0")
        assert transcript.get("k1") is None
        transcript.append(exchange("k1"))
    assert path.read_bytes() == whole
    assert "the last reply was not written whole" in caplog.text


@pytest.mark.parametrize(
    "line",
    ["{", "[]", "{}", '{"key": 1, "request": {}, "reply": {}, "retries": 0}'],
)
def test_damage_elsewhere_is_an_error_that_names_the_line(line, tmp_path):
    path = filled(tmp_path / "t.jsonl", "k0")
    path.write_text(line + "\n" + path.read_text())
    before = path.read_bytes()
    with pytest.raises(TranscriptError, match="line 1 is no request with its reply"):
        Transcript(path)
    assert path.read_bytes() == before


def test_one_process_writes_at_a_time(tmp_path):
    path = tmp_path / "t.jsonl"
    message = "another process is writing it"
    with Transcript(path), pytest.raises(TranscriptError, match=message):
        Transcript(path)
    filled(path, "k0")
