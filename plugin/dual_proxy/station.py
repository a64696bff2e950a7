# SPDX-License-Identifier: BSD-3-Clause
"""The station: a scenario in, a Drake diagram out. Nothing here is control.

    operator -> device -> haptic_side --pose--> to_robot --> robot_side -> panda
                  ^           |                                |  ^          |
                  +--- F_h ---+ <--pose, Omega-- to_device <---+  +- filter <+

`filter` is the Force-Space Particle Filter; it takes the wrist sensor's force
and what the robot side commanded. `angular_filter`, in scenarios that ask for
it, is a second one, with moments and rotations.
"""

from __future__ import annotations

import math
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
from dual_proxy.log import make_frame, signals
from dual_proxy.native import NativeTwin
from dual_proxy.panda import (
    PandaModel,
    SensorReaction,
    add_panda_scene,
    p_SE_S,
    read_contacts,
)
from dual_proxy.replay import SceneDrawer
from dual_proxy.scenario import Scenario
from dual_proxy.systems import (
    CommunicationChannel,
    ForceSpaceParticleFilter,
    HapticSide,
    PositionForceHapticSide,
    RobotSide,
    SimulatedHapticDevice,
)

__all__ = ["Station", "build_station"]

_FRAMES_PER_SECOND = 30
# Of the log, when they are moved to where it is kept.
_ROWS_AT_A_TIME = 1000

# What the ports of counters hold: port -> signals, without the port's name.
_FILTER_COUNTERS = ("bad_inputs", "all_weights_zero")
_CHANNEL_COUNTERS = ("lost", "overflow", "refused")
_COUNTERS = {
    "sensor": ("bad_inputs", "tares_refused"),
    "filter": _FILTER_COUNTERS,
    "angular_filter": _FILTER_COUNTERS,
    "haptic_link": ("dropped", "bad_messages", "gaps", "spikes", "losses"),
    "to_robot": _CHANNEL_COUNTERS,
    "to_device": _CHANNEL_COUNTERS,
}


class ContactTruthSystem(NativeTwin, LeafSystem):
    """The tool's true contacts as a vector: force 3, normal 3, dimension 1; and
    with `rotations` the number of rotations that they block 1, free axis 3."""

    def __init__(self, tool_body: BodyIndex, rotations: bool = False) -> None:
        super().__init__()
        self._tool_body = tool_body
        self._rotations = rotations
        self._native_arguments = {"tool_body": int(tool_body), "rotations": rotations}
        self._results = self.DeclareAbstractInputPort(
            "contact_results", Value[ContactResults]()
        )
        self.DeclareVectorOutputPort(
            "truth", 11 if rotations else 7, self._calc, {self._results.ticket()}
        )

    def _calc(self, context: Context, output: Any) -> None:
        results: Any = self._results.Eval(context)
        values = read_contacts(results, self._tool_body, self._rotations)
        output.SetFromVector(values[: output.size()])


