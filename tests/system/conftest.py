"""Runs that ask for the same gains share one design of them: it takes a second, and `tests/control` tests it."""

from __future__ import annotations

import pytest

from cablecomp.config import JointConfig
from cablecomp.control.design import design_gains
from cablecomp.control.options import ControlConfig
from cablecomp.control.synthesis import Gains

_designed: dict[tuple[str, float, str], Gains] = {}


@pytest.fixture(autouse=True)
def _designed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def gains(config: JointConfig, rate_Hz: float, wanted: ControlConfig) -> Gains:
        key = (config.model_dump_json(), rate_Hz, wanted.model_dump_json())
        if key not in _designed:
            _designed[key] = design_gains(config, rate_Hz, wanted)
        return _designed[key]

    monkeypatch.setattr("cablecomp.control.design.design_gains", gains)
