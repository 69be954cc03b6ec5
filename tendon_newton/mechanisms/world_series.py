"""Newton models of many worlds, continued from those of two and three.

Newton's builder copies worlds one by one in Python, 0.15 ms each. All worlds of a mechanism are
alike: from one world to the next the rows of an array repeat, and indices and counts grow by the
same step. So the models of two and three worlds say what a model of more holds.
"""

from collections.abc import Callable
from typing import Any

import newton
import numpy as np
import warp as wp
from numpy.typing import NDArray

FEW = 3  # Up to so many worlds a model is Newton's own
# Fields of a model that have no rows of worlds, and one that `_shapes_of_bodies` makes
DESCRIPTIONS = ("attribute_specs", "attribute_frequency", "attribute_assignment", "body_shapes")


def model_of_worlds(replicate: Callable[[int], newton.Model], world_count: int) -> newton.Model:
    """Return the finalized model of W equal worlds.

    `replicate` makes a model of a few worlds with Newton's builder.
    """
    model: Any = replicate(min(world_count, FEW))
    if world_count > FEW:
        _continue_fields(replicate(FEW - 1), model, world_count - FEW)
        model.body_shapes = _shapes_of_bodies(model)
        leaves = newton.ModelBuilder.BvhConfig()
        model.bvh_build_shapes(
            model, bvh_constructor=leaves.shape_constructor, shape_flags=leaves.shape_flags
        )
    return model


def _continue_fields(two: Any, three: Any, more: int) -> None:
    """Continue the fields of three worlds by further ones, in place: others may refer to them."""
    fields = vars(three)
    for name in fields.keys() - DESCRIPTIONS:
        fields[name] = _continued(getattr(two, name), fields[name], more)


def _continued(two: Any, three: Any, more: int) -> Any:
    """Return a value of three worlds for further ones; what has no rows of worlds stays."""
    if two is three:
        return three
    if isinstance(three, wp.array):
        if len(two) == len(three):
            return three
        rows = _rows(two.numpy(), three.numpy(), more)
        return wp.array(
            rows, dtype=three.dtype, device=three.device, requires_grad=three.requires_grad
        )
    if isinstance(three, np.ndarray):
        return _rows(two, three, more)
    if isinstance(three, list):
        count = len(three) - len(two)
        return three + three[:count] * more
    if isinstance(three, dict):
        return {key: _continued(two[key], value, more) for key, value in three.items()}
    if type(three) is int:
        return three + more * (three - two)
    if type(three).__module__.startswith("newton.") and hasattr(three, "__dict__"):
        _continue_fields(two, three, more)
    return three


def _rows(two: NDArray[Any], three: NDArray[Any], more: int) -> NDArray[Any]:
    """Return the rows of three worlds, of further ones, and what follows the last, such as an end.

    A row in front of all worlds does no harm: steps are those between the last worlds.
    """
    count = len(three) - len(two)
    _, earlier, latest, last = np.split(three, [count, 2 * count, FEW * count])
    further = np.repeat(latest[None], more, axis=0)
    if three.dtype.kind in "iu":
        world = np.arange(1, more + 1, dtype=three.dtype).reshape(-1, *[1] * three.ndim)
        further += world * (latest - earlier)
        last = last + more * (last - two[2 * count :])
    return np.concatenate([three[: FEW * count], further.reshape(-1, *three.shape[1:]), last])


def _shapes_of_bodies(model: Any) -> dict[int, list[int]]:
    """Return the shapes of each body and of the base, -1."""
    shapes: dict[int, list[int]] = {body: [] for body in range(-1, model.body_count)}
    for shape, body in enumerate(model.shape_body.numpy().tolist()):
        shapes[body].append(shape)
    return shapes
