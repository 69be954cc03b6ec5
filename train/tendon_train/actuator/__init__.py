"""Force networks: from recordings to a file that predicts the tension of a tendon."""
