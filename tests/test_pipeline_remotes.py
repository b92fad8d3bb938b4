"""What the pipeline made reaches other machines: by a folder, and by a bucket."""

import json
import shutil
import threading
from types import SimpleNamespace

import boto3
import pytest
import yaml
from datasets import load_dataset
from moto.moto_server.werkzeug_app import (
    DomainDispatcherApplication,
    create_backend_app,
)
from werkzeug.serving import make_server

from mpmworlds.files.checksums import read_checksums
from mpmworlds.loaders.integrity import check_release
from mpmworlds.metrics import METRICS
from tests.checkout import ROOT, Checkout
from tests.small import PARAMS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs a git checkout"),
]
RELEASE = "release/mpmworlds"
STAGES = ["split@tiny", "build", "evaluate"]
KEYS = {
    "AWS_ACCESS_KEY_ID": "nobody",
    "AWS_SECRET_ACCESS_KEY": "nothing",
    "AWS_DEFAULT_REGION": "us-east-1",
    "NO_PROXY": "127.0.0.1",
}


@pytest.fixture(scope="module")
def made(small, tmp_path_factory):
    """A checkout in which the pipeline ran, and all was committed."""
    checkout = Checkout.of_now(tmp_path_factory.mktemp("made"))
    tables = yaml.safe_load((ROOT / "params.yaml").read_text())["tables"]
    params = PARAMS | {"tables": tables}
    (checkout.folder / "params.yaml").write_text(yaml.safe_dump(params))
    shutil.copytree(small.store, checkout.folder / "work/store")
    checkout.repro()
    checkout.git("add", "-A")
    checkout.git("commit", "-q", "-m", "made")
    return checkout


@pytest.fixture(scope="module")
def bucket():
    """A server that answers as S3 does, with a bucket."""
    app = DomainDispatcherApplication(create_backend_app)
    server = make_server("127.0.0.1", 0, app, threaded=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    url = f"http://127.0.0.1:{server.server_port}"
    client = boto3.client(
        "s3",
        endpoint_url=url,
        region_name=KEYS["AWS_DEFAULT_REGION"],
        aws_access_key_id=KEYS["AWS_ACCESS_KEY_ID"],
        aws_secret_access_key=KEYS["AWS_SECRET_ACCESS_KEY"],
    )
    client.create_bucket(Bucket="worlds")
    yield SimpleNamespace(url=url, client=client)
    server.shutdown()
    thread.join()


@pytest.fixture(params=["folder", "bucket"])
def remote(request, made, bucket, tmp_path):
    """Name a remote in a checkout."""

    def name(checkout):
        place = tmp_path / "remote" if request.param == "folder" else "s3://worlds/dvc"
        checkout.dvc("remote", "add", "--local", "-f", "-d", "store", str(place))
        if request.param == "bucket":
            told = ("store", "endpointurl", bucket.url)
            checkout.dvc("remote", "modify", "--local", *told)

    yield name
    made.dvc("remote", "remove", "--local", "store")


def test_clone_and_pull_give_the_release_and_a_clean_status(made, remote, tmp_path):
    remote(made)
    made.dvc("push", *STAGES, **KEYS)
    clone = made.clone(f"clone-{tmp_path.name}")
    remote(clone)
    clone.dvc("pull", *STAGES, **KEYS)
    sums = read_checksums(made.folder / RELEASE)
    assert read_checksums(clone.folder / RELEASE) == sums
    status = clone.dvc("status", "--json", "sources", "plan@tiny", *STAGES, **KEYS)
    assert json.loads(status) == {}
    rows = load_dataset(
        str(clone.folder / RELEASE), "tiny", split="test", cache_dir=str(tmp_path)
    )
    assert list(rows["id"]) == ["p0000"]
    lists = "splits/recorded/tiny/test.txt"
    assert (clone.folder / RELEASE / "splits/test.txt").read_bytes() == clone.read(
        lists
    )


def test_a_release_is_got_without_a_clone(made, tmp_path):
    made.dvc("remote", "add", "--project", "-f", "-d", "here", str(tmp_path / "remote"))
    made.git("add", "-A")
    made.git("commit", "-q", "-m", "a remote that others can read")
    made.dvc("push", *STAGES)
    out = tmp_path / "got"
    made.dvc("get", str(made.folder), RELEASE, "-o", str(out))
    assert read_checksums(out) == read_checksums(made.folder / RELEASE)
    check_release(out)  # raises if a file is not the one of SHA256SUMS


def test_a_difference_of_metrics_is_eight_numbers(made):
    path = made.folder / "params.yaml"
    text = path.read_text()
    try:
        path.write_text(text.replace("predictor: copy_last", "predictor: black"))
        assert made.repro() == ["evaluate"]
        told = json.loads(made.dvc("metrics", "diff", "--json", "--all"))
    finally:
        path.write_text(text)
        made.repro()
    (numbers,) = [found for name, found in told.items() if "tiny.metrics" in name]
    assert set(numbers) == {*METRICS, "failed"}
    assert numbers["mask_iou"]["diff"] < 0
    shown = json.loads(made.dvc("metrics", "show", "--json"))
    files = shown[""]["data"]
    assert len(files["builder/recorded/tiny.metrics.json"]["data"]) == 8
