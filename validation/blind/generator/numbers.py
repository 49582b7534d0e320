"""The published constants, in the units and under the names of the recordings' sidecars."""

KRL35 = {
    "beta_1": 21.9987, "beta_2": 2.8458, "beta_3": 90.5096,
    "ka_1": 12.6422, "ka_2": -1.6532, "ka_3": 8.0373,
    "rho_mean": 18.8697, "rho_span": 2.1034, "km_1": -2.2045, "km_2": 1.7241, "km_3": 7.2,
    "alpha_1": 17.1884, "alpha_2": 1.5648, "a": 7.8613, "b": 0.6906, "gamma_max": 0.195,
    "G_m": 3.0, "G_a": 8.25, "gamma_L": 0.1013,
    "gR_amplitude": 0.065, "gR_slope": 10.32, "gR_shift": 1.57, "gR_decay": 5.0,
    "T_mid": 31.0, "T_width": 2.5,
}  # fmt: skip
"""Table 2.2 with the corrections; moduli in GPa, resistivity in ohm per metre of wire, temperatures in
degC."""

KRL45 = KRL35 | {
    "beta_1": 18.9749, "beta_2": 3.7937, "beta_3": 155.2259,
    "ka_1": 15.5459, "ka_2": -1.7322, "ka_3": 13.9375,
    "rho_mean": 18.9763, "rho_span": 3.1742, "km_1": -2.0476, "km_2": 1.1748, "km_3": 3.4851,
    "alpha_1": 16.9255, "alpha_2": -0.5693, "a": 7.9280, "b": 0.8488, "T_mid": 35.0, "T_width": 2.6,
}  # fmt: skip

NITI_WIRE = {
    "E_m": 30.0, "E_a": 70.0, "eps_L": 0.05, "beta_1": 52.0, "beta_2": 3.255, "beta_3": 90.5,
    "ka_1": 32.0, "ka_2": -1.25, "ka_3": 14.0,
    "gR_amplitude": 0.0321, "gR_slope": 20.9, "gR_shift": 0.5, "gR_decay": 5.0,
    "T_mid": 45.0, "T_width": 5.0,
}  # fmt: skip
"""Constants of the wire of this name in the calibration data."""

SPRING = {
    "wire_diameter_mm": 0.25, "mandrel_diameter_mm": 0.9, "initial_pitch_mm": 0.269,
    "active_coils": 52.0, "free_length_mm": 14.0,
}  # fmt: skip

TUBE = {"outer_diameter_mm": 10.0, "wall_thickness_mm": 1.0, "length_mm": 56.0, "silicone_stiffness": 1.0}

ALLOYS = {"krl35": KRL35, "krl45": KRL45, "niti_wire": NITI_WIRE}
