"""A fleet: one row for each joint and night, none lost by another; what changed is told from what scatters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cablecomp.cli import main
from cablecomp.cluster import Workers
from cablecomp.errors import InputError
from cablecomp.examples import example
from cablecomp.fleet import fleet as fleet_module
from cablecomp.fleet.change import EVIDENCE, change
from cablecomp.fleet.fleet import Fleet, run_fleet
from cablecomp.fleet.places import Night, nights, strays
from cablecomp.fleet.rows import Compliance, Kept, Parts, step_within
from cablecomp.recording.replay import Replayed
from cablecomp.recording.table import Block
from cablecomp.report.fleet_page import FLAGS, _over_nights, failures, fleet_page, fleet_table

rng = np.random.default_rng(7)


def folders(place: Path, joints: tuple[str, ...], count: int) -> Path:
    for joint in joints:
        (place / joint).mkdir(parents=True)
        for k in range(count):
            (place / joint / f"night-{k:02d}.csv").write_text("time_s\n0\n", encoding="utf-8")
    return place


def told(done: int, of: int) -> None:
    assert 0 <= done <= of


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Rows with a drift, a slip, strands that go, and one night that fails; the list holds what was worked on."""
    asked: list[str] = []

    def work(night: Night) -> dict[str, float]:
        asked.append(f"{night.joint}/{night.name}")
        k = int(night.name[6:8])
        if (night.joint, k) == ("sound", 3):
            raise InputError(f"{night.name}: is cut off")
        zero = {"drifting": 1e-4 * k, "slipping": 1e-3 * (k >= 4)}.get(night.joint, 0.0)
        ratio = 1.04 if night.joint == "fraying" and k >= 5 else 1.0
        scatter = rng.standard_normal(2)
        return {"zero_rad": zero + 2e-5 * scatter[0], "compliance_ratio": ratio + 2e-3 * scatter[1]}

    monkeypatch.setitem(fleet_module._WORK, "replay", work)
    return asked


def test_each_joint_is_told_by_what_it_does(tmp_path: Path, made_up: list[str]) -> None:
    place = folders(tmp_path / "in", ("drifting", "fraying", "slipping", "sound"), 8)
    config = example("joints", "capstan-arm")
    found = run_fleet("replay", nights([place], config), tmp_path / "out", Workers(0), told)
    assert len(found.rows) == 32
    flags = {j.joint: j.flags for j in found.joints}
    assert flags == {
        "drifting": ("drifts",),
        "slipping": ("slips",),
        "fraying": ("loses strands",),
        "sound": (),
    }
    assert [r["night"] for r in found.rows if r["failed"]] == ["night-03.csv"]
    text = fleet_page(found, "cablecomp replay in --workers 2")
    assert all(word in text for word in (*FLAGS, "is cut off", "night-04.csv on"))
    assert fleet_table(found).row_count == 4
    (failed,) = failures(found)
    assert "/night-03.csv: " in failed
    assert "is cut off" in failed
    layout = _over_nights(found, "fraying").layout
    assert [axis.title.text.partition(" /")[0] for axis in (layout.xaxis, layout.yaxis, layout.yaxis2)] == [
        "", "zero moved", "compliance",
    ]  # fmt: skip
    assert (layout.xaxis2.title.text, layout.xaxis2.dtick) == ("night", 1)
    assert (
        layout.yaxis.range[1] - layout.yaxis.range[0] > 0.2
    )  # mrad: scatter of a night's zero does not fill it

    made_up.clear()  # again: only what failed, or was changed meanwhile, is worked on
    (place / "drifting/night-00.csv").write_text("time_s\n0\n1\n", encoding="utf-8")
    again = run_fleet("replay", nights([place], config), tmp_path / "out", Workers(0), told)
    assert sorted(made_up) == ["drifting/night-00.csv", "sound/night-03.csv"]
    assert again.reused == 30


@pytest.mark.parametrize("name", ["cablecomp.map.toml", "night-01.csv.map.toml"])
def test_a_night_whose_mapping_was_mended_is_worked_on_again(
    name: str, tmp_path: Path, made_up: list[str]
) -> None:
    place = folders(tmp_path / "in", ("a",), 2)
    config = example("joints", "capstan-arm")
    worked_on = []
    for sign in (1, 1, -1):
        made_up.clear()
        text = f'[channel]\njoint_position_rad = {{ column = "angle", sign = {sign} }}\n'
        (place / "a" / name).write_text(text, encoding="utf-8")
        run_fleet("replay", nights([place], config), tmp_path / "out", Workers(0), told)
        worked_on.append(list(made_up))
    both = ["a/night-00.csv", "a/night-01.csv"]
    assert worked_on == [both, [], both if name.startswith("cablecomp") else both[1:]]


