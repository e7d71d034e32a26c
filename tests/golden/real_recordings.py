"""Print errors on recordings of real hardware, by the command's own diagnosis and by models that do not know the drive:
`python tests/golden/real_recordings.py [jaw|jaw-given|sheath|jaw-baselines|sheath-baselines]`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

import jaw_given
import jaw_recordings as jaw
import numpy as np
import recordings as files
import sheath_recordings as sheath
from recordings import KINDS, degrees, own_zero, session_zero

from cablecomp.diagnosis.result import Diagnosis


def jaw_by_diagnosis() -> None:
    """All straight recordings; every load left out once; every wrist pitch left out once."""
    config = files.joint("davinci-jaw")
    _show("all straight recordings", files.diagnosed(config, jaw.straight()))
    found = {}
    for level in jaw.LOADS:
        joint = files.diagnosed(config, jaw.straight(without=level)).augmented_joint
        judged = [p for p in jaw.straight() if jaw.load_of(p) == level]
        found |= {str(p): files.replayed(joint, p, jaw.GROUP) for p in judged}
    print(
        f"load left out {degrees(found):.3f} deg, one zero per recording {degrees(own_zero(found)):.3f} deg"
    )
    for pitch in jaw.PITCHES:
        train, judged = jaw.pitch_split(pitch)
        for how, joint in (("one pretension", config), ("each session's own pretension", jaw.turned(config))):
            found = files.diagnosed(joint, train).augmented_joint
            left = {str(p): files.replayed(found, p, jaw.GROUP) for p in judged}
            print(
                f"{pitch} left out, {how}: {degrees(left):.3f} deg, with the session's own zero "
                f"{degrees(session_zero(left)):.3f} deg",
                flush=True,
            )


def jaw_laws_given() -> None:
    """Every wrist pitch left out once, the laws given and not searched for."""
    for pitch in jaw.PITCHES:
        left = jaw_given.pitch_left_out(pitch)
        print(
            f"{pitch} left out, laws given: {degrees(left):.3f} deg, the session's own zero "
            f"{degrees(session_zero(left)):.3f}, one zero per recording {degrees(own_zero(left)):.3f}",
            flush=True,
        )


def jaw_baselines() -> None:
    """In sample, load left out (one zero per session, per recording), wrist pitches left out."""
    for motor_torque in (False, True):
        for kind in KINDS:
            left_out = jaw.baseline_loads(kind, motor_torque)
            cells = [
                jaw.baseline(kind, jaw.straight(), jaw.straight(), motor_torque),
                left_out,
                own_zero(left_out),
            ]
            cells += [jaw.baseline(kind, *jaw.pitch_split(p), motor_torque) for p in jaw.PITCHES]
            print(
                f"{kind + ', motor torque' * motor_torque:26}",
                *(f"{degrees(c):8.3f}" for c in cells),
                flush=True,
            )


def sheath_by_diagnosis() -> None:
    """All bends in one call; every bend left out once."""
    config = files.joint("tendon-sheath")
    _show("all bends", files.diagnosed(config, [sheath.path(b) for b in sheath.BENDS]))


def sheath_baselines() -> None:
    """All bends in one fit, every bend left out once, a fit of its own per bend."""
    for kind in KINDS:
        own = [sheath.baseline(kind, [b], [b]) for b in sheath.BENDS]
        cells = [sheath.baseline(kind, sheath.BENDS, sheath.BENDS), sheath.baseline_left_out(kind), *own]
        print(f"{kind:26}", *(f"{degrees(c):8.3f}" for c in cells), flush=True)


def _show(what: str, d: Diagnosis) -> None:
    names = ", ".join(f"{n.effect} ({n.confidence:.2f})" for n in d.named)
    print(f"{what}: {d.verdict}; {names or 'no name'}; {d.runtime_s:.0f} s")
    for name, e in (("calibrated drive", d.baseline), ("augmented", d.augmented)):
        values = [float(np.degrees(v)) for v in (e.rmse_rad, e.heldout_rmse_rad, e.final_rmse_rad)]
        print(
            f"  {name}: fitted {values[0]:.3f}, {d.heldout_by}s left out "
            f"{values[1]:.3f}, for the end {values[2]:.3f} deg"
        )


PARTS: Final[dict[str, Callable[[], None]]] = {
    "jaw": jaw_by_diagnosis, "jaw-given": jaw_laws_given, "sheath": sheath_by_diagnosis,
    "jaw-baselines": jaw_baselines, "sheath-baselines": sheath_baselines,
}  # fmt: skip


def main() -> int:
    """Print what is asked for, or everything."""
    if files.root() is None:
        print("set CABLECOMP_RECORDINGS to the folder of the recordings", file=sys.stderr)
        return 2
    for part in sys.argv[1:] or PARTS:
        if part not in PARTS:
            print(f"`{part}` is no part; accepted are {', '.join(PARTS)}", file=sys.stderr)
            return 2
        PARTS[part]()
    return 0


if __name__ == "__main__":
    sys.exit(main())
