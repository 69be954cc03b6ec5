"""Networks that a comparison of forces finds in folders."""

from pathlib import Path

from tendon_lab.force_scoring.compared_models import load_networks
from tests.train.actuator.network_files import written


def test_a_folder_gives_each_network_once_and_without_code(tmp_path: Path) -> None:
    """Of a network in both forms the weights are read: its program may be a stranger's."""
    written(tmp_path / "network.safetensors")
    (tmp_path / "network.pt").write_bytes(b"PK, a program")
    (found,) = load_networks([tmp_path], trust=False)
    assert found.path.suffix == ".safetensors"
