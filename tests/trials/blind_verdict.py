"""What a diagnosis says, as short as a scoreboard can read it."""

from __future__ import annotations

from typing import Any

EVIDENCE = {"selected_in": 1.0, "z": 4.0}


def verdict(*names: str, **changes: Any) -> dict[str, Any]:
    """What a diagnosis writes, with these names given."""
    said: dict[str, Any] = {
        "verdict": "explained" if names else "consistent",
        "noise_floor_rad": 1e-5,
        "augmented": {"heldout_rmse_rad": 1.05e-5, "final_rmse_rad": 1.1e-5},
        "calibration": {},
        "mismatch": [{"covariate": "load", "intervals_s": [[3.0, 5.0]]}],
        "missing_physics": [
            {"effect": n, "confidence": 0.97, "parameters": {}, "evidence": EVIDENCE, "depends_on": None}
            for n in names
        ],
        "candidates": [],
        "hypotheses": [
            {"name": n, "beside": "the drive", "z": 5.0 - k} for k, n in enumerate((*names, "crosstalk"))
        ],
        "not_excluded": [],
        "empirical": [],
        "could_be_unseen": [],
        "next_experiment": None,
    }
    return said | changes
