"""Cables of surgical instruments: spindle torque and jaw angle from spindle path and jaw load."""
