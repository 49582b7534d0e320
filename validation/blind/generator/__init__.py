"""Generator of blind campaigns with concealed physics: a second implementation that shares nothing with the
tool under trial.

It uses NumPy and SciPy only and is written from the published equations. It has its own sums over the section
(`section`), time stepping (`march`) and root finder (`roots`). Its laws (`nitinol`, `silicone`), stands
(`tube`, `coil`, `wire`, `actuator`) and instruments (`noise`) are its own, too. It agrees with independently
computed values of the published base model, as a valid null requires.

Effects (`effects_*`, `outside`) are hooks along the march. Their functional forms differ from those of the
catalogue. Their strength is the evidence of the true form after the base has been refitted within its
tolerances (`detectability`). `plans` has a laboratory's test plans, `building` makes a case from its seed,
`writing` writes a laboratory's files. The same seed gives the same bytes.
"""
