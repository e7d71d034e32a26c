"""Verdicts on recordings of real hardware: what was missing, and how well it predicts what it was not
fitted to.

Set CABLECOMP_RECORDINGS to the folder of the recordings; without it these tests are skipped. `pytest -s`
shows the figures; `python tests/golden/real_recordings.py` prints the README's tables, with baselines. Left
out here are the loads and bends at both ends, which are the hardest, and the middle ones; there, every one.
"""

from __future__ import annotations

import jaw_recordings as jaw
import pytest
import recordings as files
import sheath_recordings as sheath
from recordings import degrees

from cablecomp.identification.path_fit import MOTOR
from cablecomp.identification.path_selection import heldout_square

pytestmark = pytest.mark.skipif(
    files.root() is None, reason="CABLECOMP_RECORDINGS does not name the folder of the real recordings"
)

TRAIN = ("L_4/11", "L_4/14", "L_4/10", "L_2/10", "L_2/12")
LOADS, BENDS = "024", (0, 120, 240)
JUDGE = ("L_4/12", "L_2/11", "L_2/13")


def square_left_out(effects: tuple[str, ...]) -> float:
    """Mean square over scale, of joint angle and motor torque, on recordings that were not fitted."""
    found = jaw.fit(TRAIN, effects, iterations=12)
    return heldout_square(found, [jaw.recording(n) for n in JUDGE], jaw.SCALE)


def test_each_effect_found_on_the_jaw_is_needed_on_recordings_left_out() -> None:
    whole = square_left_out(jaw.FOUND)
    print(f"\n  jaw, with {', '.join(jaw.FOUND)}: left-out square {whole:.2f}")
    for effect in jaw.FOUND:
        without = square_left_out(tuple(e for e in jaw.FOUND if e != effect))
        print(f"  jaw, without {effect}: {without:.2f}")
        assert without > 1.05 * whole


def test_loads_left_out_are_predicted() -> None:
    physics, law = jaw.loads_left_out(levels=LOADS), jaw.loads_left_out(law=True, levels=LOADS)
    for level in LOADS:
        each = [degrees({n: m for n, m in parts.items() if n[-1] == level}) for parts in (physics, law)]
        print(
            f"\n  jaw, load {10 + 10 * int(level)} % left out: {each[0]:.3f}, with the law {each[1]:.3f}",
            end="",
        )
    print(f"\n  jaw, these left out: effects alone {degrees(physics):.3f} deg, one zero per recording "
          f"{degrees(files.own_zero(physics)):.3f}; with the law of motor angle {degrees(law):.3f} deg")  # fmt: skip
    assert degrees(law) <= 0.30
    assert degrees(files.own_zero(physics)) <= 0.30


def test_the_torques_of_both_ends_agree_with_one_path() -> None:
    torque = max(jaw.without_load(level, jaw.FOUND)[0].misfit[MOTOR] for level in LOADS)
    print(f"\n  jaw, motor torque left: {torque * 1e3:.2f} mNm of a loop of +-50 to 70 mNm")
    assert torque < 0.05 * 0.06


def test_a_wrist_pitch_is_predicted_once_its_lightest_load_has_shown_the_pretension() -> None:
    found = {p: jaw.pitch_left_out(p) for p in jaw.PITCHES}
    for pitch, misfits in found.items():
        print(f"\n  jaw, {pitch} left out: {degrees(misfits):.3f} deg", end="")
    together = {n: m for misfits in found.values() for n, m in misfits.items()}
    print(f"\n  jaw, every pitch left out once: {degrees(together):.3f} deg")
    assert degrees(together) <= 0.45


@pytest.mark.parametrize("kind", ["linear", "polynomial", "plays"])
def test_models_without_the_drive_predict_left_out_pitches_worse(kind: str) -> None:
    ours = {n: m for p in jaw.PITCHES for n, m in jaw.pitch_left_out(p).items()}
    theirs = {n: m for p in jaw.PITCHES for n, m in jaw.baseline_pitch(kind, p).items()}
    assert degrees(ours) < degrees(theirs)


def test_one_sheath_drive_for_all_bends() -> None:
    found = sheath.all_bends()
    each = ", ".join(f"{b} deg {degrees({b: m}):.2f}" for b, m in found.items())
    print(f"\n  sheath, one drive, all bends: {degrees(found):.2f} deg ({each})")
    assert degrees(found) <= 1.5


def test_bends_left_out_are_predicted() -> None:
    found = sheath.bends_left_out(BENDS)
    for bend, misfit in found.items():
        print(f"\n  sheath, {bend} deg left out: {degrees({bend: misfit}):.2f} deg", end="")
    print(f"\n  sheath, these left out: {degrees(found):.2f} deg")
    assert degrees(found) <= 2.5
