"""Physics concealed in recordings: what the drive felt stays what was measured, sizes are as stated, twins hold
nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from firmware_sim.conceal.__main__ import main
from firmware_sim.conceal.physics import JOINT, MOTOR, NEIGHBOUR, PHYSICS, TIME, TORQUE, acceleration, dahl
from firmware_sim.conceal.plan import Trial, trials_of
from firmware_sim.errors import SimError
from firmware_sim.trials import digest, open_truth

Table = dict[str, np.ndarray]


def table(seed: int = 0, torque: bool = True) -> Table:
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 0.004)
    q = 0.5 * np.sin(1.3 * t)
    found = {TIME: t, MOTOR: q, JOINT: q + 1e-4 * rng.standard_normal(len(t))}
    return found | ({TORQUE: 0.3 * np.sin(0.7 * t) + 0.02} if torque else {})


def trials(torque: bool = True, rounds: int = 4) -> tuple[list[Trial], dict[str, str]]:
    return trials_of([[table(2 * r, torque), table(2 * r + 1, torque)] for r in range(rounds)], 5)


def added(trial: Trial, twin: Trial, channel: str) -> np.ndarray:
    pairs = zip(trial.recordings, twin.recordings, strict=True)
    return np.concatenate([a[channel] - b[channel] for a, b in pairs])


def test_every_size_once_in_as_many_rounds_beside_a_twin_that_differs_by_nothing_else() -> None:
    found, missing = trials()
    assert missing == {}
    assert len(found) == 4 * (1 + len(PHYSICS))
    for physics in PHYSICS:
        mine = [t for t in found if t.physics is physics]
        assert sorted(t.share for t in mine) == sorted(physics.shares)
        for t in mine:
            twin = next(o for o in found if o.round == t.round and o.physics is None)
            assert t.change is not None
            for name in t.recordings[0]:
                assert np.any(added(t, twin, name)) == (name == t.change.channel), (physics.id, name)
    assert found[1].share == PHYSICS[0].shares[2]


def test_sizes_are_what_the_truth_says() -> None:
    found, _ = trials()
    travel, torque = 1.0, float(np.sqrt(np.mean(table()[TORQUE] ** 2)))
    for t in found:
        if t.physics is None or t.change is None:
            continue
        twin = next(o for o in found if o.round == t.round and o.physics is None)
        delta = added(t, twin, t.change.channel)
        size = t.change.numbers["size"]
        if t.physics.id in ("neighbour", "weight", "inertia", "friction"):
            assert np.std(delta) == pytest.approx(size, rel=1e-6)
            assert size == pytest.approx(t.share * torque, rel=0.05)
        elif t.physics.id in ("slip", "play"):
            assert np.ptp(delta) == pytest.approx(size, rel=0.02)
            assert size == pytest.approx(t.share * travel, rel=0.02)
        elif t.physics.id in ("drift", "frame"):
            assert np.std(delta) == pytest.approx(size, rel=1e-6)
        elif t.physics.id == "late":
            late, own = t.recordings[0][JOINT], twin.recordings[0][JOINT]
            lag = round(size / 0.004)
            if size >= 0.004:  # by whole samples: the same readings, later
                np.testing.assert_allclose(late[lag:], own[:-lag], atol=1e-12)
        assert t.truth()["size"] == pytest.approx(size * t.physics.per_unit)


def test_under_a_steady_load_torques_are_shares_of_it_and_a_weight_pulls_about_as_much_as_it_changes() -> (
    None
):
    steady = [[{**table(r), TORQUE: 0.3 + 0.01 * np.sin(0.7 * table(r)[TIME])}] for r in range(8)]
    found, missing = trials_of(steady, 5)
    assert set(missing) == {"play"}
    twins = {t.round: t for t in found if t.physics is None}
    for t in found:
        if t.physics is None or t.physics.id not in ("neighbour", "weight", "inertia", "friction"):
            continue
        delta = added(t, twins[t.round], TORQUE)
        assert np.std(delta) == pytest.approx(0.3 * t.share, rel=0.01)
        assert abs(np.mean(delta)) < 2.0 * np.std(delta)


def test_a_few_physics_alone_are_the_same_as_among_all() -> None:
    pieces = [[table(r)] for r in range(2)]
    whole, few = trials_of(pieces, 5)[0], trials_of(pieces, 5, ("weight", "late"))[0]
    assert [t.physics.id if t.physics else "twin" for t in few] == ["twin", "late", "weight"] * 2
    for t in few:
        same = next(o for o in whole if o.round == t.round and o.physics is t.physics)
        for name, values in t.recordings[0].items():
            np.testing.assert_array_equal(values, same.recordings[0][name])
    with pytest.raises(SimError, match=r"physics is 'wait'; late, slip, .* are accepted"):
        trials_of(pieces, 5, ("late", "wait"))


def test_a_slip_goes_on_into_the_recordings_after_it() -> None:
    for trial in (t for t in trials()[0] if t.physics is not None and t.physics.id == "slip"):
        assert trial.change is not None
        where = int(trial.change.numbers["recording"])
        for k, step in enumerate(trial.change.added):
            expected = {k < where: 0.0, k > where: trial.change.numbers["size"]}.get(True)
            if expected is not None:
                assert np.all(np.abs(step) == expected)


def test_acceleration_of_a_sine_and_dahls_limits() -> None:
    t = np.arange(0.0, 10.0, 0.005)
    a = acceleration(t, np.sin(3.0 * t))[100:-100]
    np.testing.assert_allclose(a, -9.0 * np.sin(3.0 * t)[100:-100], atol=0.1)
    z = dahl(np.concatenate([np.linspace(0, 1, 500), np.linspace(1, 0, 500)]), 0.05)
    assert z[499] == pytest.approx(1.0, abs=1e-6)
    assert z[-1] == pytest.approx(-1.0, abs=1e-6)
    # half a turn of build-up after the reversal: 1 - 2 (1 - exp(-q/turn)) = 0 at q = turn ln 2
    assert abs(z[500 + round(0.05 * np.log(2.0) * 500)]) < 0.03


def with_gaps(channel: str, *rows: slice) -> Table:
    found = table()
    for here in rows:
        found[channel][here] = np.nan
    return found


def test_play_leaves_the_joint_as_it_was_read_where_the_load_is_not_known_from_the_first_row() -> None:
    whole, late = table(), with_gaps(TORQUE, slice(0, 3))
    found, missing = trials_of([[late], [whole, late], [whole, with_gaps(TORQUE, slice(None))]], 5, ("play",))
    assert missing == {}
    for trial in (t for t in found if t.physics is not None):
        assert all(np.all(np.isfinite(r[JOINT])) for r in trial.recordings)
    # the first load that is known presses the joint to its flank: until then it lies there already
    alone = next(t for t in found if t.physics is not None)
    step = added(alone, found[0], JOINT)
    np.testing.assert_allclose(step[:3], step[3], rtol=1e-9)


def test_a_weight_pulls_also_where_the_angle_is_not_read_and_takes_no_torque_away() -> None:
    every_other = slice(1, None, 2)
    found, _ = trials_of([[with_gaps(JOINT, every_other)]], 5, ("weight",))
    whole, _ = trials_of([[with_gaps(JOINT)]], 5, ("weight",))
    torque = found[1].recordings[0][TORQUE]
    assert np.all(np.isfinite(torque))
    # an angle that turns by 3 mrad from row to row, bridged: as if it were known
    np.testing.assert_allclose(torque, whole[1].recordings[0][TORQUE], atol=2e-3)


def test_without_a_torque_channel_what_needs_one_is_left_out_and_said() -> None:
    found, missing = trials(torque=False, rounds=1)
    assert {t.physics.id for t in found if t.physics is not None} == {"late", "slip", "frame", "drift"}
    assert set(missing) == {"neighbour", "weight", "inertia", "friction", "play", "gain"}
    assert all("need a joint torque" in why for why in missing.values())
    assert all(NEIGHBOUR in r for t in found for r in t.recordings)


def test_command_line_writes_public_folders_and_seals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    piece = tmp_path / "pieces" / "00000"
    piece.mkdir(parents=True)
    (piece / "joint.toml").write_text("schema = 1\n")
    np.savez(piece / "recording-1.npz", **table())
    arguments = ["--in", str(tmp_path / "pieces"), "--seed", "3", "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    count = 1 + len(PHYSICS)
    assert lines[-1] == f"sha256 {digest(tmp_path / 'out' / 'sealed')}"
    assert lines[count - 1] == f"written {count} of {count}"
    assert open_truth(tmp_path / "out" / "sealed" / "00000.zip")["physics"] == "twin"
    public = tmp_path / "out" / "trials" / "00003"
    assert sorted(str(p.relative_to(public)) for p in public.rglob("*.*")) == [
        "joint.toml",
        "recordings/recording-1.npz",
    ]
    assert main([*arguments, "--physics", "late, weight"]) == 0
    assert "written 3 of 3" in capsys.readouterr().out
    (piece / "recording-1.npz").unlink()
    assert main(arguments) == 2
    assert capsys.readouterr().err.startswith("error: ")
