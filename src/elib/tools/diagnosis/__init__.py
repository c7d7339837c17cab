"""The connection doctor: find out why a robot does not connect, step by step, and say what to do.

``await diagnose(url)`` returns a :class:`Diagnosis`; the command line and the panel show it.
"""

from elib.tools.diagnosis.doctor import CHECKS, diagnose
from elib.tools.diagnosis.report import OFFER, Diagnosis, DiagnosisStep

__all__ = ["CHECKS", "OFFER", "Diagnosis", "DiagnosisStep", "diagnose"]
