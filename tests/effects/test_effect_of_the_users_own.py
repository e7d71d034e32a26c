"""The guide's worked example, run exactly as it stands there."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from effect_cases import excitation, joint, run

from cablecomp.effects import catalogue, load_effects, with_effects
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.observer.refusal import SampleRefused

EXAMPLE = Path(__file__).with_name("user_effect_example.py")
GUIDE = Path(__file__).parents[2] / "cablecomp/guide/effects.md"


@pytest.fixture(autouse=True)
def _nothing_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("cablecomp.effects.catalogue")
    monkeypatch.setattr(module, "_registered", {})


def test_the_guide_shows_this_very_file() -> None:
    block = re.search(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.S)
    assert block is not None
    code = EXAMPLE.read_text(encoding="utf-8").split('"""\n', 1)[1].strip()
    assert block.group(1).strip().endswith(code)


def test_the_example_acts_as_it_says() -> None:
    assert load_effects(EXAMPLE) == ("seal_drag",)
    assert catalogue()["seal_drag"].acts_through == ("velocity",)
    config = joint()
    columns = excitation(config)
    values = {"drag_Nms_per_rad": 0.8}
    found = run(config, columns, ("seal_drag", values))["joint_position_rad"]
    speed = np.diff(found, prepend=found[0]) / np.diff(columns["time_s"], prepend=-1.0)
    fed = {**columns, "joint_torque_Nm": columns["joint_torque_Nm"] - 0.8 * speed}
    assert found == pytest.approx(run(config, fed)["joint_position_rad"], abs=1e-10)


def test_neutral_is_the_plain_drive_and_a_snapshot_works() -> None:
    load_effects(EXAMPLE)
    config = joint()
    columns = excitation(config)
    plain = run(config, columns)["joint_position_rad"]
    assert np.array_equal(
        run(config, columns, ("seal_drag", {"drag_Nms_per_rad": 0.0}))["joint_position_rad"], plain
    )
    config = with_effects(config, [("seal_drag", {"drag_Nms_per_rad": 0.5})])
    first, second = Observer(config), Observer(config)
    first.run({key: value[:200] for key, value in columns.items()})
    second.restore(first.snapshot())
    rest = {key: value[200:] for key, value in columns.items()}
    assert np.array_equal(first.run(rest)["joint_position_rad"], second.run(rest)["joint_position_rad"])


def test_a_pretension_that_moves_without_a_word_is_refused(tmp_path: Path) -> None:
    """A plain drive's code does not move what lies on the drums; an effect that says what it does gets the code that
    does."""
    text = EXAMPLE.read_text(encoding="utf-8").replace("c.moment += p.drag * rate", "c.pretension_h *= 0.9")
    for name, said in (("silent", ""), ("outspoken", ", moves_pretension=True")):
        path = tmp_path / f"{name}.py"
        path.write_text(text.replace("seal_drag", name).replace('"]))', f'"]){said})'), encoding="utf-8")
        load_effects(path)
    config = joint()
    columns = excitation(config)
    values = {"drag_Nms_per_rad": 0.5}
    assert np.all(run(config, columns, ("outspoken", values))["tension_h_N"] > 0.0)
    with pytest.raises(SampleRefused, match="moves_pretension"):
        run(config, columns, ("silent", values))


def test_an_id_that_exists_is_refused(tmp_path: Path) -> None:
    copy = tmp_path / "again.py"
    copy.write_text(EXAMPLE.read_text(encoding="utf-8").replace("seal_drag", "crosstalk"), encoding="utf-8")
    with pytest.raises(InputError, match=r"crosstalk.*exists already"):
        load_effects(copy)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1\n", "defines no effect"),
        ("1/0\n", "does not run .ZeroDivisionError"),
        ("raise SystemExit\n", "does not run .SystemExit"),
        ("def f(:\n", "does not run .SyntaxError"),
        ("import no_such_module_anywhere\n", "does not run .ModuleNotFoundError"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "mine.py"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        load_effects(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_file_and_a_wrong_ending_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"does not run .FileNotFoundError"):
        load_effects(tmp_path / "none.py")
    (tmp_path / "notes.txt").write_text("hello", encoding="utf-8")
    with pytest.raises(InputError, match="no Python file"):
        load_effects(tmp_path / "notes.txt")
