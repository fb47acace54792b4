"""Every run checked for contact with python-fcl, independently of all that controls."""

from motm_wbc.audit.audit import Audit, AuditResult, Clearances
from motm_wbc.audit.episodes import Episode
from motm_wbc.audit.parameters import AuditParameters

__all__ = ["Audit", "AuditParameters", "AuditResult", "Clearances", "Episode"]
