"""Tables hold the numbers that one works out by hand, in every form."""

import csv
import json
import re

import pytest

from mpmworlds.baselines.report.board import boards, read_systems
from mpmworlds.baselines.report.numbers import entries
from mpmworlds.baselines.report.paper import paper
from mpmworlds.baselines.report.rank import rank
from mpmworlds.baselines.report.table import Group, Table, escape, latex
from mpmworlds.baselines.report.tables import number, overview, ranking_table
from mpmworlds.metrics import SCORED
from tests.baselines.made_results import result, write

# Goodness of vlm_7b, full_config, by its chosen candidates: .75, .25, a crash, 1.
# Valid only: mean 2/3, variance (.0833^2 + .4167^2 + .3333^2) / 2 = .14583, so that the
# standard error is .2205. Failures at worst: mean .5, variance .625 / 3, error .2282.
# The noise ceiling loses .0625, so that the 1/3 that it loses is .2708 beyond.


def numbers(report):
    with (report / "numbers.csv").open() as stream:
        return list(csv.DictReader(stream))


def found(report, **wanted):
    rows = numbers(report)
    (row,) = [r for r in rows if all(r[key] == wanted[key] for key in wanted)]
    return row


TOLD = {"system": "vlm_7b", "regime": "full_config"}


@pytest.mark.parametrize("metric", SCORED)
@pytest.mark.parametrize(
    ("summary", "goodness", "sem", "n"),
    [
        ("valid", 2 / 3, 0.220479, 3),
        ("failures_at_worst", 0.5, 0.228218, 4),
        ("paired", 2 / 3, 0.220479, 3),
    ],
)
def test_csv_holds_the_three_summaries(report, metric, summary, goodness, sem, n):
    wanted = TOLD | {"metric": metric, "summary": summary}
    row = found(report, **wanted, scale="raw")
    mean = goodness if SCORED[metric].direction == "up" else 1 - goodness
    assert float(row["mean"]) == pytest.approx(mean)
    assert float(row["sem"]) == pytest.approx(sem, abs=1e-6)
    assert (row["n"], row["low"], row["high"]) == (str(n), "", "")
    beyond = found(report, **wanted, scale="beyond")
    assert float(beyond["mean"]) == pytest.approx(1 - goodness - 0.0625)
    assert float(beyond["sem"]) == pytest.approx(sem, abs=1e-6)


def test_csv_holds_coverage_and_failures(report):
    row = found(report, **TOLD, metric="mse", scale="raw", summary="valid")
    told = ("evaluated", "expected", "compared", "valid", "failures", "knows_answers")
    assert [row[key] for key in told] == ["4", "4", "4", "3", "1 crash", "false"]


def test_systems_are_paired_over_what_is_valid_for_all(report):
    row = found(
        report, system="copy_last", metric="semd", scale="raw", summary="paired"
    )
    assert (row["mean"], row["n"]) == ("0.5", "3")


def lines_with(text, *parts):
    return [line for line in text.splitlines() if all(part in line for part in parts)]


def test_markdown_shows_mean_error_coverage_and_failures(report):
    text = (report / "report.md").read_text()
    start = r"| vlm\_7b | full\_config | 4/4 | 3 (75.0%) | 1 crash | "
    valid, worst, paired = lines_with(text, start, "0.220 | 0.333")[:1] + [
        lines_with(text, start, cells)[0]
        for cells in ("| 4 | 0.500 ± 0.228 | 0.500", "| 3 | 0.667 ± 0.220 | 0.333")
    ]
    assert valid == paired
    assert worst.count("0.500 ± 0.228") == len(SCORED)
    (detail,) = lines_with(text, start, "0.667 ± 0.220 | – | 3 | 0.500")  # noqa: RUF001
    assert detail.endswith("| 0.500 ± 0.228 | – | 4 | 0.667 ± 0.220 | – | 3 |")  # noqa: RUF001


def test_every_table_of_systems_shows_coverage_and_failures(report):
    data = (report / "data.js").read_text()
    page = json.loads(data.removeprefix("onReport(").removesuffix(");\n"))
    (section,) = page["sections"]
    assert len(section["tables"]) == 1 + 2 + len(SCORED)
    for table in section["tables"]:
        assert {"evaluated", "valid", "failures"} <= set(table["columns"])
        width = len(table["columns"])
        assert all(len(row) == width for g in table["groups"] for row in g["rows"])


def test_latex_is_booktabs_and_escaped(report):
    text = (report / "report.tex").read_text()
    row = r"vlm\_7b & full\_config & 4/4 & 3 (75.0\%) & 1 crash & 3 & 0.667 $\pm$ 0.220"
    assert row in text
    for rule in (r"\toprule", r"\bottomrule", r"\begin{tabular}", r"\end{tabular}"):
        assert text.count(rule) == text.count(r"\begin{table*}") == 1 + 2 + 9 + 1
    assert text.isascii()
    body = text.partition("\n")[2].replace(r"\%", "").replace(r"\_", "")
    assert "%" not in body.replace("{!}{%", "")
    assert "_" not in body


def test_latex_escapes_what_is_special():
    assert escape("a_b & 5 % of #1 {x}") == r"a\_b \& 5 \% of \#1 \{x\}"
    assert escape("\\~^") == r"\textbackslash{}\textasciitilde{}\textasciicircum{}"


