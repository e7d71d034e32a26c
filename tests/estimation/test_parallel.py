"""Fits side by side: in order, in as many threads as are allowed, and in no more where one of them does so again."""

from __future__ import annotations

import threading

import pytest

from cablecomp.errors import InputError
from cablecomp.estimation.parallel import side_by_side


@pytest.mark.parametrize("allowed", ["1", "2"])
def test_results_stand_in_the_order_of_the_items(monkeypatch: pytest.MonkeyPatch, allowed: str) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", allowed)
    assert list(side_by_side(lambda k: k * k, range(20))) == [k * k for k in range(20)]
    assert list(side_by_side(lambda k: k, [])) == []


def test_work_within_work_starts_no_further_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cablecomp.estimation.parallel._threads", lambda: 2)
    both = threading.Barrier(2, timeout=10.0)

    def outer(k: int) -> tuple[int, set[int]]:
        both.wait()  # two at once, each in a thread of its own
        return threading.get_ident(), set(side_by_side(lambda _: threading.get_ident(), range(4)))

    found = dict(side_by_side(outer, range(2)))
    assert len(found) == 2
    assert threading.get_ident() not in found
    for own, inner in found.items():
        assert inner == {own}
    # outside of it there are threads again
    assert threading.get_ident() not in set(side_by_side(lambda _: threading.get_ident(), range(4)))


def test_what_is_raised_is_raised_to_whom_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cablecomp.estimation.parallel._threads", lambda: 2)

    def refuse(k: int) -> int:
        if k == 3:
            raise InputError("three")
        return k

    with pytest.raises(InputError, match="three"):
        list(side_by_side(refuse, range(6)))
