"""The emulated servo's memory and protocol."""
