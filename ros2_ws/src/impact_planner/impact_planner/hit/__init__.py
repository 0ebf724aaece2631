"""The hit: eqs. (2) to (5) in `momentum`, stance (Fig. 5) in `stance`, posture in `posture`."""
