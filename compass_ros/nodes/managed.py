"""A lifecycle node that can also start by itself, and that answers a wrong request with a line instead of its end."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.timer import Timer

from compass_ros.errors import CompassError
from compass_ros.nodes.alarms import Alarms
from compass_ros.nodes.requests import one_line, wrong_text
from compass_ros.nodes.surroundings import Surroundings
from compass_ros.places import data_home, placed

AUTOSTART = "autostart"
_START = "configure and activate by itself; false: wait for a lifecycle manager, or `ros2 lifecycle set`"
_TO_BE_CONFIGURED = frozenset({"unconfigured", "configuring"})
GRACE_S = 1.0
"""[s] Not so soon after the node has come to life or was activated: it finds the others one after the other."""
LOOK_S = 0.5
"""[s] How often a node looks for what is wrong with it and around it."""
Check = Callable[[Any], str]
"""Of a parameter's value: what is wrong with it, or nothing."""


class ManagedNode(LifecycleNode):
    """Unconfigured, inactive or active, as lifecycle managers know it.

    A node derives from it and says what to do: `configure` makes all publishers, subscriptions, services and timers
    (they are destroyed again by `cleanup`), `activate` begins to work, `deactivate` ends it. Each may raise
    CompassError: the transition then fails with that line, and the state stays.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.active = False
        self._changed_s = time.monotonic()
        self._fixed: set[str] = set()
        self._checks: dict[str, Check] = {}
        self.declare_parameter(AUTOSTART, True, ParameterDescriptor(description=_START))
        self.add_on_set_parameters_callback(self._checked)
        self._surroundings = Surroundings(self)
        self._said = Alarms(self.get_logger())
        self.every(LOOK_S, self._look)
        self._failure: CompassError | None = None
        self._before = {id(one) for one in self._entities()}
        for service in self.services:
            if service.srv_name.endswith("/change_state"):
                service.callback = partial(self._change, service.callback)

    def configure(self) -> None:
        """Make what the node talks through. Raises CompassError."""

    def activate(self) -> None:
        """Begin to work. Raises CompassError."""

    def deactivate(self) -> None:
        """End the work. Raises CompassError where that would lose something; the node then stays active."""

    def cleanup(self) -> None:
        """Let go of what is not ROS's: files, threads. Called also when `configure` has failed half-way."""

    def problems(self) -> list[str]:
        """What is wrong now, one sentence each. A node adds what it knows, and shows all where an operator looks."""
        return self._surroundings.problems()

    def tell(self) -> None:
        """Something has begun to be wrong, or is right again; the log has it already. A node with a status shows it."""

    def every(self, period_s: float, work: Callable[[], None]) -> Timer:
        """A timer that goes on where a simulated clock stands still."""
        return self.create_timer(period_s, work, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def declare_fixed(self, name: str, default: object, text: str, check: Check | None = None, **extra: object) -> None:
        """A parameter that may change only while the node is not configured."""
        self._fixed.add(name)
        self.declare_described(name, default, text, check, **extra)

    def declare_described(
        self, name: str, default: object, text: str, check: Check | None = None, **extra: object
    ) -> None:
        """A parameter that may change at any time, to a value that passes `check`; `extra`: more of its descriptor."""
        if check is not None:
            self._checks[name] = check
        self.declare_parameter(name, default, ParameterDescriptor(description=text, **extra))

    def declare_data_dir(self) -> None:
        """The folder of all that a node writes, where no parameter names another one."""
        text = "folder of all that this node writes; empty: compass_ros in $ROS_HOME, else in $XDG_DATA_HOME, else in "
        self.declare_fixed("data_dir", "", text + "~/.local/share", wrong_text)

    def place(self, parameter: str, name: str = "") -> Path:
        """The absolute folder that a parameter names; where it is empty, `name` (or the parameter's) in data_dir."""
        home = placed(self.get_parameter("data_dir").value, data_home())
        return placed(self.get_parameter(parameter).value, home / (name or parameter))

    def start(self) -> None:
        """Configure and activate, where `autostart` says so. Raises CompassError."""
        if not self.get_parameter(AUTOSTART).value:
            return
        self._raise_from(self.trigger_configure)
        self._raise_from(self.trigger_activate)

    def end(self) -> None:
        """End everything, whatever the state."""
        if self.state != "finalized":
            self.trigger_shutdown()

    @property
    def state(self) -> str:
        """As lifecycle managers call it."""
        return str(self._state_machine.current_state[1])

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        del state
        done = self._do(self.configure)
        if done is not TransitionCallbackReturn.SUCCESS:
            self._release()
        return done

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.active, self._changed_s = True, time.monotonic()
        done = self._do(self.activate)
        self.active = done is TransitionCallbackReturn.SUCCESS
        return super().on_activate(state) if self.active else done

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        done = self._do(self.deactivate)
        if done is not TransitionCallbackReturn.SUCCESS:
            return done
        self.active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        del state
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        del state
        self.active = False
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """rclpy keeps an unexpected exception of a transition to itself; what is left is to be whole again."""
        self.get_logger().error(f"a transition from {state.label} has failed unexpectedly; the node is unconfigured")
        self.active = False
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def _do(self, work: Callable[[], None]) -> TransitionCallbackReturn:
        self._failure = None
        try:
            work()
        except (CompassError, NameValidationException) as error:
            self._failure = CompassError(one_line(str(error)))
            self.get_logger().error(str(self._failure))
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    def _raise_from(self, trigger: Callable[[], TransitionCallbackReturn]) -> None:
        if trigger() is TransitionCallbackReturn.SUCCESS:
            return
        raise self._failure or CompassError(f"{trigger.__name__} has failed unexpectedly")

    def _release(self) -> None:
        self.cleanup()
        for destroy, own in (
            (self.destroy_timer, self.timers),
            (self.destroy_subscription, self.subscriptions),
            (self.destroy_service, self.services),
            (self.destroy_client, self.clients),
            (self.destroy_publisher, self.publishers),
        ):
            for entity in [one for one in own if id(one) not in self._before]:
                destroy(entity)

    def _entities(self) -> list[object]:
        return [*self.timers, *self.subscriptions, *self.services, *self.clients, *self.publishers]

    def _look(self) -> None:
        if time.monotonic() - self._changed_s < GRACE_S:
            return
        if self._said.take(self.problems()):
            self.tell()

    def _checked(self, changes: list[Parameter]) -> SetParametersResult:
        for change in changes:
            wrong = self._checks[change.name](change.value) if change.name in self._checks else ""
            if wrong:
                return SetParametersResult(successful=False, reason=f"{change.name}: {wrong}")
        late = [change.name for change in changes if change.name in self._fixed]
        if late and self.state not in _TO_BE_CONFIGURED:
            reason = f"{late[0]} can be changed only while the node is not configured, it is {self.state}"
            return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _change(
        self, change: Callable[[Any, Any], ChangeState.Response], request: Any, response: Any
    ) -> ChangeState.Response:
        """Refuse a transition that the state does not have; rclpy would raise and end the node."""
        known = {number: label for number, label, *_ in self._state_machine.available_transitions}
        wanted = request.transition
        if wanted.label not in known.values() if wanted.label else wanted.id not in known:
            name = wanted.label[:40] or str(wanted.id)
            self.get_logger().error(f"refused: no transition {name!r} from {self.state}")
            response.success = False
            return response
        return change(request, response)
