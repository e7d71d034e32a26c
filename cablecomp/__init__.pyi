__version__: str

from .config import JointConfig as JointConfig
from .config import load_joint as load_joint
from .config import parse_joint as parse_joint
from .control.command import Command as Command
from .control.command import Reference as Reference
from .control.compensator import Compensator as Compensator
from .errors import CablecompError as CablecompError
from .errors import DeviceError as DeviceError
from .errors import InputError as InputError
from .errors import InternalError as InternalError
from .library import calibrate as calibrate
from .library import diagnose as diagnose
from .library import replay as replay
from .observer import ErasePlan as ErasePlan
from .observer import Observer as Observer
from .observer import WrapProfile as WrapProfile
from .observer import plan_erase as plan_erase
from .signals import Estimate as Estimate
from .signals import Sample as Sample
