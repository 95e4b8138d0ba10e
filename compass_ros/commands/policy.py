"""`compass policy`: agents from simulators, judged in the calibrated one or played in a concealed real cell."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.policy import Agent, Judged, Shots

CAMPAIGN = Path("benchmarks/policy.jsonl")
BEGIN, END = "<!-- policies: begin -->\n", "<!-- policies: end -->"


def add_to(app: typer.Typer) -> None:
    app.command()(policy)


def policy(
    result: Annotated[Path | None, typer.Argument(help="folder that `compass calibrate` has written")] = None,
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML; or of an experiment")] = "air_hockey",
    body: Annotated[str, typer.Option("--object", help="tracked body that shall reach the goal")] = "puck2",
    goal: Annotated[str, typer.Option(help="its centre: x,y or x,y,z [m]")] = "0.43,0",
    radius: Annotated[float, typer.Option(min=0.001, help="of the goal [m]")] = 0.15,
    rollouts: Annotated[int, typer.Option(min=64, help="shots that an agent is trained with")] = 4608,
    jitter: Annotated[float, typer.Option(min=0, help="repeatability of the arm, share of half the range")] = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="decides all random numbers")] = 0,
    threads: Annotated[int, typer.Option(min=0, help="threads for rollouts; 0: all cores")] = 0,
    out: Annotated[Path, typer.Option(help="folder of what is written")] = Path("out/policy"),
    loop: Annotated[bool, typer.Option("--loop", help="rounds of Algorithm 1 against a concealed real cell")] = False,
    condition: Annotated[list[str] | None, typer.Option(help="of that cell, e.g. low or high; repeatable")] = None,
    rounds: Annotated[int, typer.Option(min=1, help="--loop: calibrations at most")] = 2,
    fresh: Annotated[int, typer.Option(min=0, help="--loop: new recordings a round; 0: the fixed set")] = 0,
    recordings: Annotated[int, typer.Option(min=4, help="recordings of the concealed cell")] = 12,
    method: Annotated[list[str] | None, typer.Option(help="simulators, as in docs/policy.md; repeatable")] = None,
    campaign: Annotated[bool, typer.Option("--campaign", help="all simulators; goes on where it was stopped")] = False,
    seeds: Annotated[int, typer.Option(min=1, help="--campaign: policies of each simulator")] = 5,
    file: Annotated[Path, typer.Option(help="lines of a campaign")] = CAMPAIGN,
    table: Annotated[bool, typer.Option("--table", help="print the tables of a campaign")] = False,
    picture: Annotated[Path | None, typer.Option(help="--table: PNG of real rollouts")] = None,
    page: Annotated[Path | None, typer.Option(help="--table: Markdown file whose tables are replaced")] = None,
) -> None:
    """Train one agent in the simulator as it was and one as it is calibrated, and judge both in the latter.

    With --loop or --campaign: in simulators that are made from recordings of a concealed cell, and play them there.
    """
    if loop:
        _loop(cell, condition or ["low"], method or ["laws"], rounds, fresh, recordings, rollouts, seed, threads, out)
    elif campaign:
        _campaign(cell, condition, method or [], seeds, recordings, rollouts, threads, file, out)
    elif table:
        _table(cell, file, picture, page)
    elif result is None:
        raise typer.BadParameter("expected the folder of a calibration, --loop, --campaign or --table")
    else:
        _judged(result, cell, body, goal, radius, rollouts, jitter, seed, threads, out)


def _judged(
    result: Path, cell: str, body: str, goal: str, radius: float, rollouts: int, jitter: float, seed: int, threads: int,
    out: Path,
) -> None:  # fmt: skip
    import yaml

    from compass_ros.cells import load
    from compass_ros.commands.progress import Bar
    from compass_ros.operation.current import current
    from compass_ros.policy import Goal, Shots, one, train
    from compass_ros.reporting import read_result
    from compass_ros.reporting.atomic import write_text
    from compass_ros.results import make_writable

    read_result(result / "result.json")  # says what is wrong with it
    aim = Goal(body, _numbers(goal), radius)
    loaded = load(cell)
    before, after = current(loaded, threads=threads), current(loaded, result, threads)
    make_writable(out)
    judge = Shots(loaded, one(after.simulator, after.values), aim)
    agents: dict[str, Agent] = {}
    with Bar() as bar:
        for name, at in (("nominal", before), ("calibrated", after)):
            agents[name] = train(Shots(loaded, one(at.simulator, at.values), aim), rollouts, seed, bar)
    judged = {name: judge.judge(agent.action(), jitter, seed) for name, agent in agents.items()}
    agents["calibrated"].save(out / "policy.npz")
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


def _loop(
    name: str, conditions: list[str], methods: list[str], rounds: int, fresh: int, recordings: int, rollouts: int,
    seed: int, threads: int, out: Path,
) -> None:  # fmt: skip
    from compass_ros.commands.progress import Bar
    from compass_ros.transfer.experiment import experiment
    from compass_ros.transfer.loop import LoopConfig, run_loop

    if len(conditions) > 1 or len(methods) > 1:
        raise typer.BadParameter("--loop takes one --condition and one --method")
    config = LoopConfig(methods[0], rounds, recordings, fresh, rollouts, seed=seed)
    with Bar() as bar:
        rows = run_loop(experiment(name), conditions[0], config, out, threads, bar)
    for row in rows:
        typer.echo(f"round {row['round']}: {row['recordings']} recordings, trajectory difference "
                   f"{row['difference_m']} m, success {row['success']}, distance {row['distance_m']} m")  # fmt: skip
    typer.echo(f"written: {out}")


def _campaign(
    name: str, conditions: list[str] | None, methods: list[str], seeds: int, recordings: int, rollouts: int,
    threads: int, file: Path, out: Path,
) -> None:  # fmt: skip
    from compass_ros.commands.progress import Bar
    from compass_ros.transfer.campaign import Plan, compare, run
    from compass_ros.transfer.experiment import experiment
    from compass_ros.transfer.simulators import chosen

    what = experiment(name)
    known = (*what.conditions, *what.changed)
    for condition in conditions or ():
        if condition not in known:
            raise typer.BadParameter(f"expected one of {', '.join(known)}, found {condition}", param_hint="--condition")
    plan = Plan(chosen(methods), tuple(conditions or known), seeds, recordings, rollouts)
    with Bar() as bar:
        added = compare(what, plan, file, out, threads) + run(what, plan, file, out, threads, bar)
    typer.echo(f"{added} lines added: {file}")


def _table(name: str, file: Path, picture: Path | None, page: Path | None) -> None:
    from compass_ros.errors import DataError
    from compass_ros.reporting.markdown import replace_between
    from compass_ros.transfer import table
    from compass_ros.transfer.campaign import read
    from compass_ros.transfer.experiment import experiment

    rows = read(file)
    if not rows:
        raise DataError(f"{file}: no results; run `compass policy --campaign --file {file}` first")
    text = table.tables(rows)
    typer.echo(text)
    if page:
        replace_between(page, BEGIN, END, f"\n{text}\n\n")
    if picture:
        what = experiment(name)
        table.picture(what, [r for r in rows if r["task"] == name], what.conditions, picture)


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
