"""Device code written once, compiled for any precision, joint count and list of effects.

A device function is plain Python marked with `device_template`. It speaks of placeholders (`real`,
`JointVector`, `JOINTS`, ...; see `placeholders`). A `Specialiser` binds them, and every template
that the function calls in turn, and hands the result to Warp.
"""

from __future__ import annotations

import hashlib
import inspect
import types
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import warp as wp

Function = TypeVar("Function", bound=Callable[..., Any])
_MARK = "__device_template__"


def device_template(function: Function) -> Function:
    """Mark a function as device code with placeholders, to be bound by a `Specialiser`."""
    setattr(function, _MARK, True)
    return function


def is_device_template(value: Any) -> bool:
    """Tell whether something is device code with placeholders."""
    return getattr(value, _MARK, False) is True


class Specialiser:
    """Binds placeholders in device templates; one per kernel, whose functions are shared inside it.

    Args:
        bindings: Placeholder name -> type, constant or Warp function.
        inline: Whether functions are inlined. The adjoint of a call repeats its forward pass at
            every depth; inlined, the compiler finds the repetition, and takes far longer to do so.
    """

    def __init__(self, bindings: Mapping[str, Any], *, inline: bool = False) -> None:
        self._bindings = dict(bindings)
        self._inline = inline
        self._functions: dict[types.CodeType, Any] = {}
        self._sources: list[str] = []

    def child(self) -> Specialiser:
        """Return one with the same bindings, which may get more; its sources count here too."""
        child = Specialiser(self._bindings, inline=self._inline)
        child._sources = self._sources
        return child

    def bind(self, name: str, value: Any) -> None:
        """Bind one more placeholder, before the templates that use it."""
        self._bindings[name] = value

    def function(self, template: Callable[..., Any], *, inline: bool | None = None) -> Any:
        """Return the Warp function of a template under the bindings.

        Args:
            template: A device function.
            inline: Whether it is inlined, in place of what the compiler would do; False lets a
                compiler meet a long function once.
        """
        code = template.__code__
        if code not in self._functions:
            hint = True if self._inline and inline is None else inline
            decorator: Any = wp.func(inline=hint)
            self._functions[code] = decorator(self._bind(template))
        return self._functions[code]

    def gradient(self, template: Callable[..., Any], rule: Callable[..., Any]) -> None:
        """Give a template a derivative of its own, before any kernel that uses it is made.

        Args:
            template: A device function.
            rule: Device code with the same arguments and the adjoint of the result, which adds to
                `wp.adjoint[argument]`.
        """
        wp.func_grad(self.function(template))(self._bind(rule))

    def kernel(self, template: Callable[..., Any], identity: str, **options: Any) -> wp.Kernel:
        """Return the Warp kernel of a template, in a module of its own.

        Args:
            template: Device code without a result.
            identity: Tells apart kernels whose bindings differ. Warp's cache keys hold neither
                functions nor numbers that a static loop picks from a tuple; without this, two lists
                of effects of one shape would share one binary.
            options: As for `warp.kernel`.
        """
        bound = self._bind(template)
        digest = hashlib.sha256(
            "\n".join([identity, str(self._inline), *self._sources]).encode()
        ).hexdigest()[:12]
        name = f"{template.__name__}_{digest}"
        decorator: Any = wp.kernel
        return decorator(bound, name=name, module="unique", **options)

    def _bind(self, template: Callable[..., Any]) -> types.FunctionType:
        """Copy a function with globals in which every placeholder and template is bound."""
        scope = dict(template.__globals__)
        scope.update(self._bindings)
        for name in template.__code__.co_names:
            if is_device_template(scope.get(name)):
                scope[name] = self.function(scope[name])
        bound = types.FunctionType(template.__code__, scope, template.__name__)
        bound.__annotations__ = {
            key: eval(value, scope) if isinstance(value, str) else value
            for key, value in template.__annotations__.items()
        }
        bound.__module__ = template.__module__
        bound.__qualname__ = template.__qualname__
        bound.__doc__ = template.__doc__
        self._sources.append(inspect.getsource(template))
        return bound
