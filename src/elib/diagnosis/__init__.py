"""The connection doctor: why a robot does not connect, step by step, with what to do about it.

For the command line and the panel: ``await diagnose(url)`` returns a :class:`Diagnosis`.
"""

from elib.diagnosis.doctor import CHECKS, diagnose
from elib.diagnosis.report import OFFER, Diagnosis, Step

__all__ = ["CHECKS", "OFFER", "Diagnosis", "Step", "diagnose"]
