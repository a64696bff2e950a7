# SPDX-License-Identifier: BSD-3-Clause
"""The separate faces in a row and the station's fused faces: the same bits."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Demultiplexer, LogVectorOutput, ZeroOrderHold

from dual_proxy import _core, systems
from dual_proxy.native import NativeTwin
from dual_proxy.panda import PandaModel, SensorReaction, add_panda_scene, p_SE_S
from dual_proxy.scenario import load_scenario
from dual_proxy.station import build_station

DURATION = 3.6
PERIOD = 1e-3

# Name in the separate wiring -> signal in the fused sides' `signals`.
HELD = {
    "torque": "torque",
    "mean_sensed_force": "mean_sensed_force",
    "mean_velocity": "mean_velocity",
    "mean_motion_force": "mean_motion_force",
    "mean_contact_force": "mean_contact_force",
}
ROBOT_STEP = {
    "motion_error": "motion_error",
    "rotation_error": "rotation_error",
    "reference_force": "reference_force",
    "reference_moment": "reference_moment",
    "motion_force": "motion_force",
    "contact_force": "force_space_force",
    "observed_energy": "observed_energy",
    "injected_damping": "injected_damping",
    "proxy_velocity": "robot_proxy_velocity",
    "force_selection": "force_selection",
}
HAPTIC_STEP = {
    "haptic_reference_force": "haptic_reference_force",
    "haptic_reference_moment": "haptic_reference_moment",
    "haptic_force_selection": "haptic_force_selection",
}


class Separate:
    """The diagram of scheme `dual_proxy` from separate faces."""

    def __init__(self, scenario):
        self.builder = DiagramBuilder()
        self.logs = {}
        robot_sender = self.add_robot(scenario)
        device_sender = self.add_device(scenario)
        self.add_channel(scenario, "to_robot", device_sender, self.robot_message)
        self.add_channel(scenario, "to_device", robot_sender, self.device_message)
        self.diagram = self.builder.Build()
        self.simulator = Simulator(self.diagram)
        context = self.simulator.get_mutable_context()
        # The arm is held until the first step, as by RobotSide.
        hold = self.hold.GetMyMutableContextFromRoot(context)
        hold.SetDiscreteState(self.start_torque)
        self.simulator.Initialize()

    def add(self, system):
        # A face as the station adds it, in C++ where that is in use.
        if isinstance(system, NativeTwin):
            count = len(self.builder.GetSystems())
            return system._join(self.builder, f"{type(system).__name__} {count}")
        return self.builder.AddSystem(system)

    def connect(self, source, output, target, port):
        self.builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def log(self, name, port):
        self.logs[name] = LogVectorOutput(port, self.builder, publish_period=PERIOD)

    def data(self, name):
        return self.logs[name].FindLog(self.simulator.get_context()).data().T

    def split(self, port):
        """Returns the first half of a six-vector."""
        halves = self.add(Demultiplexer(6, 3))
        self.builder.Connect(port, halves.get_input_port(0))
        return halves.get_output_port(0)

    def add_robot(self, scenario):
        builder, connect = self.builder, self.connect
        params = scenario.scene
        model = PandaModel(params.tool_mass, params.gravity)
        q_start = model.inverse_kinematics(
            scenario.map.p_cw, scenario.map.R_cw, scenario.controller.q_rest
        )
        self.start_torque = -model.calc(q_start, np.zeros(7)).gravity
        scene = add_panda_scene(builder, params, q_start)
        reaction = self.add(SensorReaction(scene.sensor_joint))
        sensor = self.add(
            systems.ForceTorqueSensor(
                scenario.sensor, p_SE_S, scenario.calc_seed("sensor")
            )
        )
        kinematics = self.add(systems.ArmKinematics(model))
        proxy = self.add(systems.RobotSideProxy(scenario.robot_proxy))
        controller = self.add(
            systems.OperationalSpaceController(scenario.controller, model)
        )
        self.hold = self.add(ZeroOrderHold(PERIOD, 7))
        particle_filter = self.add(
            systems.ForceSpaceParticleFilter(
                scenario.filter, scenario.calc_seed("filter")
            )
        )
        sender = self.add(systems.PoseSender(scenario.link.sender))

        builder.Connect(
            scene.reaction_forces_port, reaction.GetInputPort("reaction_forces")
        )
        builder.Connect(scene.state_port, kinematics.GetInputPort("robot_state"))
        builder.Connect(scene.state_port, controller.GetInputPort("robot_state"))
        builder.Connect(self.hold.get_output_port(), scene.actuation_port)
        builder.Connect(controller.GetOutputPort("torque"), self.hold.get_input_port())
        connect(reaction, "reaction", sensor, "reaction")
        connect(kinematics, "robot_velocity", sensor, "robot_velocity")
        for system, port in (
            (sensor, "robot_pose"),
            (proxy, "robot_pose"),
            (sender, "pose"),
        ):
            connect(kinematics, "robot_pose", system, port)
        for system in (proxy, controller):
            connect(sensor, "sensed_wrench", system, "sensed_wrench")
            connect(sensor, "ready", system, "sensor_ready")
        for system in (proxy, controller, sender):
            connect(particle_filter, "force_selection", system, "force_selection")
        for name in (
            "motion_error",
            "rotation_error",
            "reference_force",
            "reference_moment",
            "proxy_velocity",
            "proxy_acceleration",
        ):
            connect(proxy, name, controller, name)
        for name, port in (
            ("sensed_force", self.split(sensor.GetOutputPort("sensed_wrench"))),
            ("velocity", self.split(kinematics.GetOutputPort("robot_velocity"))),
            ("motion_force", controller.GetOutputPort("motion_force")),
            ("contact_force", controller.GetOutputPort("contact_force")),
        ):
            mean = self.add(systems.WindowMean(scenario.filter.period, PERIOD))
            builder.Connect(port, mean.GetInputPort("value"))
            connect(mean, "mean", particle_filter, name)
            self.log(f"mean_{name}", mean.GetOutputPort("mean"))

        self.log("torque", self.hold.get_output_port())
        self.log("robot_state", scene.state_port)
        self.log("robot_link_status", proxy.GetOutputPort("link_status"))
        for name in ("motion_error", "rotation_error"):
            self.log(name, proxy.GetOutputPort(name))
        for name in ("reference_force", "reference_moment"):
            self.log(name, proxy.GetOutputPort(name))
        for name in (
            "motion_force",
            "contact_force",
            "observed_energy",
            "injected_damping",
        ):
            self.log(name, controller.GetOutputPort(name))
        for name in ("dimension", "force_direction", "force_selection"):
            self.log(name, particle_filter.GetOutputPort(name))
        self.log("sensed_wrench", sensor.GetOutputPort("sensed_wrench"))
        self.log("proxy_velocity", proxy.GetOutputPort("proxy_velocity"))
        self.robot_message = proxy.GetInputPort("haptic_message")
        return sender

    def add_device(self, scenario):
        motion = scenario.operator_motion()
        workspace_map = _core.WorkspaceMap(scenario.map)
        R = np.asarray(scenario.map.R_cw)
        points = [workspace_map.haptic_proxy(p, R)[0] for p in motion.positions]
        path = _core.OperatorPath(motion.times, np.transpose(points), "minimum_jerk")
        device = self.add(systems.SimulatedHapticDevice(path, scenario.device))
        proxy = self.add(systems.HapticSideProxy(scenario.haptic_proxy))
        controller = self.add(systems.HapticController(scenario.haptic_controller))
        hold = self.add(ZeroOrderHold(PERIOD, 6))
        sender = self.add(systems.PoseSender(scenario.link.sender))
        connect = self.connect
        connect(device, "device_pose", proxy, "device_pose")
        connect(device, "device_pose", sender, "pose")
        connect(device, "device_velocity", controller, "device_velocity")
        for name in ("reference_force", "reference_moment", "force_selection"):
            connect(proxy, name, controller, name)
            self.log(f"haptic_{name}", proxy.GetOutputPort(name))
        self.builder.Connect(
            controller.GetOutputPort("device_wrench"), hold.get_input_port()
        )
        self.builder.Connect(
            hold.get_output_port(), device.GetInputPort("device_wrench")
        )
        self.log("haptic_link_status", proxy.GetOutputPort("link_status"))
        self.log("device_wrench", hold.get_output_port())
        self.log("device_velocity", device.GetOutputPort("device_velocity"))
        self.device_message = proxy.GetInputPort("robot_message")
        return sender

    def add_channel(self, scenario, name, sender, target):
        link = scenario.link
        channel = self.add(
            systems.CommunicationChannel(
                link.channel, scenario.calc_seed(name), link.rate, PERIOD
            )
        )
        self.connect(sender, "message", channel, "message")
        self.builder.Connect(channel.GetOutputPort("message"), target)


def logged(station):
    """The station's log, by port."""
    context = station.simulator.get_context()
    rows = station._sink.FindLog(context).data().T
    sizes = [port.size() for port in station._ports.values()]
    assert rows.shape[1] == sum(sizes)
    parts = np.split(rows, np.cumsum(sizes)[:-1], axis=1)
    return dict(zip(station._ports, parts, strict=True))


