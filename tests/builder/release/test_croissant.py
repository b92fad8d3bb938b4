"""croissant.json, read by the library of MLCommons."""

import json
import logging

import mlcroissant
import pytest

from mpmworlds.builder.release.croissant import CroissantFile, croissant_text
from mpmworlds.builder.release.features import RECIPE_COLUMNS, columns_of
from mpmworlds.files.checksums import read_checksums

DATE = "datePublished"  # a build has none: equal input gives equal bytes
CONFIGS = {name: columns_of(name) for name in ("tiny", "mini", "recipes")}


@pytest.fixture(scope="module")
def records(release):
    return [
        CroissantFile(name, (release / name).stat().st_size, digest)
        for name, digest in read_checksums(release).items()
        if name != "croissant.json"
    ]


@pytest.fixture
def read(tmp_path, caplog):
    """Function text -> the metadata that mlcroissant reads without complaint."""

    def run(text):
        path = tmp_path / "croissant.json"
        path.write_text(text)
        with caplog.at_level(logging.WARNING):
            dataset = mlcroissant.Dataset(jsonld=path)
        lines = [ln for r in caplog.records for ln in r.getMessage().splitlines()[1:]]
        assert [line for line in lines if DATE not in line] == []
        return dataset.metadata

    return run


def test_it_is_valid_and_says_what_each_column_holds(read, records):
    metadata = read(croissant_text("1.2.3", records, CONFIGS))
    assert str(metadata.version) == "1.2.3"
    told = {
        records.name: {field.name: field.description for field in records.fields}
        for records in metadata.record_sets
    }
    assert told == {
        name: {column.name: column.meaning for column in columns}
        for name, columns in CONFIGS.items()
    }


def test_every_file_has_its_checksum_and_every_configuration_its_files(
    read, records, release
):
    metadata = read(croissant_text("1.2.3", records, CONFIGS))
    files = {
        item.content_url: item.sha256
        for item in metadata.distribution
        if isinstance(item, mlcroissant.FileObject)
    }
    sums = read_checksums(release)
    del sums["croissant.json"]
    assert files == sums
    sets = [d for d in metadata.distribution if isinstance(d, mlcroissant.FileSet)]
    assert {s.id: set(s.contained_in) for s in sets} == {
        f"files-{config}": {
            n for n in files if n.startswith(f"data/{config}/") and "-of-" in n
        }
        for config in CONFIGS
    }


def test_it_says_what_responsible_use_needs(read, records):
    metadata = read(croissant_text("1.2.3", records, CONFIGS))
    for told in (
        metadata.data_collection,
        metadata.data_biases,
        metadata.data_limitations,
        metadata.data_use_cases,
        metadata.data_social_impact,
        metadata.data_release_maintenance_plan,
        metadata.personal_sensitive_information,
    ):
        assert told


def test_a_release_has_it(release, records):
    text = (release / "croissant.json").read_text()
    configs = {name: CONFIGS[name] for name in ("tiny", "mini", "recipes")}
    assert text == croissant_text("1.2.3", records, configs)


def test_text_follows_from_arguments_alone(records):
    text = croissant_text("1.2.3", records, CONFIGS)
    assert text == croissant_text("1.2.3", records[::-1], CONFIGS)
    assert json.loads(text)["license"].startswith("https://creativecommons.org/")


def test_damaged_metadata_are_found(read, records):
    told = json.loads(croissant_text("1.2.3", records, CONFIGS))
    told["recordSet"][0]["field"][0]["source"]["fileSet"]["@id"] = "files-nowhere"
    with pytest.raises(mlcroissant.ValidationError, match="files-nowhere"):
        read(json.dumps(told))


def test_a_configuration_without_files_is_refused(records):
    with pytest.raises(ValueError, match="'grand': has no files in data/grand/"):
        croissant_text("1.2.3", records, {"grand": RECIPE_COLUMNS})
