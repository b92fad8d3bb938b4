"""From parameters to a release folder: plan, render what is missing, write shards."""

from contextlib import suppress
from pathlib import Path

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.trials import RECORDED
from mpmworlds.builder.release.build import build_release, check_target
from mpmworlds.builder.release.shards import PlannedShard
from mpmworlds.builder.render.materialise import Materialised, render_rows
from mpmworlds.builder.render.store import Store


def build_corpus(
    params: Parameters,
    config: str,
    store: Store,
    out: Path,
    *,
    manifest: Path | None = None,
    workers: int = 0,
) -> tuple[Materialised, list[PlannedShard] | None]:
    """Build the release of a profile, or of a subset of one.

    Parameters
    ----------
    params, config
        Which corpus.
    store
        Rendered samples; what it lacks is rendered.
    out
        Folder of the release.
    manifest
        A plan; else the recorded one of the profile, or one that is made now.
    workers
        Processes, one for each core if 0.

    Returns
    -------
    Materialised
        What became of the samples.
    list of PlannedShard, or None
        Files of the release; None if samples failed, and it was not built.
    """
    check_target(out)  # before all that takes long
    profile, ids = params.subset(config)
    params.profile(profile)  # raises what is wrong with it
    version, per_shard = params.version, params.rows_per_shard(profile)
    manifest = manifest or plan_of(params, profile, store.root, workers)
    rows = read_manifest(manifest)
    lists = params.lists_of(profile, [row.id for row in rows])
    chosen = [row for row in rows if ids is None or row.id in ids]
    done, _ = render_rows(chosen, store, workers=workers)
    if done.failures:
        return done, None
    shards = build_release(
        manifest,
        store,
        out,
        {config: ids},
        version=version,
        lists=lists,
        measured=params.measured_of(profile),
        rows_per_shard=per_shard,
        workers=workers,
    )
    return done, shards


def plan_of(params: Parameters, profile: str, folder: Path, workers: int = 0) -> Path:
    """The recorded manifest of a profile, or one that is planned now into a folder."""
    if not params.path:  # else the recorded one is of other parameters
        with suppress(LookupError):
            return recorded_manifest(profile)
    path = folder / f"{profile}.parquet"
    write_plan(params.profile(profile), path, workers=workers, trials=RECORDED)
    return path
