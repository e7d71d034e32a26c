"""Every input that once broke a reader or decoder, and seeded mutations of them, end in a line or a result."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

pytest.importorskip("mcap", reason="optional package mcap is not installed")
pytest.importorskip("rosbags", reason="optional package rosbags is not installed")

from fuzz_targets import TARGETS
from mutate import mutated

CORPUS = Path(__file__).parent / "corpus"


@pytest.mark.filterwarnings("ignore::DeprecationWarning:can", "ignore::UserWarning:can")
@pytest.mark.parametrize("name", TARGETS)
def test_nothing_in_the_corpus_or_near_it_breaks_a_target(name: str) -> None:
    assert set(TARGETS) == {path.name for path in CORPUS.iterdir()}
    seeds = [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]
    assert seeds
    random_ = random.Random(name)
    for data in [*seeds, *(mutated(random_.choice(seeds), random_) for _ in range(60))]:
        TARGETS[name](data)
