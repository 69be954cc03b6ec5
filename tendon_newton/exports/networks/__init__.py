"""Networks of a servo's force in the formats of other simulators."""
