"""A run as a recording for the rerun viewer, and as a table in memory.

Takes arrays, names and the scene's own data; rerun and pyarrow are imported when a recorder
is made or a table is asked for.
"""

from motm_wbc.recording.parameters import RecordingParameters
from motm_wbc.recording.rrd import RrdRecorder
from motm_wbc.recording.tee import Recorders, ScalarRecorder
from motm_wbc.recording.trace import TraceRecorder

__all__ = ["Recorders", "RecordingParameters", "RrdRecorder", "ScalarRecorder", "TraceRecorder"]