def test_latex_sets_a_minus_and_keeps_a_hyphen():
    text = latex(
        Table("t", "T", ("of", "b"), (Group("", (("a-1", "[-1, -0.5]"),)),), 1)
    )
    assert r"a-1 & [$-$1, $-$0.5] \\" in text


def test_latex_row_that_starts_with_a_bracket_is_no_option():
    text = latex(Table("t", "T", ("of",), (Group("", (("[a]",), ("*",))),), 1))
    assert "{}[a] \\\\\n{}* \\\\\n" in text


def test_latex_captions_are_sentences(report):
    text = (report / "report.tex").read_text()
    captions = re.findall(r"\\caption\{(.*)\}", text)
    assert len(captions) == text.count(r"\begin{table*}")
    assert all(caption.endswith(".") and ".." not in caption for caption in captions)


def test_latex_rows_have_as_many_cells_as_columns(report):
    text = (report / "report.tex").read_text()
    for columns, body in re.findall(
        r"\\begin\{tabular\}\{([lr]+)\}\n(.*?)\\end\{tabular\}", text, re.DOTALL
    ):
        rows = [row for row in body.splitlines() if row.endswith(r"\\")]
        for row in rows:
            spanned = re.match(r"\\multicolumn\{(\d+)\}", row)
            cells = len(re.findall(r"(?<!\\)&", row)) + 1
            assert (int(spanned[1]) if spanned else cells) == len(columns)


def test_number_that_rounds_to_nothing_has_no_sign():
    assert (number(-0.0001), number(-0.001)) == ("0.000", "-0.001")


def test_summaries_without_failures_are_shown_once(folders):
    board = board_of(folders[0])
    told = overview(board, entries(board), "raw", paper())
    first, of_paper = told.groups
    assert first.heading == "valid only = failures at worst = paired"
    assert len(first.rows) == 1
    assert "other samples" in of_paper.heading


def test_paper_stands_beside_ours_as_other_data(report):
    text = (report / "report.md").read_text()
    assert len(lines_with(text, "2606.01538: other samples", "| *")) == 1
    rows = lines_with(text, "| paper: VLM | frames\\_only |")
    assert rows[0].split(" | ")[6:11] == ["0.316", "0.095", "0.349", "0.333", "–"]  # noqa: RUF001
    assert "read from a figure by a third party" in text
    assert all(row.values.keys() <= SCORED.keys() for row in paper().rows)


def board_of(*folders):
    (board,) = boards(read_systems(map(str, folders)))
    return board


def test_ranking_is_by_anchored_score(folders):
    # Means .5, .5 and .4375 of goodness: (.5 - .5625) / (.5 - .0625) = -1/7.
    places = rank(board_of(*folders)).places
    assert [(p.rank, p.system.label) for p in places] == [
        (1, "copy_last, frames_only"),
        (2, "vlm_7b, full_config"),
        (3, "vlm_7b, no_materials"),
    ]
    scores = [place.score.mean for place in places]
    assert scores == pytest.approx([0.0, 0.0, -1 / 7], abs=1e-12)


def test_oracle_takes_no_rank_and_is_marked(folders, tmp_path, command):
    samples = [[result(f"p{k:04d}", 1.0)] for k in range(1, 5)]
    changes = {"predictor": "oracle", "knows_answers": True}
    oracle = write(tmp_path / "oracle", samples, **changes)
    places = rank(board_of(folders[0], oracle)).places
    assert [(p.rank, p.system.name) for p in places] == [
        (None, "oracle"),
        (1, "copy_last"),
    ]


def test_ranking_says_in_a_line_why_there_is_none(folders, tmp_path):
    missing = rank(board_of(folders[1])).missing
    assert missing.startswith("tiny/test: no ranking, since it needs results of copy_l")
    bare = [[result(f"p{k:04d}", 0.5, ceiling=None if k == 2 else 1)] for k in (1, 2)]
    board = board_of(write(tmp_path / "bare", bare))
    assert "1 of 2 samples have no noise ceiling (the first is p0002)" in (
        rank(board).missing
    )


@pytest.mark.parametrize("families", [9, 10])
def test_ranking_has_intervals_from_ten_families_on(tmp_path, families):
    # Two samples of each family: what counts is not the number of samples.
    names = [f"p{k:04d}{kind}" for k in range(families) for kind in ("", "-n00")]
    samples = [[result(name, k % 2)] for k, name in enumerate(names)]
    floor = [[result(name, 0.5)] for name in names]
    board = board_of(
        write(tmp_path / "floor", floor),
        write(tmp_path / "other", samples, predictor="black"),
    )
    ranking = rank(board)
    table = ranking_table(board, ranking, entries(board))
    column = table.columns.index("95 %")
    shown = [row[column] for row in table.groups[0].rows]
    assert [cell.startswith("[") for cell in shown] == [families == 10] * 2
    assert f"{families} families. No interval below 10 families." in table.notes[0]


def test_interval_appears_with_ten_families(tmp_path):
    samples = [[result(f"p{k:04d}", k % 2)] for k in range(10)]
    (entry,) = [
        entry
        for entry in entries(board_of(write(tmp_path / "ten", samples)))
        if entry.metric.name == "mse"
    ]
    assert entry.raw.valid.low < 0.5 < entry.raw.valid.high
    assert entry.beyond.valid.low == pytest.approx(entry.raw.valid.low - 0.0625)
