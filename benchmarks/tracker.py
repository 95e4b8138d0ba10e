"""The tracker against the drawn truth: error, identity swaps, time of an image on one core.

    python benchmarks/tracker.py --shots 200 [--simulator]

Random planar shots with bounces, collisions and an arm that hides pucks; with --simulator, shots of the cell.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping

import numpy as np

from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.rehearsal import Shot, film, random_shot
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.tracker import Frame, TrackerState, step, use_one_core
from compass_ros.tracking.virtual_camera import make_camera
from compass_ros.types import Floats

_DURATION_S = 2.5


def planar_shots(count: int, scene: SceneConfig) -> Iterator[Shot]:
    for seed in range(count):
        yield random_shot(scene, _DURATION_S, seed)


def simulated_shots(count: int) -> Iterator[Shot]:
    from compass_ros.cells import load
    from compass_ros.simulation import Simulator

    cell = load("air_hockey")
    simulator = Simulator(cell)
    rng = np.random.default_rng(0)
    values = np.array([p.default for p in cell.parameters])
    times = np.arange(0, _DURATION_S, 0.002)
    for _ in range(count):
        action = np.array([rng.uniform(a.low, a.high) for a in cell.action])
        yield Shot(times, simulator.bodies(values, action, times))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shots", type=int, default=20)
    parser.add_argument("--simulator", action="store_true")
    arguments = parser.parse_args()
    use_one_core()
    scene = SceneConfig()
    camera = make_camera(scene)
    config = TrackerConfig()
    names = list(config.objects)
    errors: dict[str, list[float]] = {name: [] for name in names}
    bridged: list[float] = []
    normalised: list[float] = []
    drawing, tracking = [], []
    images = seen = swaps = 0
    shots = simulated_shots(arguments.shots) if arguments.simulator else planar_shots(arguments.shots, scene)
    for number, shot in enumerate(shots):
        state = TrackerState()
        filmed = film(camera, shot, _DURATION_S, number * 1000)
        while True:
            started = time.process_time()
            image = next(filmed, None)
            drawn = time.process_time()
            if image is None:
                break
            state, frame = step(state, image.bgr, image.stamp_ns, camera.scene.view.camera, config)
            tracking.append(time.process_time() - drawn)
            drawing.append(drawn - started)
            images += len(names)
            swaps += _swapped(frame, image.truth)
            for sighting in frame.sightings:
                distance = float(np.linalg.norm(sighting.xy - image.truth[sighting.object][:2]))
                if sighting.seen:
                    seen += 1
                    errors[sighting.object].append(distance)
                    normalised.append(distance / sighting.std)
                    if distance > 0.003:
                        print(
                            f"  shot {number} {image.stamp_ns * 1e-9:.3f} s {sighting.object}: {distance * 1e3:.2f} mm,"
                            f" std {sighting.std * 1e3:.2f} mm, arc {sighting.arc:.2f}"
                        )
                else:
                    bridged.append(distance)
    for name in names:
        e = np.array(errors[name]) * 1e3
        print(f"{name:8s} rms {np.sqrt((e**2).mean()):.3f} mm, p99 {np.quantile(e, 0.99):.3f} mm, max {e.max():.3f} mm")
    everything = np.concatenate([np.array(e) for e in errors.values()]) * 1e3
    print(
        f"all      rms {np.sqrt((everything**2).mean()):.3f} mm, p99 {np.quantile(everything, 0.99):.3f} mm "
        f"(targets 1 and 3), error / stated std: rms {np.sqrt(np.mean(np.square(normalised)) / 2):.2f} a coordinate"
    )
    print(
        f"seen in {seen / images:.1%} of {images} object images, bridged {len(bridged)}"
        + (f" with rms {np.sqrt(np.mean(np.square(bridged))) * 1e3:.1f} mm" if bridged else "")
    )
    print(f"identity swaps {swaps} in {arguments.shots} shots (target 0)")
    ms = np.array(tracking) * 1e3
    print(
        f"track {np.median(ms):.2f} ms median, {ms.mean():.2f} mean, {np.quantile(ms, 0.99):.2f} p99 an image on one "
        f"core (target 6); draw {np.median(drawing) * 1e3:.2f} ms (target 8)"
    )


def _swapped(frame: Frame, truth: Mapping[str, Floats]) -> int:
    """Seen objects that are nearer to another object's truth than to their own."""
    count = 0
    for sighting in frame.sightings:
        if sighting.seen:
            distance = {name: float(np.linalg.norm(sighting.xy - pose[:2])) for name, pose in truth.items()}
            count += min(distance, key=lambda name: distance[name]) != sighting.object
    return count


if __name__ == "__main__":
    main()
