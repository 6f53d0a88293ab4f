"""onnxruntime with its telemetry off: the one place that loads it, and that makes its sessions.

From 1.29 on its builds send what runs to Microsoft, and keep an id of the computer in the user's folder. The variable
is read once, as the library is loaded; where another part of the process loaded it before, the call stops later events.
Reference: https://github.com/microsoft/onnxruntime/blob/main/docs/Privacy.md, "Disabling Telemetry".
"""

import os
from pathlib import Path

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import onnxruntime as onnxruntime  # only now: see above

SILENT = 4
"""Of onnxruntime's severities, fatal alone: its complaints come as exceptions, in our words."""

onnxruntime.disable_telemetry_events()
onnxruntime.set_default_logger_severity(SILENT)


def new_session(path: Path, *, env_allocators: bool = False) -> onnxruntime.InferenceSession:
    """Load a file to run on this process's processor with one thread; it raises a dozen types of its own."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # the processes are the parallelism
    options.log_severity_level = SILENT
    if env_allocators:
        options.add_session_config_entry("session.use_env_allocators", "1")
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
