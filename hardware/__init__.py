"""What drives a real finger from a Raspberry Pi; nothing is here yet."""
