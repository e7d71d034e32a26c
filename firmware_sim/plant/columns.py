"""Columns of what goes into a step of the plant, and of what comes out of it."""

from __future__ import annotations

TIME, MOTOR_ANGLE, MOTOR_TORQUE, JOINT_TORQUE, TEMPERATURE, OTHER = range(6)
"""Given from outside: s, rad, N·m, N·m, °C, any unit."""

PRETENSION_H, PRETENSION_L, SOFTENED_H, SOFTENED_L, RELEASED_H, RELEASED_L = range(6, 12)
"""Of cable h and l: change of pretension over T0, share of EA lost, length let go into the free span (m)."""

UNSEEN_TORQUE, TILT, LEAN, MU_DRUMS, MU_GUIDE, BEARING_TORQUE = range(12, 18)
"""Moment on the output pulley that the torque channel does not see (N·m), turn of the weight's direction (rad),
share of the weight that does not turn this joint, changes of friction coefficients over their values, what the output
bearing's friction torque gains (N·m)."""

N_INPUTS = 18

(Q_OUT, Q_IN, V_OUT, V_IN, T_H, T_L, T_H_IN, T_L_IN, JOINT_NM, MOTOR_NM, PULLEY, MOTOR_TRUE, PATH) = range(13)
"""As the channels show them: angles, speeds, tensions of the free span at the output and at the input drum,
torques; and what no channel shows: true angles of pulley and motor, torque in the load path."""

N_OUTPUTS = 13