class Fused:
    """The station's log, by signal."""

    def __init__(self, station):
        self.station = station
        data = logged(station)
        self.logs = {name: data[name] for name in ("dimension", "force_direction")}
        for name, side in (
            ("robot", systems.RobotSide),
            ("device", systems.HapticSide),
        ):
            layout = side.layout
            assert data[name].shape[1] == max(s.stop for s in layout.values())
            for signal, where in layout.items():
                self.logs[signal] = data[name][:, where]

    def data(self, name):
        return self.logs[name]


def baseline_data(station):
    """What the tests want of the baseline's log."""
    data = logged(station)
    layout = systems.RobotSide.layout
    return {
        "sensed_force": data["robot"][:, layout["sensed_force"]],
        "force_selection": data["robot"][:, layout["force_selection"]],
        "bad_inputs": data["robot"][:, layout["robot_bad_inputs"]],
        "acting": data["position_force"],
        "link": data["position_force_link"],
    }


@pytest.fixture(scope="module")
def runs():
    scenario = load_scenario("plane").with_overrides({"link.delay": 0.05})
    assert scenario.control_period == PERIOD
    station = build_station(scenario)
    station.advance_to(DURATION)
    separate = Separate(scenario)
    separate.simulator.AdvanceTo(DURATION)
    return Fused(station), separate


