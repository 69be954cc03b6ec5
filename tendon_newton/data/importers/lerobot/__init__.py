"""LeRobotDatasets: what an arm was told and where its joints were, in parquet files.

A folder holds ``meta/info.json`` (``fps``, ``robot_type``, and for ``action`` and
``observation.state`` the ``names`` of their entries) and ``data/chunk-*/*.parquet`` with the
columns ``action``, ``observation.state``, ``timestamp`` and ``episode_index``. Every joint of every
episode becomes one recording of the bench ``servo``. Source of the format: huggingface/lerobot,
LeRobotDataset v3; the files of v2 have the same columns.
"""

from tendon_newton.data.importers.lerobot.reading import read_lerobot
from tendon_newton.data.importers.lerobot.units import LeRobotUnits

__all__ = ["LeRobotUnits", "read_lerobot"]
