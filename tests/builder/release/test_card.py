"""The card describes the release that it lies in, to people and to load_dataset."""

import re
import shlex
from dataclasses import fields

import pytest
import yaml
from datasets import load_dataset_builder
from datasets.info import DatasetInfosDict
from datasets.utils.metadata import MetadataConfigs
from huggingface_hub import DatasetCard

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.card import fields_table, lists_text, materials_table
from mpmworlds.builder.release.features import (
    RECIPE_COLUMNS,
    recipe_features,
    release_features,
)
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.statistics.counts import count_scenes
from mpmworlds.cli import parser
from mpmworlds.sim.scene.objects import MATERIALS


@pytest.fixture(scope="module")
def card(release):
    return DatasetCard.load(release / "README.md")


def test_the_header_names_every_configuration_with_its_files(card, release):
    configs = MetadataConfigs.from_dataset_card_data(card.data)
    assert set(configs) == {"tiny", "mini", "recipes"}
    assert configs.get_default_config_name() == "tiny"
    for name, config in configs.items():
        assert config["version"] == "1.2.3"
        for entry in config["data_files"]:
            assert list(release.glob(entry["path"]))
        splits = {entry["split"] for entry in config["data_files"]}
        files = (release / "data" / name).glob("*-*.arrow")
        found = {path.name.split("-")[0] for path in files}
        assert splits == found


def test_the_header_counts_rows_and_bytes(card, release):
    infos = DatasetInfosDict.from_dataset_card_data(card.data)
    rows = {split: info.num_examples for split, info in infos["tiny"].splits.items()}
    assert rows == {"train": 5, "modification_validation": 1, "test": 2}
    files = (release / "data/tiny").glob("*-*.arrow")
    assert infos["tiny"].download_size == sum(path.stat().st_size for path in files)
    assert infos["tiny"].features == release_features()
    assert infos["recipes"].features == recipe_features()


def test_the_header_has_what_the_hub_asks_for(card):
    header = yaml.safe_load(card.content.split("---")[1])
    assert header["license"] == "cc-by-4.0"
    assert header["task_categories"] == ["image-to-video", "video-text-to-text"]
    assert header["size_categories"] == "n<1K"
    assert header["pretty_name"] == "MPMWorlds"
    assert "arxiv:2606.01538" in header["tags"]


def test_the_text_says_whose_work_this_is_and_under_which_licence(card):
    text = " ".join(card.text.split())
    assert "independent reconstruction" in text
    assert "paper's authors have not released theirs" in text
    assert "CC-BY-4.0" in text
    assert "Apache-2.0" in text


def test_datasets_knows_licence_citation_and_homepage(release, tmp_path):
    info = load_dataset_builder(str(release), "mini", cache_dir=str(tmp_path)).info
    assert info.license == "https://creativecommons.org/licenses/by/4.0/"
    assert "arXiv:2606.01538" in info.citation
    assert info.homepage.startswith("https://")
    assert "independent reconstruction" in info.description


@pytest.mark.parametrize(
    "section",
    ["Which video is which", "What differs from the paper", "What this is not"]
    + ["Errata", "Maintenance", "Limits", "Citation", "Reproduce it"],
)
def test_the_text_answers_what_users_ask(section, card):
    assert f"\n## {section}\n" in card.text


def test_errata_name_the_version_and_sizes_what_a_configuration_has(card):
    assert "None known of data version 1.2.3." in card.text
    assert "| `mini` | `program`, `video`, `clip` | `test` | 1 |" in card.text
    assert "| `recipes` | scenes | `test` | 2 |" in card.text


def test_no_mark_is_left_unfilled(card):
    assert "<!--" not in card.content
    assert re.findall(r"<(?!owner|folder)[a-z]+>", card.text) == []


def test_the_examples_load_what_the_release_has(card):
    assert_examples_hold(card)


def test_a_release_without_test_rows_has_examples_all_the_same(corpus, tmp_path):
    trained = [row.id for row in corpus.rows if row.split == "train"]
    out = tmp_path / "release"
    planned = Corpus(corpus.manifest, {"few": trained})
    build_release([planned], corpus.store, out, version="1.0.0")
    assert_examples_hold(DatasetCard.load(out / "README.md"))


def assert_examples_hold(card):
    """Every split that an example of the card loads is one of the default config."""
    configs = MetadataConfigs.from_dataset_card_data(card.data)
    default = configs.get_default_config_name()
    splits = {entry["split"] for entry in configs[default]["data_files"]}
    found = re.findall(r"load(?:_dataset)?\(([^)]*)\)", card.text)
    examples = [example for example in found if "ids=" not in example]
    assert len(examples) == 7
    for example in examples:
        positional = re.findall(r'(?:^|, )"([^"]*)"', example)
        assert set(positional) - {"recipes", default} <= {
            *("mpmworlds", "./release/mpmworlds", "<owner>/mpmworlds")
        }
        assert set(re.findall(r'split="([^"]*)"', example)) <= splits


def test_the_table_of_lists_counts_their_kinds(card):
    ids = ["s03", "p0001", "p0001-n00", "p0001-c2", "p0001-c2-n01", "p0001-c2-n02"]
    text = lists_text({"10k_train": ids, "10k_test": []})
    assert "| `10k_train` | 6 | 2 | 1 | 3 |" in text
    assert text.endswith("| `10k_test` | 0 | 0 | 0 | 0 |")


def test_a_release_without_lists_speaks_of_none(card):
    assert lists_text({}) == ""
    assert "evaluation_" not in card.text
    assert "smaller corpora" not in lists_text({"evaluation_test": ["p0001"]})


def test_the_table_explains_every_column():
    names = re.findall(r"^\| `(\w+)`", fields_table(), flags=re.MULTILINE)
    assert names == [*release_features(), "preview", "poster"]


def test_the_table_of_materials_lists_the_registry():
    table = materials_table()
    names = re.findall(r"^\| `(\w+)`", table, flags=re.MULTILINE)
    assert names == sorted(MATERIALS)
    assert "`density`: mass per area at rest [kg/m^2]" in table


def test_the_columns_of_a_recipe_are_those_of_the_manifest():
    names = [column.name for column in RECIPE_COLUMNS]
    assert names == [field.name for field in fields(ManifestRow)]


def test_statistics_count_the_manifest(corpus, card):
    found = count_scenes(corpus.rows)
    assert (found.scenes, found.families) == (8, 3)
    assert found.kinds == {"seed": 0, "parent": 3, "child": 2, "perturbation": 3}
    assert found.materials == {"liquid": 8, "sand": 3}
    assert found.two_materials == pytest.approx(3 / 8)
    assert "8 scenes of 3 families" in card.text
    assert "| sand | 3 | 37.5% |" in card.text


def test_statistics_of_nothing_are_refused():
    with pytest.raises(ValueError, match="must have at least one"):
        count_scenes([])


def test_commands_of_the_card_are_commands(card):
    """Each is parsed by the command itself; none is run."""
    lines = re.findall(r"^mpmworlds .*$", card.content, re.MULTILINE)
    verbs = {line.split()[1] for line in lines}
    assert {"fetch", "gallery", "play", "verify", "regenerate", "build"} <= verbs
    for line in lines:
        told = shlex.split(line.replace("<owner>", "owner"), comments=True)
        assert parser().parse_args(told[1:]).name == told[1]
