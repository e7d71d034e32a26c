"""Physics concealed in somebody's own recordings: scored beside the twin, resumed where it stopped, nothing
told beforehand."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf, isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blind_joint import JOINT, recording
from rich.text import Text

from cablecomp.cli import main
from cablecomp.cluster import Workers
from cablecomp.config.sessions import Empirical, Session
from cablecomp.diagnosis.body import session_names
from cablecomp.errors import InputError
from cablecomp.estimation.standing import as_it_stood
from cablecomp.report.concealed_page import concealed_page, concealed_section, concealed_table
from cablecomp.trials.curves import Curves, curves, score_concealed
from cablecomp.trials.own import SCORED, Own, OwnWish, concealed_beside, joint_of_piece, piece, prove_in
from cablecomp.trials.run import Verdict
from cablecomp.trials.sealed import digest

Said = dict[str, Any]


def said(*names: str, covariate: str = "load", EA: float = 1.0, size: float = 1.0) -> Said:
    return {
        "missing_physics": [
            {
                "effect": n,
                "confidence": 0.9,
                "parameters": {"channel": "other_1", "of": {"value": size, "sd": 0.1}},
            }
            for n in names
        ],
        "candidates": [],
        "mismatch": [{"covariate": covariate, "p_value": 0.001}],
        "calibration": {"EA_N": {"value": EA, "sd": 0.01}},
    }


def put(physics: str, share: float = 0.1, **changes: Any) -> dict[str, Any]:
    named = {"late": ["clock_skew"], "friction": ["bearing_friction"]}.get(physics, [])
    return {
        "trial": 1, "round": 0, "physics": physics, "named": named, "shows_in": ["temperature"],
        "calibrates": physics == "gain", "share": share, "size": None if physics == "twin" else 10.0 * share,
        "unit": "ms", "words": physics,
    } | changes  # fmt: skip


def test_what_counts_is_new_beside_the_twin() -> None:
    twin = said("bearing_friction")
    late = score_concealed(put("late"), Verdict(said("bearing_friction", "clock_skew"), 1.0, ""), twin)
    assert (late.found, late.wrong, late.grown, late.new) == (True, False, (), ("clock_skew",))
    other = score_concealed(put("late"), Verdict(said("bearing_friction", "crosstalk"), 1.0, ""), twin)
    assert (other.found, other.wrong) == (False, True)
    same = score_concealed(put("friction"), Verdict(twin, 1.0, ""), twin)
    assert (same.found, same.wrong, same.new) == (False, False, ())
    for size, found in ((1.29, False), (1.31, True), (0.69, True)):  # three deviations off the twin's, or not
        more = Verdict(said("bearing_friction", size=size), 1.0, "")
        assert score_concealed(put("friction"), more, twin).found is found
        assert not score_concealed(put("late"), more, twin).found
    none = score_concealed(put("late"), Verdict(None, 2.0, "no luck"), twin)
    assert (none.found, none.wrong, none.failed) == (False, False, "no luck")


def test_what_has_no_name_is_found_by_its_covariate_or_by_the_calibration() -> None:
    drift = score_concealed(put("drift"), Verdict(said(covariate="temperature"), 1.0, ""), said())
    assert drift.found
    assert not score_concealed(
        put("drift"), Verdict(said(covariate="temperature"), 1.0, ""), said(covariate="temperature")
    ).found
    assert score_concealed(put("gain"), Verdict(said(EA=1.1), 1.0, ""), said()).found
    assert not score_concealed(put("gain"), Verdict(said(EA=1.001), 1.0, ""), said()).found


def answered() -> Curves:
    twin = said("strand_friction")
    rows = [score_concealed(put("twin"), Verdict(twin, 1.0, ""), twin)]
    for share, names in (
        (0.1, ()),
        (0.2, ("clock_skew",)),
        (0.4, ("clock_skew",)),
        (0.4, ("clock_skew", "crosstalk")),
    ):
        rows.append(score_concealed(put("late", share), Verdict(said(*names), 3.0, ""), twin))
    rows.append(score_concealed(put("gain"), Verdict(said(), float("nan"), "no luck"), twin))
    wish = {"recordings": ["a.csv"], "seed": 1, "rounds": 4, "seconds": 20.0, "sha256": "ab" * 32}
    return curves(rows, 40, wish)


def test_curves_count_by_size_and_say_from_where_all_are_found() -> None:
    found = answered()
    late, gain = found.curves
    assert [(p.size, p.found.hits, p.found.of) for p in late.points] == [
        (1.0, 0, 1),
        (2.0, 1, 1),
        (4.0, 2, 2),
    ]
    assert late.from_size == 2.0
    assert isnan(gain.from_size)
    assert found.names_in_twins == {"strand_friction": 1}
    assert (late.in_twins.hits, late.in_twins.of, found.wrong.hits, found.wrong.of) == (0, 1, 1, 5)
    entry = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert entry["curves"][0]["found_from"] == 2.0
    assert entry["curves"][1]["found_from"] is None


def test_page_table_and_section_hold_it() -> None:
    answer = answered().as_json()
    text = concealed_page(answer)
    for words in ("no luck", "abababababab", "6 of 40", "a.csv"):
        assert words in text
    table = concealed_table(answer)
    assert table.row_count == 2
    assert table.caption == "a wrong name beside: 1 of 5; any name in twins: strand friction 1 of 1"
    nameless = concealed_table({**answer, "names_in_twins": {}})
    assert str(nameless.caption).endswith("any name in twins: none")
    assert "2 ms" in concealed_section(answer).body


def test_what_was_not_found_says_up_to_which_size_it_was_put() -> None:
    """A first answer holds one size of each, and seldom the largest."""
    twin = said()
    rows = [score_concealed(put("late", share), Verdict(said(), 3.0, ""), twin) for share in (0.1, 0.2)]
    answer = answered().as_json() | {"curves": curves(rows, 40, {}).as_json()["curves"]}
    assert "not up to 2 ms" in concealed_section(answer).body
    assert list(concealed_table(answer).columns[2].cells) == [Text("not up to 2 ms", "dim")]


def test_pieces_are_stretches_of_one_session_and_the_same_again() -> None:
    whole = {f"{s}/{k}.csv": recording(JOINT, k) for s in ("one", "two") for k in range(2)}
    for number in range(4):
        found = list(piece(JOINT, whole, 30.0, 2, number).values())
        assert sum(float(np.ptp(t["time_s"])) for t in found) == pytest.approx(30.0, abs=0.1)
        np.testing.assert_array_equal(
            found[0]["time_s"], next(iter(piece(JOINT, whole, 30.0, 2, number).values()))["time_s"]
        )
    assert len(piece(JOINT, whole, 70.0, 2, 0)) == 2
    short = {name: {c: v[:2000] for c, v in table.items()} for name, table in whole.items()}
    seconds = float(np.ptp(next(iter(short.values()))["time_s"]))
    first = [next(iter(piece(JOINT, short, seconds, 2, number))) for number in range(4)]
    assert sorted(first) == sorted(whole)  # none twice while there are others
    with pytest.raises(InputError, match="200 samples"):
        piece(JOINT, {"a": {"time_s": np.arange(5.0)}}, 20.0, 0, 0)


def test_a_pieces_joint_states_what_the_joint_states_of_its_recordings() -> None:
    tight = Session(name="tight", recordings=("one/1.csv",), values={"pretension_N": 71.0})
    joint = JOINT.model_copy(update={"session": (Session(own=("pretension_N",)), tight)})
    drawn = {f"one/{k}.csv": recording(JOINT, k) for k in range(3)}
    there = joint_of_piece(joint, drawn)
    names = [f"recordings/recording-{k}.npz" for k in (1, 2, 3)]
    common = JOINT.drive.stage[0].pretension_N
    stood = [as_it_stood(there, Path(n), dict)[0].drive.stage[0].pretension_N for n in names]
    assert stood == [common, 71.0, common]
    assert len(set(session_names(there, names).values())) == 1
    assert there.session_own == joint.session_own
    assert joint_of_piece(JOINT, drawn) == JOINT


def test_a_pieces_joint_has_the_laws_of_its_recordings_session() -> None:
    laws = tuple(
        Empirical(id=s, law="fourier", of="motor_position_rad", coefficients_rad=(0.0, 1e-3), session=s)
        for s in ("one", "two")
    )
    sessions = tuple(Session(name=s, recordings=(s,)) for s in ("one", "two"))
    joint = JOINT.model_copy(update={"session": sessions, "empirical": laws})
    there = joint_of_piece(joint, {f"two/{k}.csv": recording(JOINT, k) for k in range(2)})
    assert [(law.id, law.session) for law in there.empirical] == [("two", "")]


def _conceal(pieces: Path, wish: OwnWish, out: Path, told: Callable[[int, int], None]) -> str:
    (out / "sealed").mkdir()
    assert (pieces / "00000" / "joint.toml").exists()
    for k, physics in enumerate(("twin", "late", "late")):
        (out / "trials" / f"{k:05d}").mkdir(parents=True)
        with zipfile.ZipFile(out / "sealed" / f"{k:05d}.zip", "w") as archive:
            archive.writestr("truth.json", json.dumps(put(physics, 0.1 * k, trial=k)))
        told(k + 1, 3)
    return digest(out / "sealed")


def test_a_run_stops_at_its_time_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    log: list[str] = []

    def diagnose(folder: Path, further: Sequence[Path], out: Path) -> None:
        log.append(folder.name)
        (out / "diagnosis.json").write_text(
            json.dumps(said(*(["clock_skew"] if folder.name != "00000" else [])))
        )

    own = Own(tmp_path, {"a.csv": recording(JOINT, 0)}, JOINT, _conceal, Workers(0), diagnose)
    wish = OwnWish(1, 1, 20.0, 0.0)
    first = prove_in(own, wish, lambda what, done, of: None, log.append)
    seal = digest(tmp_path / "sealed")
    assert log == [seal, "00000", "00001"]  # the least: a twin and one beside it
    assert (first.done, first.of) == (2, 3)
    second = prove_in(own, replace(wish, budget_s=inf), lambda what, done, of: None, log.append)
    assert log[3:] == [seal, "00002"]
    assert (second.done, second.of, second.curves[0].in_twins.hits) == (3, 3, 0)
    answer = concealed_beside(tmp_path)
    assert answer is not None
    assert answer["done"] == 3
    with pytest.raises(InputError, match="holds another run"):
        prove_in(own, replace(wish, seed=2), lambda what, done, of: None, log.append)
    with pytest.raises(InputError, match="holds another run"):
        prove_in(own, replace(wish, physics="late"), lambda what, done, of: None, log.append)
    (tmp_path / SCORED).write_text("[]")
    with pytest.raises(InputError, match="is no answer"):
        concealed_beside(tmp_path)
    assert concealed_beside(tmp_path / "trials") is None


def test_where_a_twin_failed_its_trials_are_done_compared_with_nothing_and_say_so(tmp_path: Path) -> None:
    def diagnose(folder: Path, further: Sequence[Path], out: Path) -> None:
        if folder.name == "00000":
            raise MemoryError("too large")
        (out / "diagnosis.json").write_text(json.dumps(said("clock_skew")))

    own = Own(tmp_path, {"a.csv": recording(JOINT, 0)}, JOINT, _conceal, Workers(0), diagnose)
    found = prove_in(own, OwnWish(1, 1, 20.0), lambda what, done, of: None, lambda sha256: None)
    assert (found.done, found.of, found.twins, found.curves, found.wrong.of) == (3, 3, 0, (), 0)
    text = concealed_page(json.loads((tmp_path / SCORED).read_text()))
    assert text.count("nothing to compare with, its twin failed: MemoryError: too large") == 2
    assert "No twin was given a name." not in text


@pytest.mark.parametrize("beside", [False, True])
def test_what_cannot_be_concealed_leaves_nothing(tmp_path: Path, beside: bool) -> None:
    def unknown(pieces: Path, wish: OwnWish, out: Path, told: Callable[[int, int], None]) -> str:
        assert (pieces / "00000" / "recording-1.npz").exists()
        raise InputError("physics is 'sleep'; late, slip are accepted")

    out = tmp_path / "diagnosis"
    if beside:
        out.mkdir()
        (out / "report.html").touch()
    own = Own(out, {"a.csv": recording(JOINT, 0)}, JOINT, unknown, Workers(0))
    with pytest.raises(InputError, match="'sleep'"):
        prove_in(own, OwnWish(1, 1, 20.0, physics="sleep"), lambda what, done, of: None, print)
    assert [p.name for p in tmp_path.rglob("*")] == (["diagnosis", "report.html"] if beside else [])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--in", "a.csv"], "--in needs --config"),
        (["--config", "x"], "go with --in"),
        (["--physics", "late"], "go with --in"),
    ],
)
def test_recordings_and_their_configuration_go_together(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["prove", *options]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
