"""Before anything is concealed a folder says for which run; what is there by itself, or of another, is left alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from cablecomp.errors import InputError
from cablecomp.trials.run import BEGUN, COMMITMENT, committed
from cablecomp.trials.sealed import SEALED, digest

WISH = {"seed": 5, "kinds": ["none"]}


def _conceals(out: Path) -> str:
    (out / SEALED).mkdir(exist_ok=True)
    (out / SEALED / "00000.zip").write_bytes(b"truth")
    return digest(out / SEALED)


def _is_stopped(out: Path) -> str:
    _conceals(out)
    raise KeyboardInterrupt


def _cannot(out: Path) -> str:
    raise InputError("no joint can show it")


def test_what_was_stopped_goes_on_for_the_same_wish_alone(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        committed(tmp_path, WISH, lambda: _is_stopped(tmp_path))
    with pytest.raises(InputError, match="another run's beginning"):
        committed(tmp_path, {**WISH, "seed": 77}, lambda: _conceals(tmp_path))
    sha256 = committed(tmp_path, WISH, lambda: _conceals(tmp_path))
    assert not (tmp_path / BEGUN).exists()
    assert committed(tmp_path, WISH, lambda: _cannot(tmp_path)) == sha256


@pytest.mark.parametrize("name", ["pieces", "trials", "sealed", "verdicts"])
def test_a_folder_of_somebody_elses_is_refused_and_kept(tmp_path: Path, name: str) -> None:
    mine = tmp_path / name / "mine.txt"
    mine.parent.mkdir()
    mine.write_text("precious", encoding="utf-8")
    with pytest.raises(InputError, match=f"{name}: is there already"):
        committed(tmp_path, WISH, lambda: _conceals(tmp_path))
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == [mine]


def test_where_nothing_can_be_concealed_nothing_is_left(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no joint"):
        committed(tmp_path / "new", WISH, lambda: _cannot(tmp_path))
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("text", ["", "[]", '{"seed":', "{}"])
def test_a_damaged_commitment_is_said_in_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / COMMITMENT).write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        committed(tmp_path, WISH, lambda: _conceals(tmp_path))
    assert str(tmp_path) in str(caught.value)
    assert "another folder" in str(caught.value)
