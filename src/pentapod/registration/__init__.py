"""Registration: where the clamped part is, from touches of a probe; what they leave open; which touches to make."""

from pentapod.registration.fit import register
from pentapod.registration.motions import Motion
from pentapod.registration.probing import Probing, plan_probing
from pentapod.registration.result import CutSurface, NotRegistered, OtherPlacement, Registration
from pentapod.registration.touches import Touches, read_touches, touches_text

__all__ = [
    "CutSurface",
    "Motion",
    "NotRegistered",
    "OtherPlacement",
    "Probing",
    "Registration",
    "Touches",
    "plan_probing",
    "read_touches",
    "register",
    "touches_text",
]
