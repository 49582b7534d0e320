"""Constants of alloys, silicones and actuators, one TOML file per source; see `pneusma_jax.calibration`."""
