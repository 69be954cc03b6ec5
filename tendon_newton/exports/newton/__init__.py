"""Export to Newton: the bench with actuator prims, and a drive for what prims cannot say."""
