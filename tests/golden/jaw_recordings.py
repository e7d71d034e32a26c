"""Jaw of a da Vinci instrument on a bench: how its recordings are split, and what models without the drive leave."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import recordings as files
from baselines import BASELINES
from recordings import JOINT, MOTOR

from cablecomp.config import JointConfig
from cablecomp.config.sessions import ZEROS, Session
from cablecomp.signal.smoothing import FloatArray

PITCHES: Final = ("Pitch_1", "Pitch_3", "Pitch_5")
LOADS: Final = "01234"
GROUP: Final = 20
"""Samples that make a row of the baselines and of what is replayed: 50 Hz."""


def of_session(session: str) -> list[Path]:
    """Recordings of a session ("L_4", "L_2", "Pitch_1"...)."""
    name = f"Tool_4_Maryland_{session}" if session.startswith("L_") else f"Tool_4_Maryland_L_{session}"
    return sorted((files.folder("davinci-jaw") / name).glob("*.csv.gz"))


def straight(without: str = "") -> list[Path]:
    """Loads <= 50 % of L_4 and L_2, all frequencies; `without` names a load to leave out."""
    return [p for p in (*of_session("L_4"), *of_session("L_2")) if not without or load_of(p) != without]


def load_of(path: Path) -> str:
    """A recording's load, as its name has it."""
    return path.name.removesuffix(".csv.gz")[-1]


def pitch_split(session: str) -> tuple[list[Path], list[Path]]:
    """What is learnt from when a wrist pitch is left out (the two others, and its own lightest load), and what
    is judged."""
    mine = of_session(session)
    return [*(n for p in PITCHES if p != session for n in of_session(p)), mine[0]], mine[1:]


def turned(config: JointConfig) -> JointConfig:
    """The joint whose pretension is each session's own: the wrist's turn changes the cables' way."""
    return config.model_copy(update={"session": (Session(own=(*ZEROS, "pretension_N")),)})


def baseline(
    kind: str, train: Sequence[Path], test: Sequence[Path], motor_torque: bool = False
) -> dict[str, FloatArray]:
    """Misfit on `test` of a baseline fitted to `train`, with one encoder zero per session; that of a session of
    which only one recording was learnt from is its mean misfit."""
    sessions = sorted({p.parent.name for p in train})

    def given(path: Path) -> dict[str, FloatArray]:
        columns = {k: v for k, v in files.coarse(path, GROUP).items() if motor_torque or k != MOTOR}
        rows = len(columns[JOINT])
        return {
            **columns,
            **{f"other_{s}": np.full(rows, float(path.parent.name == s)) for s in sessions[1:]},
        }

    model = BASELINES[kind]([given(p) for p in train], tuple(f"other_{s}" for s in sessions[1:]))
    found = {str(p): given(p)[JOINT] - model.predict(given(p)) for p in test}
    pitched = {n: m for n, m in found.items() if "Pitch" in n}
    if pitched:
        found |= files.session_zero(pitched)
    return found


def baseline_loads(kind: str, motor_torque: bool = False) -> dict[str, FloatArray]:
    """Every load left out once."""
    found: dict[str, FloatArray] = {}
    for level in LOADS:
        judged = [p for p in straight() if load_of(p) == level]
        found |= baseline(kind, straight(without=level), judged, motor_torque)
    return found