@pytest.mark.parametrize(
    "given", ["--map auto", "--map time_s=t", "--session a", "--effects own.py", "--no-bounds", "--view"]
)
def test_what_a_fleet_has_no_use_for_is_refused(
    given: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = [
        "replay",
        str(folders(tmp_path / "in", ("a",), 1)),
        "--config",
        "capstan-arm",
        "--workers",
        "1",
    ]
    assert main([*command, *given.split(), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"cablecomp: {given.split()[0]}: of a fleet every night is taken by itself")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["replay", "diagnose"])
def test_a_configuration_for_all_is_needed_by_joints_without_their_own(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = folders(tmp_path / "in", ("a",), 1)
    out = ["--out", str(tmp_path / "out")]
    assert main([command, str(place), "--workers", "1", *out]) == 2
    said = (
        f"cablecomp: {place / 'a/joint.toml'}: is missing; add it, or give one for all joints with --config\n"
    )
    assert capsys.readouterr().err == said
    assert main([command, str(place / "a/night-00.csv"), *out]) == 2
    assert capsys.readouterr().err.startswith(
        "cablecomp: --config: is missing; give a joint's TOML file, or "
    )


def test_a_night_that_failed_is_told_of_on_one_line() -> None:
    row = {"joint": "a", "night": "odd\nname.csv", "failed": "is cut off"}
    assert failures(Fleet("replay", (row,), (), 0)) == ["a/odd name.csv: is cut off"]
    for place in (
        "rig/a/mon",
        "rig/a/mon/1.csv",
    ):  # who read it said where, a recording of the night or the night
        row = {"joint": "a", "night": "mon", "failed": f"{place}: line 3: is empty"}
        assert failures(Fleet("replay", (row,), (), 0)) == [f"{place}: line 3: is empty"]
    row = {"joint": "a", "night": "mon", "failed": "rig/a/joint.toml: is not valid TOML"}
    assert failures(Fleet("replay", (row,), (), 0)) == ["a/mon: rig/a/joint.toml: is not valid TOML"]


def test_a_joint_has_its_own_configuration_or_that_of_all(tmp_path: Path) -> None:
    place = folders(tmp_path, ("a", "b"), 2)
    common = example("joints", "capstan-arm")
    (place / "a/joint.toml").write_text(common.read_text(encoding="utf-8"), encoding="utf-8")
    assert {n.joint: n.config for n in nights([place], common)} == {"a": place / "a/joint.toml", "b": common}
    with pytest.raises(InputError, match=r"b/joint\.toml: is missing"):
        nights([place], None)
    for out in (place, place / "replay", place / "a/replay"):
        with pytest.raises(InputError, match="whose folders are joints; give another place with --out"):
            nights([place], common, out)
    with pytest.raises(InputError, match="FOLDER/JOINT/RECORDING"):
        nights([place / "a"], common)


def test_a_recording_in_no_joints_folder_is_told_of(tmp_path: Path) -> None:
    place = folders(tmp_path / "in", ("a",), 1)
    assert strays([place]) == []
    for name in ("b.MCAP", "c.csv", "notes.txt"):
        (place / name).touch()
    assert strays([place]) == [f"{place}: b.MCAP and 1 more: left out, as in no joint's folder"]


@pytest.mark.parametrize("how", ["", "trend", "step"])
def test_changes_are_told_from_scatter(how: str) -> None:
    """What is put in is found, with its size; scatter alone passes for a change in fewer than 1 in 50."""
    wrong = 0
    for _ in range(100):
        values = rng.standard_normal(20)
        if how == "trend":
            values += np.linspace(0.0, 12.0, 20)
        elif how == "step":
            values[9:] += 8.0
        found = change(values, 0.0)
        wrong += found.how != how
        if found.how == how == "step":
            assert found.size == pytest.approx(8.0, abs=2.5)
            assert abs(found.at - 9) <= 1
        if found.how == how == "trend":
            assert found.size == pytest.approx(12.0, abs=4.0)
    assert wrong <= 2
    assert change(np.zeros(4), 1.0).how == ""
    assert change(1e-9 * np.arange(20.0), 1.0).evidence < EVIDENCE  # below what one value is known to


@pytest.mark.parametrize(("step_rad", "seen"), [(2e-4, True), (1e-5, False)])
def test_a_step_within_a_night_is_seen_beside_what_follows_the_load(step_rad: float, seen: bool) -> None:
    """One of ten times the encoder's noise; none that single readings hide, for friction remembers noise."""
    count = 4_000
    load = np.sin(np.linspace(0.0, 20.0, count))
    residual = 3e-4 * load + step_rad * (np.arange(count) > 2_500) + 2e-5 * rng.standard_normal(count)
    kept = Kept()
    for r, m in zip(np.array_split(residual, 5), np.array_split(load, 5), strict=True):
        kept.take(Replayed(Block(1, {}, 1.0), {"deflection_rad": np.zeros(len(r))}, r, None, m))
    assert step_within(kept) == pytest.approx(step_rad if seen else 0.0, rel=0.2)


def test_streams_in_any_blocks_give_the_same() -> None:
    """Means of parts are those of the whole stream; compliance is the straight line's, offsets or not."""
    values = rng.standard_normal(40_000) + np.linspace(0.0, 5.0, 40_000)
    parts = Parts()
    for block in np.array_split(values, 13):
        parts.add(block)
    means = parts.means()
    assert 32 <= len(means) < 64
    assert np.mean(means) == pytest.approx(values[: int(len(values) * 0.99)].mean(), abs=0.1)
    assert np.all(np.diff(np.convolve(means, np.ones(8) / 8, "valid")) > 0.0)
    load = rng.standard_normal(1_000)
    line = Compliance()
    for m in np.array_split(load, 7):
        line.add(m, 2e-3 * m + 0.1, 1e-4 * m + 0.3)
    assert line.ratio() == pytest.approx(1.05, rel=1e-9)
