"""Blind campaigns with concealed physics: a second implementation that shares nothing with the tool under trial.

NumPy and SciPy only, written from the published equations: its own sums over the section (`section`), time stepping
(`march`), root finder (`roots`), laws (`nitinol`, `silicone`), stands (`tube`, `coil`, `wire`, `actuator`) and
instruments (`noise`). It agrees with independently computed values of the published base model, which is what makes
a null a null.

Effects (`effects_*`, `outside`) are hooks along the march and have other functional forms than the catalogue writes
down. Their strength is the evidence that the true form would reach after the base has been refitted within its
tolerances (`detectability`). `plans` says what a laboratory would record, `building` makes a case from its seed,
`writing` writes what the laboratory would have. The same seed gives the same bytes.
"""
