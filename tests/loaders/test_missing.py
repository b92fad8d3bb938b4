"""What is said to be buildable is what the parameters build."""

from mpmworlds.builder.parameters import Parameters
from mpmworlds.loaders.missing import ROWS, cost_of, no_such_config


def test_the_configurations_are_those_of_the_parameters_with_as_many_rows():
    params = Parameters.read()
    assert set(ROWS) == set(params.configurations())
    for config, rows in ROWS.items():
        profile, ids = params.subset(config)
        lists = params.lists_of(profile, params.sample_ids(profile))
        every = sum(len(lists[s]) for s in ("train", "modification_validation", "test"))
        assert rows == (every if ids is None else len(ids)), config


def test_twins_without_videos_cost_as_many_hours_and_fewer_bytes():
    assert cost_of("10k") == "about 50 core-hours and 8 GB"
    assert cost_of("10k-clips") == "about 50 core-hours and 2.1 GB"
    assert cost_of("another") == ""


def test_a_name_that_nobody_knows_is_answered_with_those_that_are_known():
    said = no_such_config("huge", ["tiny"], "folder")
    assert said.startswith("folder: has no configuration 'huge'; it has tiny;")
    assert "tiny, mini, evaluation, 10k, full, preview" in said
