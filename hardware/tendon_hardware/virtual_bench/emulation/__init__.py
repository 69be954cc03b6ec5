"""Firmware and physics joined into a servo that answers."""
