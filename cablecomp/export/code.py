"""A joint as C, and as a functional mock-up unit: play operators in place of the wraps' profiles."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Final

from cablecomp.config import JointConfig
from cablecomp.control.plays import Plays
from cablecomp.errors import InputError
from cablecomp.export.equivalent import beyond_loops, loads
from cablecomp.recording.atomic import atomic_directory

_C: Final = Template("""\
/* Load and deflection of the joint $name: $count play operators (Prandtl-Ishlinskii) fitted to its observer.
 * q_out = ratio q_in + deflection,  deflection = c + a M + b M^2 + sum w_i z_i,
 * z_i <- min(max(z_i, M - r_i), M + r_i).
 * Fit: $rms rad RMS on loops from $loads. Left out:
$lost
 * C99, no library but <math.h>'s fmin and fmax, no allocation; all state is the caller's. SI units. */
#include <math.h>
#include <stddef.h>

enum { ${prefix}_STATES = $count };
typedef struct { double z[$count]; } ${prefix}_state; /* zeros: uniform pretension, no load */

static const double ${prefix}_ratio = $ratio;
static const double ${prefix}_rest = $rest;
static const double ${prefix}_linear[2] = {$linear};
static const double ${prefix}_weight[$count] = {$weights};
static const double ${prefix}_radius[$count] = {$radii};

/* Deflection [rad] at a load [Nm]; the state moves along. */
double ${prefix}_deflection(${prefix}_state *s, double load) {
    double sum = ${prefix}_rest + ${prefix}_linear[0] * load + ${prefix}_linear[1] * load * load;
    for (size_t i = 0; i < $count; ++i) {
        s->z[i] = fmin(fmax(s->z[i], load - ${prefix}_radius[i]), load + ${prefix}_radius[i]);
        sum += ${prefix}_weight[i] * s->z[i];
    }
    return sum;
}

/* Joint angle [rad] at a motor angle [rad] and a load [Nm]; the state moves along. */
double ${prefix}_step(${prefix}_state *s, double motor, double load) {
    return ${prefix}_ratio * motor + ${prefix}_deflection(s, load);
}
""")

_SLAVE: Final = Template('''\
"""$name: joint angle from motor angle and load. $rms rad RMS on loops from $loads. Left out:
$lost"""

from copy import copy
from xml.etree.ElementTree import SubElement

from $package import Fmi${version}Causality, Fmi${version}Slave, $real

RATIO = $ratio
REST = $rest
LINEAR = ($linear)
WEIGHT = ($weights,)
RADIUS = ($radii,)


class $cls(Fmi${version}Slave):
    author = "cablecomp"
    description = "cable drive as play operators"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.motor_position_rad = self.joint_torque_Nm = 0.0
        self.z = [0.0] * len(RADIUS)
        for name in ("motor_position_rad", "joint_torque_Nm"):
            self.register_variable($real(name, causality=Fmi${version}Causality.input))
        for name in ("joint_position_rad", "deflection_rad"):
            self.register_variable($real(name, causality=Fmi${version}Causality.output))

    def to_xml(self, *options):  # FMI 2.0, 2.2.8: calculated outputs are unknowns of the initialisation too
        root = super().to_xml(*options)
        structure = root.find("ModelStructure")
        SubElement(structure, "InitialUnknowns").extend(map(copy, structure.find("Outputs")))
        return root

    def plays(self):
        load = self.joint_torque_Nm
        return [min(max(z, load - r), load + r) for z, r in zip(self.z, RADIUS)]

    @property
    def deflection_rad(self):  # asked before the first step too, while a simulation is initialised
        load = self.joint_torque_Nm
        held = sum(w * z for w, z in zip(WEIGHT, self.plays()))
        return REST + LINEAR[0] * load + LINEAR[1] * load * load + held

    @property
    def joint_position_rad(self):
        return RATIO * self.motor_position_rad + self.deflection_rad

    def do_step(self, current_time, step_size):
        self.z = self.plays()
        return True
''')


def left_out(config: JointConfig) -> tuple[str, ...]:
    """What the play operators of a joint leave out, one line each."""
    return (
        "what turning of the pulleys does to the history",
        "what time does: creep, relaxation, speed",
        "bounds for what came before, cable tensions",
        *beyond_loops(config),
    )


def c_source(config: JointConfig, found: Plays) -> str:
    """C99 source of `PREFIX_step(state, motor, load)`, PREFIX being the joint's name as an identifier."""
    return _C.substitute(_words(config, found, " *   "), prefix=identifier(config.name))


def write_fmu(config: JointConfig, found: Plays, out: Path) -> Path:
    """Write `out`/NAME.fmu, FMI 2.0 for co-simulation; who runs it needs Python. Raises InputError without
    `pythonfmu`."""
    try:
        from pythonfmu import FmuBuilder
    except ImportError:
        raise InputError("--fmu needs a package: pip install 'cablecomp[fmu]'") from None
    cls = "".join(part.capitalize() for part in identifier(config.name).split("_"))
    source = _SLAVE.substitute(
        _words(config, found, ""),
        cls=cls,
        version="2",
        package="pythonfmu",
        real="Real",
    )
    with (
        TemporaryDirectory() as sources,
        atomic_directory(out) as folder,
    ):  # building imports it and leaves traces
        script = Path(sources) / f"{cls.lower()}.py"
        script.write_text(source, encoding="utf-8")
        FmuBuilder.build_FMU(script, dest=folder)
    return out / f"{cls}.fmu"


def identifier(name: str) -> str:
    """A joint's name as an identifier of C and Python."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_").lower()
    return found if found and not found[0].isdigit() else f"joint_{found}".rstrip("_")


def _words(config: JointConfig, found: Plays, indent: str) -> dict[str, str]:
    # what ends a comment or a string cannot stand in one
    lost = "\n".join(indent + re.sub(r'[*"\\]', "_", line) for line in left_out(config))
    return {
        "name": identifier(config.name),
        "lost": lost,
        "count": str(len(found.radii_Nm)),
        "rms": f"{found.rms_rad:.3g}",
        "loads": loads(config, found.most_Nm),
        "ratio": repr(float(config.drive.ratio)),
        "rest": repr(found.rest_rad),
        "linear": _numbers(found.weights[:2]),
        "weights": _numbers(found.weights[2:]),
        "radii": _numbers(found.radii_Nm),
    }


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(repr(float(v)) for v in values)
