# SPDX-License-Identifier: BSD-3-Clause
"""The station: a scenario in, a Drake diagram out. Nothing here is control.

    wiring "fused":    loop <-> plant
    wiring "systems":  haptic_side -> to_robot -> robot_side <-> plant
                       haptic_side <- to_device <- robot_side

Both give the same bits. The second is for diagrams to look at, to change and to
replace something in; the first is fast.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import dual_proxy._pydrake  # noqa: F401

# isort: split
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.multibody.plant import ContactResults
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import LogVectorOutput, Multiplexer

from dual_proxy import _core
from dual_proxy.log import make_frame
from dual_proxy.native import NativeTwin
from dual_proxy.panda import (
    PandaModel,
    add_panda_scene,
    p_SE_S,
    read_contacts,
)
from dual_proxy.replay import SceneDrawer
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.systems import (
    CommunicationChannel,
    HapticSide,
    RobotSide,
    SensorReaction,
    TeleopLoop,
)

__all__ = ["WIRINGS", "Station", "build_station", "start_posture"]

_FRAMES_PER_SECOND = 30
# Of the log, when they are moved to where it is kept.
_ROWS_AT_A_TIME = 1000

WIRINGS = ("fused", "systems")


class ContactTruthSystem(NativeTwin, LeafSystem):
    """The tool's true contacts as a vector: force 3, normal 3, dimension 1,
    axis of free motion 3; and with `rotations` the number of rotations that they
    block 1, free axis 3."""

    def __init__(self, tool_body: BodyIndex, rotations: bool = False) -> None:
        super().__init__()
        self._tool_body = tool_body
        self._rotations = rotations
        self._native_name = "ContactTruthSystem"
        self._native_arguments = {"tool_body": int(tool_body), "rotations": rotations}
        self._results = self.DeclareAbstractInputPort(
            "contact_results", Value[ContactResults]()
        )
        self.DeclareVectorOutputPort(
            "truth", 14 if rotations else 10, self._calc, {self._results.ticket()}
        )

    def _calc(self, context: Context, output: Any) -> None:
        results: Any = self._results.Eval(context)
        values = read_contacts(results, self._tool_body, self._rotations)
        output.SetFromVector(values[: output.size()])


class Station:
    """A diagram built from a scenario, with its simulator and its log.

    The diagram's systems have the names of the picture above, and it exports
    what is wired further: `robot_state` (14), `sensed_wrench` (6), `torque`
    (7), `device_pose`, `device_wrench` (6), with a scheme that uses them
    `force_selection` (9) and `dimension` (1), and with the angular filter
    `moment_selection` (9) and `moment_dimension` (1).

    Made by `build_station`.

    Attributes
    ----------
    scenario : what it was built from.
    diagram : the Drake diagram.
    simulator : of the diagram, at time 0.
    """

    def __init__(
        self,
        scenario: Scenario,
        meshcat: bool = False,
        logged: bool = True,
        wiring: str = "fused",
    ) -> None:
        if wiring not in WIRINGS:
            raise ValueError(
                f"wiring: expected one of {', '.join(WIRINGS)}, got {wiring!r}"
            )
        scenario._check_for_drake(fused=wiring == "fused")
        self.scenario = scenario
        self._builder = DiagramBuilder()
        # Ports that are logged, side by side, and where their signals are.
        self._logged: list[OutputPort] = []
        self._layout: dict[str, slice] = {}
        self._num_columns = 0
        self._watched = meshcat or logged
        self._add_scene()
        if wiring == "fused":
            self._add_loop()
        else:
            self._add_sides()
        self._path = scenario.handle_path()
        self._sink: Any = None
        self._store: Any = None
        if self._watched:
            self._gather(logged)
        self.diagram: Diagram = self._builder.Build()
        self.diagram.set_name("station")
        self.simulator = Simulator(self.diagram)
        self.simulator.Initialize()
        self._drawer = None
        if meshcat:
            self._drawer = SceneDrawer(
                Meshcat(), scenario.scene, _core.WorkspaceMap(scenario.map)
            )

    def advance_to(self, time: float) -> None:
        """Simulates up to `time`, s; draws on the way if there is a viewer."""
        if self._drawer is not None:
            now = self.simulator.get_context().get_time()
            frames = int((time - now) * _FRAMES_PER_SECOND)
            for end in np.linspace(now, time, frames + 1)[1:-1]:
                self.simulator.AdvanceTo(end)
                self._drawer.update(self._current_row())
        self.simulator.AdvanceTo(time)
        if self._store is not None:
            log: Any = self._sink.FindLog(self.simulator.get_context())
            if log.num_samples() >= _ROWS_AT_A_TIME:
                self._move_log(self._store)

    def store_log(self, duration: float) -> None:
        """Keeps the log where it takes no memory: on disk, if the run is long.

        From now on, `advance_to` moves there what was logged. The simulator's
        context, copied or put back, is then no longer all of the log.

        Parameters
        ----------
        duration : of the run, s; there is no room for more.

        Raises
        ------
        RuntimeError
            If the station was built without a log.
        OSError
            If there is no space for it; the error names the folder.
        """
        self._check_logged("store_log")
        rows = math.ceil(duration / self._log_period) + 1
        self._store = _core._RunLogStore(self._num_columns, rows)

    def log_frame(self) -> pd.DataFrame:
        """Returns the log so far; see `dual_proxy.log.SIGNALS`.

        It is read-only.

        Raises
        ------
        RuntimeError
            If the station was built without a log.
        OSError
            If the log is so long that it goes to disk, and there is no space.
        """
        self._check_logged("log_frame")
        store = self._store
        if store is None:
            log: Any = self._sink.FindLog(self.simulator.get_context())
            store = _core._RunLogStore(self._num_columns, log.num_samples())
            self._append(log, store)
        else:
            self._move_log(store)
        return make_frame(store.time, self._signals(store.values))

    def _check_logged(self, who: str) -> None:
        if self._sink is None:
            raise RuntimeError(f"{who}: the station was built with logged=False")

    def _move_log(self, store: Any) -> None:
        """Moves what was logged to `store`; it is forgotten even if that fails."""
        context: Any = self.simulator.get_mutable_context()
        log: Any = self._sink.FindMutableLog(context)
        try:
            self._append(log, store)
        finally:
            log.Clear()

    def _append(self, log: Any, store: Any) -> None:
        times = log.sample_times()
        # A simulator that goes on from a copied context notes its time once more.
        new = np.append(np.diff(times) > 0.0, True)[: len(times)]
        times = times[new]
        rows = np.vstack([log.data()[:, new], self._hand_positions(times)])
        store.append(times, rows)

    def _hand_positions(self, times: Any) -> NDArray[np.float64]:
        """Returns where the hand means to be, (3, n): of the times alone."""
        positions = [self._path.calc(time)[0] for time in times]
        return np.reshape(positions, (len(times), 3)).T

    def _current_row(self) -> dict[str, float]:
        root = self.simulator.get_context()
        system: Any = self._everything.get_system()
        row: Any = self._everything.Eval(system.GetMyContextFromRoot(root))
        times = np.array([root.get_time()])
        rows = np.append(row, self._hand_positions(times))[np.newaxis]
        frame = make_frame(times, self._signals(rows))
        return dict(zip(frame.columns, frame.iloc[0].tolist(), strict=True))

    def _log(self, port: OutputPort, layout: Mapping[str, slice]) -> None:
        self._logged.append(port)
        self._add_columns(layout)

    def _add_columns(self, layout: Mapping[str, slice]) -> None:
        start = self._num_columns
        for name, where in layout.items():
            self._layout[name] = slice(start + where.start, start + where.stop)
            self._num_columns = max(self._num_columns, start + where.stop)

    def _gather(self, logged: bool) -> None:
        """All signals side by side, and one sink for them: every event of Drake's
        has its price."""
        sizes = [port.size() for port in self._logged]
        everything = self._builder.AddNamedSystem("everything", Multiplexer(sizes))
        for index, port in enumerate(self._logged):
            self._builder.Connect(port, everything.get_input_port(index))
        self._everything = everything.get_output_port()
        # What follows from the time alone is added where the log is read.
        self._add_columns({"hand_position": slice(0, 3)})
        if logged:
            self._log_period = self.scenario.control_period
            self._sink = LogVectorOutput(
                self._everything, self._builder, publish_period=self._log_period
            )

    def _add(self, name: str, system: type[NativeTwin], *args: Any) -> Any:
        return system.add_to(self._builder, *args, name=name)

    def _export(self, system: Any, *names: str) -> None:
        for name in names:
            self._builder.ExportOutput(system.GetOutputPort(name), name)

    def _export_selections(self, system: Any) -> None:
        if not self.scenario.uses_selections:
            return
        self._export(system, "force_selection", "dimension")
        if self.scenario.has_angular_filter:
            self._export(system, "moment_selection", "moment_dimension")

    def _connect(self, source: Any, output: str, target: Any, port: str) -> None:
        self._builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def _add_scene(self) -> None:
        """The arm in its scene, and what its tool really touches."""
        scenario = self.scenario
        self._model, self._q_start = start_posture(scenario)
        try:
            scene = add_panda_scene(
                self._builder, scenario.scene, self._q_start, drawn=False
            )
        except ScenarioError as error:
            raise ScenarioError(f"{scenario.name}.{error}") from error
        self._scene = scene
        if self._watched:
            rotations = scenario.has_angular_filter
            truth = self._add(
                "contact_truth", ContactTruthSystem, scene.tool_body, rotations
            )
            self._builder.Connect(
                scene.contact_results_port, truth.GetInputPort("contact_results")
            )
            layout = {
                "contact_force": slice(0, 3),
                "contact_normal": slice(3, 6),
                "contact_dimension": slice(6, 7),
                "contact_motion_axis": slice(7, 10),
            }
            if rotations:
                layout["contact_moment_dimension"] = slice(10, 11)
                layout["contact_rotation_axis"] = slice(11, 14)
            self._log(truth.GetOutputPort("truth"), layout)
        self._builder.ExportOutput(scene.state_port, "robot_state")

    def _add_loop(self) -> None:
        """Everything else, as one system."""
        scene = self._scene
        loop = TeleopLoop(self.scenario, self._model, scene.sensor_joint, self._q_start)
        layout = loop.layout
        system = loop._join(self._builder, "loop")
        builder = self._builder
        builder.Connect(scene.state_port, system.GetInputPort("robot_state"))
        builder.Connect(
            scene.reaction_forces_port, system.GetInputPort("reaction_forces")
        )
        builder.Connect(system.GetOutputPort("torque"), scene.actuation_port)
        self._log(system.GetOutputPort("signals"), layout)
        self._export(system, "sensed_wrench", "torque", "device_pose", "device_wrench")
        self._export_selections(system)

    def _add_sides(self) -> None:
        """The same in the systems that people's own diagrams are made of."""
        scenario, scene, builder = self.scenario, self._scene, self._builder
        robot = RobotSide(
            scenario.robot_side_params(),
            self._model,
            self._q_start,
            scenario.sensor,
            p_SE_S,
            scenario.calc_seed("sensor"),
            scenario.calc_seed("filter"),
            scenario.calc_seed("angular_filter"),
        )
        haptic = HapticSide(
            scenario.haptic_side_params(), scenario.device, scenario.handle_path()
        )
        robot_layout, haptic_layout = robot.layout, haptic.layout
        reaction = self._add("reaction", SensorReaction, scene.sensor_joint)
        robot_side = robot._join(builder, "robot_side")
        haptic_side = haptic._join(builder, "haptic_side")
        builder.Connect(
            scene.reaction_forces_port, reaction.GetInputPort("reaction_forces")
        )
        builder.Connect(scene.state_port, robot_side.GetInputPort("robot_state"))
        builder.Connect(robot_side.GetOutputPort("torque"), scene.actuation_port)
        self._connect(reaction, "reaction", robot_side, "reaction")
        self._log(haptic_side.GetOutputPort("signals"), haptic_layout)
        self._log_scalars(haptic_side, "device_bad_inputs", "device_bad_inputs")
        self._log(robot_side.GetOutputPort("signals"), robot_layout)
        self._log_scalars(
            robot_side, "sensor_counters", "sensor_bad_inputs", "sensor_tares_refused"
        )
        tags = _core._scheme_tags(scenario.scheme)
        self._add_channel("to_robot", tags[0], haptic_side, robot_side)
        self._add_channel("to_device", tags[1], robot_side, haptic_side)
        self._export(robot_side, "sensed_wrench", "torque")
        self._export(haptic_side, "device_pose", "device_wrench")
        self._export_selections(robot_side)

    def _log_scalars(self, system: Any, port: str, *names: str) -> None:
        layout = {name: slice(i, i + 1) for i, name in enumerate(names)}
        self._log(system.GetOutputPort(port), layout)

    def _add_channel(self, name: str, tag: int, source: Any, target: Any) -> None:
        """One direction of the link."""
        link = self.scenario.link
        kind = _core.Message()
        kind.tag = tag
        channel = self._add(
            name,
            CommunicationChannel,
            link.channel,
            self.scenario.calc_seed(name),
            link.rate,
            self.scenario.control_period,
            kind,
            True,
        )
        port = "haptic_message" if name == "to_robot" else "robot_message"
        self._connect(source, "message", channel, "message")
        self._connect(channel, "message", target, port)
        self._log_scalars(
            channel,
            "counters",
            *(f"{name}_{what}" for what in ("lost", "overflow", "refused")),
        )

    def _signals(self, rows: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Returns every signal of the log from rows of the logged ports, with the
        hand's positions at their end."""
        return {name: rows[:, where] for name, where in self._layout.items()}


def start_posture(scenario: Scenario) -> tuple[PandaModel, Any]:
    """Returns the scenario's arm with its tool, and where it is at time 0, rad.

    Raises
    ------
    ValueError
        If no posture of the arm reaches the start.
    """
    model = PandaModel(scenario.scene.tool_mass, scenario.scene.gravity)
    return model, model.inverse_kinematics(
        scenario.map.p_cw, scenario.map.R_cw, scenario.controller.q_rest
    )


def build_station(
    scenario: Scenario,
    meshcat: bool = False,
    logged: bool = True,
    wiring: str = "fused",
) -> Station:
    """Builds the diagram of a scenario, ready to simulate.

    Parameters
    ----------
    scenario : what to build; see `dual_proxy.load_scenario`.
    meshcat : whether to open a viewer and draw the run in it.
    logged : whether to note all signals in every control period.
    wiring : "fused", or "systems" for separate systems with the same results.

    Raises
    ------
    ScenarioError
        If the scene is nothing for Drake; see `add_panda_scene`.
    ValueError
        If the parameters contradict each other, or no posture of the arm
        reaches the start.
    """
    return Station(scenario, meshcat, logged, wiring)
