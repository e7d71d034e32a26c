"""A seal that drags on the output shaft: the file `seal_drag.py` of the guide, word for word."""

from cablecomp.effects import Change, Effect, Parameter, register, term
from cablecomp.mechanics.layout import X_DT, X_FIRST, X_JOINT, X_JOINT_OLD, X_MOMENT, X_MOMENT_SLOPE


@term(parameters=1)
def drag(c, p, s):  # c: context, p: parameters, s: state of its own (none here)
    if c[X_FIRST] == 0.0 and c[X_DT] > 0.0:
        c[X_MOMENT] += p[0] * (c[X_JOINT] - c[X_JOINT_OLD]) / c[X_DT]  # taken out of the load path
        c[X_MOMENT_SLOPE] += p[0] / c[X_DT]  # its derivative by the joint angle: keeps the solver quick


EFFECT = Effect(
    id="seal_drag",
    statement="A seal on the output shaft drags in proportion to the joint's speed.",
    equation="M_cable = M - d dq_out/dt",
    source="oil film between shaft and lip",
    parameters=(
        Parameter("drag_Nms_per_rad", "N m s/rad", neutral=0.0, low=1e-4, high=10.0, text="d", log=True),
    ),
    acts_through=("velocity",),
    bounded=False,  # it depends on the solved motion: no guaranteed bounds
    change=lambda values, config: Change(terms=drag(values["drag_Nms_per_rad"])),
)
register(EFFECT)
