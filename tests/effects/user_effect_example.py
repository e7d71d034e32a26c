"""A seal that drags on the output shaft: the file `seal_drag.py` of the guide, word for word."""

from cablecomp.effects import Change, Effect, Parameter, register, term


@term(parameters=("drag",))
def drag(c, p, s):  # c: the joint's context, p: parameters, s: state of its own (none here)
    if c.first or c.dt <= 0.0:
        return
    rate = (c.joint - c.joint_old) / c.dt
    c.moment += p.drag * rate  # taken out of the load path
    c.moment_slope += p.drag / c.dt  # its derivative by the joint angle: keeps the solver quick


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
    change=lambda values, config: Change(terms=drag(drag=values["drag_Nms_per_rad"])),
)
register(EFFECT)
