"""Files of a campaign: columns with seven digits, and sidecars with the laboratory's assumptions."""

import numpy as np

ORDER = ("time_s", "pressure_kPa", "elongation_mm", "strain", "stress_MPa", "temperature_degC", "stress_kPa", "force_N",
         "resistance_ohm", "resistance_1_ohm", "resistance_2_ohm", "current_A", "current_2_A", "curvature_1pm",
         "bend_angle_deg", "length_mm")  # fmt: skip


def _value(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(float(value))


def sidecar(bench, take):
    """Text of a recording's sidecar."""
    lines = [f'kind = "{bench.kind}"', f'role = "{take.role}"', f'specimen = "{bench.specimen}"', "real = false"]
    tables = {"noise": bench.noise if bench.noise_stated else {}, "geometry": bench.geometry, "tolerance": bench.tolerance}
    for title, table in tables.items():
        if table:
            lines += [f"[{title}]"] + [f"{name} = {_value(value)}" for name, value in table.items()]
    return "\n".join(lines) + "\n"


def write(bench, columns, folder):
    """Write columns (K, N) by name and the sidecars into an existing folder."""
    for k, take in enumerate(bench.recordings):
        present = {"time_s": take.time} | {name: columns[name][k] for name in bench.measured}
        names = [name for name in ORDER if name in present]
        table = np.stack([present[name][: take.rows] for name in names], axis=1)
        text = [",".join(names)] + [",".join(f"{x:.7g}" for x in line) for line in table]
        (folder / f"{take.name}.csv").write_text("\n".join(text) + "\n", encoding="utf-8", newline="\n")
        (folder / f"{take.name}.toml").write_text(sidecar(bench, take), encoding="utf-8", newline="\n")
