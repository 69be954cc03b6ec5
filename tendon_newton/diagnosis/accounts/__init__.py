"""Why a cause was named or not, read from ``diagnosis.json`` and told in plain sentences."""
