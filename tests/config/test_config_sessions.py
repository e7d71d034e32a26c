"""Sessions, conditions and empirical laws: read, written back, put into force."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from cablecomp.config import in_session, load_joint, parse_joint, session_of
from cablecomp.config_text import joint_text
from cablecomp.effects.catalogue import extend, other_channels
from cablecomp.errors import InputError
from cablecomp.estimation.standing import as_it_stood
from cablecomp.observer import Observer
from cablecomp.recording.assumptions import assumptions

JOINT = Path(__file__).parents[2] / "configs/joints/tendon-finger.toml"
SESSIONS = """
[condition]
sheath_bend_rad = "other_sheath_angle_rad"
[[session]]
own = ["joint_position_offset_rad", "pretension_N"]
[[session]]
name = "monday"
recordings = ["monday/*.csv"]
values = {joint_position_offset_rad = 1.5e-3, pretension_N = 31.25}
[[session]]
name = "tuesday"
recordings = ["night"]
[session.values]
motor_torque_offset_Nm = -0.004
"""
RIPPLE = """
[[empirical]]
id = "ripple_by_motor_angle"
law = "{law}"
of = "{of}"
centre = 0.2
half_width = 0.5
coefficients_rad = [1e-3, 2e-3, -4e-3, 5e-4]
"""


def config(text: str):
    return parse_joint(tomllib.loads(JOINT.read_text() + text), "joint.toml")


ODD = r"""
condition = {"Öl 🛢\u007f" = "temperature_degC"}
session = [{name = "🦾\u007f", own = [], recordings = ["\u0085\\"]}]
"""


@pytest.mark.parametrize("text", [SESSIONS, "[session]\nown = ['EA_N', 'effect.viscous_slip.x']\n", ""])
def test_what_is_written_reads_back_as_the_same_configuration(text: str) -> None:
    joint = config(text + RIPPLE.format(law="fourier", of="motor_position_rad"))
    assert parse_joint(tomllib.loads(joint_text(joint)), "again") == joint
    assert parse_joint(joint.model_dump(by_alias=True), "dumped") == joint


def test_any_text_is_written_so_that_toml_takes_it() -> None:
    joint = parse_joint(tomllib.loads(ODD + JOINT.read_text()), "joint.toml")
    text = joint_text(joint, ("two\nlines, and a bell\x07",))
    assert parse_joint(tomllib.loads(text), "again") == joint


def test_the_zeros_alone_differ_unless_the_configuration_says_more() -> None:
    assert config("").session_own == ("joint_position_offset_rad", "motor_torque_offset_Nm")
    assert config("[session]\nown = []\n").session_own == ()
    assert config(SESSIONS).session_own == (
        "joint_position_offset_rad",
        "pretension_N",
        "motor_torque_offset_Nm",
    )


def test_a_session_is_found_by_name_or_by_the_recordings_path() -> None:
    joint = config(SESSIONS)
    for path, expected in {
        "data/monday/a.csv": "monday",
        "monday/a.csv": "monday",
        "x/night/3/a.mcap": "tuesday",
        "monday/a.mcap": None,
        "elsewhere.csv": None,
    }.items():
        found = session_of(joint, Path(path), None)
        assert (found and found.name) == expected, path
    chosen = session_of(joint, Path("data/monday/a.csv"), "tuesday")
    assert chosen is not None
    assert chosen.name == "tuesday"
    with pytest.raises(InputError, match="no session of that name; it has monday, tuesday"):
        session_of(joint, None, "wednesday")
    with pytest.raises(InputError, match="several sessions claim it"):
        session_of(joint, Path("night/monday/a.csv"), None)


def test_a_recording_that_is_named_goes_before_its_folder() -> None:
    text = """
[[session]]
name = "after"
recordings = ["monday"]
[[session]]
name = "before"
recordings = ["monday/a.csv"]
"""
    for path, expected in {"x/monday/a.csv": "before", "x/monday/b.csv": "after", "b/a.csv": None}.items():
        found = session_of(config(text), Path(path), None)
        assert (found and found.name) == expected, path


def test_brackets_in_a_path_are_its_own_where_they_are_escaped_or_the_path_is_just_that() -> None:
    text = """
[[session]]
name = "escaped"
recordings = ["run [[]1]", "run [[]?]/[*].csv"]
[[session]]
name = "pattern"
recordings = ["run [23]"]
"""
    for path, expected in {
        "run [1]/r.csv": "escaped",
        "run 1/r.csv": None,
        "run [4]/*.csv": "escaped",
        "run [4]/r.csv": None,
        "run 3/r.csv": "pattern",
        "run [23]/r.csv": "pattern",
    }.items():
        found = session_of(config(text), Path(path), None)
        assert (found and found.name) == expected, path


def test_a_bracketed_path_that_is_named_goes_before_its_folder() -> None:
    named = '[[session]]\nname = "named"\nrecordings = ["run [[]1]/r.csv"]\n'
    folder = '[[session]]\nname = "folder"\nrecordings = ["run [[]1]"]\n'
    found = session_of(config(folder + named), Path("x/run [1]/r.csv"), None)
    assert found is not None
    assert found.name == "named"


def test_of_two_that_name_a_recording_the_one_that_names_more_of_its_path_claims_it() -> None:
    text = """
