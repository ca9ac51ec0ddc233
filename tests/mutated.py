"""Broken files, each read or refused in one line that names it, and changed documents."""

from __future__ import annotations

import json
import random
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import GaitgraphError
from gaitgraph.io.formats import read_table

if TYPE_CHECKING:
    from pathlib import Path


def refusal(path: Path) -> str:
    """Return the one line that a gait file is refused with; the error holds the path, row and value that this tells."""
    with pytest.raises(GaitgraphError) as caught:
        read_table(path)
    message = str(caught.value)
    assert message.startswith("gait file") and str(path) in message, message  # noqa: PT018
    assert message.count("gait file") == 1
    assert "\n" not in message
    stated = json.loads(json.dumps(caught.value.as_mapping()))
    assert stated["path"] == str(path)
    row = re.search(r": row (\d+)", message)
    assert row is None or stated["row"] == int(row[1])
    says_value = re.search(
        ", got (?!no|None|numbers|semicolons|both|other bytes)", message
    )
    assert "value" in stated or not says_value, message
    return message


def check_mutations(content: bytes, path: Path, *, count: int, seed: int = 1) -> int:
    """Read so many mutations of a file, and return how many of them were refused."""
    chance = random.Random(seed)
    refused = 0
    for _ in range(count):
        mutation = bytearray(content)
        for _ in range(chance.randint(1, 4)):
            place, length = chance.randrange(len(mutation) or 1), chance.randint(1, 8)
            kind = chance.choice(("set", "bit", "put", "cut", "end"))
            if kind == "bit" and mutation:
                mutation[place] ^= 1 << chance.randrange(8)
            elif kind == "put":
                mutation[place:place] = chance.randbytes(length)
            elif kind == "cut":
                del mutation[place : place + 5 * length]
            elif kind == "end" and chance.random() < 0.2:
                del mutation[place:]
            else:
                mutation[place : place + length] = chance.choice(
                    (chance.randbytes(length), b"\xff" * length)
                )
        path.write_bytes(mutation)
        try:
            assert np.isfinite(read_table(path).alpha[:, :2]).all()
        except GaitgraphError as error:
            refused += 1
            assert "\n" not in str(error)
            assert str(path) in str(error)
    return refused


def changed(document: dict[str, Any], *path: Any, to: Any) -> dict[str, Any]:
    """Return a document with the value at a path of names and numbers replaced."""
    copy = json.loads(json.dumps(document))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return dict(copy)
