"""From data to a report by the command: train, generate, evaluate, compare."""

import json


def test_data_to_report(clips, pipeline, command, tmp_path):
    model, results = tmp_path / "model", tmp_path / "results"
    at = ["--release", clips, "--regime", "full_config"]
    settings = ["--set", f"checkpoint={pipeline}", "--set", "steps=2"]
    status, printed, error = command(
        *("train", "vdm", *at, "--recipe", "tiny", *settings, "--out", model)
    )
    assert status == 0, error
    assert printed.strip() == str(model)
    rows = {
        "vdm": [f"lora={model}", "steps=1"],
        "vae": [f"checkpoint={pipeline}"],
    }
    for name, options in rows.items():
        made_with = [part for one in options for part in ("--predictor-option", one)]
        out = results / name
        status, _, error = command(
            "evaluate",
            *at,
            "--predictor",
            name,
            *made_with,
            "--keep-clips",
            "--out",
            out,
        )
        assert status == 0, error
        summary = json.loads((out / "summary.json").read_text())
        assert summary["samples"] == summary["expected"] == 1
        line = json.loads((out / "results.jsonl").read_text().splitlines()[-1])
        assert line["outcome"] == "ok", line["reason"]
        assert (out / "clips" / "p0002.mp4").stat().st_size > 0
    provenance = json.loads((results / "vdm" / "summary.json").read_text())[
        "provenance"
    ]
    assert provenance["options"]["text"] == "mpmworlds-vdm-text/1"
    assert provenance["options"]["lora_sha256"]
    assert provenance["options"]["trained_on"] == "full_config"
    assert not provenance["knows_answers"]
    status, *_ = command(
        "report",
        *(results / name for name in rows),
        *("--release", clips, "--out", tmp_path / "report"),
    )
    assert status == 0
    assert "vdm" in (tmp_path / "report" / "data.js").read_text()


def test_what_stands_in_the_way_is_one_line(clips, command, tmp_path):
    status, _, error = command(
        "evaluate",
        *("--release", clips, "--predictor", "vdm", "--out", tmp_path / "results"),
        *("--predictor-option", "checkpoint=nowhere"),
    )
    assert status == 2
    told = "checkpoint 'nowhere': is no folder, and no OWNER/NAME of the Hub"
    assert error.strip().splitlines() == [f"mpmworlds evaluate: {told}"]
