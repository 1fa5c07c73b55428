# SPDX-License-Identifier: Apache-2.0
"""Reads the folders that `alidade run`, `alidade sweep` and `alidade compare` write.

    import alidade
    run = alidade.Run("runs/05")
    depth = run["ekf"].estimates["target.depth"]            # numpy array
    unit = run["ekf"].estimates.units["target.depth"]       # "m"
"""
from .reader import Comparison, Estimator, Run, Sweep
from .table import AlidadeError, Table, UnknownName

__all__ = ["AlidadeError", "Comparison", "Estimator", "Run", "Sweep", "Table", "UnknownName"]
