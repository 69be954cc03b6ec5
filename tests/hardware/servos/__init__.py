"""Servos: data sheets, registers, and the driver on an emulated bus."""
