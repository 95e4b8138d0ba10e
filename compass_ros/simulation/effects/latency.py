"""Stamps of an encoder, or of another sensor, that are later than the moment that it was read.

observed(t) = true(t - latency). Source: transfer over a bus before stamping; the sensing of `camera_latency`.
"""

from __future__ import annotations

from dataclasses import replace

from compass_ros.simulation.effects import camera_latency

EFFECT = replace(camera_latency.EFFECT, name="latency", sentence="a latency of the sensors", on=("encoder", "sensor"))