class Station:
    """A diagram built from a scenario, with its simulator and its log.

    The diagram's systems have the names of the picture above, and it exports
    what is wired further: `robot_state` (14), `sensed_wrench` (6), `torque`
    (7), `device_pose`, `device_wrench` (6), with the dual proxy
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
        self, scenario: Scenario, meshcat: bool = False, logged: bool = True
    ) -> None:
        self.scenario = scenario
        self._builder = DiagramBuilder()
        self._ports: dict[str, OutputPort] = {}
        self._watched = meshcat or logged
        self._add_robot()
        self._add_device()
        self._add_link()
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
        store.append(times, np.vstack([log.data(), self._hand_positions(times)]))

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

    def _gather(self, logged: bool) -> None:
        """All signals side by side, and one sink for them: every event of Drake's
        has its price."""
        sizes = [port.size() for port in self._ports.values()]
        # The last ones are what is added where the log is read.
        self._columns = np.cumsum(sizes)
        self._num_columns = sum(sizes) + 3
        everything = self._builder.AddNamedSystem("everything", Multiplexer(sizes))
        for index, port in enumerate(self._ports.values()):
            self._builder.Connect(port, everything.get_input_port(index))
        self._everything = everything.get_output_port()
        if logged:
            self._log_period = self.scenario.control_period
            self._sink = LogVectorOutput(
                self._everything, self._builder, publish_period=self._log_period
            )

    def _add(self, name: str, system: type[NativeTwin], *args: Any) -> Any:
        return system.add_to(self._builder, *args, name=name)

    def _export(self, port: OutputPort, name: str) -> None:
        self._builder.ExportOutput(port, name)

    def _connect(self, source: Any, output: str, target: Any, port: str) -> None:
        self._builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def _add_robot(self) -> None:
        """The arm in its scene, the wrist sensor, the robot side, the filter."""
        scenario = self.scenario
        builder = self._builder
        scene_params = scenario.scene
        model = PandaModel(scene_params.tool_mass, scene_params.gravity)
        q_start = model.inverse_kinematics(
            scenario.map.p_cw, scenario.map.R_cw, scenario.controller.q_rest
        )
        scene = add_panda_scene(builder, scene_params, q_start, drawn=False)
        reaction = self._add("reaction", SensorReaction, scene.sensor_joint)
        params = _core.RobotSideParams(
            proxy=scenario.robot_proxy,
            controller=scenario.controller,
            sender=scenario.link.sender,
            filter_period=scenario.filter.period,
        )
        if scenario.has_angular_filter:
            params.angular_filter_period = scenario.angular_filter.filter.period
        side = self._add(
            "robot_side",
            RobotSide,
            params,
            model,
            q_start,
            scenario.sensor,
            p_SE_S,
            scenario.calc_seed("sensor"),
        )
        builder.Connect(
            scene.reaction_forces_port, reaction.GetInputPort("reaction_forces")
        )
        builder.Connect(scene.state_port, side.GetInputPort("robot_state"))
        builder.Connect(side.GetOutputPort("torque"), scene.actuation_port)
        self._connect(reaction, "reaction", side, "reaction")
        self._robot_side = side
        self._ports["robot"] = side.GetOutputPort("signals")
        self._ports["sensor"] = side.GetOutputPort("sensor_counters")
        if self._watched:
            truth = self._add(
                "contact_truth",
                ContactTruthSystem,
                scene.tool_body,
                scenario.has_angular_filter,
            )
            builder.Connect(
                scene.contact_results_port, truth.GetInputPort("contact_results")
            )
            self._ports["truth"] = truth.GetOutputPort("truth")
        self._export(scene.state_port, "robot_state")
        self._export(side.GetOutputPort("sensed_wrench"), "sensed_wrench")
        self._export(side.GetOutputPort("torque"), "torque")

        if scenario.scheme == "dual_proxy":
            particle_filter = self._add(
                "filter",
                ForceSpaceParticleFilter,
                scenario.filter,
                scenario.calc_seed("filter"),
            )
            for name in ("sensed_force", "velocity", "motion_force", "contact_force"):
                self._connect(side, f"mean_{name}", particle_filter, name)
            self._connect(particle_filter, "force_selection", side, "force_selection")
            for name in ("dimension", "force_direction"):
                self._ports[name] = particle_filter.GetOutputPort(name)
            self._ports["filter"] = particle_filter.GetOutputPort("counters")
            for name in ("dimension", "force_selection"):
                self._export(particle_filter.GetOutputPort(name), name)
        if scenario.has_angular_filter:
            self._add_angular_filter()

    def _add_angular_filter(self) -> None:
        """A second filter, for moments and rotations."""
        side = self._robot_side
        angular_filter = self._add(
            "angular_filter",
            ForceSpaceParticleFilter,
            self.scenario.angular_filter.filter,
            self.scenario.calc_seed("angular_filter"),
        )
        for mean, name in (
            ("sensed_moment", "sensed_force"),
            ("angular_velocity", "velocity"),
            ("motion_moment", "motion_force"),
            ("contact_moment", "contact_force"),
        ):
            self._connect(side, f"mean_{mean}", angular_filter, name)
        self._connect(angular_filter, "force_selection", side, "moment_selection")
        for name, port in (
            ("moment_dimension", angular_filter.GetOutputPort("dimension")),
            ("moment_selection", angular_filter.GetOutputPort("force_selection")),
        ):
            self._ports[name] = port
            self._export(port, name)
        self._ports["angular_filter"] = angular_filter.GetOutputPort("counters")

    def _add_device(self) -> None:
        """The device in the operator's hand, and the haptic side."""
        scenario = self.scenario
        motion = scenario.operator_motion()
        workspace_map = _core.WorkspaceMap(scenario.map)
        R = np.asarray(scenario.map.R_cw)
        points = [workspace_map.haptic_proxy(p, R)[0] for p in motion.positions]
        self._path = _core.OperatorPath(
            motion.times,
            np.transpose(points),
            "cubic" if motion.sampled else "minimum_jerk",
            np.asarray(scenario.map.R_DB) @ motion.rotations.T,
        )
        params = _core.HapticSideParams(
            proxy=scenario.haptic_proxy,
            controller=scenario.haptic_controller,
            sender=scenario.link.sender,
        )
        if scenario.scheme == "dual_proxy":
            side = self._add(
                "haptic_side", HapticSide, params, scenario.device, self._path
            )
            acting = device = side
            refused = side.GetOutputPort("device_bad_inputs")
        else:
            side = self._add("haptic_side", HapticSide, params)
            device = self._add(
                "device", SimulatedHapticDevice, self._path, scenario.device
            )
            for name in ("device_pose", "device_velocity"):
                self._connect(device, name, side, name)
            acting = self._add(
                "position_force",
                PositionForceHapticSide,
                scenario.position_force,
                scenario.control_period,
            )
            self._ports["position_force"] = acting.GetOutputPort("device_wrench")
            self._ports["position_force_link"] = acting.GetOutputPort("link_status")
            self._ports["haptic_link"] = acting.GetOutputPort("link_counters")
            refused = device.GetOutputPort("bad_inputs")
            self._connect(acting, "device_wrench", device, "device_wrench")
        self._haptic_side, self._acting_haptic_side = side, acting
        self._ports["device"] = side.GetOutputPort("signals")
        self._ports["device_bad_inputs"] = refused
        self._export(device.GetOutputPort("device_pose"), "device_pose")
        self._export(acting.GetOutputPort("device_wrench"), "device_wrench")

    def _add_link(self) -> None:
        """Both directions of the link: all that the two sides share."""
        link = self.scenario.link
        step = self.scenario.control_period
        to_robot = self._add(
            "to_robot",
            CommunicationChannel,
            link.channel,
            self.scenario.calc_seed("to_robot"),
            link.rate,
            step,
            _core.PoseMessage(),
            True,
        )
        self._connect(self._haptic_side, "message", to_robot, "message")
        self._connect(to_robot, "message", self._robot_side, "haptic_message")
        dual_proxy = self.scenario.scheme == "dual_proxy"
        to_device = self._add(
            "to_device",
            CommunicationChannel,
            link.channel,
            self.scenario.calc_seed("to_device"),
            link.rate,
            step,
            _core.PoseMessage() if dual_proxy else _core.ForceMessage(),
            True,
        )
        self._connect(
            self._robot_side,
            "message" if dual_proxy else "force_message",
            to_device,
            "message",
        )
        self._connect(
            to_device,
            "message",
            self._acting_haptic_side,
            "robot_message" if dual_proxy else "force_message",
        )
        self._ports["to_robot"] = to_robot.GetOutputPort("counters")
        self._ports["to_device"] = to_device.GetOutputPort("counters")

    def _signals(self, rows: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Returns every signal of the log from rows of the logged ports, with the
        hand's positions at their end."""
        *parts, hand = np.split(rows, self._columns, axis=1)
        data = dict(zip(self._ports, parts, strict=True))
        values = {
            name: data[side][:, where]
            for side, layout in (
                ("robot", RobotSide.layout),
                ("device", HapticSide.layout),
            )
            for name, where in layout.items()
        }
        truth = data["truth"]
        count = len(truth)
        values |= {
            "hand_position": hand,
            "contact_force": truth[:, :3],
            "contact_normal": truth[:, 3:6],
            "contact_dimension": truth[:, 6:7],
            "dimension": data.get("dimension", np.zeros((count, 1))),
            "force_direction": data.get("force_direction", np.zeros((count, 3))),
            "filter_bad_inputs": np.zeros(count),
            "filter_all_weights_zero": np.zeros(count),
        }
        if "position_force" in data:
            force = data["position_force"][:, :3]
            status, age = data["position_force_link"][:, :2].T
            values |= {
                "haptic_reference_force": force,
                "device_force": force,
                "haptic_link_status": status,
                "haptic_link_age": age,
            }
        for port, names in _COUNTERS.items():
            if port in data:
                values |= {
                    f"{port}_{name}": data[port][:, index]
                    for index, name in enumerate(names)
                }
        values["device_bad_inputs"] = data["device_bad_inputs"]
        if self.scenario.has_angular_filter:
            values |= {
                "contact_moment_dimension": truth[:, 7:8],
                "contact_rotation_axis": truth[:, 8:],
                "moment_dimension": data["moment_dimension"],
                "moment_selection": data["moment_selection"],
            }
        return {name: values[name] for name in signals(values)}


def build_station(
    scenario: Scenario, meshcat: bool = False, logged: bool = True
) -> Station:
    """Builds the diagram of a scenario, ready to simulate.

    Parameters
    ----------
    scenario : what to build; see `dual_proxy.load_scenario`.
    meshcat : whether to open a viewer and draw the run in it.
    logged : whether to note all signals in every control period.

    Raises
    ------
    ValueError
        If the parameters contradict each other, or no posture of the arm
        reaches the start.
    """
    return Station(scenario, meshcat, logged)
