"""The drive's state table."""

from __future__ import annotations

from firmware_sim.firmware.records import DriveState, Request

TABLE: dict[tuple[DriveState, Request], DriveState] = {
    (DriveState.DISABLED, Request.DISABLE): DriveState.DISABLED,
    (DriveState.DISABLED, Request.CALIBRATE): DriveState.CALIBRATING,
    (DriveState.DISABLED, Request.ENABLE): DriveState.ENABLED,
    (DriveState.DISABLED, Request.CLEAR_FAULTS): DriveState.DISABLED,
    (DriveState.DISABLED, Request.SET_ZERO): DriveState.DISABLED,
    (DriveState.CALIBRATING, Request.DISABLE): DriveState.DISABLED,
    (DriveState.ENABLED, Request.DISABLE): DriveState.DISABLED,
    (DriveState.ENABLED, Request.ENABLE): DriveState.ENABLED,
    (DriveState.ENABLED, Request.CLEAR_FAULTS): DriveState.ENABLED,
    (DriveState.FAULT, Request.CLEAR_FAULTS): DriveState.DISABLED,
    **{(state, Request.STOP): DriveState.FAULT for state in DriveState},
    **{(state, Request.RESET): DriveState.DISABLED for state in DriveState},
}
"""What a request does in each state; a pair that is missing is refused and leaves everything as it is."""