[[session]]
name = "here"
recordings = ["s/rec.csv"]
[[session]]
name = "there"
recordings = ["mon/s/rec.csv"]
"""
    for path, expected in {"s/rec.csv": "here", "mon/s/rec.csv": "there", "tue/s/rec.csv": "here"}.items():
        found = session_of(config(text), Path(path), None)
        assert (found and found.name) == expected, path


TWICE = """
[[session]]
name = "each"
recordings = ["s/a.csv", "s/b.csv"]
[[session]]
name = "each s/b.csv"
mounting = "{mounting}"
recordings = [{recordings}]
"""


@pytest.mark.parametrize("mounting", ["each", "", "each s/b.csv"])
@pytest.mark.parametrize("recordings", ['"s/b.csv"', '"s/c.csv", "s/b.csv"'])
def test_of_equal_claims_the_part_goes_before_its_mounting_and_the_shorter_list_before_the_longer(
    mounting: str, recordings: str
) -> None:
    joint = config(TWICE.format(mounting=mounting, recordings=recordings))
    whole = session_of(joint, Path("s/a.csv"), None)
    assert whole is not None
    assert whole.name == "each"
    if mounting == "each" or "," not in recordings:
        part = session_of(joint, Path("x/s/b.csv"), None)
        assert part is not None
        assert part.name == "each s/b.csv"
    else:
        with pytest.raises(InputError, match=r"several sessions claim it \(each, each s/b.csv\)"):
            session_of(joint, Path("x/s/b.csv"), None)


def test_the_number_of_patterns_decides_nothing() -> None:
    text = """
