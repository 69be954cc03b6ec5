"""An operator who is not there, for runs that nobody watches."""

from tendon_hardware.control.operator import OperatorProgress


class SilentOperator:
    """Nobody: asks nothing, and keeps what was told."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def ask(self, text: str) -> None:
        """Note what would have been asked."""
        self.told.append(text)

    def announce(self, text: str) -> None:
        """Say nothing."""

    def tell(self, text: str) -> None:
        """Note it."""
        self.told.append(text)

    def show(self, progress: OperatorProgress) -> None:
        """Show nothing."""
