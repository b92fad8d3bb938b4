"""The audit of a corpus: nothing that is held out has been seen in another guise."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mpmworlds.splits.assign import SplitParams
from mpmworlds.splits.audit_records import Finding, Record
from mpmworlds.splits.duplicates import duplicate_findings
from mpmworlds.splits.ids import SampleId, SampleIdError
from mpmworlds.splits.lineage import lineage_findings
from mpmworlds.splits.near_duplicates import NEAR, near_findings


@dataclass(frozen=True)
class Audit:
    """Outcome of an audit.

    Attributes
    ----------
    samples, templates
        How many samples it looked at, and how many of them it compared by distance.
    problems
        What must not be; none in a sound corpus.
    kin
        Modifications that are near training scenes of their own family, nearest first.
        They are meant to be.
    """

    samples: int
    templates: int
    problems: tuple[Finding, ...]
    kin: tuple[Finding, ...]


def audit(records: Sequence[Record], params: SplitParams, near: float = NEAR) -> Audit:
    """Look for any leak between the splits of a corpus.

    Parameters
    ----------
    records
        Its samples, in any order.
    params
        Parameters of its splits.
    near
        Largest config distance of templates that are near each other. [1]

    Returns
    -------
    Audit
        What it found: see `lineage_findings`, `duplicate_findings` and `near_findings`.

    Raises
    ------
    ValueError
        If `near` is negative.
    """
    templates = list(_templates(records))
    problems = [*lineage_findings(records, params), *duplicate_findings(records)]
    close, kin = near_findings(templates, near)
    return Audit(len(records), len(templates), (*problems, *close), tuple(kin))


def _templates(records: Sequence[Record]) -> Iterator[Record]:
    """Samples that are no perturbations; ids out of the grammar are found elsewhere."""
    for record in records:
        try:
            sample = SampleId.parse(record.id)
        except SampleIdError:
            continue
        if sample.perturbation is None:
            yield record
