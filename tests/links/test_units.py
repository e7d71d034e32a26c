"""Units of message tables, against the definitions that SciPy keeps."""

from __future__ import annotations

import pytest
from scipy import constants as c

from cablecomp.links.units import UNITS, to_si

INCH_POUND = c.inch * c.lbf
DEFINED = {
    "rad": {"rad": 1, "mrad": c.milli, "urad": c.micro, "deg": c.degree, "°": c.degree}
    | dict.fromkeys(("rev", "turn", "turns"), 360 * c.degree),
    "rad_s": {"rad/s": 1, "mrad/s": c.milli, "deg/s": c.degree, "°/s": c.degree}
    | {"rev/s": 360 * c.degree, "turns/s": 360 * c.degree, "rpm": 360 * c.degree / c.minute},
    "Nm": dict.fromkeys(("Nm", "N.m", "N·m"), 1)
    | {"mNm": c.milli, "kNm": c.kilo, "inlbf": INCH_POUND, "inozf": INCH_POUND * c.oz / c.lb},
    "N": {"N": 1, "mN": c.milli, "kN": c.kilo, "lbf": c.lbf},
    "A": {"A": 1, "mA": c.milli},
    "s": {"s": 1, "ms": c.milli, "us": c.micro, "µs": c.micro, "ns": c.nano},
    "Nm_per_rad": {"Nm/rad": 1, "mNm/rad": c.milli, "Nm/deg": 1 / c.degree, "Nm/rev": 1 / (360 * c.degree)},
    "Nms_per_rad": {"Nms/rad": 1, "Nm/(rad/s)": 1, "mNms/rad": c.milli},
}
CELSIUS = {"degC": "C", "°C": "C", "C": "C", "K": "K", "degF": "F"}


def test_every_unit_is_as_large_as_it_is_defined() -> None:
    found = {
        q: {unit: line.gain for unit, line in units.items()} for q, units in UNITS.items() if q != "degC"
    }
    assert found == {q: pytest.approx(units, rel=1e-15) for q, units in DEFINED.items()}
    assert not any(line.offset for q, units in UNITS.items() if q != "degC" for line in units.values())


def test_every_temperature_is_on_its_scale() -> None:
    assert UNITS["degC"].keys() == CELSIUS.keys()
    for unit, scale in CELSIUS.items():
        line = to_si("degC", f" {unit} ", "here")
        for value in (0.0, 212.0):
            expected = c.convert_temperature(value, scale, "C")
            assert line.gain * value + line.offset == pytest.approx(expected, abs=1e-9)
