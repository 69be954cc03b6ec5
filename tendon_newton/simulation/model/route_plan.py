"""The paths of routed tendons as kernels know them: what is fixed in code, and what is a number."""

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property

from tendon_newton.mechanisms.geometry.joint_frames import way_between

NO_PULLEY = -1


@dataclass(frozen=True, kw_only=True)
class SpanPlan:
    """One span: which tendon's, and which of a world's path points it joins."""

    tendon: int
    start: int  # Row of the site where it starts, among a world's path points
    end: int
    pulley: int = NO_PULLEY  # Row of the pulley around which it runs


@dataclass(frozen=True, kw_only=True)
class RoutePlan:
    """The paths of all routed tendons of one world."""

    bodies: tuple[int, ...]  # Link of each path point, -1 for the base, shape (N,)
    spans: tuple[SpanPlan, ...]

    def first_spans(self, tendon_count: int) -> tuple[int, ...]:
        """Return the first span of each tendon, and the number of all, shape (D + 1,)."""
        tendons = [span.tendon for span in self.spans]
        return tuple(bisect_left(tendons, d) for d in range(tendon_count + 1))

    @cached_property
    def references(self) -> tuple[int, ...]:
        """Link from which each span is looked at: that of its pulley, else of its start."""
        return tuple(
            self.bodies[span.start if span.pulley == NO_PULLEY else span.pulley]
            for span in self.spans
        )

    def ways(self, parents: tuple[int, ...], name: str) -> tuple[tuple[int, ...], ...]:
        """Return per span and joint where the joint stands on the way to one of the span's ends.

        Places count from 1; they are negative where the joint carries the observer, and 0 where it
        does not move the end. The ends are named ``start`` and ``end``.
        """
        rows = []
        for span, reference in zip(self.spans, self.references, strict=True):
            row = [0] * len(parents)
            way = way_between(parents, reference, self.bodies[getattr(span, name)])
            for place, (joint, sign) in enumerate(way, start=1):
                row[joint] = sign * place
            rows.append(tuple(row))
        return tuple(rows)


NO_ROUTES = RoutePlan(bodies=(), spans=())  # A mechanism whose moment arms are all constant


def plan_of(tendons: list[int], bodies: list[int], radii: list[float]) -> RoutePlan:
    """Return the plan of one world's path points, tendon by tendon in their order.

    A link is -1 for the base, a radius [m] 0 for a site.
    """
    spans: list[SpanPlan] = []
    start, pulley = -1, NO_PULLEY
    for row, (tendon, radius) in enumerate(zip(tendons, radii, strict=True)):
        if row == 0 or tendon != tendons[row - 1]:
            start, pulley = row, NO_PULLEY
        elif radius > 0.0:
            pulley = row
        else:
            spans.append(SpanPlan(tendon=tendon, start=start, end=row, pulley=pulley))
            start, pulley = row, NO_PULLEY
    return RoutePlan(bodies=tuple(bodies), spans=tuple(spans))
