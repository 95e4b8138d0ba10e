"""The verdict as a sentence, and where an effect acts."""

from __future__ import annotations

from collections.abc import Sequence

from compass_ros.discovery.zero import ERROR_BARS
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.sites import Places
from compass_ros.types import Channel, DependsOn, EffectFinding, Floats, Phase, Region, Unit, Where

PHASE: dict[str, Phase] = {
    "rate_dependent_restitution": "all",
    "tangential_impulse": "all",
    "local_wall": "wall_contact",
    "off_centre_mass": "all",
    "friction_cone": "all",
}
"""Phase of effects in contacts; the others follow from their channel."""
OF_CHANNEL: dict[Channel, Phase] = {"dynamics": "free", "contact": "all", "actuation": "strike", "sensing": "all"}
IN_WORDS: dict[Phase, str] = {
    "strike": "In the strike",
    "free": "On free slides",
    "wall_contact": "In contacts with walls",
    "object_contact": "In contacts between objects",
    "all": "Throughout",
}
OF_JOINTS = IN_WORDS | {"strike": "In the drive", "free": "In the motion", "wall_contact": "In contacts"}
"""The same where nothing slides on a table."""


SEVERAL = 2
"""Sites of one law that a sentence says one by one; of more a report has a list."""
_REGION = ("centre_x", "centre_y", "radius", "core")
"""Shapes that say where on a table an effect is, which the place in words says."""


def where_of(laws: Sequence[Attached], numbers: Floats, movers: Sequence[str]) -> Where:
    """Object, phase, channel and region of the first of some fitted laws; on all sites that it acts on.

    (q,) numbers of it.
    """
    attached = laws[0]
    effect = attached.effect
    phase = PHASE.get(effect.name, OF_CHANNEL[effect.channel])
    named = (name for law in laws if law.effect.name == effect.name for name in law.objects)
    objects = dict.fromkeys(name.partition("@")[0] for name in named)
    told = bool(objects) and set(objects) != set(movers)
    one = listed(tuple(objects)) if told else "all"
    names = [q.name for q in effect.quantities]
    region = None
    if (size := next((n for n in ("radius", "core") if n in names), None)) is not None and "centre_x" in names:
        x, y, far = (float(numbers[names.index(name)]) for name in ("centre_x", "centre_y", size))
        region = Region((x, y), far)
    return Where(one, phase, effect.channel, region)


def listed(names: Sequence[str]) -> str:
    """'a, b and c'."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def place(where: Where, flat: bool = True) -> str:
    """The place in words: 'On free slides of puck1, within 12 cm of (0.02, -0.01)'.

    `flat`: something slides on a table.
    """
    words = (IN_WORDS if flat else OF_JOINTS)[where.phase]
    if where.object != "all":
        words = f"In {where.object}" if where.phase == "all" else f"{words} of {where.object}"
    if where.region:
        x, y = where.region.centre_m
        words += f", within {100 * where.region.radius_m:.0f} cm of ({x:.2f}, {y:.2f})"
    if where.interval:
        one = where.interval
        words += f", at {one.quantity}s of {one.low:.2g} to {one.high:.2g} {one.unit}"
    return words


DEPENDS: dict[DependsOn | None, str] = {
    None: "",
    "place": ", and depends on place",
    "velocity": ", and depends on velocity",
    "time": ", and depends neither on place nor on velocity alone",
}
"""What a difference that no law explains is a function of."""


def missing(laws: Sequence[Attached], numbers: Sequence[Floats], places: Places) -> str:
    """What the simulator lacks by some laws with (q,) numbers each, and which numbers of its scene are wrong."""
    lacks = [a.effect.sentence for a in laws if a.effect.on != ("field",)]
    fitted = zip(laws, numbers, strict=True)
    wrong = [wrong_number(a, float(n[0]), places) for a, n in fitted if a.effect.on == ("field",)]
    said = [f"the simulator lacks {' and '.join(dict.fromkeys(lacks))}"] if lacks else []
    return ", and ".join([*said, *wrong])


def wrong_number(attached: Attached, deviation: float, places: Places) -> str:
    """'the scene's armature of elbow is wrong: 0.031 kg m^2 instead of 0.02'."""
    (site,) = attached.sites(places)
    of, _, what = site.name.split("@")
    there = site.number.value if site.number else 0.0
    unit = attached.effect.quantities[0].unit
    found = f"{there + deviation:.3g}" + ("" if unit == "1" else f" {unit}")
    return f"the scene's {what.replace('_', ' ')} of {of} is wrong: {found} instead of {there:.3g}"


