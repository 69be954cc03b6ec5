"""Device code written once, compiled for any precision, joint count and list of effects.

A device function is plain Python marked with `device_template`. It speaks of declarations: types
and constants (`placeholders`), structs (`structs`) and functions that are chosen later (`slots`).
A `Specialiser` puts in what each stands for, and every template that the function calls in turn,
and hands the result to Warp.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
import types
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, TypeVar, get_args, get_origin

import warp as wp

from tendon_newton.device_code.field_check import check_fields
from tendon_newton.device_code.references import by_reference, check_calls
from tendon_newton.device_code.source_text import text_of

Function = TypeVar("Function", bound=Callable[..., Any])
Declaration = TypeVar("Declaration", bound=type)
_TEMPLATE = "__device_template__"
_STRUCT = "__device_struct__"


def device_template(function: Function) -> Function:
    """Mark a function as device code with declarations, to be bound by a `Specialiser`."""
    setattr(function, _TEMPLATE, True)
    return function


class DeviceCode:
    """A class that is never instantiated, and whose static methods are device code.

    The name of the file is `name`.
    """

    name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        cls.name = cls.__module__.rpartition(".")[2]
        for member in vars(cls).values():
            if isinstance(member, staticmethod):
                device_template(member.__func__)


def is_device_template(value: Any) -> bool:
    """Tell whether something is device code with placeholders."""
    return getattr(value, _TEMPLATE, False) is True


def device_struct(declaration: Declaration) -> Declaration:
    """Mark a class as the declaration of a struct."""
    setattr(declaration, _STRUCT, True)
    return declaration


def is_struct(value: Any) -> bool:
    """Tell whether a value is the declaration of a struct."""
    return isinstance(value, type) and _STRUCT in vars(value)


class Bindings:
    """What each declaration stands for; structs follow from their fields."""

    def __init__(self, values: Mapping[Any, Any]) -> None:
        self._declared: dict[int, Any] = {}
        self._values: dict[int, Any] = {}
        self._structs: dict[type, Any] = {}
        for declaration, value in values.items():
            self[declaration] = value

    def __setitem__(self, declaration: Any, value: Any) -> None:
        self._declared[id(declaration)] = declaration  # kept, so that no other gets its id
        self._values[id(declaration)] = value

    def __getitem__(self, declaration: Any) -> Any:
        """Return what a declaration stands for; what is none, and what nothing binds, is itself."""
        if is_struct(declaration):
            if declaration not in self._structs:
                self._structs[declaration] = self._struct(declaration)
            return self._structs[declaration]
        return self._values.get(id(declaration), declaration)

    def copy(self) -> Bindings:
        """Return the same bindings, which may get more; structs are shared."""
        copy = Bindings({})
        copy._declared, copy._values = dict(self._declared), dict(self._values)
        copy._structs = self._structs
        return copy

    def annotations(self, annotated: Any, scope: Mapping[str, Any]) -> dict[str, Any]:
        """Return the annotations of a function or class with every declaration replaced."""
        bound = _Resolved(self, scope)
        return {
            name: eval(value, {}, bound) if isinstance(value, str) else self[value]
            for name, value in inspect.get_annotations(annotated).items()
        }

    def _struct(self, declaration: type) -> Any:
        """Make the Warp struct of a declaration."""
        scope = vars(sys.modules[declaration.__module__])
        fields = {}
        for name, kind in self.annotations(declaration, scope).items():
            conditions: list[Any] = []
            if get_origin(kind) is Annotated:
                kind, *conditions = get_args(kind)
            if all(conditions):
                fields[name] = kind
        name = declaration.__name__
        return wp.struct(
            type(name, (), {"__annotations__": fields, "__module__": declaration.__module__})
        )


class _Resolved(dict[str, Any]):
    """Names of a module, each as what it stands for once it is asked for."""

    def __init__(self, bindings: Bindings, scope: Mapping[str, Any]) -> None:
        super().__init__()
        self._bindings, self._scope = bindings, scope

    def __missing__(self, name: str) -> Any:
        return self._bindings[self._scope[name]]


class Specialiser:
    """Binds declarations in device templates; one per kernel, whose functions are shared inside it.

    Large arguments may be passed by reference; a tape cannot follow them.
    """

    def __init__(self, bindings: Bindings, *, references: bool = False) -> None:
        self._bindings = bindings.copy()
        self._references = references
        self._functions: dict[types.CodeType, Any] = {}
        self._sources: list[str] = []

    def child(self) -> Specialiser:
        """Return one with the same bindings, which may get more; its sources count here too."""
        child = Specialiser(self._bindings, references=self._references)
        child._sources = self._sources
        return child

    def bind(self, declaration: Any, value: Any) -> None:
        """Say what one more declaration stands for, before the templates that use it."""
        self._bindings[declaration] = value

    def function(self, template: Callable[..., Any], *, inline: bool | None = None) -> Any:
        """Return the Warp function of a template under the bindings.

        Left to the compiler, it may be inlined; False lets a compiler meet a long function once.
        """
        code = template.__code__
        if code not in self._functions:
            decorator: Any = wp.func(inline=inline)
            bound = self._bind(template)
            if self._references:
                bound.__annotations__ = by_reference(template, bound.__annotations__)
            self._functions[code] = decorator(bound)
        return self._functions[code]

    def gradient(self, template: Callable[..., Any], rule: Callable[..., Any]) -> None:
        """Give a template a derivative of its own, before any kernel that uses it is made.

        The rule has the same arguments and the adjoint of the result; it adds to
        `wp.adjoint[argument]`.
        """
        wp.func_grad(self.function(template))(self._bind(rule))

    def kernel(self, template: Callable[..., Any], identity: str, **options: Any) -> wp.Kernel:
        """Return the Warp kernel of a template, in a module of its own.

        Kernels that share functions are all made before one of them is launched.

        The name tells apart kernels whose identity, sources or bound numbers differ. Warp's cache
        keys hold neither functions nor numbers that a static loop picks from a tuple; two lists of
        effects of one shape would share one binary.
        """
        bound = self._bind(template)
        digest = hashlib.sha256("\n".join([identity, *self._sources]).encode()).hexdigest()[:12]
        name = f"{template.__name__}_{digest}"
        decorator: Any = wp.kernel
        kernel = decorator(bound, name=name, module="unique", **options)
        # A binary's name counts what Warp evaluated inside loops. A function knows that once some
        # kernel that calls it is built; so names are taken before, and the compiler's options with
        # them. Warp has done so for the module's own block on CUDA; a CPU's block is one thread.
        kernel.module.get_module_hash(1)
        return kernel

    def _bind(self, template: Callable[..., Any]) -> types.FunctionType:
        """Copy a function with globals in which every declaration and template is bound."""
        check_fields(template, is_struct)
        scope = dict(template.__globals__)
        for name in template.__code__.co_names:
            if name in scope:
                scope[name] = self._bound(scope[name])
        bound = types.FunctionType(template.__code__, scope, template.__name__)
        check_calls(template, scope)
        bound.__annotations__ = self._bindings.annotations(template, template.__globals__)
        bound.__module__ = template.__module__
        bound.__qualname__ = template.__qualname__
        bound.__doc__ = template.__doc__
        self._sources.append(text_of(template))
        return bound

    def _bound(self, value: Any) -> Any:
        """Return what a global of a template stands for; numbers are told with the sources."""
        found = self._bindings[value]
        if is_device_template(found):
            return self.function(found)
        if found is not value and not callable(found):
            # not `repr`: of a matrix that is its place in memory, another one in each process
            self._sources.append(str(found))
        return found