def test_the_run_goes_into_contact(runs):
    _, separate = runs
    assert separate.data("dimension")[-1] == 1
    assert separate.data("force_direction")[-1, 2] < -0.9
    assert np.max(np.abs(separate.data("device_wrench"))) > 1
    assert np.min(separate.data("mean_sensed_force")[:, 2]) < -2


def test_plant_and_device_move_alike(runs):
    fused, separate = runs
    state = separate.data("robot_state")
    # `signals` holds the measurements of the step before.
    np.testing.assert_array_equal(state[:-1, :7], fused.data("joint_position")[1:])
    np.testing.assert_array_equal(state[:-1, 7:], fused.data("joint_velocity")[1:])
    np.testing.assert_array_equal(
        separate.data("device_velocity")[:-1, :3], fused.data("device_velocity")[1:]
    )


@pytest.mark.parametrize("name", HELD)
def test_held_signals_are_the_same(runs, name):
    fused, separate = runs
    # Row 0 is before any step, where `signals` is zero and the torque is not.
    mine, theirs = separate.data(name)[1:], fused.data(HELD[name])[1:]
    assert np.any(mine != mine[0])
    np.testing.assert_array_equal(mine, theirs)


def test_device_wrench_is_the_same(runs):
    fused, separate = runs
    np.testing.assert_array_equal(
        separate.data("device_wrench"),
        np.hstack([fused.data("device_force"), fused.data("device_moment")]),
    )


def test_filter_is_the_same(runs):
    fused, separate = runs
    for name in ("dimension", "force_direction"):
        np.testing.assert_array_equal(separate.data(name), fused.data(name))


# With feedthrough, a row holds what the step at its time gives; `signals` holds
# what the step before has given.
@pytest.mark.parametrize("name", [*ROBOT_STEP, *HAPTIC_STEP])
def test_steps_are_the_same(runs, name):
    fused, separate = runs
    mine = separate.data(name)[:-1]
    theirs = fused.data({**ROBOT_STEP, **HAPTIC_STEP}[name])[1:]
    np.testing.assert_array_equal(mine, theirs)


def test_sensed_wrench_is_the_same(runs):
    fused, separate = runs
    # The sensor's last step came before the side's.
    np.testing.assert_array_equal(
        separate.data("sensed_wrench")[:-1],
        np.hstack([fused.data("sensed_force"), fused.data("sensed_moment")])[1:],
    )
    assert np.all(np.any(separate.data("sensed_wrench")[510:] != 0, axis=1))


@pytest.mark.parametrize("side", ["robot", "haptic"])
def test_link_status_is_the_same(runs, side):
    fused, separate = runs
    status = separate.data(f"{side}_link_status")[:-1]
    fields = list(systems.LINK_STATUS_FIELDS)
    for field, name in (("status", "status"), ("age", "age"), ("dropped", "dropped")):
        np.testing.assert_array_equal(
            status[:, [fields.index(field)]],
            fused.data(f"{side}_link_{name}")[1:],
            err_msg=field,
        )
    assert status[-1, 0] == int(_core.LinkStatus.CONNECTED)


def test_no_input_was_refused(runs):
    fused, _ = runs
    for side in ("robot", "haptic"):
        np.testing.assert_array_equal(fused.data(f"{side}_bad_inputs"), 0)


