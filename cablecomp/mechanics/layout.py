"""Where everything lies in the flat arrays that the compiled kernel works on.

`P` holds parameters (floats), `I` the structure (integers), `S` the whole state (floats), `J` the stack heights
(integers), `L` the law tables. Flat arrays make a snapshot a copy and a call from Python cheap.
"""

from __future__ import annotations

# --- structure I: header, then circuits, then terms
(
    N_CIRCUITS,
    N_CABLES,
    CAPACITY,
    N_TERMS,
    N_STACKS,
    S_PROFILE,
    S_CABLE,
    S_CONTEXT,
    S_TERM,
    S_WET,
    NODES,
    S_FILTER,
    S_MEET,
    S_SPARE,
    P_SENSOR,
    HEADER,
) = range(16)
#   one circuit: first cable of chain h, cables in a chain, 1 if closed, first cable of chain l
C_FIRST_H, C_COUNT, C_CLOSED, C_FIRST_L, CIRCUIT = range(5)
#   one term: address of its compiled function, offset of its parameters in P, offset of its state in S
T_ADDRESS, T_PARAMETER, T_STATE, TERM = range(4)

# --- parameters P: circuits, then cables, then term parameters, then the sensors'
#   one circuit: product of r/R, moment factor N_ik, output radius, slack tension
J_RATIO, J_MOMENT, J_RADIUS, J_SLACK, JOINT = range(5)
#   one cable
(
    R_OUT, R_IN, LENGTH, EA, T0, MU_OUT, MU_IN, W_OUT, W_IN, SCALE, WEIGHT, SIGN, RATIO, RADIUS,
    GUIDE, GUIDE_LENGTH, PLAY_SHARE, PLAY_YIELD, VISCOUS, MERGE, JOINT_DRUM, PER_BREAKING, CABLE,
) = range(23)  # fmt: skip
#   the sensors: gain and offset of the load channel, angular frequency of the input filter (0 = off)
GAIN, OFFSET, CUTOFF, SENSOR = range(4)

# --- state S: cables [.., CABLE_STATE], context, input filter, term states, viscous grids; pending steps of the wraps (no
#   state: every solution writes them anew); profiles [stacks, 6, capacity]; an undo copy of all before the pending steps
#   one cable: tension at output and input end, stretch, its derivative, shaft angle at its output, play, play trial,
#   pretension and stiffness factors, length offset, error bound of the stretch, warm start and reference of the solver;
#   with a guide: stretch of the input side, end values of the guide, input shaft, and the same pending;
#   what the solver's first guess missed
(
    Q_TENSION, Q_TENSION_IN, Q_STRETCH, Q_COMPLIANCE, Q_SHAFT, Q_PLAY, Q_PLAY_TRY,
    Q_T0, Q_EA, Q_OFFSET, Q_ERROR, Q_KEPT, Q_REFERENCE, Q_SIDE, Q_GUIDE_END, Q_GUIDE_FAR, Q_SHAFT_IN,
    Q_SIDE_TRY, Q_GUIDE_TRY, Q_SHAFT_IN_TRY, Q_MISS, Q_MISS_OLD, CABLE_STATE,
) = range(23)  # fmt: skip

#   one wrap's pending step: last point kept, meeting point (y, v, C, B, exp v), wrap angle,
#   end value and its exp
M_TOTAL, M_K, M_Y, M_V, M_C, M_B, M_E, M_W, M_END, M_TAU, MEET = range(11)

# --- input filter: 1 once started; value and slope of the motor angle and of the load
STARTED, MOTOR_1, MOTOR_2, LOAD_1, LOAD_2, FILTER = range(6)

# --- context of the terms: what they may read ...
(
    X_TIME, X_DT, X_FIRST, X_COMMIT, X_MOTOR, X_MOTOR_OLD, X_JOINT, X_JOINT_OLD, X_JOINT_OLDER, X_LOAD, X_LOAD_OLD,
    X_TENSION_H, X_TENSION_L, X_RADIUS, X_TEMPERATURE, X_OTHER,
) = range(16)  # fmt: skip
OTHERS = 4
# ... and what they add to (moments on the output pulley, lengths of cable, factors, the joint encoder's reading, torque
# between the motor's torque sensor and the cable)
(
    X_MOMENT, X_MOMENT_SLOPE, X_LENGTH_H, X_LENGTH_L, X_PRETENSION_H, X_PRETENSION_L, X_STIFFNESS_H, X_STIFFNESS_L,
    X_READING, X_COMPLIANCE, X_RIGID, X_MOTOR_MOMENT, CONTEXT,
) = range(X_OTHER + OTHERS, X_OTHER + OTHERS + 13)  # fmt: skip

(
    STATUS_OK, STATUS_UNWOUND, STATUS_SLACK, STATUS_DIVERGED, STATUS_NAN, STATUS_BACKWARD, STATUS_BREAKS, STATUS_EFFECT,
    STATUS_UNREACHABLE, STATUS_UNKNOWN,
) = range(10)  # fmt: skip