[[session]]
name = "all"
recordings = ["s*/*.csv"]
[[session]]
name = "some"
recordings = ["s/a*.csv", "s/b*.csv"]
"""
    with pytest.raises(InputError, match="several sessions claim it"):
        session_of(config(text), Path("s/b.csv"), None)


def test_a_sessions_values_take_the_place_of_the_joints_own() -> None:
    joint = config(SESSIONS)
    monday = in_session(joint, joint.sessions[0])
    assert monday.drive.stage[0].pretension_N == 31.25
    assert monday.sensors.joint_position_offset_rad == 1.5e-3
    assert in_session(joint, joint.sessions[1]).sensors.motor_torque_offset_Nm == -0.004
    assert in_session(joint, None) == joint


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[session]\nown = ['pretention_N']\n", "did you mean `pretension_N`"),
        ("[session]\nowns = []\n", "unknown key `session.owns`"),
        ("[[session]]\nrecordings = ['a']\n", "needs a `name`"),
        ("[[session]]\nname = 'a'\n[[session]]\nname = 'a'\n", "`a` is given twice"),
        ("[[session]]\nname = 'a'\nvalues = {EA_N = 'x'}\n", "session.1.values.EA_N"),
        ("[condition]\nbend = 3\n", "condition.bend"),
        (RIPPLE.format(law="chebyshev", of="motor_position_rad").replace("centre", "center"), "center"),
    ],
)
def test_what_is_wrong_is_named(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        config(text)


@pytest.mark.parametrize("of", ["motor_position_rad", "other_bend_rad"])
@pytest.mark.parametrize("law", ["chebyshev", "fourier"])
def test_an_empirical_law_adds_its_curve_to_the_joint_position(law: str, of: str) -> None:
    angle = np.linspace(-0.2, 0.7, 50)
    columns = {
        "time_s": np.arange(50) * 1e-2,
        "motor_position_rad": angle if of == "motor_position_rad" else np.zeros(50),
        "joint_torque_Nm": np.zeros(50),
        "other_bend_rad": angle,
    }
    x, c = (angle - 0.2) / 0.5, [1e-3, 2e-3, -4e-3, 5e-4]
    if law == "chebyshev":
        curve = np.polynomial.chebyshev.chebval(np.clip(x, -1.0, 1.0), c)
    else:
        turn = np.pi * x
        curve = c[0] + c[1] * np.sin(turn) + c[2] * np.cos(turn) + c[3] * np.sin(2.0 * turn)
    plain = Observer(config("")).run(columns)["joint_position_rad"]
    with_law = Observer(config(RIPPLE.format(law=law, of=of))).run(columns)["joint_position_rad"]
    np.testing.assert_allclose(with_law - plain, curve, atol=1e-15)


MONDAYS = SESSIONS + RIPPLE.format(law="fourier", of="motor_position_rad") + "session = 'monday'\n"


@pytest.mark.parametrize(
    ("session", "runs"), [(None, False), ("tuesday", False), ("monday", True), ("late on monday", True)]
)
def test_a_law_of_one_session_runs_in_that_one_and_on_that_mounting_alone(
    session: str | None, runs: bool
) -> None:
    part = "[[session]]\nname = 'late on monday'\nmounting = 'monday'\n"
    joint, plain = config(MONDAYS + part), config(SESSIONS + part)
    columns = {
        "time_s": np.arange(50) * 1e-2,
        "motor_position_rad": np.linspace(-0.2, 0.7, 50),
        "joint_torque_Nm": np.zeros(50),
    }
    angles = []
    for c in (joint, plain):
        there = None if session is None else session_of(c, None, session)
        angles.append(Observer(in_session(c, there)).run(columns)["joint_position_rad"])
    assert bool(np.any(np.abs(angles[0] - angles[1]) > 1e-4)) is runs
    assert parse_joint(tomllib.loads(joint_text(joint)), "again") == joint


def test_a_recording_of_no_session_asks_for_nothing_that_laws_of_sessions_read() -> None:
    """Nor are they among what its prediction takes for granted."""
    joint = config(MONDAYS.replace("motor_position_rad", "other_bend_rad"))
    for recording, laws, channels in (
        ("wednesday/1.csv", 0, []),
        ("monday/1.csv", 1, ["other_bend_rad"]),
    ):
        stood, _, _ = as_it_stood(joint, Path(recording), dict)
        assert other_channels(stood) == channels
        assert sum("ripple_by_motor_angle" in line for line in assumptions(stood)) == laws


@pytest.mark.parametrize(("law", "of"), [("spline", "time_s"), ("fourier", "dwell")])
def test_a_law_of_one_session_that_cannot_run_is_refused_before_that_session_runs(law: str, of: str) -> None:
    joint = config(SESSIONS + RIPPLE.format(law=law, of=of) + "session = 'monday'\n")
    with pytest.raises(InputError, match=r"ripple_by_motor_angle.*accepted"):
        extend(joint)


def test_a_law_of_a_session_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match=r"ripple_by_motor_angle`: no \[\[session\]\] is called `sunday`"):
        config(MONDAYS.replace("session = 'monday'", "session = 'sunday'"))


@pytest.mark.parametrize(("law", "of"), [("spline", "time_s"), ("fourier", "dwell")])
def test_an_empirical_law_that_cannot_run_is_refused(law: str, of: str) -> None:
    with pytest.raises(InputError, match=r"ripple_by_motor_angle.*accepted"):
        Observer(config(RIPPLE.format(law=law, of=of)))


def test_a_joint_free_of_load_needs_no_torque() -> None:
    columns = {"time_s": np.arange(20) * 1e-2, "motor_position_rad": np.sin(np.arange(20.0))}
    joint = config('[observer]\nload = "none"\n')
    zero = {**columns, "joint_torque_Nm": np.zeros(20)}
    expected = Observer(load_joint(JOINT)).run(zero)["joint_position_rad"]
    np.testing.assert_array_equal(Observer(joint).run(columns)["joint_position_rad"], expected)


def test_the_zero_of_the_motor_torque_is_taken_off_its_reading() -> None:
    torque = 0.01 * np.sin(np.arange(40) * 0.2)
    columns = {"time_s": np.arange(40) * 1e-2, "motor_position_rad": np.zeros(40)}
    source = '[observer]\nload = "motor_torque"\n'
    plain = Observer(config(source)).run({**columns, "motor_torque_Nm": torque})
    turned = (source + "[[session]]\nname = 'a'\nvalues = {motor_torque_offset_Nm = 0.25}\n",)
    joint = config(turned[0])
    shifted = Observer(in_session(joint, joint.sessions[0])).run(
        {**columns, "motor_torque_Nm": torque + 0.25}
    )
    np.testing.assert_allclose(shifted["joint_position_rad"], plain["joint_position_rad"], atol=1e-15)


RUBS = (
    '[[effect]]\nid = "bearing_friction"\ntorque_Nm = 0.01\npresliding_rad = 1e-4\nload_coefficient = 0.0\n'
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[tolerance]\n"effect.bearing_friction.torq" = 0.1\n', "that effect has torque_Nm"),
        ('[[session]]\nname = "a"\nvalues = {"effect.slip.size_m" = 0.1}\n', "has no such effect"),
        ('[[session]]\nname = "a"\nvalues = {pretension_N = -5.0}\n', "`pretension_N` = -5"),
        ('[[session]]\nmounting = "a"\n', "needs a `name`"),
    ],
)
def test_what_no_joint_can_have_is_said_when_it_is_read(text: str, words: str) -> None:
    data = tomllib.loads(JOINT.read_text())
    with pytest.raises(InputError, match=words):
        parse_joint(data | tomllib.loads(RUBS + text), "joint.toml")
