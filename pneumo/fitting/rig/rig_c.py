"""A fitted rig as C99: tables of nodes and restrictions, and `gas_network` as loops over them."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from pneumo.export.c_source import TEMPLATES
from pneumo.export.printing import digits
from pneumo.fitting.rig.rig_file import Rig
from pneumo.fitting.rig.rig_record import Points, Run
from pneumo.fitting.rig.rig_replay import network
from pneumo.simulation.gas_network import LAMINAR, fastest_rate, replay
from pneumo.simulation.tableau import DORMAND_PRINCE
from pneumo.storage.files import DOI

SAMPLES = 60  # of the test program's run
# Of the test program, relative: rounding, and a library's pow of a few units in the last place.
TOLERANCE = 1e-9
VALVE = ("opening_delay", "opening", "closing_delay", "closing")


def node_names(rig: Rig) -> list[str]:
    """Names of the nodes of `network`, in its order."""
    has = {"CHAMBER": True, "HOSE": rig.has("hose_volume"), "SILENCER": rig.has("silencer_volume")}
    sides = "AB" if rig.has("dead_volume_B") else "A"
    of_sides = [f"{kind}_{side}" for kind, there in has.items() if there for side in sides]
    return of_sides + ["SUPPLY"] * rig.has("supply_volume")


def _braced(values: Sequence[float]) -> str:
    numbers = [str(value) if isinstance(value, int) else digits(float(value)) for value in values]
    return "{" + ", ".join(numbers) + "}"


def rig_c(rig: Rig, model: str, values: Mapping[str, float], runs: Sequence[Run]) -> dict[str, str]:
    """Texts of rig.c, rig.h and rig_test.c by name, for a model with the quantities `values`, SI units.

    The runs give the travel and the position at which k_0 holds: where the first run begins.
    """
    travel, x_start = runs[0].travel, float(runs[0].x[0])
    points = Points(np.zeros(1), np.zeros(1))
    # From shut to open, over a metre: volumes and area ratios are linear in x, areas in the opening.
    over_a_metre = np.array([x_start, x_start + 1.0])
    run = Run(1.0, over_a_metre, np.nan, np.nan, points, travel=travel)
    of_rig = network(rig, model, values, run, is_open=np.array([0.0, 1.0]))
    nodes, links, surroundings = of_rig.nodes, of_rig.links, of_rig.surroundings
    shut, opened = of_rig.areas.reshape(len(links), 2).T
    lines = [(part[:, 0], part[:, 1] - part[:, 0]) for part in (of_rig.volumes, of_rig.area_ratios)]
    (V, dV_dx), (ratio, dratio_dx) = ((first - slope * x_start, slope) for first, slope in lines)

    # A run over the whole travel that opens and shuts the valve; for a vessel as long as it was measured.
    part = np.linspace(0, 1, SAMPLES)
    x, opening = travel * np.sin(np.pi * part) ** 2, np.clip(2 - 6 * np.abs(part - 0.5), 0, 1)
    x[np.argmax(x)] = travel
    h = 1e-3 if rig.has("bore") else float(runs[0].t[-1]) / SAMPLES
    volumes, ratios = np.outer(dV_dx, x) + V[:, None], np.outer(dratio_dx, x) + ratio[:, None]
    areas = np.outer(opened - shut, opening) + shut[:, None]
    known = replay(nodes, links, surroundings, volumes, areas, rig.gas, h, ratios).P

    rows, A = list[tuple[str, str]](), DORMAND_PRINCE.A
    names, b_of_gas = node_names(rig), rig.gas.critical_ratio
    for s, (name, node) in enumerate(zip(names, nodes, strict=True)):
        law, k_0 = node.lane, node.lane.wall_scale * node.k_0
        indices = law.n_V, law.n_in, law.n_out, law.a, law.mixing, law.e_A, law.e_PT, int(law.full)
        wall = node.P_0, node.T_0, node.T_wall, k_0, node.k_store, node.c_store, node.k_back
        rows.append((name, _braced([*indices, *wall, V[s], dV_dx[s], ratio[s], dratio_dx[s]])))
    restrictions = list[list[float]]()
    for link, *areas_of in zip(links, shut, opened, strict=True):
        b = b_of_gas if np.isnan(link.b) else link.b
        restrictions.append([int(link.first), int(link.second), b, int(link.b > 0), link.back, *areas_of])
    heading = [
        "A rig: volumes of gas joined by restrictions, in SI units.",
        f"Model: {model}, with parameters as fitted by pneumo {version('pneumo')}.",
        f"Equation numbers are those of J. Falcao Carneiro and F. Gomes de Almeida (2006), {DOI}.",
    ]
    content: dict[str, Any] = {
        "heading": heading,
        "digits": digits,
        "names": names,
        "sensor": of_rig.sensor,
        "has_piston": rig.has("bore"),
        "valve": {part: values[f"valve_{part}"] for part in VALVE} if rig.has("valve_C_in") else None,
        "gas": rig.gas,
        "laminar": LAMINAR,
        "fastest": fastest_rate(nodes, links, surroundings, volumes, areas, rig.gas),
        "rows": rows,
        "links": [_braced(row) for row in restrictions],
        "surroundings": [_braced(pair) for pair in surroundings],
        "start": [
            ", ".join(digits(float(value)) for value in column)
            for column in ([n.P for n in nodes], [n.T for n in nodes], [n.T_wall for n in nodes])
        ],
        "A": ", ".join(digits(float(value)) for i in range(1, len(A)) for value in A[i, :i]),
        "b": [digits(float(value)) for value in DORMAND_PRINCE.b],
        "c": [digits(float(value)) for value in DORMAND_PRINCE.c],
        "inputs": [_braced(pair) for pair in zip(x, opening, strict=True)],
        "P": [_braced(column) for column in known.T[1:]],
        "h": digits(h),
        "tolerance": TOLERANCE,
    }
    files = ("rig.c", "rig.h", "rig_test.c")
    return {name: TEMPLATES.get_template(f"{name}.j2").render(content) for name in files}
