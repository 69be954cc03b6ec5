"""An operator who is not there, for runs that nobody watches."""

from tendon_hardware.control.operator import OperatorProgress


class SilentOperator:
    """Nobody: asks nothing, and keeps what was told, announced and shown."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.announced: list[str] = []
        self.shown: list[OperatorProgress] = []

    def ask(self, text: str) -> None:
        """Note what would have been asked."""
        self.told.append(text)

    def announce(self, text: str) -> None:
        """Note it, which is no alarm."""
        self.announced.append(text)

    def tell(self, text: str) -> None:
        """Note it."""
        self.told.append(text)

    def show(self, progress: OperatorProgress) -> None:
        """Note the figures."""
        self.shown.append(progress)
