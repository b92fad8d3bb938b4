"""Hashes by which rows of different files are compared."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from mpmworlds.builder.plan.manifest import SCHEMA


def recipe_digest(row: Mapping[str, Any]) -> bytes:
    """Hash of what a row has of its manifest."""
    return digest_of(json.dumps([row[name] for name in SCHEMA.names]))


def digest_of(value: object) -> bytes:
    """Hash of a value of a column."""
    data = value.get("bytes") if isinstance(value, dict) else value
    whole = data if isinstance(data, bytes) else repr(data).encode()
    return hashlib.sha256(whole).digest()[:16]
