"""The paths of routed tendons as kernels know them: what is fixed in code, and what is a number."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tendon_newton.mechanisms.joint_frames import way_between

NO_PULLEY = -1


@dataclass(frozen=True, kw_only=True)
class SpanPlan:
    """One span: which tendon's, and which of a world's path points it joins."""

    tendon: int
    start: int
    """Row of the site where it starts, among a world's path points."""
    end: int
    pulley: int = NO_PULLEY
    """Row of the pulley around which it runs."""


@dataclass(frozen=True, kw_only=True)
class RoutePlan:
    """The paths of all routed tendons of one world."""

    bodies: tuple[int, ...]
    """Link of each path point, -1 for the base, shape (N,)."""
    spans: tuple[SpanPlan, ...]

    def bindings(self, parents: tuple[int, ...], revolute: tuple[bool, ...]) -> dict[str, Any]:
        """Return the constants of `routes`, from the joints' parents and kinds."""
        return {
            "ROUTED": bool(self.spans),
            "POINTS": len(self.bodies),
            "SPANS": len(self.spans),
            "POINT_BODY": self.bodies,
            "SPAN_TENDON": tuple(span.tendon for span in self.spans),
            "SPAN_START": tuple(span.start for span in self.spans),
            "SPAN_END": tuple(span.end for span in self.spans),
            "SPAN_PULLEY": tuple(span.pulley for span in self.spans),
            "START_SIGN": self._signs(parents, "start"),
            "START_PAIR": self._pairs(parents, revolute, "start"),
            "END_SIGN": self._signs(parents, "end"),
            "END_PAIR": self._pairs(parents, revolute, "end"),
        }

    @cached_property
    def references(self) -> tuple[int, ...]:
        """Link from which each span is looked at: that of its pulley, else of its start."""
        return tuple(
            self.bodies[span.start if span.pulley == NO_PULLEY else span.pulley]
            for span in self.spans
        )

    def _ways(self, parents: tuple[int, ...], name: str) -> list[dict[int, tuple[int, int]]]:
        """Return per span how each joint moves one of its ends: place on the way, and sign."""
        ways = []
        for span, reference in zip(self.spans, self.references, strict=True):
            way = way_between(parents, reference, self.bodies[getattr(span, name)])
            ways.append({joint: (place, sign) for place, (joint, sign) in enumerate(way)})
        return ways

    def _signs(self, parents: tuple[int, ...], name: str) -> tuple[tuple[int, ...], ...]:
        """Return +1, -1 or 0 per span and joint, as the joint carries the end, or who looks."""
        ways = self._ways(parents, name)
        return tuple(tuple(way.get(j, (0, 0))[1] for j in range(len(parents))) for way in ways)

    def _pairs(
        self, parents: tuple[int, ...], revolute: tuple[bool, ...], name: str
    ) -> tuple[tuple[tuple[bool, ...], ...], ...]:
        """Return per span whether joint j turns how joint k moves the end, shape (S, J, J).

        It does where it turns and lies before k, or is k, on the way from who looks.
        """
        joints = range(len(parents))
        return tuple(
            tuple(
                tuple(
                    revolute[j] and j in way and k in way and way[j][0] <= way[k][0] for k in joints
                )
                for j in joints
            )
            for way in self._ways(parents, name)
        )


NO_ROUTES = RoutePlan(bodies=(), spans=())
"""A mechanism whose moment arms are all constant."""


def plan_of(tendons: list[int], bodies: list[int], radii: list[float]) -> RoutePlan:
    """Return the plan of one world's path points, tendon by tendon in their order.

    Args:
        tendons: Tendon of each path point.
        bodies: Its link, -1 for the base.
        radii: Its radius [m], 0 for a site.
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
