#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Records what the pydrake faces do, for the tests of the C++ ones.

    python tests/systems/record_traces.py [FACE ...]

writes traces/FACE.csv for each face of the table (by default for all), and
arm.yaml, the Panda's numbers. Every number has the digits that bring it back
bit for bit. Columns are the time, then every input port, then every output
port, matrices row by row (a Matrix3X has one column, its first).

The first row is of the start: time 0, before any step. Then, row after row,
the inputs take their new values, the face goes on to the row's time and takes
the step that is due there, and the outputs are read. In some rows, one input
after the other is not finite.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from face_table import FACES, HERE, alone, evaluate, flat, panda, spoiled
from pydrake.systems.analysis import Simulator

from dual_proxy import systems

TRACES = HERE / "traces"
ARM = HERE / "arm.yaml"

NUM_ROWS = 26
# Seconds between steps, steps between rows: so that more than one message and a
# change of the selection fall into the rows.
TIMING = {
    "CommunicationChannel": (0.001, 10),
    "ForceSpaceParticleFilter": (0.02, 1),
    "ContactHistory": (0.01, 1),
}
DEFAULT_TIMING = (0.001, 6)
# The rows in which the first, second, ... input is not finite.
BAD_ROWS = range(5, NUM_ROWS, 2)


def trace_inputs(name):
    """The rows' times, and the values of the input ports."""
    period, steps = TIMING.get(name, DEFAULT_TIMING)
    rows = []
    for i in range(NUM_ROWS):
        # As Drake computes the time of a step: not i times the rows' distance.
        time = max(i - 1, 0) * steps * period
        sources = FACES[name].sources.items()
        rows.append((time, {port: source(time) for port, source in sources}))
    for k, port in enumerate(FACES[name].inputs):
        _, inputs = rows[BAD_ROWS[k]]
        bad = (math.nan, math.inf, -math.inf)[k % 3]
        inputs[port.name] = spoiled(inputs[port.name], bad)
    return rows


def record(name):
    """A face's trace: the names of its columns, and the rows as an array."""
    entry = FACES[name]
    diagram, face = alone(entry)
    simulator = Simulator(diagram)
    context = face.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    rows = []
    for i, (time, inputs) in enumerate(trace_inputs(name)):
        for port, value in inputs.items():
            vector = isinstance(value, np.ndarray) and value.ndim == 1
            face.GetInputPort(port).FixValue(
                context, value if vector else systems.make_value(value)
            )
        if i > 0:
            simulator.AdvanceTo(time)
            simulator.AdvancePendingEvents()
        values = {"time": np.array([time])}
        for port in entry.inputs:
            values[f"in.{port.name}"] = flat(inputs[port.name])
        for port in entry.outputs:
            value = evaluate(face.GetOutputPort(port.name), context)
            values[f"out.{port.name}"] = flat(value)
        rows.append(np.concatenate(list(values.values())))
    header = [
        column if values[column].size == 1 else f"{column}.{i}"
        for column in values
        for i in range(values[column].size)
    ]
    return header, np.array(rows)


def text(number):
    """The shortest decimal that is this very number."""
    return repr(float(number)).removesuffix(".0")


def write_trace(name):
    header, rows = record(name)
    lines = [",".join(header), *(",".join(map(text, row)) for row in rows)]
    TRACES.mkdir(exist_ok=True)
    (TRACES / f"{name}.csv").write_text("\n".join(lines) + "\n")


def arm_numbers():
    """Field -> numbers of the Panda's ArmModelParams, as nested lists."""
    params = panda().arm_params
    return {name: getattr(params, name).tolist() for name in params.fields}


def write_arm():
    lines = [
        "# SPDX-License-Identifier: BSD-3-Clause",
        "#",
        "# ArmModelParams of the Panda. Written by record_traces.py.",
    ]
    for field, value in arm_numbers().items():
        lines.append("")
        if np.ndim(value) == 1:
            lines.append(f"{field}: {value}")
        else:
            lines.append(f"{field}:")
            lines += [f"  - {row}" for row in value]
    ARM.write_text("\n".join(lines) + "\n")


def main(names):
    unknown = set(names) - set(FACES)
    if unknown:
        sys.exit(f"record_traces.py: no face {sorted(unknown)}, there are {[*FACES]}")
    for name in names or FACES:
        write_trace(name)
    write_arm()


if __name__ == "__main__":
    main(sys.argv[1:])