def value_of(finding: EffectFinding, attached: Attached, told: bool) -> str:
    """The effect and its numbers: 'fan_field, strength 0.21 +- 0.01 m/s^2'; `told`: with what it acts on.

    Amplitudes that are not told from zero stand last, shapes that are not are left out, and so is a region. A law that
    is clearly there and of which that holds for all amplitudes is known together with its shape, or with numbers of the
    scene. Of numbers that each episode has by chance: how far they spread.
    """
    sure, open_, shapes = list[str](), list[str](), list[str]()
    for quantity in attached.effect.quantities:
        found = finding.parameters[quantity.name]
        unit = "" if found.unit == "1" else f" {found.unit}"
        said = f"{quantity.name} {found.value:.3g} +- {found.std:.1g}{unit}"
        told_from_zero = abs(found.value) >= ERROR_BARS * found.std
        if quantity.amplitude:
            (sure if told_from_zero else open_).append(said)
        elif told_from_zero and quantity.name not in _REGION:
            shapes.append(said)
    on = f" of {', '.join(attached.distinct)}" if told else ""
    of_chance = " (standard deviations over episodes, each of which has its own)" * attached.effect.scattered
    if not sure:
        return f"{finding.name}{on}, {', '.join(open_)} (shows only together with other numbers)"
    rest = f" (not told from 0: {', '.join(open_)})" if open_ else ""
    return f"{finding.name}{on}, {', '.join(sure + shapes)}{rest}{of_chance}"


def values_of(findings: Sequence[EffectFinding], laws: Sequence[Attached]) -> str:
    """What all laws come to; of one on more than two sites how far its amplitudes reach: 'cogging, sine -0.1 to 0.3 N m
    on 4 sites'."""
    out = []
    for name in dict.fromkeys(f.name for f in findings):
        own = [(f, a) for f, a in zip(findings, laws, strict=True) if f.name == name]
        if len(own) <= SEVERAL:
            out += [value_of(f, a, len(own) > 1) for f, a in own]
            continue
        reach = []
        for quantity in (q for q in own[0][1].effect.quantities if q.amplitude):
            values = [f.parameters[quantity.name].value for f, _ in own]
            unit = "" if quantity.unit == "1" else f" {quantity.unit}"
            reach.append(f"{quantity.name} {min(values):.3g} to {max(values):.3g}{unit}")
        out.append(f"{name}, {', '.join(reach)} on {len(own)} sites")
    return "; ".join(out)


def corrected(laws: Sequence[Attached]) -> str:
    """What stands for the rest of a law's form: '; its form is corrected by a spring'; empty where nothing does."""
    said = dict.fromkeys("a number of the scene" if a.effect.on == ("field",) else a.effect.sentence for a in laws)
    return f"; its form is corrected by {listed(tuple(said))}" if said else ""


def short_name(laws: Sequence[Attached]) -> str:
    """Laws with their sites; of one on more than two how many: 'spring(elbow) + eccentricity on 6 sites'."""
    sites: dict[str, list[str]] = {}
    for a in laws:
        sites.setdefault(a.effect.name, []).extend(a.distinct)
    return " + ".join(
        f"{name} on {len(own)} sites" if len(own) > SEVERAL else f"{name}({', '.join(own)})" if own else name
        for name, own in sites.items()
    )


def errors(what: str, before: float, after: float, floor: float, unit: Unit) -> str:
    """Errors of the episodes that judge, in thousandths of the unit."""
    return f"{what} {1e3 * before:.2f} -> {1e3 * after:.2f} m{unit}, floor {1e3 * floor:.2f} m{unit}"
