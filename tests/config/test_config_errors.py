"""What is wrong with a configuration is said at once, with the line, and with what was meant where that is plain."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.cli.app import main
from cablecomp.config import load_joint, parse_joint
from cablecomp.config.drive import Stage
from cablecomp.control.options import load_control
from cablecomp.control.protocol import load_protocol
from cablecomp.errors import ConfigError, InputError
from cablecomp.links.load import load_link

CONFIGS = Path(__file__).parents[2] / "configs"
GOOD = (CONFIGS / "joints/tendon-finger.toml").read_text(encoding="utf-8")
LOADERS: dict[str, Callable[[Path], object]] = {
    "joint": load_joint,
    "link": load_link,
    "control": load_control,
    "protocol": load_protocol,
}


def said(text: str, tmp_path: Path) -> tuple[str, ...]:
    path = tmp_path / "joint.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_joint(path)
    assert all(line.startswith(f"{path}: ") for line in caught.value.lines)
    return tuple(line.removeprefix(f"{path}: ") for line in caught.value.lines)


def line_of(text: str, part: str) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if part in line)


def changed(*pairs: tuple[str, str]) -> str:
    text = GOOD
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("name", ["effect.viscous_slip.exponent", "EA_N.2"])
def test_a_name_with_dots_is_told_to_go_in_quotes(name: str, tmp_path: Path) -> None:
    for table in ("[tolerance]", "[[session]]\nname = 'a'\n[session.values]"):
        text = GOOD.partition("[tolerance]")[0] + f"{table}\n{name} = 0.1\n"
        (line,) = said(text, tmp_path)
        assert line.endswith(f'; a number is accepted; a name with dots goes in quotes: "{name}"')


def test_every_error_is_said_each_with_its_line(tmp_path: Path) -> None:
    text = changed(
        ('circuit = "closed"', 'circuit = "clsed"'),
        ("output_radius_m = 0.008", "output_radius_mm = 8"),
        ("pretension_N = 35.0", 'pretension_N = "35"'),
        ("mu_input = 0.16", "mu_input = -0.16"),
        ("[sensors]", "[sensors]\nspeed = 3"),
        ("EA_N = 0.08", "EA = 0.08\nmu_inptu = 0.1"),
    )
    expected = {
        'circuit = "clsed"': "'clsed'",
        "output_radius_mm": "did you mean `output_radius_m = 0.008`?",
        'pretension_N = "35"': "a number is accepted",
        "mu_input = -0.16": "a number above 0 is accepted",
        "speed": "unknown key `sensors.speed`",
        "[tolerance]": "did you mean `EA_N`, `mu_input`?",
    }
    lines = said(text, tmp_path)
    assert len(lines) == len(expected)
    for place, words in expected.items():
        assert any(line.startswith(f"line {line_of(text, place)}: ") and words in line for line in lines), (
            words
        )


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [
        ("output_radius_cm", "0.8", "`output_radius_m = 0.008`"),
        ("output_radius_inch", "1", "`output_radius_m = 0.0254`"),
        ("Output_Radius_m", "0.008", "`output_radius_m`"),
        ("output_radius", "0.008", "`output_radius_m`"),
        ("outputradius_m", "0.008", "`output_radius_m`"),
        ("output_radius_mm", '"8"', "`output_radius_m`"),
    ],
)
def test_a_near_miss_is_guessed_and_not_called_missing_as_well(
    key: str, value: str, meant: str, tmp_path: Path
) -> None:
    lines = said(changed(("output_radius_m = 0.008", f"{key} = {value}")), tmp_path)
    assert len(lines) == 1
    assert f"did you mean {meant}?" in lines[0]


@pytest.mark.parametrize("key", [key for key, field in Stage.model_fields.items() if field.is_required()])
def test_what_no_number_can_carry_is_said_by_its_line(key: str, tmp_path: Path) -> None:
    """Else a command ends in a division by zero or an overflow, a running joint in a state that breaks its own laws."""
    for value in ("1e308", "1e13"):
        (line,) = said(re.sub(f"(?m)^{key} = .*$", f"{key} = {value}", GOOD), tmp_path)
        assert f"key `drive.stage.1.{key}` is {float(value)}; a number of at most " in line


def test_a_mark_at_the_head_of_the_file_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "joint.toml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert load_joint(path) == parse_joint(tomllib.loads(GOOD), "joint.toml")


def test_a_quotient_is_not_taken_for_its_last_unit(tmp_path: Path) -> None:
    path = tmp_path / "control.toml"
    path.write_text("[motor]\nstiffness_Nm_per_deg = 60.0\n")
    with pytest.raises(ConfigError) as caught:
        load_control(path)
    assert caught.value.lines == (
        f"{path}: line 2: unknown key `motor.stiffness_Nm_per_deg`; did you mean `stiffness_Nm_per_rad`?",
    )


def test_errors_are_counted_beyond_twenty(tmp_path: Path) -> None:
    lines = said(GOOD + "[condition]\n" + "".join(f"c{k} = {k}\n" for k in range(50)), tmp_path)
    assert len(lines) == 21
    assert lines[-1] == "and 30 more errors"


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("nested arrays", "x = " + "[" * 9000 + "]" * 9000, "nested too deeply"),
        ("nested tables", "x = " + "{a = " * 9000, "nested too deeply"),
        ("dotted key", ".".join("a" * 900) + " = 1", "nested too deeply"),
        ("endless key", ".".join("a" * 500_000) + " = 1", "nested too deeply"),
        ("endless head", "[" + ".".join("a" * 500_000) + "]", "nested too deeply"),
        ("endless key inside", "x = {y = 1, " + ".".join("a" * 500_000) + " = 1}", "nested too deeply"),
        ("decimal digits", "schema = " + "9" * 5000, "too many digits"),
        ("hexadecimal digits", "schema = 0x" + "f" * 5000, "a number with too many digits"),
        ("many stages", GOOD + "[[drive.stage]]\n" * 50_000, "50001 entries; at most 16"),
        ("large", "# " + "x" * 5_000_000, "larger than 4 MB"),
        ("binary", "\0\1", "not valid TOML"),
        ("a sentence", "this is no configuration", "not valid TOML"),
    ],
)
@pytest.mark.parametrize("kind", LOADERS)
def test_hostile_files_end_in_a_line(kind: str, name: str, text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "hostile.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        LOADERS[kind](path)
    if kind == "joint":
        assert words in str(caught.value)


_LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.dates()
_KEYS = st.sampled_from(
    ["schema", "name", "drive", "stage", "circuit", "session", "effect", "EA_N", "values", "x"]
)
_VALUES = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_KEYS | st.text(max_size=3), inner),
    max_leaves=12,
)


@given(st.dictionaries(_KEYS | st.text(max_size=4), _VALUES))
def test_whatever_a_table_holds_the_answer_is_a_line_or_a_joint(data: dict[str, object]) -> None:
    lines: tuple[str, ...] = ()
    try:
        parse_joint(data, "x.toml")
    except ConfigError as error:
        lines = error.lines
    assert all(line.startswith("x.toml: ") and line.isprintable() for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            changed(("joint_position_max_rad = 0.8", "joint_position_max_rad = -0.9")),
            "-0.8 < joint_position_max_rad",
        ),
        (changed(("EA_N = 0.08", '"EA_N.2" = 0.08')), "`EA_N.2`: no such parameter"),
        (changed(("EA_N = 0.08", '"effect.backlash.gap_rad" = 0.1')), "no such effect"),
    ],
)
def test_what_contradicts_itself_is_refused(text: str, words: str, tmp_path: Path) -> None:
    assert any(words in line for line in said(text, tmp_path))


def test_the_command_line_prints_one_line_for_each_error_and_exits_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "[red]joint.toml"
    path.write_text('schema = 2\n"\\u001b[31m[/red]" = 1\nname = "[/red]"\n', encoding="utf-8")
    assert main(["info", "--config", str(path)]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    lines = error.splitlines()
    assert len(lines) == 3
    assert all(line.startswith(f"cablecomp: {path}: ") for line in lines)
    assert "unknown key `\\x1b[31m[/red]`" in error
    assert "\x1b" not in error


def test_a_name_that_looks_like_markup_is_printed_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "joint.toml"
    path.write_text(changed(('name = "tendon-finger"', 'name = "[/red][bold]:smile:"')), encoding="utf-8")
    assert main(["info", "--config", str(path)]) == 0
    assert "[/red][bold]:smile:" in capsys.readouterr().out
