"""Configuration files of an identified servo for training programs that pin other versions."""
