"""The command `compass`: everything without ROS. Exit status 0: done; 1: the input is bad; 2: wrong use."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from threadpoolctl import threadpool_limits

from compass_ros import __version__
from compass_ros.commands import (
    bench,
    calibrate,
    check,
    conceal,
    demo,
    diagnose,
    evaluate,
    export,
    fleet,
    history,
    init,
    layout,
    plan,
    policy,
    prove,
    real,
    record,
    report,
    rivals,
    track,
    unseal,
)
from compass_ros.commands import import_ as tables
from compass_ros.errors import CompassError
from compass_ros.extras import what_to_install

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
for module in (demo, init, plan, track, record, check, calibrate, evaluate, diagnose, report, export, policy):
    module.add_to(app)
for module in (history, fleet, layout):
    module.add_to(app)
for module in (conceal, unseal, prove, rivals, bench, real, tables):
    module.add_to(app)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"compass_ros {__version__}")
        raise typer.Exit


@app.callback()
def about(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """What went wrong with my simulator? Calibrate it from recordings, and find the physics that it lacks."""


def main() -> None:
    """Run the command line; what a user can mend ends as one line and status 1.

    Rollouts take all cores; linear algebra takes one, so that a result does not depend on how many there are.
    """
    threadpool_limits(1, "blas")
    try:
        app()
    except CompassError as error:
        print(f"compass: {error}", file=sys.stderr)
        sys.exit(1)
    except ModuleNotFoundError as error:
        said = what_to_install(error)
        if said is None:
            raise
        print(f"compass: {said}", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