def test_exported_outputs_are_those_of_the_log(runs):
    fused, separate = runs
    station = fused.station
    context = station.simulator.get_context()
    root = separate.simulator.get_context()
    for name in ("torque", "device_wrench", "dimension", "force_selection"):
        value = station.diagram.GetOutputPort(name).Eval(context)
        port = separate.logs[name].get_input_port()
        theirs = port.Eval(separate.logs[name].GetMyContextFromRoot(root))
        np.testing.assert_array_equal(value, theirs, err_msg=name)
    sensed = separate.logs["sensed_wrench"]
    np.testing.assert_array_equal(
        station.diagram.GetOutputPort("sensed_wrench").Eval(context),
        sensed.get_input_port().Eval(sensed.GetMyContextFromRoot(root)),
    )


# The two-channel baseline: its robot side is the same system, its link carries
# forces back.


@pytest.fixture(scope="module")
def baseline():
    scenario = load_scenario("plane").with_overrides(
        {"link.delay": 0.05, "scheme": "position_force"}
    )
    station = build_station(scenario)
    station.advance_to(DURATION)
    return station


@pytest.fixture(scope="module")
def baseline_log(baseline):
    return baseline_data(baseline)


def sent_force(scenario, data, step):
    """The mean over a message interval that a message of that step holds."""
    interval = round(1 / (scenario.link.rate * PERIOD))
    # `signals` shows the measurements of a step in the row after it.
    first = max(step - interval + 1, 0)
    return np.mean(data["sensed_force"][first + 1 : step + 2], axis=0)


def test_baseline_presses_and_the_hand_feels_it(baseline, baseline_log):
    data = baseline_log
    assert np.min(data["sensed_force"][:, 2]) < -2
    assert np.max(data["acting"][:, 2]) > 1
    np.testing.assert_array_equal(data["bad_inputs"], 0)
    assert data["link"][-1, 0] == int(_core.LinkStatus.CONNECTED)
    # No filter: nothing selects a force space.
    np.testing.assert_array_equal(data["force_selection"], 0)
    with pytest.raises(RuntimeError, match="filter"):
        baseline.diagram.GetSubsystemByName("filter")


def test_baseline_link_carries_the_sensed_force(baseline, baseline_log):
    context = baseline.simulator.get_context()
    channel = baseline.diagram.GetSubsystemByName("to_device")
    message = systems.get_value(
        channel.GetOutputPort("message").EvalAbstract(
            channel.GetMyContextFromRoot(context)
        )
    )
    assert isinstance(message, _core.ForceMessage)
    rate, delay = baseline.scenario.link.rate, baseline.scenario.link.delay
    assert message.sequence == round(message.send_time * rate)
    age = context.get_time() - message.send_time
    assert delay <= age + 1e-9 <= delay + 1 / rate + 2 * PERIOD
    np.testing.assert_allclose(
        message.force,
        sent_force(baseline.scenario, baseline_log, round(message.send_time / PERIOD)),
        rtol=0,
        atol=1e-12,
    )
    assert np.linalg.norm(message.force) > 2
    channel = baseline.diagram.GetSubsystemByName("to_robot")
    message = systems.get_value(
        channel.GetOutputPort("message").EvalAbstract(
            channel.GetMyContextFromRoot(context)
        )
    )
    assert isinstance(message, _core.PoseMessage)


def test_baseline_force_on_the_hand_is_the_late_sensed_force(baseline, baseline_log):
    data = baseline_log
    scenario = baseline.scenario
    scale = scenario.position_force.force_scale
    assert scale == 0.6
    R_DB = np.asarray(scenario.map.R_DB)
    # Row by row, from the robot's log alone: the force of the newest message
    # that a step after its sending and the delay can have.
    interval = round(1 / (scenario.link.rate * PERIOD))
    lag = round(scenario.link.delay / PERIOD) + 2
    acting = data["acting"][:, :3]
    expected = np.zeros_like(acting)
    limit = scenario.position_force.max_force
    for row in range(len(acting)):
        sent = (row - lag) // interval * interval
        if sent >= 0:
            force = -scale * R_DB @ sent_force(scenario, data, sent)
            expected[row] = force * min(1.0, limit / max(np.linalg.norm(force), 1e-12))
    np.testing.assert_allclose(acting, expected, rtol=0, atol=1e-12)


def test_baseline_is_the_same_every_time(baseline):
    again = build_station(baseline.scenario)
    again.advance_to(1.0)
    first = logged(baseline)
    for name, data in logged(again).items():
        np.testing.assert_array_equal(data, first[name][: len(data)], err_msg=name)
