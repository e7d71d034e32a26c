"""What a compiled step says of its sample."""

from __future__ import annotations

(
    STATUS_OK, STATUS_UNWOUND, STATUS_SLACK, STATUS_DIVERGED, STATUS_NAN, STATUS_BACKWARD, STATUS_BREAKS, STATUS_EFFECT,
    STATUS_UNREACHABLE, STATUS_UNKNOWN,
) = range(10)  # fmt: skip
