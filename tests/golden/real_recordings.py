"""Print the tables of the README's "Real recordings": `python tests/golden/real_recordings.py
[jaw|sheath|search]`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

import jaw_recordings as jaw
import recordings as files
import sheath_recordings as sheath
from recordings import KINDS, degrees, own_zero

from cablecomp.identification.path_fit import MOTOR, misfit_of
from cablecomp.identification.path_selection import Trial, best_of, select_effects

SUSPECTS: Final = (
    "routing_friction", "bearing_friction", "nonlinear_cable", "termination_backlash", "series_compliance",
    "strand_friction", "gravity_load", "pulley_runout", "inertial_load", "clock_skew",
)  # fmt: skip


def table_of_the_jaw() -> None:
    """Errors in degrees, full cycles: load left out (one zero per session, per recording), pitch left out."""
    _row("jaw [deg]", ("in sample", "load left out", "same, zero per rec.", *jaw.PITCHES, "pitches together"))
    for motor_torque in (False, True):
        for kind in KINDS:
            inside = jaw.baseline(kind, jaw.straight(), jaw.straight(), motor_torque)
            left_out = jaw.baseline_loads(kind, motor_torque)
            pitches = {p: jaw.baseline_pitch(kind, p, motor_torque) for p in jaw.PITCHES}
            together = {n: m for parts in pitches.values() for n, m in parts.items()}
            name = kind + ", motor torque" * motor_torque
            _row(name, (inside, left_out, own_zero(left_out), *pitches.values(), together))
    for effects in ((), jaw.FOUND):
        found = jaw.fit(jaw.fitted(jaw.straight()), effects)
        inside = misfit_of(found, jaw.whole(jaw.straight()))
        left_out = jaw.loads_left_out(effects)
        pitches = {p: jaw.pitch_left_out(p, effects) for p in jaw.PITCHES}
        together = {n: m for parts in pitches.values() for n, m in parts.items()}
        name = "Snow's drive alone" if not effects else "with the effects found"
        _row(name, (inside, left_out, own_zero(left_out), *pitches.values(), together))
        unseen = {p: jaw.pitch_unseen(found, p) for p in jaw.PITCHES}
        together = {n: m for parts in unseen.values() for n, m in parts.items()}
        _row("  no pitch seen", ("", "", "", *unseen.values(), together))
    left_out = jaw.loads_left_out(law=True)
    _row("  and a law of motor angle", ("", left_out, own_zero(left_out)))
    print(f"motor torque left: {found.misfit[MOTOR] * 1e3:.2f} mNm; fitted:")
    print("  " + ", ".join(f"{k} {v:.4g}" for k, v in found.values.items()))


def table_of_the_sheath() -> None:
    """Errors in degrees: one model fitted to all bends, and every bend left out once."""
    _row("sheath [deg]", ("all bends", *(f"{b} left out" for b in sheath.BENDS), "left out, together"))
    for kind in KINDS:
        left_out = sheath.baseline_left_out(kind)
        _row(
            kind,
            (
                sheath.baseline(kind, sheath.BENDS, sheath.BENDS),
                *({b: m} for b, m in left_out.items()),
                left_out,
            ),
        )
    left_out = sheath.bends_left_out()
    _row("sheath drive", (sheath.all_bends(), *({b: m} for b, m in left_out.items()), left_out))
    print("fitted: " + ", ".join(f"{k} {v:.4g}" for k, v in sheath.fit(sheath.BENDS).values.items()))


def search() -> None:
    """What the search finds missing from the jaw's drive: every hypothesis with its held-out square."""
    train = ("L_4/10", "L_4/42", "L_4/14", "L_4/40", "L_2/10", "L_2/42")
    judge = ("L_4/11", "L_4/43", "L_2/41", "L_2/13")

    def show(trial: Trial) -> None:
        print(
            f"  {'+'.join(trial.effects) or 'the drive alone':70} held out {trial.heldout:7.3f}", flush=True
        )

    trials = select_effects(
        jaw.config(),
        [jaw.recording(n) for n in train],
        [jaw.recording(n) for n in judge],
        SUSPECTS,
        jaw.SCALE,
        show,
    )
    print(f"missing: {', '.join(best_of(trials).effects)}")


def _row(name: str, cells: tuple[object, ...]) -> None:
    texts = [f"{degrees(c):.3f}" if isinstance(c, dict) else str(c) for c in cells]
    print(f"{name:26}" + "".join(f"{t:>21}" for t in texts), flush=True)


PARTS: Final[dict[str, Callable[[], None]]] = {
    "jaw": table_of_the_jaw, "sheath": table_of_the_sheath, "search": search,
}  # fmt: skip


def main() -> int:
    """Print what is asked for, or the two tables."""
    if files.root() is None:
        print("set CABLECOMP_RECORDINGS to the folder of the recordings", file=sys.stderr)
        return 2
    for part in sys.argv[1:] or ("jaw", "sheath"):
        if part not in PARTS:
            print(f"`{part}` is no part; accepted are {', '.join(PARTS)}", file=sys.stderr)
            return 2
        PARTS[part]()
    return 0


if __name__ == "__main__":
    sys.exit(main())
