"""What an exported program is made of: no file here needs more than MuJoCo and numpy.

`program` joins these files, the code of a model's effects and its numbers into one. The files
import nothing but each other, the standard library, MuJoCo and numpy, and their names must not
clash.
"""
