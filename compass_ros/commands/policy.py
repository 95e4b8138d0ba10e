"""`compass policy`: an agent retrained in the calibrated simulator."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.policy import Agent, Judged, Shots


def add_to(app: typer.Typer) -> None:
    app.command()(policy)


def policy(
    result: Annotated[Path, typer.Argument(help="folder that `compass calibrate` has written")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    body: Annotated[str, typer.Option("--object", help="tracked body that shall reach the goal")] = "puck2",
    goal: Annotated[str, typer.Option(help="its centre: x,y or x,y,z [m]")] = "0.43,0",
    radius: Annotated[float, typer.Option(min=0.001, help="of the goal [m]")] = 0.15,
    rollouts: Annotated[int, typer.Option(min=640, help="shots that an agent is trained with")] = 6400,
    jitter: Annotated[float, typer.Option(min=0, help="repeatability of the arm, share of half the range")] = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="decides all random numbers")] = 0,
    threads: Annotated[int, typer.Option(min=0, help="threads for rollouts; 0: all cores")] = 0,
    out: Annotated[Path, typer.Option(help="folder of policy.yaml and policy.zip")] = Path("out/policy"),
) -> None:
    """Train one agent in the simulator as it was and one as it is calibrated, and judge both in the latter."""
    import yaml

    from compass_ros.cells import load
    from compass_ros.commands.progress import Bar
    from compass_ros.operation.current import current
    from compass_ros.policy import Goal, Shots, train
    from compass_ros.reporting import read_result
    from compass_ros.reporting.atomic import write_text
    from compass_ros.results import make_writable

    read_result(result / "result.json")  # says what is wrong with it
    aim = Goal(body, _numbers(goal), radius)
    loaded = load(cell)
    before, after = current(loaded, threads=threads), current(loaded, result, threads)
    make_writable(out)
    judge = Shots(after.simulator, after.values, aim)
    agents: dict[str, Agent] = {}
    with Bar() as bar:
        for name, at in (("nominal", before), ("calibrated", after)):
            agents[name] = train(Shots(at.simulator, at.values, aim), rollouts, seed, bar)
    judged = {name: judge.judge(agent.action(), jitter, seed) for name, agent in agents.items()}
    agents["calibrated"].save(out / "policy.zip")
    action = judge.command(agents["calibrated"].action()[None])[0]
    content = {
        "cell": loaded.name,
        "result": str(result),
        "goal": {"object": body, "centre": list(aim.centre), "radius": radius},
        "action": dict(zip(judge.names, action.round(6).tolist(), strict=True)),
        "judged_in_the_calibrated_simulator": {name: asdict(outcome) for name, outcome in judged.items()},
    }
    write_text(out / "policy.yaml", yaml.safe_dump(content, sort_keys=False))
    _print(judge, agents, judged)
    typer.echo(f"written: {out}")


def _numbers(text: str) -> tuple[float, ...]:
    from compass_ros.errors import ConfigError, shown

    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise ConfigError(f"--goal: expected numbers with commas between them [m], found {shown(text)}") from error


def _print(judge: Shots, agents: dict[str, Agent], judged: dict[str, Judged]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title="agents, judged in the calibrated simulator", title_justify="left")
    for column in ("trained in", "success", "distance [cm]", *judge.names):
        table.add_column(column)
    for name, agent in agents.items():
        outcome, action = judged[name], judge.command(agent.action()[None])[0]
        cells = [f"{100 * outcome.success:.0f} %", f"{100 * outcome.distance:.1f}", *(f"{a:.3f}" for a in action)]
        table.add_row(name, *cells)
    Console().print(table)
