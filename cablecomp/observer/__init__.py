"""The online state of a joint: init, step, peek, snapshot, bounds, erasing history.

Imports effects, the kernel and what lies below. Start reading at `observer.py`, the Python side; what each sample runs
through is `stepper.py`.
"""

from cablecomp.observer.erase import ErasePlan, plan_erase
from cablecomp.observer.observer import Observer
from cablecomp.observer.refusal import Refusal, SampleRefused
from cablecomp.observer.wraps import WrapProfile

__all__ = ["ErasePlan", "Observer", "Refusal", "SampleRefused", "WrapProfile", "plan_erase"]
