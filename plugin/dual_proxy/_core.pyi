"""
The Drake-free algorithms of dual_proxy.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import typing
__all__: list[str] = ['AngularFilterMeans', 'AngularFilterParams', 'ArmModel', 'ArmModelParams', 'BoxParams', 'CommunicationChannel', 'CommunicationChannelParams', 'CommunicationChannelState', 'ContactHistory', 'ContactHistoryParams', 'ContactHistoryState', 'ContactScene', 'ContactSceneParams', 'ContactSurface', 'ContactSurfaceParams', 'FilterMeans', 'FilterTrial', 'FilterTrialMetrics', 'FilterTrialParams', 'ForceCommunicationChannel', 'ForceCommunicationChannelState', 'ForceLoop', 'ForceLoopParams', 'ForceLoopState', 'ForceMessage', 'ForceSender', 'ForceSenderState', 'ForceSpaceParticleFilter', 'ForceSpaceParticleFilterAlgorithm', 'ForceSpaceParticleFilterParams', 'ForceSpaceParticleFilterState', 'ForceSpaceParticleFilterThresholds', 'ForceTorqueSensor', 'ForceTorqueSensorParams', 'ForceTorqueSensorState', 'FrictionConeParams', 'HapticController', 'HapticControllerParams', 'HapticControllerState', 'HapticSide', 'HapticSideOutput', 'HapticSideParams', 'HapticSideProxy', 'HapticSideProxyOutput', 'HapticSideProxyParams', 'HapticSideProxyState', 'HapticSideState', 'LinkMonitor', 'LinkMonitorParams', 'LinkMonitorState', 'LinkParams', 'LinkStatus', 'OperationalSpaceController', 'OperationalSpaceControllerOutput', 'OperationalSpaceControllerParams', 'OperationalSpaceControllerState', 'OperatorParams', 'OperatorPath', 'OperatorPathParams', 'PandaSceneParams', 'PointRobot', 'PointRobotParams', 'PointRobotState', 'Pose', 'PoseInterpolatorParams', 'PoseMessage', 'PoseSender', 'PoseSenderParams', 'PoseSenderState', 'PositionForceHapticSide', 'PositionForceHapticSideParams', 'PositionForceHapticSideState', 'RobotSide', 'RobotSideOutput', 'RobotSideParams', 'RobotSideProxy', 'RobotSideProxyOutput', 'RobotSideProxyParams', 'RobotSideProxyState', 'RobotSideState', 'Scenario', 'ScenarioError', 'SceneContact', 'SelectionBlend', 'SelectionBlendParams', 'SelectionBlendState', 'SimulatedHapticDevice', 'SimulatedHapticDeviceParams', 'SimulatedHapticDeviceState', 'SurfaceContact', 'TimeDomainPassivity', 'TimeDomainPassivityParams', 'TimeDomainPassivityState', 'TrajectoryLimiter', 'TrajectoryLimiterParams', 'TrajectoryLimiterState', 'VirtualSpring', 'VirtualSpringParams', 'VirtualSpringState', 'Waypoint', 'WindowMean', 'WindowMeanState', 'WorkspaceLimits', 'WorkspaceLimitsParams', 'WorkspaceMap', 'WorkspaceMapParams', 'calc_operational_space_inertia', 'rate_limit', 'run_filter_trial', 'saturate']
class Pose:
    """
    A pose: X_BE of the tool point in the robot base frame, or X_DH of the handle in the device base frame.
    """
    def __copy__(self) -> Pose:
        ...
    def __deepcopy__(self, memo: dict) -> Pose:
        ...
    def __getstate__(self) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]]:
        ...
    def __init__(self, p: typing.Any = ..., R: typing.Any = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    @property
    def R(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Rotation matrix, (3, 3).
        """
    @R.setter
    def R(self, arg1: typing.Any) -> None:
        ...
    @property
    def p(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Position, (3,), m.
        """
    @p.setter
    def p(self, arg1: typing.Any) -> None:
        ...
class PoseMessage:
    """
    What the dual proxy sends over the link, in both directions: a pose and the selections
    of force and moment space (which stay zero from the haptic side).
    """
    def __copy__(self) -> PoseMessage:
        ...
    def __deepcopy__(self, memo: dict) -> PoseMessage:
        ...
    def __getstate__(self) -> tuple[int, float, Pose, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]]:
        ...
    def __init__(self, sequence: typing.SupportsInt | typing.SupportsIndex = -1, send_time: typing.SupportsFloat | typing.SupportsIndex = 0.0, pose: Pose = ..., force_selection: typing.Any = ..., moment_selection: typing.Any = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    def is_valid(self) -> bool:
        """
        True if the message may be acted on: finite, its pose a pose, its selections projections.
        """
    @property
    def force_selection(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Omega_f, (3, 3), orthogonal projection, in B.
        """
    @force_selection.setter
    def force_selection(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_selection(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Omega_tau, (3, 3), orthogonal projection, in B.
        """
    @moment_selection.setter
    def moment_selection(self, arg1: typing.Any) -> None:
        ...
    @property
    def pose(self) -> Pose:
        """
        Pose: X_DH or X_BE.
        """
    @pose.setter
    def pose(self, arg0: Pose) -> None:
        ...
    @property
    def send_time(self) -> float:
        """
        Sender's clock, s.
        """
    @send_time.setter
    def send_time(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sequence(self) -> int:
        """
        0, 1, 2, ...; -1: nothing has come yet.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class ForceMessage:
    """
    What the two-channel baseline sends from the robot to the device.
    """
    def __copy__(self) -> ForceMessage:
        ...
    def __deepcopy__(self, memo: dict) -> ForceMessage:
        ...
    def __getstate__(self) -> tuple[int, float, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]]:
        ...
    def __init__(self, sequence: typing.SupportsInt | typing.SupportsIndex = -1, send_time: typing.SupportsFloat | typing.SupportsIndex = 0.0, force: typing.Any = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    def is_valid(self) -> bool:
        """
        True if the message may be acted on: finite.
        """
    @property
    def force(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Robot on its environment, (3,), N, in B.
        """
    @force.setter
    def force(self, arg1: typing.Any) -> None:
        ...
    @property
    def send_time(self) -> float:
        """
        Sender's clock, s.
        """
    @send_time.setter
    def send_time(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sequence(self) -> int:
        """
        0, 1, 2, ...; -1: nothing has come yet.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class PoseSenderParams:
    """
    Parameters of a sender.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('rate', 'average', 'period')
    fields: typing.ClassVar[dict] = {'rate': 'Hz, in (0, 1/period], default 50', 'average': 'send the mean since the last message, not the newest sample, default true', 'period': 's, > 0, between samples, default 0.001'}
    def __copy__(self) -> PoseSenderParams:
        ...
    def __deepcopy__(self, memo: dict) -> PoseSenderParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def average(self) -> bool:
        """
        send the mean since the last message, not the newest sample, default true
        """
    @average.setter
    def average(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, between samples, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def rate(self) -> float:
        """
        Hz, in (0, 1/period], default 50
        """
    @rate.setter
    def rate(self, arg1: typing.Any) -> None:
        ...
class PoseSenderState:
    """
    Memory of a sender.
    """
    def __copy__(self) -> PoseSenderState:
        ...
    def __deepcopy__(self, memo: dict) -> PoseSenderState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Samples refused: not finite, or no pose.
        """
    @property
    def message(self) -> PoseMessage:
        """
        The newest message; sequence -1 before the first. A copy.
        """
class ForceSenderState:
    """
    Memory of a sender.
    """
    def __copy__(self) -> ForceSenderState:
        ...
    def __deepcopy__(self, memo: dict) -> ForceSenderState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Samples refused: not finite, or no pose.
        """
    @property
    def message(self) -> ForceMessage:
        """
        The newest message; sequence -1 before the first. A copy.
        """
class PoseSender:
    """
    Turns poses at the control rate into messages at the link's rate: mean position and
    chordal-mean rotation since the last message, the latest selections.
    """
    def __init__(self, params: PoseSenderParams = ...) -> None:
        ...
    def make_state(self) -> PoseSenderState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, position: typing.Any, rotation: typing.Any, force_selection: typing.Any, moment_selection: typing.Any, state: PoseSenderState) -> PoseMessage:
        """
        Takes one sample: time (s), position (3,) m, rotation (3, 3), selections (3, 3) in B.
        Returns the newest message; it is a new one when its sequence has grown.
        """
    @property
    def params(self) -> PoseSenderParams:
        ...
class ForceSender:
    """
    Turns forces at the control rate into messages at the link's rate.
    """
    def __init__(self, params: PoseSenderParams = ...) -> None:
        ...
    def make_state(self) -> ForceSenderState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, force: typing.Any, state: ForceSenderState) -> ForceMessage:
        """
        Takes one sample: time (s), force (3,) N, in B. Returns the newest message.
        """
    @property
    def params(self) -> PoseSenderParams:
        ...
class CommunicationChannelParams:
    """
    Parameters of a simulated link, one way.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('delay', 'jitter', 'loss', 'reordering')
    fields: typing.ClassVar[dict] = {'delay': 's, one way, >= 0, default 0', 'jitter': 's, >= 0: standard deviation of the normal whose absolute value is added to the delay, default 0', 'loss': 'probability of loss, in [0, 1), default 0', 'reordering': 'whether a message may overtake another, default true'}
    def __copy__(self) -> CommunicationChannelParams:
        ...
    def __deepcopy__(self, memo: dict) -> CommunicationChannelParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def delay(self) -> float:
        """
        s, one way, >= 0, default 0
        """
    @delay.setter
    def delay(self, arg1: typing.Any) -> None:
        ...
    @property
    def jitter(self) -> float:
        """
        s, >= 0: standard deviation of the normal whose absolute value is added to the delay, default 0
        """
    @jitter.setter
    def jitter(self, arg1: typing.Any) -> None:
        ...
    @property
    def loss(self) -> float:
        """
        probability of loss, in [0, 1), default 0
        """
    @loss.setter
    def loss(self, arg1: typing.Any) -> None:
        ...
    @property
    def reordering(self) -> bool:
        """
        whether a message may overtake another, default true
        """
    @reordering.setter
    def reordering(self, arg1: typing.Any) -> None:
        ...
class CommunicationChannelState:
    """
    What is under way in a channel, its generator and counters.
    """
    def __copy__(self) -> CommunicationChannelState:
        ...
    def __deepcopy__(self, memo: dict) -> CommunicationChannelState:
        ...
    @property
    def in_flight(self) -> int:
        """
        Messages under way, as of the last send().
        """
    @property
    def lost(self) -> int:
        """
        Of these, lost on the way.
        """
    @property
    def overflow(self) -> int:
        """
        Of these, pushed out of a full channel.
        """
    @property
    def refused(self) -> int:
        """
        Messages refused because not finite.
        """
    @property
    def sent(self) -> int:
        """
        Messages sent.
        """
class CommunicationChannel:
    """
    A link with delay, jitter, loss and reordering, one way, for PoseMessages.
    """
    def __init__(self, params: CommunicationChannelParams = ...) -> None:
        ...
    def make_state(self, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> CommunicationChannelState:
        """
        An empty channel. The same seed gives the same bits.
        """
    def receive(self, time: typing.SupportsFloat | typing.SupportsIndex, state: CommunicationChannelState) -> PoseMessage:
        """
        The message that arrived last at `time` (s, not before the last send), or the empty one.
        """
    def send(self, time: typing.SupportsFloat | typing.SupportsIndex, message: PoseMessage, state: CommunicationChannelState) -> None:
        """
        Offers the sender's newest message at `time` (s, not decreasing); one that was offered
        before (by its sequence) is ignored.
        """
    @property
    def params(self) -> CommunicationChannelParams:
        ...
class ForceCommunicationChannelState:
    """
    What is under way in a channel, its generator and counters.
    """
    def __copy__(self) -> ForceCommunicationChannelState:
        ...
    def __deepcopy__(self, memo: dict) -> ForceCommunicationChannelState:
        ...
    @property
    def in_flight(self) -> int:
        """
        Messages under way, as of the last send().
        """
    @property
    def lost(self) -> int:
        """
        Of these, lost on the way.
        """
    @property
    def overflow(self) -> int:
        """
        Of these, pushed out of a full channel.
        """
    @property
    def refused(self) -> int:
        """
        Messages refused because not finite.
        """
    @property
    def sent(self) -> int:
        """
        Messages sent.
        """
class ForceCommunicationChannel:
    """
    The same link for ForceMessages.
    """
    def __init__(self, params: CommunicationChannelParams = ...) -> None:
        ...
    def make_state(self, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> ForceCommunicationChannelState:
        """
        An empty channel. The same seed gives the same bits.
        """
    def receive(self, time: typing.SupportsFloat | typing.SupportsIndex, state: ForceCommunicationChannelState) -> ForceMessage:
        """
        The message that arrived last at `time` (s, not before the last send), or the empty one.
        """
    def send(self, time: typing.SupportsFloat | typing.SupportsIndex, message: ForceMessage, state: ForceCommunicationChannelState) -> None:
        """
        Offers the sender's newest message at `time` (s, not decreasing); one that was offered
        before (by its sequence) is ignored.
        """
    @property
    def params(self) -> CommunicationChannelParams:
        ...
class LinkStatus(enum.IntEnum):
    """
    What a receiver knows about its link.
    """
    CONNECTED: typing.ClassVar[LinkStatus]
    LOST: typing.ClassVar[LinkStatus]
    WAITING: typing.ClassVar[LinkStatus]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class LinkMonitorParams:
    """
    Parameters of LinkMonitor.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('timeout', 'max_age', 'spike_threshold')
    fields: typing.ClassVar[dict] = {'timeout': 's, > 0: silence after which the link is lost, default 0.5', 'max_age': 's, > 0: older messages are dropped, default 5', 'spike_threshold': 's, > 0: a message this much later than the fastest is a latency spike, default 0.1'}
    def __copy__(self) -> LinkMonitorParams:
        ...
    def __deepcopy__(self, memo: dict) -> LinkMonitorParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def max_age(self) -> float:
        """
        s, > 0: older messages are dropped, default 5
        """
    @max_age.setter
    def max_age(self, arg1: typing.Any) -> None:
        ...
    @property
    def spike_threshold(self) -> float:
        """
        s, > 0: a message this much later than the fastest is a latency spike, default 0.1
        """
    @spike_threshold.setter
    def spike_threshold(self, arg1: typing.Any) -> None:
        ...
    @property
    def timeout(self) -> float:
        """
        s, > 0: silence after which the link is lost, default 0.5
        """
    @timeout.setter
    def timeout(self, arg1: typing.Any) -> None:
        ...
class LinkMonitorState:
    """
    State and counters of LinkMonitor.
    """
    def __copy__(self) -> LinkMonitorState:
        ...
    def __deepcopy__(self, memo: dict) -> LinkMonitorState:
        ...
    @property
    def age(self) -> float:
        """
        Now minus send time of the message in use, s.
        """
    @property
    def bad_inputs(self) -> int:
        """
        Messages refused: not finite or not valid.
        """
    @property
    def dropped(self) -> int:
        """
        Messages refused: too old or out of order.
        """
    @property
    def gaps(self) -> int:
        """
        Sequence numbers skipped.
        """
    @property
    def last_arrival_time(self) -> float:
        """
        Of the message in use, s.
        """
    @property
    def last_send_time(self) -> float:
        """
        Of the message in use, s, sender's clock.
        """
    @property
    def last_sequence(self) -> int:
        """
        Of the message in use; -1 before the first.
        """
    @property
    def losses(self) -> int:
        """
        Times the link was lost.
        """
    @property
    def received(self) -> int:
        """
        Messages accepted.
        """
    @property
    def spikes(self) -> int:
        """
        Messages that came unusually late.
        """
    @property
    def status(self) -> LinkStatus:
        """
        LinkStatus.
        """
class LinkMonitor:
    """
    Decides which messages may be acted on, and whether the link is alive.
    """
    def __init__(self, params: LinkMonitorParams = ...) -> None:
        ...
    def make_state(self) -> LinkMonitorState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, sequence: typing.SupportsInt | typing.SupportsIndex, send_time: typing.SupportsFloat | typing.SupportsIndex, valid: bool, state: LinkMonitorState) -> bool:
        """
        Looks at the newest message; call it every tick. Returns True if it is fresh and to be used.
        """
    @property
    def params(self) -> LinkMonitorParams:
        ...
class WorkspaceMapParams:
    """
    How the device's workspace lies in the robot's.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('R_DB', 'p_cw', 'R_cw', 'scale')
    fields: typing.ClassVar[dict] = {'R_DB': '(3, 3), rotation from the robot base frame B to the device base frame D, default identity', 'p_cw': "(3,), m, in B: robot position at the device's home, default 0", 'R_cw': "(3, 3), R_BE at the device's home, default identity", 'scale': 'metres of the robot per metre of the device, > 0, default 2.5'}
    def __copy__(self) -> WorkspaceMapParams:
        ...
    def __deepcopy__(self, memo: dict) -> WorkspaceMapParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def R_DB(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), rotation from the robot base frame B to the device base frame D, default identity
        """
    @R_DB.setter
    def R_DB(self, arg1: typing.Any) -> None:
        ...
    @property
    def R_cw(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), R_BE at the device's home, default identity
        """
    @R_cw.setter
    def R_cw(self, arg1: typing.Any) -> None:
        ...
    @property
    def p_cw(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B: robot position at the device's home, default 0
        """
    @p_cw.setter
    def p_cw(self, arg1: typing.Any) -> None:
        ...
    @property
    def scale(self) -> float:
        """
        metres of the robot per metre of the device, > 0, default 2.5
        """
    @scale.setter
    def scale(self, arg1: typing.Any) -> None:
        ...
class WorkspaceMap:
    """
    The map between the device's and the robot's workspace, eq. (1)-(3).
    
        x_pr = p_cw + s R_DB^T x_h        R_pr = R_DB^T R_h R_DB R_cw
        x_ph = R_DB (x_r - p_cw) / s      R_ph = R_DB R_r R_cw^T R_DB^T
        Omega_h = R_DB Omega R_DB^T
    """
    @typing.overload
    def __init__(self, params: WorkspaceMapParams) -> None:
        ...
    @typing.overload
    def __init__(self, *, R_DB: typing.Any = ..., p_cw: typing.Any = ..., R_cw: typing.Any = ..., scale: typing.SupportsFloat | typing.SupportsIndex = 2.5) -> None:
        """
        R_DB: (3, 3); p_cw: (3,), m, in B; R_cw: (3, 3); scale > 0. Raises ValueError that names
        the one that has another shape, is no rotation, not finite or out of range.
        """
    def haptic_proxy(self, x_r: typing.Any, R_r: typing.Any) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]]:
        """
        Haptic proxy of a robot pose: x_r (3,), m, in B, and R_r (3, 3).
        Returns (x_ph, R_ph): (3,), m, and (3, 3), in D.
        """
    def haptic_selection(self, Omega: typing.Any) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        A selection (3, 3) in B, for the device: (3, 3), in D.
        """
    def robot_proxy(self, x_h: typing.Any, R_h: typing.Any) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]]:
        """
        Robot proxy of a device pose: x_h (3,), m, in D, from home, and R_h (3, 3).
        Returns (x_pr, R_pr): (3,), m, and (3, 3), in B.
        """
    @property
    def params(self) -> WorkspaceMapParams:
        ...
class WorkspaceLimitsParams:
    """
    Where the robot proxy may go.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('shape', 'center', 'half_size', 'radius', 'half_height')
    fields: typing.ClassVar[dict] = {'shape': '"none", "box", "sphere" or "cylinder" (about B\'s z), default "none"', 'center': '(3,), m, in B, default 0', 'half_size': 'box: half of each side, (3,), m, >= 0, default 0.5', 'radius': 'sphere and cylinder: m, > 0, default 0.5', 'half_height': 'cylinder: m, >= 0, default 0.5'}
    def __copy__(self) -> WorkspaceLimitsParams:
        ...
    def __deepcopy__(self, memo: dict) -> WorkspaceLimitsParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def center(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B, default 0
        """
    @center.setter
    def center(self, arg1: typing.Any) -> None:
        ...
    @property
    def half_height(self) -> float:
        """
        cylinder: m, >= 0, default 0.5
        """
    @half_height.setter
    def half_height(self, arg1: typing.Any) -> None:
        ...
    @property
    def half_size(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        box: half of each side, (3,), m, >= 0, default 0.5
        """
    @half_size.setter
    def half_size(self, arg1: typing.Any) -> None:
        ...
    @property
    def radius(self) -> float:
        """
        sphere and cylinder: m, > 0, default 0.5
        """
    @radius.setter
    def radius(self, arg1: typing.Any) -> None:
        ...
    @property
    def shape(self) -> str:
        """
        "none", "box", "sphere" or "cylinder" (about B's z), default "none"
        """
    @shape.setter
    def shape(self, arg1: typing.Any) -> None:
        ...
class WorkspaceLimits:
    """
    Keeps positions inside a convex workspace.
    """
    def __init__(self, params: WorkspaceLimitsParams = ...) -> None:
        ...
    def clamp(self, p: typing.Any) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        The nearest point inside, (3,), m, in B.
        """
    def contains(self, p: typing.Any) -> bool:
        """
        Whether p, (3,), m, in B, is inside.
        """
    @property
    def params(self) -> WorkspaceLimitsParams:
        ...
class TrajectoryLimiterParams:
    """
    Limits of the motion of the robot proxy, per axis of B.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('max_velocity', 'max_acceleration', 'max_angular_velocity', 'max_angular_acceleration', 'period')
    fields: typing.ClassVar[dict] = {'max_velocity': 'm/s, > 0, default 0.2', 'max_acceleration': 'm/s^2, > 0, default 10', 'max_angular_velocity': 'rad/s, > 0, default 1', 'max_angular_acceleration': 'rad/s^2, > 0, default 20', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> TrajectoryLimiterParams:
        ...
    def __deepcopy__(self, memo: dict) -> TrajectoryLimiterParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def max_acceleration(self) -> float:
        """
        m/s^2, > 0, default 10
        """
    @max_acceleration.setter
    def max_acceleration(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_angular_acceleration(self) -> float:
        """
        rad/s^2, > 0, default 20
        """
    @max_angular_acceleration.setter
    def max_angular_acceleration(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_angular_velocity(self) -> float:
        """
        rad/s, > 0, default 1
        """
    @max_angular_velocity.setter
    def max_angular_velocity(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_velocity(self) -> float:
        """
        m/s, > 0, default 0.2
        """
    @max_velocity.setter
    def max_velocity(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
class TrajectoryLimiterState:
    """
    The limited motion, in B.
    """
    def __copy__(self) -> TrajectoryLimiterState:
        ...
    def __deepcopy__(self, memo: dict) -> TrajectoryLimiterState:
        ...
    @property
    def a(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), m/s^2.
        """
    @property
    def alpha(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), rad/s^2.
        """
    @property
    def bad_inputs(self) -> int:
        """
        Targets refused.
        """
    @property
    def pose(self) -> Pose:
        """
        Pose. A copy.
        """
    @property
    def v(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), m/s.
        """
    @property
    def w(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), rad/s.
        """
class TrajectoryLimiter:
    """
    Moves a pose towards a target that may change every tick, within limits of velocity and
    acceleration: the time-optimal way of every axis, on its own.
    """
    def __init__(self, params: TrajectoryLimiterParams = ...) -> None:
        ...
    def make_state(self, position: typing.Any, rotation: typing.Any) -> TrajectoryLimiterState:
        """
        At rest at a pose: (3,), m, and (3, 3), in B.
        """
    def stop(self, state: TrajectoryLimiterState) -> None:
        """
        Advances by one period, braking to rest.
        """
    def update(self, position: typing.Any, rotation: typing.Any, state: TrajectoryLimiterState, velocity: typing.Any = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)) -> None:
        """
        Advances by one period towards a target: (3,), m, and (3, 3), in B, which moves with
        `velocity`, (6,) [linear; angular], m/s, rad/s.
        """
    @property
    def params(self) -> TrajectoryLimiterParams:
        ...
class VirtualSpringParams:
    """
    Parameters of VirtualSpring; of moments with N m and rad.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'stiffness': 'N/m, >= 0, default 500', 'max_force': 'N, >= 0, default 20', 'rate': 'N/s, > 0, default 50', 'handover': '"printed" or "bumpless": how the force starts in a new direction, default "printed"', 'new_direction_angle': 'rad, in (0, pi/2): from the last force space, beyond which a direction is new, default pi/3', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> VirtualSpringParams:
        ...
    def __deepcopy__(self, memo: dict) -> VirtualSpringParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def handover(self) -> str:
        """
        "printed" or "bumpless": how the force starts in a new direction, default "printed"
        """
    @handover.setter
    def handover(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        N, >= 0, default 20
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def new_direction_angle(self) -> float:
        """
        rad, in (0, pi/2): from the last force space, beyond which a direction is new, default pi/3
        """
    @new_direction_angle.setter
    def new_direction_angle(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def rate(self) -> float:
        """
        N/s, > 0, default 50
        """
    @rate.setter
    def rate(self, arg1: typing.Any) -> None:
        ...
    @property
    def stiffness(self) -> float:
        """
        N/m, >= 0, default 500
        """
    @stiffness.setter
    def stiffness(self, arg1: typing.Any) -> None:
        ...
class VirtualSpringState:
    """
    Memory of VirtualSpring.
    """
    def __copy__(self) -> VirtualSpringState:
        ...
    def __deepcopy__(self, memo: dict) -> VirtualSpringState:
        ...
    @property
    def reference(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        The reference force, (3,), N.
        """
    @property
    def selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        The selection of the last update, (3, 3).
        """
class VirtualSpring:
    """
    The spring between proxy and robot (or hand) in force space, eq. (4) and (5), saturated
    and rate-limited: F = -k Omega (x - x_p).
    """
    def __init__(self, params: VirtualSpringParams = ...) -> None:
        ...
    def make_state(self) -> VirtualSpringState:
        ...
    def update(self, displacement: typing.Any, selection: typing.Any, sensed: typing.Any, active: bool, state: VirtualSpringState) -> None:
        """
        Advances by one period: displacement x - x_p (3,), m; selection (3, 3); sensed force (3,),
        N, or None; active False lets the force fade.
        """
    @property
    def params(self) -> VirtualSpringParams:
        ...
class PoseInterpolatorParams:
    """
    Parameters of PoseInterpolator.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('max_interval')
    fields: typing.ClassVar[dict] = {'max_interval': 's, > 0, default 0.25: poses sent further apart are not joined'}
    def __copy__(self) -> PoseInterpolatorParams:
        ...
    def __deepcopy__(self, memo: dict) -> PoseInterpolatorParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def max_interval(self) -> float:
        """
        s, > 0, default 0.25: poses sent further apart are not joined
        """
    @max_interval.setter
    def max_interval(self, arg1: typing.Any) -> None:
        ...
class RobotSideProxyParams:
    """
    Parameters of the robot side of the dual proxy.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('map', 'workspace', 'limiter', 'link', 'interpolate', 'interpolator', 'stiffness', 'rotational_stiffness', 'max_force', 'max_moment', 'force_rate', 'moment_rate', 'max_motion_error', 'handover', 'period')
    fields: typing.ClassVar[dict] = {'map': 'WorkspaceMapParams', 'workspace': 'WorkspaceLimitsParams: where the robot proxy may go', 'limiter': 'TrajectoryLimiterParams: how fast; its period is `period`', 'link': 'LinkMonitorParams', 'interpolate': "true: the device's poses are joined to a motion with continuous velocity, one message interval behind; false: the target is the newest pose", 'interpolator': 'PoseInterpolatorParams', 'stiffness': 'k_vir_r, N/m, >= 0, default 500', 'rotational_stiffness': 'N m/rad, >= 0, default 10', 'max_force': 'N, >= 0, default 20', 'max_moment': 'N m, >= 0, default 2', 'force_rate': 'N/s, > 0, default 50', 'moment_rate': 'N m/s, > 0, default 10', 'max_motion_error': 'bound on |dx_m|, m, >= 0, 0 is none, default 0.012', 'handover': '"bumpless" (from the sensed force) or "printed" (from where it is): how the forces start in a new direction', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> RobotSideProxyParams:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideProxyParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def force_rate(self) -> float:
        """
        N/s, > 0, default 50
        """
    @force_rate.setter
    def force_rate(self, arg1: typing.Any) -> None:
        ...
    @property
    def handover(self) -> str:
        """
        "bumpless" (from the sensed force) or "printed" (from where it is): how the forces start in a new direction
        """
    @handover.setter
    def handover(self, arg1: typing.Any) -> None:
        ...
    @property
    def interpolate(self) -> bool:
        """
        true: the device's poses are joined to a motion with continuous velocity, one message interval behind; false: the target is the newest pose
        """
    @interpolate.setter
    def interpolate(self, arg1: typing.Any) -> None:
        ...
    @property
    def interpolator(self) -> PoseInterpolatorParams:
        """
        PoseInterpolatorParams
        """
    @interpolator.setter
    def interpolator(self, arg1: typing.Any) -> None:
        ...
    @property
    def limiter(self) -> TrajectoryLimiterParams:
        """
        TrajectoryLimiterParams: how fast; its period is `period`
        """
    @limiter.setter
    def limiter(self, arg1: typing.Any) -> None:
        ...
    @property
    def link(self) -> LinkMonitorParams:
        """
        LinkMonitorParams
        """
    @link.setter
    def link(self, arg1: typing.Any) -> None:
        ...
    @property
    def map(self) -> WorkspaceMapParams:
        """
        WorkspaceMapParams
        """
    @map.setter
    def map(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        N, >= 0, default 20
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_moment(self) -> float:
        """
        N m, >= 0, default 2
        """
    @max_moment.setter
    def max_moment(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_motion_error(self) -> float:
        """
        bound on |dx_m|, m, >= 0, 0 is none, default 0.012
        """
    @max_motion_error.setter
    def max_motion_error(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_rate(self) -> float:
        """
        N m/s, > 0, default 10
        """
    @moment_rate.setter
    def moment_rate(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotational_stiffness(self) -> float:
        """
        N m/rad, >= 0, default 10
        """
    @rotational_stiffness.setter
    def rotational_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def stiffness(self) -> float:
        """
        k_vir_r, N/m, >= 0, default 500
        """
    @stiffness.setter
    def stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def workspace(self) -> WorkspaceLimitsParams:
        """
        WorkspaceLimitsParams: where the robot proxy may go
        """
    @workspace.setter
    def workspace(self, arg1: typing.Any) -> None:
        ...
class RobotSideProxyOutput:
    """
    Outputs of one tick, in B.
    """
    def __copy__(self) -> RobotSideProxyOutput:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideProxyOutput:
        ...
    @property
    def link_age(self) -> float:
        """
        s.
        """
    @property
    def link_status(self) -> LinkStatus:
        """
        LinkStatus.
        """
    @property
    def motion_error(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        dx_m, (3,), m.
        """
    @property
    def proxy_acceleration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [linear; angular], m/s^2, rad/s^2.
        """
    @property
    def proxy_pose(self) -> Pose:
        """
        Pose of the limited robot proxy.
        """
    @property
    def proxy_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [linear; angular], m/s, rad/s.
        """
    @property
    def reference_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_r, (3,), N.
        """
    @property
    def reference_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_r, (3,), N m.
        """
    @property
    def rotation_error(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), rad.
        """
class RobotSideProxyState:
    """
    Memory of the robot side.
    """
    def __copy__(self) -> RobotSideProxyState:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideProxyState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Ticks refused.
        """
    @property
    def initialized(self) -> bool:
        """
        Whether a robot pose has been seen.
        """
    @property
    def link(self) -> LinkMonitorState:
        """
        LinkMonitorState. A copy.
        """
    @property
    def output(self) -> RobotSideProxyOutput:
        """
        Of the last tick. A copy.
        """
class RobotSideProxy:
    """
    The robot side of the dual proxy: turns the device's delayed poses into motion errors and
    reference forces, eq. (4).
    """
    def __init__(self, params: RobotSideProxyParams = ...) -> None:
        ...
    def make_state(self) -> RobotSideProxyState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, message: PoseMessage, robot_position: typing.Any, robot_rotation: typing.Any, force_selection: typing.Any, moment_selection: typing.Any, sensed_wrench: typing.Any, state: RobotSideProxyState) -> None:
        """
        Advances by one period; the outputs are in `state.output`. time: s; message: PoseMessage;
        robot pose (3,), m, and (3, 3); selections (3, 3); sensed_wrench: (6,) [force; moment], N, N m,
        or None (no bumpless hand-over). In B.
        """
    @property
    def params(self) -> RobotSideProxyParams:
        ...
class HapticSideProxyParams:
    """
    Parameters of the haptic side of the dual proxy.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('map', 'link', 'stiffness', 'robot_stiffness', 'rotational_stiffness', 'max_force', 'max_moment', 'force_rate', 'moment_rate', 'period')
    fields: typing.ClassVar[dict] = {'map': 'WorkspaceMapParams', 'link': 'LinkMonitorParams', 'stiffness': 'k_vir_h, N/m, >= 0; 0: force-matched, map.scale x robot_stiffness, default 0', 'robot_stiffness': 'k_vir_r of the robot side, N/m, >= 0, default 500', 'rotational_stiffness': 'N m/rad, >= 0, default 0.5', 'max_force': 'N, >= 0, default 12', 'max_moment': 'N m, >= 0; 0: moments off, default 0', 'force_rate': 'N/s, > 0, default 20', 'moment_rate': 'N m/s, > 0, default 1', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> HapticSideProxyParams:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideProxyParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def force_rate(self) -> float:
        """
        N/s, > 0, default 20
        """
    @force_rate.setter
    def force_rate(self, arg1: typing.Any) -> None:
        ...
    @property
    def link(self) -> LinkMonitorParams:
        """
        LinkMonitorParams
        """
    @link.setter
    def link(self, arg1: typing.Any) -> None:
        ...
    @property
    def map(self) -> WorkspaceMapParams:
        """
        WorkspaceMapParams
        """
    @map.setter
    def map(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        N, >= 0, default 12
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_moment(self) -> float:
        """
        N m, >= 0; 0: moments off, default 0
        """
    @max_moment.setter
    def max_moment(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_rate(self) -> float:
        """
        N m/s, > 0, default 1
        """
    @moment_rate.setter
    def moment_rate(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def robot_stiffness(self) -> float:
        """
        k_vir_r of the robot side, N/m, >= 0, default 500
        """
    @robot_stiffness.setter
    def robot_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotational_stiffness(self) -> float:
        """
        N m/rad, >= 0, default 0.5
        """
    @rotational_stiffness.setter
    def rotational_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def stiffness(self) -> float:
        """
        k_vir_h, N/m, >= 0; 0: force-matched, map.scale x robot_stiffness, default 0
        """
    @stiffness.setter
    def stiffness(self, arg1: typing.Any) -> None:
        ...
class HapticSideProxyOutput:
    """
    Outputs of one tick, in D.
    """
    def __copy__(self) -> HapticSideProxyOutput:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideProxyOutput:
        ...
    @property
    def force_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_fh, (3, 3).
        """
    @property
    def link_age(self) -> float:
        """
        s.
        """
    @property
    def link_status(self) -> LinkStatus:
        """
        LinkStatus.
        """
    @property
    def moment_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_tauh, (3, 3).
        """
    @property
    def proxy_pose(self) -> Pose:
        """
        Pose of the haptic proxy.
        """
    @property
    def reference_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_h, (3,), N, on the hand.
        """
    @property
    def reference_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_h, (3,), N m, on the hand.
        """
class HapticSideProxyState:
    """
    Memory of the haptic side.
    """
    def __copy__(self) -> HapticSideProxyState:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideProxyState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Ticks refused.
        """
    @property
    def link(self) -> LinkMonitorState:
        """
        LinkMonitorState. A copy.
        """
    @property
    def output(self) -> HapticSideProxyOutput:
        """
        Of the last tick. A copy.
        """
class HapticSideProxy:
    """
    The haptic side of the dual proxy: what the hand is to feel, eq. (5).
    """
    def __init__(self, params: HapticSideProxyParams = ...) -> None:
        ...
    def make_state(self) -> HapticSideProxyState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, message: PoseMessage, device_position: typing.Any, device_rotation: typing.Any, state: HapticSideProxyState) -> None:
        """
        Advances by one period; the outputs are in `state.output`. time: s; message: PoseMessage;
        device pose (3,), m, from home, and (3, 3), in D.
        """
    @property
    def params(self) -> HapticSideProxyParams:
        ...
    @property
    def stiffness(self) -> float:
        """
        k_vir_h in use, N/m.
        """
class ForceSpaceParticleFilterThresholds:
    """
    Corners of the force and the velocity ramp of the likelihood, eq. (6) and (7).
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('force_low', 'force_high', 'velocity_low', 'velocity_high')
    fields: typing.ClassVar[dict] = {'force_low': 'f_l, N, >= 0: below it a contact is ruled out, default 0', 'force_high': 'f_h, N, > force_low: above it the force speaks fully for it, default 3', 'velocity_low': 'v_l, m/s, >= 0: below it the velocity speaks fully for it, default 0.001', 'velocity_high': 'v_h, m/s, > velocity_low: above it a contact is ruled out, default 0.01'}
    def __copy__(self) -> ForceSpaceParticleFilterThresholds:
        ...
    def __deepcopy__(self, memo: dict) -> ForceSpaceParticleFilterThresholds:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def force_high(self) -> float:
        """
        f_h, N, > force_low: above it the force speaks fully for it, default 3
        """
    @force_high.setter
    def force_high(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_low(self) -> float:
        """
        f_l, N, >= 0: below it a contact is ruled out, default 0
        """
    @force_low.setter
    def force_low(self, arg1: typing.Any) -> None:
        ...
    @property
    def velocity_high(self) -> float:
        """
        v_h, m/s, > velocity_low: above it a contact is ruled out, default 0.01
        """
    @velocity_high.setter
    def velocity_high(self, arg1: typing.Any) -> None:
        ...
    @property
    def velocity_low(self) -> float:
        """
        v_l, m/s, >= 0: below it the velocity speaks fully for it, default 0.001
        """
    @velocity_low.setter
    def velocity_low(self, arg1: typing.Any) -> None:
        ...
class FrictionConeParams:
    """
    What likelihood "friction_cone" knows of sensors and surfaces; nothing is per update.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('force_noise', 'velocity_noise', 'sliding_speed', 'max_friction', 'contact_force', 'loss_force', 'compliance', 'curvature', 'torsion', 'evidence')
    fields: typing.ClassVar[dict] = {'force_noise': 'sigma_f, N, > 0, of one input per axis, default 0.25', 'velocity_noise': 'sigma_v, m/s, > 0, likewise, default 0.0015', 'sliding_speed': 'm/s, > 0: half of it sticks, 1.5 times it slides, default 0.004', 'max_friction': 'mu, > 0, the most that is thought of, default 0.7', 'contact_force': 'N, > 0: a larger force speaks for a contact, default 0.6', 'loss_force': 'N, >= 0, < contact_force: a smaller one speaks against one that was there, default 0.45', 'compliance': 'm/N, >= 0: how much surface, tool and arm give, default 2e-4', 'curvature': 'rad^2/m, >= 0: variance of the normal per metre of sliding, about the axis across the motion, default 1', 'torsion': 'rad^2/m, >= 0: about the direction of motion, default 0.05', 'evidence': '> 0: log likelihood ratio that adds or drops a contact, default 9'}
    def __copy__(self) -> FrictionConeParams:
        ...
    def __deepcopy__(self, memo: dict) -> FrictionConeParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def compliance(self) -> float:
        """
        m/N, >= 0: how much surface, tool and arm give, default 2e-4
        """
    @compliance.setter
    def compliance(self, arg1: typing.Any) -> None:
        ...
    @property
    def contact_force(self) -> float:
        """
        N, > 0: a larger force speaks for a contact, default 0.6
        """
    @contact_force.setter
    def contact_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def curvature(self) -> float:
        """
        rad^2/m, >= 0: variance of the normal per metre of sliding, about the axis across the motion, default 1
        """
    @curvature.setter
    def curvature(self, arg1: typing.Any) -> None:
        ...
    @property
    def evidence(self) -> float:
        """
        > 0: log likelihood ratio that adds or drops a contact, default 9
        """
    @evidence.setter
    def evidence(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_noise(self) -> float:
        """
        sigma_f, N, > 0, of one input per axis, default 0.25
        """
    @force_noise.setter
    def force_noise(self, arg1: typing.Any) -> None:
        ...
    @property
    def loss_force(self) -> float:
        """
        N, >= 0, < contact_force: a smaller one speaks against one that was there, default 0.45
        """
    @loss_force.setter
    def loss_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_friction(self) -> float:
        """
        mu, > 0, the most that is thought of, default 0.7
        """
    @max_friction.setter
    def max_friction(self, arg1: typing.Any) -> None:
        ...
    @property
    def sliding_speed(self) -> float:
        """
        m/s, > 0: half of it sticks, 1.5 times it slides, default 0.004
        """
    @sliding_speed.setter
    def sliding_speed(self, arg1: typing.Any) -> None:
        ...
    @property
    def torsion(self) -> float:
        """
        rad^2/m, >= 0: about the direction of motion, default 0.05
        """
    @torsion.setter
    def torsion(self, arg1: typing.Any) -> None:
        ...
    @property
    def velocity_noise(self) -> float:
        """
        sigma_v, m/s, > 0, likewise, default 0.0015
        """
    @velocity_noise.setter
    def velocity_noise(self, arg1: typing.Any) -> None:
        ...
class ForceSpaceParticleFilterParams:
    """
    Parameters of ForceSpaceParticleFilter; the defaults are the paper's where it gives a number.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('num_particles', 'period', 'likelihood', 'scatter_mean', 'scatter_std', 'update_thresholds', 'resampling_thresholds', 'alpha_add', 'alpha_remove', 'epsilon', 'prior_particles', 'prior_std', 'friction_cone')
    fields: typing.ClassVar[dict] = {'num_particles': 'n_p, 2 to 100000, default 1000', 'period': 's, > 0, time between updates, default 1/15', 'likelihood': '"paper" (eq. 6 to 8) or "friction_cone" (contacts with friction), default "friction_cone"', 'scatter_mean': 'mean of the scatter per axis and update, -1 to 1, default 0', 'scatter_std': 'standard deviation of the scatter per axis and update, 0 to 1, default 0.025', 'update_thresholds': 'weigh the tentative particle, default 3, 10 N, 0.001, 0.005 m/s', 'resampling_thresholds': 'weigh every particle, default 0, 3 N, 0.001, 0.01 m/s', 'alpha_add': 'share of the largest singular value above which a direction is added, in (0, 1), default 0.5', 'alpha_remove': 'share below which it is removed, in (0, alpha_add], default 0.1', 'epsilon': 'vectors no longer than this count as zero, 1e-12 to 0.1, default 1e-6', 'prior_particles': 'particles that each prior normal adds to an update, 0 to 100000, default 50', 'prior_std': 'rad, in (0, pi], how sure a prior is, default 0.1', 'friction_cone': 'of likelihood "friction_cone"'}
    def __copy__(self) -> ForceSpaceParticleFilterParams:
        ...
    def __deepcopy__(self, memo: dict) -> ForceSpaceParticleFilterParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def alpha_add(self) -> float:
        """
        share of the largest singular value above which a direction is added, in (0, 1), default 0.5
        """
    @alpha_add.setter
    def alpha_add(self, arg1: typing.Any) -> None:
        ...
    @property
    def alpha_remove(self) -> float:
        """
        share below which it is removed, in (0, alpha_add], default 0.1
        """
    @alpha_remove.setter
    def alpha_remove(self, arg1: typing.Any) -> None:
        ...
    @property
    def epsilon(self) -> float:
        """
        vectors no longer than this count as zero, 1e-12 to 0.1, default 1e-6
        """
    @epsilon.setter
    def epsilon(self, arg1: typing.Any) -> None:
        ...
    @property
    def friction_cone(self) -> FrictionConeParams:
        """
        of likelihood "friction_cone"
        """
    @friction_cone.setter
    def friction_cone(self, arg1: typing.Any) -> None:
        ...
    @property
    def likelihood(self) -> str:
        """
        "paper" (eq. 6 to 8) or "friction_cone" (contacts with friction), default "friction_cone"
        """
    @likelihood.setter
    def likelihood(self, arg1: typing.Any) -> None:
        ...
    @property
    def num_particles(self) -> int:
        """
        n_p, 2 to 100000, default 1000
        """
    @num_particles.setter
    def num_particles(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, time between updates, default 1/15
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def prior_particles(self) -> int:
        """
        particles that each prior normal adds to an update, 0 to 100000, default 50
        """
    @prior_particles.setter
    def prior_particles(self, arg1: typing.Any) -> None:
        ...
    @property
    def prior_std(self) -> float:
        """
        rad, in (0, pi], how sure a prior is, default 0.1
        """
    @prior_std.setter
    def prior_std(self, arg1: typing.Any) -> None:
        ...
    @property
    def resampling_thresholds(self) -> ForceSpaceParticleFilterThresholds:
        """
        weigh every particle, default 0, 3 N, 0.001, 0.01 m/s
        """
    @resampling_thresholds.setter
    def resampling_thresholds(self, arg1: typing.Any) -> None:
        ...
    @property
    def scatter_mean(self) -> float:
        """
        mean of the scatter per axis and update, -1 to 1, default 0
        """
    @scatter_mean.setter
    def scatter_mean(self, arg1: typing.Any) -> None:
        ...
    @property
    def scatter_std(self) -> float:
        """
        standard deviation of the scatter per axis and update, 0 to 1, default 0.025
        """
    @scatter_std.setter
    def scatter_std(self, arg1: typing.Any) -> None:
        ...
    @property
    def update_thresholds(self) -> ForceSpaceParticleFilterThresholds:
        """
        weigh the tentative particle, default 3, 10 N, 0.001, 0.005 m/s
        """
    @update_thresholds.setter
    def update_thresholds(self, arg1: typing.Any) -> None:
        ...
class ForceSpaceParticleFilterState:
    """
    What the filter remembers, and its result; with its random generator.
    """
    def __copy__(self) -> ForceSpaceParticleFilterState:
        ...
    def __deepcopy__(self, memo: dict) -> ForceSpaceParticleFilterState:
        ...
    @property
    def all_weights_zero(self) -> int:
        """
        Number of updates in which nothing was likely.
        """
    @property
    def bad_inputs(self) -> int:
        """
        Number of calls refused.
        """
    @property
    def dimension(self) -> int:
        """
        0 to 3: number of directions in force space.
        """
    @property
    def dimension_confidence(self) -> float:
        """
        0 to 1: the probability that the dimension is right; 0 with likelihood "paper".
        """
    @property
    def direction_uncertainty(self) -> float:
        """
        rad: the true direction is within this angle with 95 %: U1 at dimension 1, U3 at 2.
        pi/2 at 0 and with likelihood "paper"; 0 at 3.
        """
    @property
    def force_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_f, (3, 3), in B: orthogonal projection onto force space.
        """
    @property
    def motion_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_m = I - Omega_f, (3, 3), in B.
        """
    @property
    def particles(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"]:
        """
        (3, n), in B: unit vectors into the surface, or zero for no contact. A copy.
        """
    @property
    def prior(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"]:
        """
        (3, k), unit vectors in B: the expected normals.
        """
    @property
    def singular_values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), decreasing: of the particles.
        """
    @property
    def singular_vectors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        U, (3, 3), vectors as columns, in B, right-handed; U1 points into the surface.
        """
    @property
    def updates(self) -> int:
        """
        Number of updates carried out.
        """
class ForceSpaceParticleFilterAlgorithm:
    """
    The force-space particle filter without its state; see ForceSpaceParticleFilter.
    """
    def __init__(self, params: ForceSpaceParticleFilterParams = ...) -> None:
        ...
    def make_state(self, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> ForceSpaceParticleFilterState:
        """
        Every particle at the centre. The same seed gives the same bits.
        """
    def offer_prior(self, normals: typing.Any, state: ForceSpaceParticleFilterState) -> str:
        """
        As set_prior, but never raises: normals that it would refuse change nothing, are
        counted in `state.bad_inputs`, and give "bad_input" instead of "ok".
        """
    def set_prior(self, normals: typing.Any, state: ForceSpaceParticleFilterState, std: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        """
        Replaces the expected normals, which hold until they are replaced.
        
        normals: (3, k), 0 <= k <= 8, in B, into the surface; normalised here.
        std: rad, in (0, pi], how sure they are (standard deviation per axis); params.prior_std
        if None.
        Raises ValueError unless all are finite and longer than epsilon.
        """
    def update(self, sensed_force: typing.Any, velocity: typing.Any, motion_force: typing.Any, contact_force: typing.Any, state: ForceSpaceParticleFilterState) -> str:
        """
        Advances the particles by one period and computes the spaces.
        
        sensed_force: F_s, (3,), N, in B: robot on environment, mean over the period.
        velocity: v_BE, (3,), m/s, in B, mean over the period.
        motion_force: F_m, (3,), N, in B: command in motion space.
        contact_force: F_f, (3,), N, in B: command in force space.
        Returns "ok", "bad_input" (not finite: refused and counted, nothing else changes) or "all_weights_zero" (moved particles kept, centre added, counted).
        """
    @property
    def params(self) -> ForceSpaceParticleFilterParams:
        ...
class ForceSpaceParticleFilter:
    """
    Estimates the contact directions at the tool from force, velocity and commands
    (section IV of the paper), together with its state.
    """
    def __init__(self, params: ForceSpaceParticleFilterParams = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def reset(self, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Starts again, as if new.
        """
    def set_prior(self, normals: typing.Any, std: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        """
        Replaces the expected normals, which hold until they are replaced.
        
        normals: (3, k), 0 <= k <= 8, in B, into the surface; normalised here.
        std: rad, in (0, pi], how sure they are (standard deviation per axis); params.prior_std
        if None.
        Raises ValueError unless all are finite and longer than epsilon.
        """
    def update(self, sensed_force: typing.Any, velocity: typing.Any, motion_force: typing.Any, contact_force: typing.Any) -> str:
        """
        Advances the particles by one period and computes the spaces.
        
        sensed_force: F_s, (3,), N, in B: robot on environment, mean over the period.
        velocity: v_BE, (3,), m/s, in B, mean over the period.
        motion_force: F_m, (3,), N, in B: command in motion space.
        contact_force: F_f, (3,), N, in B: command in force space.
        Returns "ok", "bad_input" (not finite: refused and counted, nothing else changes) or "all_weights_zero" (moved particles kept, centre added, counted).
        """
    @property
    def all_weights_zero(self) -> int:
        """
        Number of updates in which nothing was likely.
        """
    @property
    def bad_inputs(self) -> int:
        """
        Number of calls refused.
        """
    @property
    def dimension(self) -> int:
        """
        0 to 3: number of directions in force space.
        """
    @property
    def dimension_confidence(self) -> float:
        """
        0 to 1: the probability that the dimension is right; 0 with likelihood "paper".
        """
    @property
    def direction_uncertainty(self) -> float:
        """
        rad: the true direction is within this angle with 95 %: U1 at dimension 1, U3 at 2.
        pi/2 at 0 and with likelihood "paper"; 0 at 3.
        """
    @property
    def force_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_f, (3, 3), in B: orthogonal projection onto force space.
        """
    @property
    def motion_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_m = I - Omega_f, (3, 3), in B.
        """
    @property
    def params(self) -> ForceSpaceParticleFilterParams:
        ...
    @property
    def particles(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"]:
        """
        (3, n), in B: unit vectors into the surface, or zero for no contact. A copy.
        """
    @property
    def prior(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"]:
        """
        (3, k), unit vectors in B: the expected normals.
        """
    @property
    def singular_values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), decreasing: of the particles.
        """
    @property
    def singular_vectors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        U, (3, 3), vectors as columns, in B, right-handed; U1 points into the surface.
        """
    @property
    def state(self) -> ForceSpaceParticleFilterState:
        """
        A copy of the state; assign it to go back to it.
        """
    @state.setter
    def state(self, arg1: ForceSpaceParticleFilterState) -> None:
        ...
    @property
    def updates(self) -> int:
        """
        Number of updates carried out.
        """
class ContactHistoryParams:
    """
    Parameters of ContactHistory.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('period', 'cell_size', 'capacity', 'radius', 'merge_angle', 'min_age', 'std_base', 'std_growth')
    fields: typing.ClassVar[dict] = {'period': 's, > 0, time between updates, default 1/15', 'cell_size': 'm, 1e-4 to 1: edge of the cells in which normals are averaged, default 0.02', 'capacity': 'number of cells remembered, 1 to 1000000, default 1024', 'radius': 'm, 0 to 2 cell_size: how near a memory must be to count, default 0.02', 'merge_angle': 'rad, 0.01 to 1.5: normals within it are one contact, default 0.175', 'min_age': 's, >= 0: a cell that was left more recently does not count, default 2', 'std_base': 'rad, > 0: how uncertain a memory of this very point is, default 0.1', 'std_growth': 'rad/m, >= 0: what is added per distance from the memory, default 10'}
    def __copy__(self) -> ContactHistoryParams:
        ...
    def __deepcopy__(self, memo: dict) -> ContactHistoryParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def capacity(self) -> int:
        """
        number of cells remembered, 1 to 1000000, default 1024
        """
    @capacity.setter
    def capacity(self, arg1: typing.Any) -> None:
        ...
    @property
    def cell_size(self) -> float:
        """
        m, 1e-4 to 1: edge of the cells in which normals are averaged, default 0.02
        """
    @cell_size.setter
    def cell_size(self, arg1: typing.Any) -> None:
        ...
    @property
    def merge_angle(self) -> float:
        """
        rad, 0.01 to 1.5: normals within it are one contact, default 0.175
        """
    @merge_angle.setter
    def merge_angle(self, arg1: typing.Any) -> None:
        ...
    @property
    def min_age(self) -> float:
        """
        s, >= 0: a cell that was left more recently does not count, default 2
        """
    @min_age.setter
    def min_age(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, time between updates, default 1/15
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def radius(self) -> float:
        """
        m, 0 to 2 cell_size: how near a memory must be to count, default 0.02
        """
    @radius.setter
    def radius(self, arg1: typing.Any) -> None:
        ...
    @property
    def std_base(self) -> float:
        """
        rad, > 0: how uncertain a memory of this very point is, default 0.1
        """
    @std_base.setter
    def std_base(self, arg1: typing.Any) -> None:
        ...
    @property
    def std_growth(self) -> float:
        """
        rad/m, >= 0: what is added per distance from the memory, default 10
        """
    @std_growth.setter
    def std_growth(self, arg1: typing.Any) -> None:
        ...
class ContactHistoryState:
    """
    What the history remembers.
    """
    def __copy__(self) -> ContactHistoryState:
        ...
    def __deepcopy__(self, memo: dict) -> ContactHistoryState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Number of updates refused.
        """
    @property
    def updates(self) -> int:
        """
        Number of updates carried out.
        """
class ContactHistory:
    """
    Remembers which contact normals were believed where, so that a place visited again
    gives them as a prior (section IV.C of the paper). Its state is made by make_state().
    
    A visit of a cell ends when the tool goes on to another, and gives its prior to later
    visits, not to itself. Passing a place without contact notes and erases nothing.
    """
    def __init__(self, params: ContactHistoryParams = ...) -> None:
        ...
    def lookup(self, position: typing.Any, state: ContactHistoryState) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"], float]:
        """
        What was believed near `position` (p_BE, (3,), m, in B) on earlier visits.
        
        Returns (normals, std): (3, k), k <= 8, unit normals in B, into the surface, of the
        nearest memory first; and how uncertain the least sure of them is, rad.
        """
    def make_state(self) -> ContactHistoryState:
        """
        Nothing remembered.
        """
    def update(self, position: typing.Any, normals: typing.Any, state: ContactHistoryState) -> str:
        """
        Notes what is believed here.
        
        position: p_BE, (3,), m, in B: where the tool point is.
        normals: (3, d), 0 <= d <= 8, in B, into the surface; normalised here.
        Returns "ok" or "bad_input" (not finite, shorter than 1e-6, or a million cells away:
        refused and counted, nothing else changes).
        """
    def update_from_selection(self, position: typing.Any, force_selection: typing.Any, force_direction: typing.Any, state: ContactHistoryState) -> str:
        """
        As update, from what the ports of the filter say.
        
        force_selection: Omega_f, (3, 3), in B.
        force_direction: U1, (3,), in B; zero without contact.
        Notes U1, and where Omega_f is of rank 2 also both directions across it in force space.
        """
    @property
    def params(self) -> ContactHistoryParams:
        ...
class TimeDomainPassivityParams:
    """
    Parameters of TimeDomainPassivity; for moments N m s/rad instead of N s/m.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('enabled', 'initial_energy', 'max_energy', 'max_damping', 'damping_margin', 'actuation_delay', 'period')
    fields: typing.ClassVar[dict] = {'enabled': 'false: energy is observed, nothing is injected; default true', 'initial_energy': 'J, [0, max_energy]: spent before damping begins, default 0.002', 'max_energy': 'J, > 0: cap of the observed energy, default 0.002', 'max_damping': 'N s/m, >= 0: injected when no energy is left, default 500', 'damping_margin': 'N s/m, [0, max_damping]: dissipation demanded on balance, default 150', 'actuation_delay': 'periods, 0 to 7: from command to its acting, default 1', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> TimeDomainPassivityParams:
        ...
    def __deepcopy__(self, memo: dict) -> TimeDomainPassivityParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def actuation_delay(self) -> int:
        """
        periods, 0 to 7: from command to its acting, default 1
        """
    @actuation_delay.setter
    def actuation_delay(self, arg1: typing.Any) -> None:
        ...
    @property
    def damping_margin(self) -> float:
        """
        N s/m, [0, max_damping]: dissipation demanded on balance, default 150
        """
    @damping_margin.setter
    def damping_margin(self, arg1: typing.Any) -> None:
        ...
    @property
    def enabled(self) -> bool:
        """
        false: energy is observed, nothing is injected; default true
        """
    @enabled.setter
    def enabled(self, arg1: typing.Any) -> None:
        ...
    @property
    def initial_energy(self) -> float:
        """
        J, [0, max_energy]: spent before damping begins, default 0.002
        """
    @initial_energy.setter
    def initial_energy(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_damping(self) -> float:
        """
        N s/m, >= 0: injected when no energy is left, default 500
        """
    @max_damping.setter
    def max_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_energy(self) -> float:
        """
        J, > 0: cap of the observed energy, default 0.002
        """
    @max_energy.setter
    def max_energy(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
class TimeDomainPassivityState:
    """
    Memory of TimeDomainPassivity.
    """
    def __copy__(self) -> TimeDomainPassivityState:
        ...
    def __deepcopy__(self, memo: dict) -> TimeDomainPassivityState:
        ...
    @property
    def damping(self) -> float:
        """
        N s/m, injected last
        """
    @property
    def dissipated(self) -> float:
        """
        J, by injection
        """
    @property
    def energy(self) -> float:
        """
        J
        """
class TimeDomainPassivity:
    """
    Time-domain passivity observer and controller of a force port.
    """
    def __init__(self, params: TimeDomainPassivityParams = ...) -> None:
        ...
    def make_state(self) -> TimeDomainPassivityState:
        ...
    def update(self, feedback_force: typing.Any, velocity: typing.Any, force_selection: typing.Any, state: TimeDomainPassivityState) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Advances `state` by one period. Takes F_f - F_r without injection (3,), N; v_BE (3,), m/s; Omega_f (3, 3); in B.
        Returns the force to inject, (3,), N.
        """
    @property
    def params(self) -> TimeDomainPassivityParams:
        ...
class SelectionBlendParams:
    """
    Parameters of SelectionBlend.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'blend_time': 's, >= 0: in which a new selection takes over; 0 switches at once, default 0.03', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> SelectionBlendParams:
        ...
    def __deepcopy__(self, memo: dict) -> SelectionBlendParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def blend_time(self) -> float:
        """
        s, >= 0: in which a new selection takes over; 0 switches at once, default 0.03
        """
    @blend_time.setter
    def blend_time(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
class SelectionBlendState:
    """
    Memory of SelectionBlend.
    """
    def __copy__(self) -> SelectionBlendState:
        ...
    def __deepcopy__(self, memo: dict) -> SelectionBlendState:
        ...
    @property
    def blended(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3): what is in force now
        """
    @property
    def progress(self) -> float:
        """
        0 at a change, 1 when it is complete
        """
class SelectionBlend:
    """
    Replaces the switch of a selection matrix by a linear blend.
    """
    def __init__(self, params: SelectionBlendParams = ...) -> None:
        ...
    def make_state(self) -> SelectionBlendState:
        ...
    def update(self, selection: typing.Any, state: SelectionBlendState) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Advances `state` by one period. Takes a projection (3, 3), returns the blend (3, 3).
        """
    @property
    def params(self) -> SelectionBlendParams:
        ...
class ForceLoopParams:
    """
    Parameters of ForceLoop; for moments N m and N m s/rad.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'gain': 'Kpf, >= 0, default 2.5', 'integral_gain': 'Kif, 1/s, >= 0, default 5.5', 'damping': 'Kvf, N s/m, >= 0, default 20', 'max_integral_force': "N, >= 0: bound of the integral's force, default 10", 'filter_cutoff': 'Hz, >= 0: low-pass on the sensed force, 0 is off, default 100', 'release_time': 's, >= 0: in which a cut-off integral fades, default 0.03', 'passivity': 'its period is ignored', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> ForceLoopParams:
        ...
    def __deepcopy__(self, memo: dict) -> ForceLoopParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def damping(self) -> float:
        """
        Kvf, N s/m, >= 0, default 20
        """
    @damping.setter
    def damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def filter_cutoff(self) -> float:
        """
        Hz, >= 0: low-pass on the sensed force, 0 is off, default 100
        """
    @filter_cutoff.setter
    def filter_cutoff(self, arg1: typing.Any) -> None:
        ...
    @property
    def gain(self) -> float:
        """
        Kpf, >= 0, default 2.5
        """
    @gain.setter
    def gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def integral_gain(self) -> float:
        """
        Kif, 1/s, >= 0, default 5.5
        """
    @integral_gain.setter
    def integral_gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_integral_force(self) -> float:
        """
        N, >= 0: bound of the integral's force, default 10
        """
    @max_integral_force.setter
    def max_integral_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def passivity(self) -> TimeDomainPassivityParams:
        """
        its period is ignored
        """
    @passivity.setter
    def passivity(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def release_time(self) -> float:
        """
        s, >= 0: in which a cut-off integral fades, default 0.03
        """
    @release_time.setter
    def release_time(self, arg1: typing.Any) -> None:
        ...
class ForceLoopState:
    """
    Memory of ForceLoop.
    """
    def __copy__(self) -> ForceLoopState:
        ...
    def __deepcopy__(self, memo: dict) -> ForceLoopState:
        ...
    @property
    def integral(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N s
        """
    @property
    def passivity(self) -> TimeDomainPassivityState:
        ...
    @property
    def released(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N, fading
        """
    @property
    def sensed(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N, filtered F_s
        """
class ForceLoop:
    """
    Force loop of eq. (13) with passivity controller.
    """
    def __init__(self, params: ForceLoopParams = ...) -> None:
        ...
    def make_state(self) -> ForceLoopState:
        ...
    def update(self, reference: typing.Any, sensed: typing.Any, velocity: typing.Any, selection: typing.Any, blended: typing.Any, state: ForceLoopState) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Advances `state` by one period. Takes F_r, F_s (3,), N; v_BE (3,), m/s; Omega_f and its blend (3, 3); in B.
        Returns F_f, (3,), N.
        """
    @property
    def params(self) -> ForceLoopParams:
        ...
class OperationalSpaceControllerParams:
    """
    Parameters of OperationalSpaceController.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('position_stiffness', 'position_damping', 'rotation_stiffness', 'rotation_damping', 'force_gain', 'force_integral_gain', 'force_damping', 'max_integral_force', 'moment_gain', 'moment_integral_gain', 'moment_damping', 'max_integral_moment', 'force_filter_cutoff', 'feed_forward', 'selection_blend_time', 'passivity', 'force_passivity', 'moment_passivity', 'unit_mass_motion_force', 'unit_inertia_motion_moment', 'q_rest', 'posture_stiffness', 'posture_damping', 'max_mass', 'characteristic_length', 'torque_limit', 'torque_rate_limit', 'period')
    fields: typing.ClassVar[dict] = {'position_stiffness': 'Kpm, 1/s^2, >= 0, default 500', 'position_damping': 'Kvm, 1/s, >= 0, default 40', 'rotation_stiffness': '1/s^2, >= 0, default 600', 'rotation_damping': '1/s, >= 0, default 38', 'force_gain': 'Kpf, >= 0, default 2.5', 'force_integral_gain': 'Kif, 1/s, >= 0, default 5.5', 'force_damping': 'Kvf, N s/m, >= 0, default 20', 'max_integral_force': 'N, >= 0, default 10', 'moment_gain': '>= 0, default 2.5', 'moment_integral_gain': '1/s, >= 0, default 5.5', 'moment_damping': 'N m s/rad, >= 0, default 0.8', 'max_integral_moment': 'N m, >= 0, default 1', 'force_filter_cutoff': 'Hz, >= 0: low-pass on the sensed wrench, 0 is off, default 100', 'feed_forward': "proxy's velocity and acceleration fed forward; false: as printed; default true", 'selection_blend_time': 's, >= 0; 0 switches at once, as printed; default 0.03', 'passivity': 'passivity controllers on; default true', 'force_passivity': 'of the force loop; its enabled and period are ignored', 'moment_passivity': 'of the moment loop; its enabled and period are ignored', 'unit_mass_motion_force': 'output motion_force is Lambda^-1 F_m; false: F_m as printed; default true', 'unit_inertia_motion_moment': 'output motion_moment is the command of a unit inertia; false: M_m, N m; default false', 'q_rest': '(7,), rad: posture in the null space', 'posture_stiffness': '1/s^2, >= 0, default 25', 'posture_damping': '1/s, >= 0, default 10', 'max_mass': 'kg, > 0: bound of the apparent mass, default 50', 'characteristic_length': 'm, > 0: turns inertia into mass for max_mass, default 0.2', 'torque_limit': '(7,), N m, > 0', 'torque_rate_limit': 'N m/s, > 0, default 1000', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> OperationalSpaceControllerParams:
        ...
    def __deepcopy__(self, memo: dict) -> OperationalSpaceControllerParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def characteristic_length(self) -> float:
        """
        m, > 0: turns inertia into mass for max_mass, default 0.2
        """
    @characteristic_length.setter
    def characteristic_length(self, arg1: typing.Any) -> None:
        ...
    @property
    def feed_forward(self) -> bool:
        """
        proxy's velocity and acceleration fed forward; false: as printed; default true
        """
    @feed_forward.setter
    def feed_forward(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_damping(self) -> float:
        """
        Kvf, N s/m, >= 0, default 20
        """
    @force_damping.setter
    def force_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_filter_cutoff(self) -> float:
        """
        Hz, >= 0: low-pass on the sensed wrench, 0 is off, default 100
        """
    @force_filter_cutoff.setter
    def force_filter_cutoff(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_gain(self) -> float:
        """
        Kpf, >= 0, default 2.5
        """
    @force_gain.setter
    def force_gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_integral_gain(self) -> float:
        """
        Kif, 1/s, >= 0, default 5.5
        """
    @force_integral_gain.setter
    def force_integral_gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_passivity(self) -> TimeDomainPassivityParams:
        """
        of the force loop; its enabled and period are ignored
        """
    @force_passivity.setter
    def force_passivity(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_integral_force(self) -> float:
        """
        N, >= 0, default 10
        """
    @max_integral_force.setter
    def max_integral_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_integral_moment(self) -> float:
        """
        N m, >= 0, default 1
        """
    @max_integral_moment.setter
    def max_integral_moment(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_mass(self) -> float:
        """
        kg, > 0: bound of the apparent mass, default 50
        """
    @max_mass.setter
    def max_mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_damping(self) -> float:
        """
        N m s/rad, >= 0, default 0.8
        """
    @moment_damping.setter
    def moment_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_gain(self) -> float:
        """
        >= 0, default 2.5
        """
    @moment_gain.setter
    def moment_gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_integral_gain(self) -> float:
        """
        1/s, >= 0, default 5.5
        """
    @moment_integral_gain.setter
    def moment_integral_gain(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_passivity(self) -> TimeDomainPassivityParams:
        """
        of the moment loop; its enabled and period are ignored
        """
    @moment_passivity.setter
    def moment_passivity(self, arg1: typing.Any) -> None:
        ...
    @property
    def passivity(self) -> bool:
        """
        passivity controllers on; default true
        """
    @passivity.setter
    def passivity(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def position_damping(self) -> float:
        """
        Kvm, 1/s, >= 0, default 40
        """
    @position_damping.setter
    def position_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def position_stiffness(self) -> float:
        """
        Kpm, 1/s^2, >= 0, default 500
        """
    @position_stiffness.setter
    def position_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def posture_damping(self) -> float:
        """
        1/s, >= 0, default 10
        """
    @posture_damping.setter
    def posture_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def posture_stiffness(self) -> float:
        """
        1/s^2, >= 0, default 25
        """
    @posture_stiffness.setter
    def posture_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def q_rest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,), rad: posture in the null space
        """
    @q_rest.setter
    def q_rest(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotation_damping(self) -> float:
        """
        1/s, >= 0, default 38
        """
    @rotation_damping.setter
    def rotation_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotation_stiffness(self) -> float:
        """
        1/s^2, >= 0, default 600
        """
    @rotation_stiffness.setter
    def rotation_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def selection_blend_time(self) -> float:
        """
        s, >= 0; 0 switches at once, as printed; default 0.03
        """
    @selection_blend_time.setter
    def selection_blend_time(self, arg1: typing.Any) -> None:
        ...
    @property
    def torque_limit(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,), N m, > 0
        """
    @torque_limit.setter
    def torque_limit(self, arg1: typing.Any) -> None:
        ...
    @property
    def torque_rate_limit(self) -> float:
        """
        N m/s, > 0, default 1000
        """
    @torque_rate_limit.setter
    def torque_rate_limit(self, arg1: typing.Any) -> None:
        ...
    @property
    def unit_inertia_motion_moment(self) -> bool:
        """
        output motion_moment is the command of a unit inertia; false: M_m, N m; default false
        """
    @unit_inertia_motion_moment.setter
    def unit_inertia_motion_moment(self, arg1: typing.Any) -> None:
        ...
    @property
    def unit_mass_motion_force(self) -> bool:
        """
        output motion_force is Lambda^-1 F_m; false: F_m as printed; default true
        """
    @unit_mass_motion_force.setter
    def unit_mass_motion_force(self, arg1: typing.Any) -> None:
        ...
class OperationalSpaceControllerOutput:
    """
    Results of one cycle, in B.
    """
    def __copy__(self) -> OperationalSpaceControllerOutput:
        ...
    def __deepcopy__(self, memo: dict) -> OperationalSpaceControllerOutput:
        ...
    @property
    def contact_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_f, (3,), N
        """
    @property
    def contact_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_f, (3,), N m
        """
    @property
    def injected_damping(self) -> float:
        """
        N s/m, force loop
        """
    @property
    def injected_moment_damping(self) -> float:
        """
        N m s/rad, moment loop
        """
    @property
    def motion_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N
        """
    @property
    def motion_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N m
        """
    @property
    def observed_energy(self) -> float:
        """
        J, force loop
        """
    @property
    def observed_moment_energy(self) -> float:
        """
        J, moment loop
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 1]"]:
        """
        (7,), N m, gravity compensated
        """
class OperationalSpaceControllerState:
    """
    Memory of OperationalSpaceController.
    """
    def __copy__(self) -> OperationalSpaceControllerState:
        ...
    def __deepcopy__(self, memo: dict) -> OperationalSpaceControllerState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        cycles refused
        """
    @property
    def force(self) -> ForceLoopState:
        ...
    @property
    def force_selection(self) -> SelectionBlendState:
        ...
    @property
    def moment(self) -> ForceLoopState:
        ...
    @property
    def moment_selection(self) -> SelectionBlendState:
        ...
    @property
    def rate_limited(self) -> int:
        """
        cycles in which torque_rate_limit acted
        """
    @property
    def singular(self) -> int:
        """
        cycles in which Lambda was bounded
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 1]"]:
        """
        (7,), N m, sent last
        """
    @property
    def torque_limited(self) -> int:
        """
        cycles in which torque_limit acted
        """
class OperationalSpaceController:
    """
    Unified force/motion control in operational space, eq. (10) to (17).
    """
    def __init__(self, params: OperationalSpaceControllerParams = ...) -> None:
        ...
    def make_state(self) -> OperationalSpaceControllerState:
        ...
    def update(self, jacobian: typing.Any, mass: typing.Any, bias: typing.Any, gravity: typing.Any, jdot_v: typing.Any, q: typing.Any, v: typing.Any, motion_error: typing.Any, rotation_error: typing.Any, proxy_velocity: typing.Any, proxy_acceleration: typing.Any, reference_force: typing.Any, reference_moment: typing.Any, force_selection: typing.Any, moment_selection: typing.Any, sensed_wrench: typing.Any, state: OperationalSpaceControllerState) -> OperationalSpaceControllerOutput:
        """
        Advances `state` by one period. Six-vectors are [linear; angular] or [force; moment], in B; jacobian (6, 7), mass (7, 7), bias (7,) without gravity, gravity (7,) as Drake's CalcGravityGeneralizedForces.
        Returns an OperationalSpaceControllerOutput.
        """
    @property
    def params(self) -> OperationalSpaceControllerParams:
        ...
class ArmModelParams:
    """
    Parameters of ArmModel: P is the link in front of a joint, J what the joint turns about its z.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'p_PJ': '(3, 7), m: column i is the position of J in P', 'R_PJ': '(7, 3, 3): orientations of J in P at q = 0', 'mass': '(7,), kg, > 0: of the links, no default', 'com': '(3, 7), m: centres of mass in J', 'inertia': '(7, 3, 3), kg m^2: about the centres of mass, in J', 'p_LE': '(3,), m: tool point in the last J', 'R_LE': '(3, 3): orientation of E in the last J', 'gravity': '(3,), m/s^2, in B, default (0, 0, -9.81)'}
    def __copy__(self) -> ArmModelParams:
        ...
    def __deepcopy__(self, memo: dict) -> ArmModelParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def R_LE(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3): orientation of E in the last J
        """
    @R_LE.setter
    def R_LE(self, arg1: typing.Any) -> None:
        ...
    @property
    def R_PJ(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7, 3, 3): orientations of J in P at q = 0
        """
    @R_PJ.setter
    def R_PJ(self, arg1: typing.Any) -> None:
        ...
    @property
    def com(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 7), m: centres of mass in J
        """
    @com.setter
    def com(self, arg1: typing.Any) -> None:
        ...
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m/s^2, in B, default (0, 0, -9.81)
        """
    @gravity.setter
    def gravity(self, arg1: typing.Any) -> None:
        ...
    @property
    def inertia(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7, 3, 3), kg m^2: about the centres of mass, in J
        """
    @inertia.setter
    def inertia(self, arg1: typing.Any) -> None:
        ...
    @property
    def mass(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,), kg, > 0: of the links, no default
        """
    @mass.setter
    def mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def p_LE(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m: tool point in the last J
        """
    @p_LE.setter
    def p_LE(self, arg1: typing.Any) -> None:
        ...
    @property
    def p_PJ(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 7), m: column i is the position of J in P
        """
    @p_PJ.setter
    def p_PJ(self, arg1: typing.Any) -> None:
        ...
class ArmModel:
    """
    Kinematics and dynamics of a serial arm with seven revolute joints.
    """
    def __init__(self, params: ArmModelParams) -> None:
        ...
    def calc(self, q: typing.Any, v: typing.Any) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 7]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 7]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]]:
        """
        Takes q (7,), rad, and v (7,), rad/s.
        Returns (p_BE (3,), R_BE (3, 3), J_BE (6, 7), mass (7, 7), bias (7,) without gravity, gravity (7,) as Drake's CalcGravityGeneralizedForces, Jdot_v (6,)); six-vectors and rows are [linear; angular] of E in B.
        """
    @property
    def params(self) -> ArmModelParams:
        ...
class HapticControllerParams:
    """
    Parameters of HapticController.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('force_damping', 'max_force', 'max_moment', 'period')
    fields: typing.ClassVar[dict] = {'force_damping': 'Kvf_h, N s/m, >= 0, default 27', 'max_force': 'N, >= 0, default 12', 'max_moment': 'N m, >= 0, default 0', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> HapticControllerParams:
        ...
    def __deepcopy__(self, memo: dict) -> HapticControllerParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def force_damping(self) -> float:
        """
        Kvf_h, N s/m, >= 0, default 27
        """
    @force_damping.setter
    def force_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        N, >= 0, default 12
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_moment(self) -> float:
        """
        N m, >= 0, default 0
        """
    @max_moment.setter
    def max_moment(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
class HapticControllerState:
    """
    Memory of HapticController.
    """
    def __copy__(self) -> HapticControllerState:
        ...
    def __deepcopy__(self, memo: dict) -> HapticControllerState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        cycles refused
        """
class HapticController:
    """
    Open-loop force control of the haptic device, eq. (18).
    """
    def __init__(self, params: HapticControllerParams = ...) -> None:
        ...
    def make_state(self) -> HapticControllerState:
        ...
    def update(self, reference_force: typing.Any, reference_moment: typing.Any, device_velocity: typing.Any, force_selection: typing.Any, state: HapticControllerState) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Takes F_h (3,), N, M_h (3,), N m, v_h (6,) [linear; angular], Omega_fh (3, 3); in D.
        Returns the device wrench (6,) [force; moment] on the hand, in D.
        """
    @property
    def params(self) -> HapticControllerParams:
        ...
class OperatorPathParams:
    """
    Parameters of OperatorPath: where the operator wants the tool or the handle, and when.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'times': '(n,), s, strictly increasing, n >= 1', 'points': '(3, n), m, one column per time, in B for the tool or D for the handle', 'interpolation': '"minimum_jerk", "linear" or "cubic" (recorded motion)', 'rotations': '(3, n), rad, rotation vectors from the start, in the frame of `points`; or (3, 0): no rotation'}
    def __copy__(self) -> OperatorPathParams:
        ...
    def __deepcopy__(self, memo: dict) -> OperatorPathParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def interpolation(self) -> str:
        """
        "minimum_jerk", "linear" or "cubic" (recorded motion)
        """
    @interpolation.setter
    def interpolation(self, arg1: typing.Any) -> None:
        ...
    @property
    def points(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (3, n), m, one column per time, in B for the tool or D for the handle
        """
    @points.setter
    def points(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotations(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (3, n), rad, rotation vectors from the start, in the frame of `points`; or (3, 0): no rotation
        """
    @rotations.setter
    def rotations(self, arg1: typing.Any) -> None:
        ...
    @property
    def times(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,), s, strictly increasing, n >= 1
        """
    @times.setter
    def times(self, arg1: typing.Any) -> None:
        ...
class OperatorPath:
    """
    What the simulated operator intends: a path through given points at given times,
    at rest before the first and after the last.
    """
    @typing.overload
    def __init__(self, params: OperatorPathParams = ...) -> None:
        ...
    @typing.overload
    def __init__(self, times: typing.Any, points: typing.Any, interpolation: typing.Any = 'minimum_jerk', rotations: typing.Any | None = None) -> None:
        """
        times: (n,), s. points: (3, n), m. rotations: (3, n), rad, or (3, 0) for none.
        """
    def calc(self, time: typing.SupportsFloat | typing.SupportsIndex) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]]:
        """
        Intended (position, velocity) at a time (s): (3,), m and (3,), m/s, in the frame of the points.
        """
    def calc_rotation(self, time: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Intended rotation from the start, (3, 3).
        """
    @property
    def params(self) -> OperatorPathParams:
        ...
class SimulatedHapticDeviceParams:
    """
    Parameters of SimulatedHapticDevice; the defaults are an Omega.7 in a firm hand.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('hand_mass', 'hand_stiffness', 'hand_damping', 'device_mass', 'device_damping', 'max_force', 'workspace_radius', 'workspace_half_length', 'resolution', 'velocity_cutoff', 'period')
    fields: typing.ClassVar[dict] = {'hand_mass': 'kg, > 0, default 0.5', 'hand_stiffness': 'K, N/m, >= 0: pull to the intended position, default 600', 'hand_damping': 'B, N s/m, >= 0: pull to the intended velocity, default 30', 'device_mass': 'kg, > 0, at the handle, default 0.25', 'device_damping': 'N s/m, >= 0: friction of the device, default 1', 'max_force': 'N, >= 0: no larger force leaves the device, default 12', 'workspace_radius': 'm, > 0, about the x axis of D, default 0.08', 'workspace_half_length': 'm, > 0, along the x axis of D, default 0.055', 'resolution': 'm, >= 0: step of the position reading, default 1e-5', 'velocity_cutoff': 'Hz, >= 0: low-pass of the velocity reading (0: none), default 20', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> SimulatedHapticDeviceParams:
        ...
    def __deepcopy__(self, memo: dict) -> SimulatedHapticDeviceParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def device_damping(self) -> float:
        """
        N s/m, >= 0: friction of the device, default 1
        """
    @device_damping.setter
    def device_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def device_mass(self) -> float:
        """
        kg, > 0, at the handle, default 0.25
        """
    @device_mass.setter
    def device_mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def hand_damping(self) -> float:
        """
        B, N s/m, >= 0: pull to the intended velocity, default 30
        """
    @hand_damping.setter
    def hand_damping(self, arg1: typing.Any) -> None:
        ...
    @property
    def hand_mass(self) -> float:
        """
        kg, > 0, default 0.5
        """
    @hand_mass.setter
    def hand_mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def hand_stiffness(self) -> float:
        """
        K, N/m, >= 0: pull to the intended position, default 600
        """
    @hand_stiffness.setter
    def hand_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        N, >= 0: no larger force leaves the device, default 12
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def resolution(self) -> float:
        """
        m, >= 0: step of the position reading, default 1e-5
        """
    @resolution.setter
    def resolution(self, arg1: typing.Any) -> None:
        ...
    @property
    def velocity_cutoff(self) -> float:
        """
        Hz, >= 0: low-pass of the velocity reading (0: none), default 20
        """
    @velocity_cutoff.setter
    def velocity_cutoff(self, arg1: typing.Any) -> None:
        ...
    @property
    def workspace_half_length(self) -> float:
        """
        m, > 0, along the x axis of D, default 0.055
        """
    @workspace_half_length.setter
    def workspace_half_length(self, arg1: typing.Any) -> None:
        ...
    @property
    def workspace_radius(self) -> float:
        """
        m, > 0, about the x axis of D, default 0.08
        """
    @workspace_radius.setter
    def workspace_radius(self, arg1: typing.Any) -> None:
        ...
class SimulatedHapticDeviceState:
    """
    Where hand and device are, and what the driver reads.
    """
    def __copy__(self) -> SimulatedHapticDeviceState:
        ...
    def __deepcopy__(self, memo: dict) -> SimulatedHapticDeviceState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Updates with an intention or a wrench not usable.
        """
    @property
    def hand_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Pull of the hand, (3,), N, in D.
        """
    @property
    def intended(self) -> Pose:
        """
        The last valid pose X_DH that the operator intended.
        """
    @property
    def pose(self) -> Pose:
        """
        True pose X_DH of the handle.
        """
    @property
    def read_pose(self) -> Pose:
        """
        Pose X_DH as read.
        """
    @property
    def read_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Twist as read, (6,) [linear; angular], m/s and rad/s, in D.
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        True velocity of the handle, (3,), m/s, in D.
        """
class SimulatedHapticDevice:
    """
    A simulated haptic device in a simulated hand that pulls it along.
    """
    def __init__(self, params: SimulatedHapticDeviceParams = ...) -> None:
        ...
    def make_state(self, position: typing.Any = ..., rotation: typing.Any = ...) -> SimulatedHapticDeviceState:
        """
        At rest at this pose X_DH.
        """
    def update(self, intended_position: typing.Any, intended_rotation: typing.Any, intended_velocity: typing.Any, device_wrench: typing.Any, state: SimulatedHapticDeviceState) -> None:
        """
        Advances by one period.
        
        intended_position: (3,), m, in D. intended_rotation: R_DH, (3, 3).
        intended_velocity: (3,), m/s, in D.
        device_wrench: (6,) [force; moment], N and N m, in D: on the hand.
        """
    @property
    def params(self) -> SimulatedHapticDeviceParams:
        ...
class ForceTorqueSensorParams:
    """
    Parameters of ForceTorqueSensor.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('force_noise_std', 'moment_noise_std', 'force_bias', 'moment_bias', 'cutoff', 'tool_mass', 'tool_com', 'gravity', 'period')
    fields: typing.ClassVar[dict] = {'force_noise_std': 'N, >= 0, per axis and sample, default 0.2', 'moment_noise_std': 'N m, >= 0, per axis and sample, default 0.005', 'force_bias': '(3,), N, in S, default 0', 'moment_bias': '(3,), N m, in S, default 0', 'cutoff': "Hz, >= 0: the sensor's low-pass (0: none), default 0", 'tool_mass': 'kg, >= 0: mass beyond the sensor, whose weight is removed, default 0', 'tool_com': '(3,), m, in S: centre of that mass, default 0', 'gravity': 'm/s^2, >= 0, along -z of B, default 9.81', 'period': 's, > 0, default 0.001'}
    def __copy__(self) -> ForceTorqueSensorParams:
        ...
    def __deepcopy__(self, memo: dict) -> ForceTorqueSensorParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def cutoff(self) -> float:
        """
        Hz, >= 0: the sensor's low-pass (0: none), default 0
        """
    @cutoff.setter
    def cutoff(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), N, in S, default 0
        """
    @force_bias.setter
    def force_bias(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_noise_std(self) -> float:
        """
        N, >= 0, per axis and sample, default 0.2
        """
    @force_noise_std.setter
    def force_noise_std(self, arg1: typing.Any) -> None:
        ...
    @property
    def gravity(self) -> float:
        """
        m/s^2, >= 0, along -z of B, default 9.81
        """
    @gravity.setter
    def gravity(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), N m, in S, default 0
        """
    @moment_bias.setter
    def moment_bias(self, arg1: typing.Any) -> None:
        ...
    @property
    def moment_noise_std(self) -> float:
        """
        N m, >= 0, per axis and sample, default 0.005
        """
    @moment_noise_std.setter
    def moment_noise_std(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool_com(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in S: centre of that mass, default 0
        """
    @tool_com.setter
    def tool_com(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool_mass(self) -> float:
        """
        kg, >= 0: mass beyond the sensor, whose weight is removed, default 0
        """
    @tool_mass.setter
    def tool_mass(self, arg1: typing.Any) -> None:
        ...
class ForceTorqueSensorState:
    """
    What the sensor remembers, and its last output.
    """
    def __copy__(self) -> ForceTorqueSensorState:
        ...
    def __deepcopy__(self, memo: dict) -> ForceTorqueSensorState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Samples refused.
        """
    @property
    def measured(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [force; moment], N and N m, in S, before the weight is removed.
        """
    @property
    def wrench(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [force; moment] about E, N and N m, in B: robot on environment.
        """
class ForceTorqueSensor:
    """
    A simulated six-axis force/torque sensor between arm and tool.
    """
    def __init__(self, params: ForceTorqueSensorParams = ...) -> None:
        ...
    def make_state(self, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> ForceTorqueSensorState:
        """
        The same seed gives the same noise.
        """
    def update(self, reaction_S: typing.Any, R_BS: typing.Any, p_SE_B: typing.Any, state: ForceTorqueSensorState) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Takes a sample and returns `state.wrench`.
        
        reaction_S: (6,) [force; moment] about the origin of S, N and N m, in S: arm on tool.
        R_BS: (3, 3), rotation of the sensor. p_SE_B: (3,), m, from sensor to tool point, in B.
        """
    @property
    def params(self) -> ForceTorqueSensorParams:
        ...
class ContactSurfaceParams:
    """
    Parameters of ContactSurface.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'shape': '"plane" (solid where z < 0), "cylinder" (about x, endless) or "box", in the surface\'s frame', 'position': "(3,), m, in B: origin of the surface's frame", 'rotation': "(3, 3): rotation of the surface's frame in B", 'radius': 'm, > 0: of the cylinder, default 0.1', 'half_size': '(3,), m, > 0: of the box, default 0.1', 'stiffness': 'N/m, > 0, default 5000', 'dissipation': 's/m, >= 0: share by which the normal force grows per m/s of sinking in, default 2', 'friction': 'mu, >= 0, default 0', 'stiction_speed': 'm/s, > 0: below it friction grows linearly, default 0.01'}
    def __copy__(self) -> ContactSurfaceParams:
        ...
    def __deepcopy__(self, memo: dict) -> ContactSurfaceParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def dissipation(self) -> float:
        """
        s/m, >= 0: share by which the normal force grows per m/s of sinking in, default 2
        """
    @dissipation.setter
    def dissipation(self, arg1: typing.Any) -> None:
        ...
    @property
    def friction(self) -> float:
        """
        mu, >= 0, default 0
        """
    @friction.setter
    def friction(self, arg1: typing.Any) -> None:
        ...
    @property
    def half_size(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, > 0: of the box, default 0.1
        """
    @half_size.setter
    def half_size(self, arg1: typing.Any) -> None:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B: origin of the surface's frame
        """
    @position.setter
    def position(self, arg1: typing.Any) -> None:
        ...
    @property
    def radius(self) -> float:
        """
        m, > 0: of the cylinder, default 0.1
        """
    @radius.setter
    def radius(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3): rotation of the surface's frame in B
        """
    @rotation.setter
    def rotation(self, arg1: typing.Any) -> None:
        ...
    @property
    def shape(self) -> str:
        """
        "plane" (solid where z < 0), "cylinder" (about x, endless) or "box", in the surface's frame
        """
    @shape.setter
    def shape(self, arg1: typing.Any) -> None:
        ...
    @property
    def stiction_speed(self) -> float:
        """
        m/s, > 0: below it friction grows linearly, default 0.01
        """
    @stiction_speed.setter
    def stiction_speed(self, arg1: typing.Any) -> None:
        ...
    @property
    def stiffness(self) -> float:
        """
        N/m, > 0, default 5000
        """
    @stiffness.setter
    def stiffness(self, arg1: typing.Any) -> None:
        ...
class SurfaceContact:
    """
    A tool's contact with one surface.
    """
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N, in B: robot on surface.
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), unit vector INTO the surface, in B.
        """
    @property
    def normal_force(self) -> float:
        """
        N, >= 0.
        """
    @property
    def penetration(self) -> float:
        """
        m: depth of the tool; negative is the distance.
        """
class ContactSurface:
    """
    An analytic surface that a spherical tool touches, with friction.
    """
    def __init__(self, params: ContactSurfaceParams = ...) -> None:
        ...
    def calc(self, p: typing.Any, v: typing.Any, tool_radius: typing.SupportsFloat | typing.SupportsIndex) -> SurfaceContact:
        """
        p: (3,), m, centre of the tool. v: (3,), m/s. tool_radius: m. In B.
        """
    @property
    def params(self) -> ContactSurfaceParams:
        ...
class ContactSceneParams:
    """
    Parameters of ContactScene.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'surfaces': 'up to 8 ContactSurfaceParams, default none; read as a tuple of copies', 'tool_radius': 'm, >= 0: radius of the spherical tool, default 0'}
    def __copy__(self) -> ContactSceneParams:
        ...
    def __deepcopy__(self, memo: dict) -> ContactSceneParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def surfaces(self) -> tuple:
        """
        up to 8 ContactSurfaceParams, default none; read as a tuple of copies
        """
    @surfaces.setter
    def surfaces(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool_radius(self) -> float:
        """
        m, >= 0: radius of the spherical tool, default 0
        """
    @tool_radius.setter
    def tool_radius(self, arg1: typing.Any) -> None:
        ...
class SceneContact:
    """
    A tool's contact with a scene: the truth.
    """
    @property
    def count(self) -> int:
        """
        Number of surfaces with a normal force.
        """
    @property
    def dimension(self) -> int:
        """
        0 to 3: number of independent normals.
        """
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), N, in B: robot on scene.
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), unit vector along the sum of the normal forces, INTO the surface, in B; zero without contact.
        """
    @property
    def normal_forces(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (count,), N.
        """
    @property
    def normals(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, n]"]:
        """
        (3, count), unit vectors INTO the surfaces, in B.
        """
class _ContactTruth:
    """
    What the tool really touches, from a simulator's contacts; see the C++ header.
    """
    def __init__(self) -> None:
        ...
    def add(self, force: typing.Any, normal: typing.Any, p: typing.Any = None) -> None:
        """
        Takes one more contact: force, (3,), N, of the tool on its environment; unit
        normal, (3,), INTO the surface; place, (3,), m, for moments. All in B.
        """
    def to_vector(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[11, 1]"]:
        """
        (11,): force 3, normal 3, dimension 1; moment dimension 1, axis of free
        rotation 3.
        """
class ContactScene:
    """
    A few surfaces and the tool that touches them.
    """
    def __init__(self, params: ContactSceneParams = ...) -> None:
        ...
    def calc(self, p: typing.Any, v: typing.Any) -> SceneContact:
        """
        p: (3,), m, centre of the tool. v: (3,), m/s. In B.
        """
    @property
    def params(self) -> ContactSceneParams:
        ...
class PointRobotParams:
    """
    Parameters of PointRobot.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'mass': 'kg, > 0, default 1', 'period': 's, > 0, default 0.001', 'substeps': 'integration steps per period, 1 to 1000, default 4'}
    def __copy__(self) -> PointRobotParams:
        ...
    def __deepcopy__(self, memo: dict) -> PointRobotParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def mass(self) -> float:
        """
        kg, > 0, default 1
        """
    @mass.setter
    def mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def period(self) -> float:
        """
        s, > 0, default 0.001
        """
    @period.setter
    def period(self, arg1: typing.Any) -> None:
        ...
    @property
    def substeps(self) -> int:
        """
        integration steps per period, 1 to 1000, default 4
        """
    @substeps.setter
    def substeps(self, arg1: typing.Any) -> None:
        ...
class PointRobotState:
    """
    Where the point robot is and what it touches there.
    """
    def __copy__(self) -> PointRobotState:
        ...
    def __deepcopy__(self, memo: dict) -> PointRobotState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        Updates with a force that was not finite.
        """
    @property
    def contact(self) -> SceneContact:
        """
        SceneContact at this position and velocity.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), m, in B.
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), m/s, in B.
        """
class PointRobot:
    """
    A mass without gravity that touches a ContactScene.
    """
    def __init__(self, params: PointRobotParams = ..., scene: ContactSceneParams = ...) -> None:
        ...
    def make_state(self, position: typing.Any = ...) -> PointRobotState:
        """
        At rest at this position, m, in B.
        """
    def update(self, control_force: typing.Any, state: PointRobotState) -> None:
        """
        Advances by one period under a force, (3,), N, in B.
        """
    @property
    def params(self) -> PointRobotParams:
        ...
    @property
    def scene(self) -> ContactScene:
        ...
class PositionForceHapticSideParams:
    """
    Parameters of PositionForceHapticSide.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('map', 'link', 'force_scale', 'max_force')
    fields: typing.ClassVar[dict] = {'map': 'only its R_DB matters', 'link': 'link monitor', 'force_scale': "share of the robot's force that the hand feels, >= 0, default 0.4", 'max_force': 'bound on the force on the hand, N, >= 0, default 12'}
    def __copy__(self) -> PositionForceHapticSideParams:
        ...
    def __deepcopy__(self, memo: dict) -> PositionForceHapticSideParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def force_scale(self) -> float:
        """
        share of the robot's force that the hand feels, >= 0, default 0.4
        """
    @force_scale.setter
    def force_scale(self, arg1: typing.Any) -> None:
        ...
    @property
    def link(self) -> LinkMonitorParams:
        """
        link monitor
        """
    @link.setter
    def link(self, arg1: typing.Any) -> None:
        ...
    @property
    def map(self) -> WorkspaceMapParams:
        """
        only its R_DB matters
        """
    @map.setter
    def map(self, arg1: typing.Any) -> None:
        ...
    @property
    def max_force(self) -> float:
        """
        bound on the force on the hand, N, >= 0, default 12
        """
    @max_force.setter
    def max_force(self, arg1: typing.Any) -> None:
        ...
class PositionForceHapticSideState:
    """
    State and output of PositionForceHapticSide.
    """
    def __copy__(self) -> PositionForceHapticSideState:
        ...
    def __deepcopy__(self, memo: dict) -> PositionForceHapticSideState:
        ...
    @property
    def link(self) -> LinkMonitorState:
        """
        State of the link monitor.
        """
    @property
    def reference_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_h, (3,), N, in D: on the hand.
        """
    @property
    def sensed_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_s of the message in use, (3,), N, in B.
        """
class PositionForceHapticSide:
    """
    Haptic side of the two-channel scheme: the sensed force comes straight back,
    F_h = -force_scale R_DB F_s.
    """
    def __init__(self, params: PositionForceHapticSideParams = ...) -> None:
        ...
    def make_state(self) -> PositionForceHapticSideState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, message: ForceMessage, state: PositionForceHapticSideState) -> None:
        """
        Looks at the newest message (ForceMessage), which may be the last one again.
        Sets `state.reference_force`. time: s, receiver's clock.
        """
    @property
    def params(self) -> PositionForceHapticSideParams:
        ...
class WindowMeanState:
    """
    Memory of WindowMean, and its result.
    """
    def __copy__(self) -> WindowMeanState:
        ...
    def __deepcopy__(self, memo: dict) -> WindowMeanState:
        ...
    @property
    def bad_inputs(self) -> int:
        """
        samples refused
        """
    @property
    def mean(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), zero before any sample
        """
    @property
    def samples(self) -> int:
        """
        in the current window so far
        """
class WindowMean:
    """
    Mean of a 3-vector over the current window [k T, (k + 1) T): what a process that
    runs every T takes.
    """
    def __init__(self, window: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        window: T, s, > 0.
        """
    def make_state(self) -> WindowMeanState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, value: typing.Any, state: WindowMeanState) -> None:
        """
        Takes a sample, (3,); the mean with it is in `state.mean`. One that is not finite is
        refused and counted.
        """
    @property
    def window(self) -> float:
        """
        s
        """
class RobotSideParams:
    """
    Parameters of RobotSide; all `period` fields are the same.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'proxy': 'RobotSideProxyParams', 'controller': 'OperationalSpaceControllerParams', 'sender': 'PoseSenderParams', 'filter_period': "s, >= period: over which the filter's inputs are averaged, default 1/15", 'angular_filter_period': 's, >= period: the same of the angular filter; 0, the default, is without one'}
    def __copy__(self) -> RobotSideParams:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def angular_filter_period(self) -> float:
        """
        s, >= period: the same of the angular filter; 0, the default, is without one
        """
    @angular_filter_period.setter
    def angular_filter_period(self, arg1: typing.Any) -> None:
        ...
    @property
    def controller(self) -> OperationalSpaceControllerParams:
        """
        OperationalSpaceControllerParams
        """
    @controller.setter
    def controller(self, arg1: typing.Any) -> None:
        ...
    @property
    def filter_period(self) -> float:
        """
        s, >= period: over which the filter's inputs are averaged, default 1/15
        """
    @filter_period.setter
    def filter_period(self, arg1: typing.Any) -> None:
        ...
    @property
    def proxy(self) -> RobotSideProxyParams:
        """
        RobotSideProxyParams
        """
    @proxy.setter
    def proxy(self, arg1: typing.Any) -> None:
        ...
    @property
    def sender(self) -> PoseSenderParams:
        """
        PoseSenderParams
        """
    @sender.setter
    def sender(self, arg1: typing.Any) -> None:
        ...
class FilterMeans:
    """
    Inputs of the force-space particle filter, in B.
    """
    def __copy__(self) -> FilterMeans:
        ...
    def __deepcopy__(self, memo: dict) -> FilterMeans:
        ...
    @property
    def contact_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_f, (3,), N
        """
    @property
    def motion_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_m, (3,), N
        """
    @property
    def sensed_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_s, (3,), N
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        v_BE, (3,), m/s
        """
class AngularFilterMeans:
    """
    Inputs of the angular filter, in B; moments about E.
    """
    def __copy__(self) -> AngularFilterMeans:
        ...
    def __deepcopy__(self, memo: dict) -> AngularFilterMeans:
        ...
    @property
    def angular_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        w_BE, (3,), rad/s
        """
    @property
    def contact_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_f, (3,), N m
        """
    @property
    def motion_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_m, (3,), N m
        """
    @property
    def sensed_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_s, (3,), N m
        """
class RobotSideOutput:
    """
    Results of one cycle, in B.
    """
    def __copy__(self) -> RobotSideOutput:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideOutput:
        ...
    def as_vector(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        All signals as one flat float64 vector, by `output_layout()`.
        """
    @property
    def angular_filter_means(self) -> AngularFilterMeans:
        """
        the same of the angular filter, zero without one
        """
    @property
    def bad_inputs(self) -> int:
        """
        cycles refused so far
        """
    @property
    def controller(self) -> OperationalSpaceControllerOutput:
        ...
    @property
    def filter_means(self) -> FilterMeans:
        """
        means since the filter's last update
        """
    @property
    def force_message(self) -> ForceMessage:
        """
        the same for the two-channel baseline
        """
    @property
    def link_age(self) -> float:
        """
        s
        """
    @property
    def link_dropped(self) -> int:
        """
        messages refused so far
        """
    @property
    def link_status(self) -> LinkStatus:
        ...
    @property
    def message(self) -> PoseMessage:
        """
        newest PoseMessage to the haptic side
        """
    @property
    def motion_error(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        dx_m, (3,), m
        """
    @property
    def proxy_acceleration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [linear; angular]
        """
    @property
    def proxy_position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        x_pr after its limiter, (3,), m
        """
    @property
    def proxy_rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3)
        """
    @property
    def proxy_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [linear; angular]
        """
    @property
    def reference_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_r, (3,), N
        """
    @property
    def reference_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_r, (3,), N m
        """
    @property
    def rotation_error(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), rad
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[7, 1]"]:
        """
        (7,), N m
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        v_BE, (6,) [linear; angular]
        """
class RobotSideState:
    """
    Memory of RobotSide.
    """
    def __copy__(self) -> RobotSideState:
        ...
    def __deepcopy__(self, memo: dict) -> RobotSideState:
        ...
    @property
    def controller(self) -> OperationalSpaceControllerState:
        ...
    @property
    def output(self) -> RobotSideOutput:
        """
        of the last cycle
        """
class RobotSide:
    """
    All of the robot side's work in one control cycle: proxy, controller, means for the filter, senders.
    """
    @staticmethod
    def calc_twist(jacobian: typing.Any, v: typing.Any) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Twist of the tool point, (6,) [linear; angular], with the very bits that `update` uses.
        """
    @staticmethod
    def output_layout() -> dict:
        """
        {signal: slice} of `output.as_vector()`, in its order. A 3x3 matrix is row-major, a rotation a quaternion w, x, y, z.
        """
    @staticmethod
    def output_size() -> int:
        """
        Length of `output.as_vector()`.
        """
    def __init__(self, params: RobotSideParams = ...) -> None:
        ...
    def make_state(self) -> RobotSideState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, message: PoseMessage, robot_position: typing.Any, robot_rotation: typing.Any, jacobian: typing.Any, mass: typing.Any, bias: typing.Any, gravity: typing.Any, jdot_v: typing.Any, q: typing.Any, v: typing.Any, force_selection: typing.Any, moment_selection: typing.Any, sensed_wrench: typing.Any, state: RobotSideState) -> None:
        """
        Advances `state` by one period; results are in `state.output`. Six-vectors are [linear; angular] or [force; moment], in B; jacobian (6, 7), mass (7, 7), bias (7,) without gravity, gravity (7,) as Drake's CalcGravityGeneralizedForces.
        """
    @property
    def params(self) -> RobotSideParams:
        ...
class HapticSideParams:
    """
    Parameters of HapticSide; all `period` fields are the same.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'proxy': 'HapticSideProxyParams', 'controller': 'HapticControllerParams', 'sender': 'PoseSenderParams'}
    def __copy__(self) -> HapticSideParams:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def controller(self) -> HapticControllerParams:
        """
        HapticControllerParams
        """
    @controller.setter
    def controller(self, arg1: typing.Any) -> None:
        ...
    @property
    def proxy(self) -> HapticSideProxyParams:
        """
        HapticSideProxyParams
        """
    @proxy.setter
    def proxy(self, arg1: typing.Any) -> None:
        ...
    @property
    def sender(self) -> PoseSenderParams:
        """
        PoseSenderParams
        """
    @sender.setter
    def sender(self, arg1: typing.Any) -> None:
        ...
class HapticSideOutput:
    """
    Results of one cycle, in D.
    """
    def __copy__(self) -> HapticSideOutput:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideOutput:
        ...
    def as_vector(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        All signals as one flat float64 vector, by `output_layout()`.
        """
    @property
    def bad_inputs(self) -> int:
        """
        cycles refused so far
        """
    @property
    def device_wrench(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) [force; moment] on the hand, N, N m
        """
    @property
    def force_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Omega_fh, (3, 3)
        """
    @property
    def link_age(self) -> float:
        """
        s
        """
    @property
    def link_dropped(self) -> int:
        """
        messages refused so far
        """
    @property
    def link_status(self) -> LinkStatus:
        ...
    @property
    def message(self) -> PoseMessage:
        """
        newest PoseMessage to the robot side
        """
    @property
    def moment_selection(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3)
        """
    @property
    def proxy_position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        x_ph, (3,), m
        """
    @property
    def proxy_rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3)
        """
    @property
    def reference_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        F_h, on the hand, (3,), N
        """
    @property
    def reference_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        M_h, on the hand, (3,), N m
        """
class HapticSideState:
    """
    Memory of HapticSide.
    """
    def __copy__(self) -> HapticSideState:
        ...
    def __deepcopy__(self, memo: dict) -> HapticSideState:
        ...
    @property
    def output(self) -> HapticSideOutput:
        """
        of the last cycle
        """
class HapticSide:
    """
    All of the haptic side's work in one control cycle: proxy, device controller, sender.
    """
    @staticmethod
    def output_layout() -> dict:
        """
        {signal: slice} of `output.as_vector()`, in its order. A 3x3 matrix is row-major, a rotation a quaternion w, x, y, z.
        """
    @staticmethod
    def output_size() -> int:
        """
        Length of `output.as_vector()`.
        """
    def __init__(self, params: HapticSideParams = ...) -> None:
        ...
    def make_state(self) -> HapticSideState:
        ...
    def update(self, time: typing.SupportsFloat | typing.SupportsIndex, message: PoseMessage, device_position: typing.Any, device_rotation: typing.Any, device_velocity: typing.Any, state: HapticSideState) -> None:
        """
        Advances `state` by one period; results are in `state.output`. Device pose from home, velocity (6,) [linear; angular], in D.
        """
    @property
    def params(self) -> HapticSideParams:
        ...
class ScenarioError(ValueError):
    """
    A scenario is wrong; the message is one line that names the field.
    """
class BoxParams:
    """
    A box fixed in the world that the tool can touch.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('name', 'center', 'size', 'yaw', 'color')
    fields: typing.ClassVar[dict] = {'name': 'unique within the scene', 'center': '(3,), m, in B', 'size': "(3,), m, full edge lengths along the box's axes, in [1e-4, 10]", 'yaw': 'rad, rotation of the box about base z, default 0', 'color': '(4,), red, green, blue, opacity, in [0, 1], default (0.80, 0.70, 0.56, 1)'}
    def __copy__(self) -> BoxParams:
        ...
    def __deepcopy__(self, memo: dict) -> BoxParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def center(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B
        """
    @center.setter
    def center(self, arg1: typing.Any) -> None:
        ...
    @property
    def color(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,), red, green, blue, opacity, in [0, 1], default (0.80, 0.70, 0.56, 1)
        """
    @color.setter
    def color(self, arg1: typing.Any) -> None:
        ...
    @property
    def name(self) -> str:
        """
        unique within the scene
        """
    @name.setter
    def name(self, arg1: typing.Any) -> None:
        ...
    @property
    def size(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, full edge lengths along the box's axes, in [1e-4, 10]
        """
    @size.setter
    def size(self, arg1: typing.Any) -> None:
        ...
    @property
    def yaw(self) -> float:
        """
        rad, rotation of the box about base z, default 0
        """
    @yaw.setter
    def yaw(self, arg1: typing.Any) -> None:
        ...
class PandaSceneParams:
    """
    The simulated arm's surroundings and how contact is computed.
    """
    CORNER_RADIUS: typing.ClassVar[float] = 0.005
    TIP_RADIUS: typing.ClassVar[float] = 0.01
    TOOL_COM_S: typing.ClassVar[tuple] = (0.0, 0.0, 0.035)
    TOOL_MASS: typing.ClassVar[float] = 0.2
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('table_height', 'table_center', 'table_size', 'boxes', 'friction', 'contact_stiffness', 'contact_dissipation', 'relaxation_time', 'contact_approximation', 'time_step', 'tool', 'tool_size', 'tool_mass', 'gravity', 'start_position')
    fields: typing.ClassVar[dict] = {'table_height': "m, height of the table's top over B, in [1e-3, 1.5]; the table stands on z = 0; default 0.1", 'table_center': "(2,), m, x and y of the table's centre, default (0.5, 0)", 'table_size': '(2,), m, edge lengths along x and y, in [1e-3, 10], default (0.6, 0.8)', 'boxes': 'further BoxParams that the tool can touch (walls, steps)', 'friction': 'Coulomb coefficient between the tool and everything, in [0, 5], default 0.3', 'contact_stiffness': 'N/m, of tool and surface together, in [1, 1e8], default 3e4; the corners of a flat tool share it', 'contact_dissipation': 's/m, Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), in [0, 1000]; for the approximations lagged and similar; default 10', 'relaxation_time': 's, linear dissipation in place of contact_dissipation for sap, in [0, 10], default 0.01', 'contact_approximation': '"lagged", "similar" or "sap": Drake\'s discrete contact approximation; the first two keep Coulomb\'s law without sap\'s gap of friction * time_step * slip; default "lagged"', 'time_step': "s, step of the plant, and period of both sides' control, in [1e-5, 1e-2], default 0.001", 'tool': '"sphere": a ball around E, or "flat": a square pad, E in the middle of its face, that touches with a small ball in each corner; default "sphere"', 'tool_size': 'm, between the corners of a flat tool along its edges, in [0.005, 0.2], default 0.06', 'tool_mass': 'kg, of all that is beyond the flange, in [1e-3, 3]; the inertia scales with it; default 0.2', 'gravity': 'm/s^2, along -z of B, in [0, 100], default 9.81', 'start_position': '(3,), m, in B, of the tool point at time 0, in [-2, 2], default (0.45, 0, 0.18)'}
    def __copy__(self) -> PandaSceneParams:
        ...
    def __deepcopy__(self, memo: dict) -> PandaSceneParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def all_boxes(self) -> tuple:
        """
        The table followed by `boxes`, as BoxParams.
        """
    def corners(self) -> tuple:
        """
        Centres of a flat tool's corners, four (3,), m, in E.
        """
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def boxes(self) -> tuple:
        """
        further BoxParams that the tool can touch (walls, steps)
        """
    @boxes.setter
    def boxes(self, arg1: typing.Any) -> None:
        ...
    @property
    def contact_approximation(self) -> str:
        """
        "lagged", "similar" or "sap": Drake's discrete contact approximation; the first two keep Coulomb's law without sap's gap of friction * time_step * slip; default "lagged"
        """
    @contact_approximation.setter
    def contact_approximation(self, arg1: typing.Any) -> None:
        ...
    @property
    def contact_dissipation(self) -> float:
        """
        s/m, Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), in [0, 1000]; for the approximations lagged and similar; default 10
        """
    @contact_dissipation.setter
    def contact_dissipation(self, arg1: typing.Any) -> None:
        ...
    @property
    def contact_height(self) -> float:
        """
        Height of the tool point when the tool, pointing down, touches the table, m.
        """
    @property
    def contact_stiffness(self) -> float:
        """
        N/m, of tool and surface together, in [1, 1e8], default 3e4; the corners of a flat tool share it
        """
    @contact_stiffness.setter
    def contact_stiffness(self, arg1: typing.Any) -> None:
        ...
    @property
    def friction(self) -> float:
        """
        Coulomb coefficient between the tool and everything, in [0, 5], default 0.3
        """
    @friction.setter
    def friction(self, arg1: typing.Any) -> None:
        ...
    @property
    def gravity(self) -> float:
        """
        m/s^2, along -z of B, in [0, 100], default 9.81
        """
    @gravity.setter
    def gravity(self, arg1: typing.Any) -> None:
        ...
    @property
    def relaxation_time(self) -> float:
        """
        s, linear dissipation in place of contact_dissipation for sap, in [0, 10], default 0.01
        """
    @relaxation_time.setter
    def relaxation_time(self, arg1: typing.Any) -> None:
        ...
    @property
    def start_position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B, of the tool point at time 0, in [-2, 2], default (0.45, 0, 0.18)
        """
    @start_position.setter
    def start_position(self, arg1: typing.Any) -> None:
        ...
    @property
    def table_center(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,), m, x and y of the table's centre, default (0.5, 0)
        """
    @table_center.setter
    def table_center(self, arg1: typing.Any) -> None:
        ...
    @property
    def table_height(self) -> float:
        """
        m, height of the table's top over B, in [1e-3, 1.5]; the table stands on z = 0; default 0.1
        """
    @table_height.setter
    def table_height(self, arg1: typing.Any) -> None:
        ...
    @property
    def table_size(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,), m, edge lengths along x and y, in [1e-3, 10], default (0.6, 0.8)
        """
    @table_size.setter
    def table_size(self, arg1: typing.Any) -> None:
        ...
    @property
    def time_step(self) -> float:
        """
        s, step of the plant, and period of both sides' control, in [1e-5, 1e-2], default 0.001
        """
    @time_step.setter
    def time_step(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool(self) -> str:
        """
        "sphere": a ball around E, or "flat": a square pad, E in the middle of its face, that touches with a small ball in each corner; default "sphere"
        """
    @tool.setter
    def tool(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool_mass(self) -> float:
        """
        kg, of all that is beyond the flange, in [1e-3, 3]; the inertia scales with it; default 0.2
        """
    @tool_mass.setter
    def tool_mass(self, arg1: typing.Any) -> None:
        ...
    @property
    def tool_size(self) -> float:
        """
        m, between the corners of a flat tool along its edges, in [0.005, 0.2], default 0.06
        """
    @tool_size.setter
    def tool_size(self, arg1: typing.Any) -> None:
        ...
class LinkParams:
    """
    Both directions of the link alike; in a scenario the keys of all three stand directly in `link`.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('rate', 'average', 'period', 'delay', 'jitter', 'loss', 'reordering', 'timeout', 'max_age', 'spike_threshold')
    fields: typing.ClassVar[dict] = {'sender': 'PoseSenderParams', 'channel': 'CommunicationChannelParams', 'monitor': 'LinkMonitorParams'}
    def __copy__(self) -> LinkParams:
        ...
    def __deepcopy__(self, memo: dict) -> LinkParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def channel(self) -> CommunicationChannelParams:
        """
        CommunicationChannelParams
        """
    @channel.setter
    def channel(self, arg1: typing.Any) -> None:
        ...
    @property
    def delay(self) -> float:
        """
        One-way delay, s.
        """
    @property
    def monitor(self) -> LinkMonitorParams:
        """
        LinkMonitorParams
        """
    @monitor.setter
    def monitor(self, arg1: typing.Any) -> None:
        ...
    @property
    def rate(self) -> float:
        """
        Messages per second.
        """
    @property
    def sender(self) -> PoseSenderParams:
        """
        PoseSenderParams
        """
    @sender.setter
    def sender(self, arg1: typing.Any) -> None:
        ...
class Waypoint:
    """
    A place to be at rest at a time.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('time', 'position', 'rotation')
    fields: typing.ClassVar[dict] = {'time': 's, in [0, 3600]', 'position': '(3,), m, in B, in [-2, 2]', 'rotation': '(3,), rad, in B, in [-pi, pi]: rotation vector of the tool from map.R_cw, default 0'}
    def __copy__(self) -> Waypoint:
        ...
    def __deepcopy__(self, memo: dict) -> Waypoint:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), m, in B, in [-2, 2]
        """
    @position.setter
    def position(self, arg1: typing.Any) -> None:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), rad, in B, in [-pi, pi]: rotation vector of the tool from map.R_cw, default 0
        """
    @rotation.setter
    def rotation(self, arg1: typing.Any) -> None:
        ...
    @property
    def time(self) -> float:
        """
        s, in [0, 3600]
        """
    @time.setter
    def time(self, arg1: typing.Any) -> None:
        ...
class OperatorParams:
    """
    What the operator means to do, in the robot's frame B.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('waypoints', 'recording', 'press_depth')
    fields: typing.ClassVar[dict] = {'waypoints': 'of Waypoint: minimum-jerk moves from each to the next; first at time 0', 'recording': 'CSV file of a human motion, in place of the waypoints; relative to the working directory', 'press_depth': "m, how far below first touch a recording's contact height goes, in [0, 0.1], default 0.04"}
    def __copy__(self) -> OperatorParams:
        ...
    def __deepcopy__(self, memo: dict) -> OperatorParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def press_depth(self) -> float:
        """
        m, how far below first touch a recording's contact height goes, in [0, 0.1], default 0.04
        """
    @press_depth.setter
    def press_depth(self, arg1: typing.Any) -> None:
        ...
    @property
    def recording(self) -> str:
        """
        CSV file of a human motion, in place of the waypoints; relative to the working directory
        """
    @recording.setter
    def recording(self, arg1: typing.Any) -> None:
        ...
    @property
    def waypoints(self) -> tuple:
        """
        of Waypoint: minimum-jerk moves from each to the next; first at time 0
        """
    @waypoints.setter
    def waypoints(self, arg1: typing.Any) -> None:
        ...
class AngularFilterParams:
    """
    The angular filter: a force-space particle filter of moments and angular
    velocity. In a scenario the keys of `filter` stand directly in `angular_filter`.
    """
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('enabled', 'num_particles', 'period', 'likelihood', 'scatter_mean', 'scatter_std', 'update_thresholds', 'resampling_thresholds', 'alpha_add', 'alpha_remove', 'epsilon', 'prior_particles', 'prior_std', 'friction_cone')
    fields: typing.ClassVar[dict] = {'enabled': 'whether it runs, default false', 'filter': 'ForceSpaceParticleFilterParams, with N m for N and rad/s for m/s; thresholds by default (0.08, 0.2, 0.02, 0.1) for update, (0, 0.05, 0.02, 0.2) for resampling'}
    def __copy__(self) -> AngularFilterParams:
        ...
    def __deepcopy__(self, memo: dict) -> AngularFilterParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def enabled(self) -> bool:
        """
        whether it runs, default false
        """
    @enabled.setter
    def enabled(self, arg1: typing.Any) -> None:
        ...
    @property
    def filter(self) -> ForceSpaceParticleFilterParams:
        """
        ForceSpaceParticleFilterParams, with N m for N and rad/s for m/s; thresholds by default (0.08, 0.2, 0.02, 0.1) for update, (0, 0.05, 0.02, 0.2) for resampling
        """
    @filter.setter
    def filter(self, arg1: typing.Any) -> None:
        ...
class Scenario:
    """
    The fields of a scenario. Use dual_proxy.Scenario, which adds mappings and YAML.
    """
    LAWS: typing.ClassVar[tuple] = ('default', 'printed')
    SCHEMES: typing.ClassVar[tuple] = ('dual_proxy', 'position_force')
    __hash__: typing.ClassVar[None] = None
    _serialized_names: typing.ClassVar[tuple] = ('description', 'robot', 'scheme', 'law', 'duration', 'extend_for_delay', 'seed', 'scene', 'map', 'link', 'robot_proxy', 'controller', 'filter', 'angular_filter', 'haptic_proxy', 'haptic_controller', 'position_force', 'device', 'sensor', 'operator', 'overrides')
    fields: typing.ClassVar[dict] = {'name': 'top-level key of the YAML file', 'description': 'one line', 'robot': '"panda"', 'scheme': '"dual_proxy" or "position_force", the two-channel baseline', 'law': '"default", this project\'s, or "printed", the paper\'s to the letter', 'duration': 's, in [0.001, 3600], default 20', 'extend_for_delay': "lengthen the run to the end of the operator's path + 3 x delay + 2 s, so that a late release is part of it; setting `duration` by an override turns this off; default true", 'seed': 'of everything random, >= 0, default 0', 'scene': 'PandaSceneParams', 'map': 'WorkspaceMapParams; its p_cw is a copy', 'link': 'LinkParams', 'robot_proxy': 'RobotSideProxyParams', 'controller': 'OperationalSpaceControllerParams', 'filter': 'ForceSpaceParticleFilterParams', 'angular_filter': 'AngularFilterParams', 'haptic_proxy': 'HapticSideProxyParams', 'haptic_controller': 'HapticControllerParams', 'position_force': 'PositionForceHapticSideParams', 'device': 'SimulatedHapticDeviceParams', 'sensor': 'ForceTorqueSensorParams', 'operator': 'OperatorParams'}
    def __copy__(self) -> Scenario:
        ...
    def __deepcopy__(self, memo: dict) -> Scenario:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def _apply_presets(self) -> None:
        """
        Sets what `scheme` and `law` decide.
        """
    def _calc_operator_path(self) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"], bool, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]]:
        """
        Where the operator means the tool to go: times (n,), s; positions (n, 3), m, in B;
        whether it is densely sampled; rotation vectors from map.R_cw, (n, 3), rad, in B, or (0, 3)
        for none. Raises ScenarioError if a recording cannot be read.
        """
    def _read(self, mapping: dict) -> None:
        """
        Reads what a YAML file has below the scenario's name; presets and overrides included.
        Raises ScenarioError.
        """
    def _write(self) -> dict:
        """
        The mapping that _read() reads, without overrides.
        """
    def calc_seed(self, stream: str) -> int:
        """
        The seed of a stream of random numbers, from `seed`: of the "filter", the "sensor", the
        channels "to_robot" and "to_device", the "angular_filter".
        """
    def reachable(self, points: typing.Any) -> typing.Annotated[numpy.typing.NDArray[numpy.bool], "[m, 1]"]:
        """
        Tells which points, (n, 3), m, in B, the device can ask for: (n,) bool.
        
        They lie, mapped to the device, within 95 % of its workspace, and over the table. The set
        is convex.
        """
    def run_duration(self) -> float:
        """
        How long a run lasts, s; see `extend_for_delay`. Raises ScenarioError if a recording
        cannot be read.
        """
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def angular_filter(self) -> AngularFilterParams:
        """
        AngularFilterParams
        """
    @angular_filter.setter
    def angular_filter(self, arg1: typing.Any) -> None:
        ...
    @property
    def controller(self) -> OperationalSpaceControllerParams:
        """
        OperationalSpaceControllerParams
        """
    @controller.setter
    def controller(self, arg1: typing.Any) -> None:
        ...
    @property
    def description(self) -> str:
        """
        one line
        """
    @description.setter
    def description(self, arg1: typing.Any) -> None:
        ...
    @property
    def device(self) -> SimulatedHapticDeviceParams:
        """
        SimulatedHapticDeviceParams
        """
    @device.setter
    def device(self, arg1: typing.Any) -> None:
        ...
    @property
    def duration(self) -> float:
        """
        s, in [0.001, 3600], default 20
        """
    @duration.setter
    def duration(self, arg1: typing.Any) -> None:
        ...
    @property
    def extend_for_delay(self) -> bool:
        """
        lengthen the run to the end of the operator's path + 3 x delay + 2 s, so that a late release is part of it; setting `duration` by an override turns this off; default true
        """
    @extend_for_delay.setter
    def extend_for_delay(self, arg1: typing.Any) -> None:
        ...
    @property
    def filter(self) -> ForceSpaceParticleFilterParams:
        """
        ForceSpaceParticleFilterParams
        """
    @filter.setter
    def filter(self, arg1: typing.Any) -> None:
        ...
    @property
    def haptic_controller(self) -> HapticControllerParams:
        """
        HapticControllerParams
        """
    @haptic_controller.setter
    def haptic_controller(self, arg1: typing.Any) -> None:
        ...
    @property
    def haptic_proxy(self) -> HapticSideProxyParams:
        """
        HapticSideProxyParams
        """
    @haptic_proxy.setter
    def haptic_proxy(self, arg1: typing.Any) -> None:
        ...
    @property
    def has_angular_filter(self) -> bool:
        """
        Whether the angular filter runs: it is enabled, and the scheme has it.
        """
    @property
    def law(self) -> str:
        """
        "default", this project's, or "printed", the paper's to the letter
        """
    @law.setter
    def law(self, arg1: typing.Any) -> None:
        ...
    @property
    def link(self) -> LinkParams:
        """
        LinkParams
        """
    @link.setter
    def link(self, arg1: typing.Any) -> None:
        ...
    @property
    def map(self) -> WorkspaceMapParams:
        """
        WorkspaceMapParams; its p_cw is a copy
        """
    @map.setter
    def map(self, arg1: typing.Any) -> None:
        ...
    @property
    def name(self) -> str:
        """
        top-level key of the YAML file
        """
    @name.setter
    def name(self, arg1: typing.Any) -> None:
        ...
    @property
    def operator(self) -> OperatorParams:
        """
        OperatorParams
        """
    @operator.setter
    def operator(self, arg1: typing.Any) -> None:
        ...
    @property
    def position_force(self) -> PositionForceHapticSideParams:
        """
        PositionForceHapticSideParams
        """
    @position_force.setter
    def position_force(self, arg1: typing.Any) -> None:
        ...
    @property
    def robot(self) -> str:
        """
        "panda"
        """
    @robot.setter
    def robot(self, arg1: typing.Any) -> None:
        ...
    @property
    def robot_proxy(self) -> RobotSideProxyParams:
        """
        RobotSideProxyParams
        """
    @robot_proxy.setter
    def robot_proxy(self, arg1: typing.Any) -> None:
        ...
    @property
    def scene(self) -> PandaSceneParams:
        """
        PandaSceneParams
        """
    @scene.setter
    def scene(self, arg1: typing.Any) -> None:
        ...
    @property
    def scheme(self) -> str:
        """
        "dual_proxy" or "position_force", the two-channel baseline
        """
    @scheme.setter
    def scheme(self, arg1: typing.Any) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        of everything random, >= 0, default 0
        """
    @seed.setter
    def seed(self, arg1: typing.Any) -> None:
        ...
    @property
    def sensor(self) -> ForceTorqueSensorParams:
        """
        ForceTorqueSensorParams
        """
    @sensor.setter
    def sensor(self, arg1: typing.Any) -> None:
        ...
class FilterTrialParams:
    """
    Parameters of run_filter_trial(). `seed` decides what is not here: the scene's
    orientation, details of the path, stiffness of contact and controller, the tool's
    radius, the noise, and when the first update is.
    """
    __hash__: typing.ClassVar[None] = None
    fields: typing.ClassVar[dict] = {'scene': '"free", "plane", "cylinder", "inner_corner", "step_edge", "still", "grazing" or "soft", default "plane"', 'drive': '"closed_loop" (point robot with the filter\'s selections), "true_selection" (with the true ones, 20 ms late) or "kinematic" (no dynamics), default "closed_loop"', 'friction': 'mu, 0 to 2, default 0.3', 'speed': 'm/s, > 0: of sliding, default 0.05', 'force': 'N, > 0: of pressing, default 6', 'force_noise': "N, >= 0: std per axis on each update's mean, default 0.2", 'velocity_noise': 'm/s, >= 0: likewise, default 0.0005', 'hold_time': 's, >= 0: of pressing still, default 0.7', 'seed': '>= 0, default 0'}
    def __copy__(self) -> FilterTrialParams:
        ...
    def __deepcopy__(self, memo: dict) -> FilterTrialParams:
        ...
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __init__(self, **kwargs) -> None:
        """
        Keyword arguments are the fields; the rest have their defaults.
        Raises TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def validate(self) -> None:
        """
        Raises ValueError naming the field, the range and the value.
        """
    @property
    def drive(self) -> str:
        """
        "closed_loop" (point robot with the filter's selections), "true_selection" (with the true ones, 20 ms late) or "kinematic" (no dynamics), default "closed_loop"
        """
    @drive.setter
    def drive(self, arg1: typing.Any) -> None:
        ...
    @property
    def force(self) -> float:
        """
        N, > 0: of pressing, default 6
        """
    @force.setter
    def force(self, arg1: typing.Any) -> None:
        ...
    @property
    def force_noise(self) -> float:
        """
        N, >= 0: std per axis on each update's mean, default 0.2
        """
    @force_noise.setter
    def force_noise(self, arg1: typing.Any) -> None:
        ...
    @property
    def friction(self) -> float:
        """
        mu, 0 to 2, default 0.3
        """
    @friction.setter
    def friction(self, arg1: typing.Any) -> None:
        ...
    @property
    def hold_time(self) -> float:
        """
        s, >= 0: of pressing still, default 0.7
        """
    @hold_time.setter
    def hold_time(self, arg1: typing.Any) -> None:
        ...
    @property
    def scene(self) -> str:
        """
        "free", "plane", "cylinder", "inner_corner", "step_edge", "still", "grazing" or "soft", default "plane"
        """
    @scene.setter
    def scene(self, arg1: typing.Any) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        >= 0, default 0
        """
    @seed.setter
    def seed(self, arg1: typing.Any) -> None:
        ...
    @property
    def speed(self) -> float:
        """
        m/s, > 0: of sliding, default 0.05
        """
    @speed.setter
    def speed(self, arg1: typing.Any) -> None:
        ...
    @property
    def velocity_noise(self) -> float:
        """
        m/s, >= 0: likewise, default 0.0005
        """
    @velocity_noise.setter
    def velocity_noise(self, arg1: typing.Any) -> None:
        ...
class FilterTrial:
    """
    A trial that was run: arrays of one row per update of the filter, in B.
    """
    def __len__(self) -> int:
        ...
    @property
    def contact_force(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        F_f, (n, 3), N: likewise.
        """
    @property
    def contacts(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k, 2), s: begin and end of each true contact of 0.5 N or more; infinity if it
        outlasts the trial. Gaps below 50 ms are none.
        """
    @property
    def dimension(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,): the filter's.
        """
    @property
    def direction_error(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,), rad, 0 to pi/2: between the filter's axis (U1, or U3 at dimension 2) and the
        true one where the dimensions agree; else between true_normal and the force space;
        NaN where filter or truth has no contact.
        """
    @property
    def motion_force(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        F_m, (n, 3), N: the filter's input, mean over the period.
        """
    @property
    def second_walls(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k, 2), s: likewise, of a second independent normal force.
        """
    @property
    def sensed_force(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        F_s, (n, 3), N: the filter's input, mean over the period with noise.
        """
    @property
    def singular_vectors(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        U, (n, 3, 3), vectors as columns: the filter's.
        """
    @property
    def time(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,), s: end of the period.
        """
    @property
    def touched(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,) bool: whether the tool touched anything in the period.
        """
    @property
    def true_axis(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n, 3): of dimension 1 the normal, of 2 the axis of free motion; else zero.
        """
    @property
    def true_dimension(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n,): at the end of the period, as all that is true.
        """
    @property
    def true_force(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n, 3), N: of the robot on the scene, with friction.
        """
    @property
    def true_normal(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        (n, 3): along the sum of the normal forces, unit, INTO the surface, or zero.
        """
    @property
    def velocity(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        v_BE, (n, 3), m/s: likewise.
        """
class FilterTrialMetrics:
    """
    What one or more trials come to. Samples count as contact from a true force of
    0.5 N at their end.
    """
    def __init__(self) -> None:
        ...
    def add(self, trial: FilterTrial) -> None:
        """
        Adds a trial.
        """
    @property
    def axis_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k,), deg: of these, where both dimensions are 2.
        """
    @property
    def contact_samples(self) -> int:
        """
        Number of updates in contact.
        """
    @property
    def detection_latency(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k,), s: from each contact to the update that shows it; infinity if it was over
        before, and left out if it was over within 100 ms.
        """
    @property
    def dimension_changes(self) -> int:
        """
        Number of changes of the filter's dimension.
        """
    @property
    def direction_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k,), deg: of contact samples where the filter has a contact.
        """
    @property
    def false_contact_samples(self) -> int:
        """
        Number of updates with a contact though nothing was touched, neither in the
        period nor since the filter last had none.
        """
    @property
    def loss_latency(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k,), s: likewise, from each contact's end to dimension 0.
        """
    @property
    def right_dimension_samples(self) -> int:
        """
        Of those, with the true dimension.
        """
    @property
    def samples(self) -> int:
        """
        Number of updates.
        """
    @property
    def second_latency(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (k,), s: likewise, from each second wall to dimension 2.
        """
def _angular_metric_descriptions() -> list[tuple[str, str, str]]:
    """
    The same of those of the angular filter.
    """
def _compute_metrics(time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], signals: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex]], map: WorkspaceMapParams, delay: typing.SupportsFloat | typing.SupportsIndex, has_filter: bool, control_period: typing.SupportsFloat | typing.SupportsIndex, wall_s: typing.SupportsFloat | typing.SupportsIndex | None) -> list[tuple[str, None | bool | int | float | list[str]]]:
    """
    [(key, value)] of every metric, in order.
    
    time: (n,), s. values: (n, m). signals: [(name, number of columns)].
    """
def _describe_broken_limits(time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], signals: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex]], control_period: typing.SupportsFloat | typing.SupportsIndex) -> list[str]:
    """
    A text for each limit of the arm that was broken; the arguments are those of
    `_compute_metrics`.
    """
def _map_device_positions(map: WorkspaceMapParams, x_D: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
    """
    (n, 3), m, from D to B.
    """
def _measure_filter_cost(trial: FilterTrial, filter: ForceSpaceParticleFilterParams, seed: typing.SupportsInt | typing.SupportsIndex, repeats: typing.SupportsInt | typing.SupportsIndex) -> float:
    """
    us of the filter's updates per second of the trial, median of repeats.
    """
def _metric_descriptions() -> list[tuple[str, str, str]]:
    """
    [(key, unit, description)] of every metric, in order.
    """
def _metric_limits() -> list[tuple[str, float, float, bool]]:
    """
    [(key, least, most, whether it is the arm's)] of the metrics that have limits.
    """
def _metrics_json(metrics: collections.abc.Sequence[tuple[str, None | bool | typing.SupportsInt | typing.SupportsIndex | typing.SupportsFloat | typing.SupportsIndex | collections.abc.Sequence[str]]]) -> str:
    """
    The text of metrics.json for [(key, value)].
    """
def _metrics_out(metrics: collections.abc.Sequence[tuple[str, None | bool | typing.SupportsInt | typing.SupportsIndex | typing.SupportsFloat | typing.SupportsIndex | collections.abc.Sequence[str]]]) -> list[str]:
    """
    The keys of the metrics [(key, value)] that are not as they should be.
    """
def _normal_error_deg(time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], signals: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex]]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    (n,), deg; the arguments are those of `_compute_metrics`.
    """
def _place_recording(times: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], start: typing.Any, contact_height: typing.SupportsFloat | typing.SupportsIndex, press_depth: typing.SupportsFloat | typing.SupportsIndex, reachable: collections.abc.Callable[[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]], bool]) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]]:
    """
    (times (m,), positions (m, 3)). reachable: whether all of some points, (n, 3), can be
    reached.
    """
def _read_recording(path: str) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"], numpy.typing.NDArray[numpy.float64] | None]:
    """
    (times (n,), positions (n, 3), rotations (n, 3, 3) or None).
    """
def calc_operational_space_inertia(jacobian: typing.Any, mass: typing.Any, max_mass: typing.SupportsFloat | typing.SupportsIndex = 50.0, length: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"], bool]:
    """
    Returns (Lambda, singular): (J A^-1 J^T)^-1 bounded, (6, 6), in B, and whether the bound acted.
    """
def rate_limit(previous: typing.Any, target: typing.Any, max_step: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    The vector (3,) nearest to `target` within `max_step` (norm) of `previous`.
    """
def run_filter_trial(params: FilterTrialParams = ..., filter: ForceSpaceParticleFilterParams = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0) -> FilterTrial:
    """
    Runs a filter, seeded with `seed`, along a trial: a simulated tool on analytic
    surfaces, controlled at 1 kHz. The same arguments give the same bits.
    
    Raises ValueError for an invalid parameter or a filter's period below 1 ms.
    """
def saturate(value: typing.Any, max_norm: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    `value` (3,) shortened to `max_norm` if it is longer.
    """
_ARM_LIMITS: dict
_FILTER_TRIAL_DRIVES: tuple = ('closed_loop', 'true_selection', 'kinematic')
_FILTER_TRIAL_SCENES: tuple = ('free', 'plane', 'cylinder', 'inner_corner', 'step_edge', 'still', 'grazing', 'soft')
_LIKELIHOODS: tuple = ('paper', 'friction_cone')
_RECORDING_MOVE_TIME: float = 2.0
