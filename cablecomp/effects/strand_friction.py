"""Strand friction: the wires of the cable rub against each other; its free span shows a loop of its own."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter, at_most, pretension


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(
        play_share=values["fraction"],
        play_yield_N=values["yield_N"],
        play_time_s=values["yields_in_s"],
        play_spread=values["spread"],
        play_grading=values["grading"],
        play_pressed=values["pressed"],
    )


EFFECT = Effect(
    id="strand_friction",
    statement="Wires rub inside the cable: part of its stretch follows the tension only after a change has "
    "overcome their grip, of all wires at once or of one after the other, most of them early where layers grip ever "
    "less; the grip may grow with the tension, which presses the wires together.",
    equation="free span's stretch = L/EA (T - T0 + s p), p = P_y[T - T0], the play operator of radius y, or the mean "
    "of five with radii y (1 + u (2 z^k - 1)), z evenly from 0 to 1, each times 1 + m (T/T0 - 1); greased, it yields "
    "in its own time: t_y dp/dt = min(max(p, T - T0 - y), T - T0 + y) - p",
    source="bending and axial hysteresis of spiral strands by interwire friction: K. O. Papailiou, On the "
    "bending stiffness of transmission line conductors, IEEE Trans. Power Delivery 12 (1997); play "
    "operator: M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989; many of them: W. D. Iwan, "
    "J. Applied Mechanics 33 (1966)",
    parameters=(
        Parameter(
            "fraction",
            "-",
            0.0,
            1e-3,
            3.0,  # a trial's 2.7 set it (seed 675, 36); fibre ropes are far stiffer in small swings than at a slow load
            "s, stretch behind the play over the elastic one",
            log=True,
            minimum=0.0,
            maximum=10.0,
        ),
        Parameter(
            "yield_N",
            "N",
            0.0,
            0.01,
            1.0,
            "y, change of tension that the grip holds",
            log=True,
            role="shape",
            scale=pretension,
            minimum=1e-9,
            least_is_another=True,  # wires that nothing holds are plain compliance
            points=7,  # a grip that lets by the peaks of the load alone promises nothing by half of it or twice
        ),
        Parameter(
            "yields_in_s",
            "s",
            0.0,
            0.02,
            2.0,
            "t_y, time in which greased wires follow a change that has overcome their grip; 0: at once",
            log=True,
            role="shape",
            omitted=0.0,
            minimum=0.0,
            tries=(0.1, 0.4),
            reach=1.0,
            is_another=at_most,
        ),
        Parameter(
            "spread",
            "-",
            0.0,
            0.0,
            1.0,
            "u, how far the grips of the wires differ, over y; 0: all hold alike, 1: some yield at once",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            of_known_drive=True,
        ),
        Parameter(
            "grading",
            "-",
            1.0,
            1.0,
            6.0,
            "k, power by which the grips grow from the weakest wire's to the strongest one's; 1: evenly",
            log=True,
            role="shape",
            omitted=1.0,
            minimum=1.0,
            maximum=10.0,
            of_known_drive=True,
        ),
        Parameter(
            "pressed",
            "-",
            0.0,
            0.0,
            1.0,
            "m, share of the grip at T0 that is in proportion to tension; 0: the tension does not change it",
            role="shape",
            omitted=0.0,
            minimum=0.0,
            maximum=1.0,
            tries=(1.0,),
            of_known_drive=True,
        ),
    ),
    acts_through=("load_direction", "reversal", "load"),
    bounded=False,
    change=_change,
    tries=(
        {"spread": 1.0},
        # layers of which most grip little are found by a strongest grip beyond what all of one grip have
        *({"yield_N": y, "spread": 1.0, "grading": 3.0} for y in (0.03, 0.1, 0.3, 1.0)),
    ),
)
