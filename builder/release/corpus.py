"""From parameters to a release folder: plan, render what is missing, write shards."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.manifest import (
    read_manifest,
    read_table,
    recorded_manifest,
)
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.trials import RECORDED
from mpmworlds.builder.release.build import Built, build_release, check_target
from mpmworlds.builder.release.layout import MAIN
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.materialise import Materialised, render_rows
from mpmworlds.builder.render.store import Store


def build_corpus(
    params: Parameters,
    configs: Sequence[str],
    store: Store,
    out: Path,
    *,
    manifest: Path | None = None,
    workers: int = 0,
) -> tuple[Materialised, Built | None]:
    """Build configurations into a release.

    Parameters
    ----------
    params, configs
        Which corpora, and what of them.
    store
        Rendered samples; what it lacks is rendered.
    out
        Folder of the release.
    manifest
        A plan; else the recorded one of each corpus, or one that is made now.
    workers
        Processes, one for each core if 0.

    Returns
    -------
    Materialised
        What became of the samples.
    Built, or None
        What became of the configurations; None if samples failed, and nothing was
        built.

    Raises
    ------
    ValueError
        If there is no such configuration, or they are of several corpora and there is
        a manifest, which is of one.
    """
    check_target(out)  # before all that takes long
    corpora = _corpora(params, configs, store.root, manifest, workers)
    chosen = {}
    for corpus in corpora:
        wanted = corpus.configs.values()
        ids = None if None in wanted else set().union(*(ids or () for ids in wanted))
        for row in read_manifest(corpus.manifest, ids) if wanted else ():
            chosen[row.program_sha256] = row
    done, _ = render_rows(list(chosen.values()), store, workers=workers)
    if done.failures:
        return done, None
    built = build_release(corpora, store, out, version=params.version, workers=workers)
    return done, built


def _corpora(
    params: Parameters,
    configs: Sequence[str],
    folder: Path,
    manifest: Path | None,
    workers: int,
) -> list[Corpus]:
    """The corpora of configurations, that of the benchmark first."""
    wanted: dict[str, dict[str, set[str] | None]] = {}
    if not params.path and not manifest:
        wanted[MAIN] = {}
    for config in configs:
        params.refuse_unknown(config)
        profile, ids = params.subset(config)
        params.profile(profile)  # raises what is wrong with it
        wanted.setdefault(profile, {})[config] = ids
    if manifest and len(wanted) > 1:
        raise ValueError(
            f"--manifest {manifest}: is of one corpus, but {', '.join(configs)} are of "
            f"{', '.join(wanted)}; build them one after another"
        )
    corpora = []
    for profile, chosen in wanted.items():
        plan = manifest or plan_of(params, profile, folder, workers)
        ids_of_all = read_table(plan, ["id"])["id"].to_pylist()
        corpora.append(
            Corpus(
                plan,
                chosen,
                name=profile,
                lists=params.lists_of(profile, ids_of_all),
                measured=params.measured_of(profile),
                rows_per_shard=params.rows_per_shard(profile),
            )
        )
    return corpora


def plan_of(params: Parameters, profile: str, folder: Path, workers: int = 0) -> Path:
    """The recorded manifest of a profile, or one that is planned now into a folder."""
    if not params.path:  # else the recorded one is of other parameters
        with suppress(LookupError):
            return recorded_manifest(profile)
    path = folder / f"{profile}.parquet"
    write_plan(params.profile(profile), path, workers=workers, trials=RECORDED)
    return path
