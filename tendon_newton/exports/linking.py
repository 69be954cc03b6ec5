"""One file out of several modules and the law that they import, for a model to be carried away.

A written program runs the very lines that the simulation runs, so that a new effect needs no second
version. The modules are ordinary ones. What they import from the package is put before them, and
what that calls in turn: device functions with the model's constants in them, structs, numbers.
"""

import ast
import copy
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any

from tendon_newton.device_code.field_check import structs_of
from tendon_newton.device_code.placeholders import Constant
from tendon_newton.device_code.source_text import syntax_of
from tendon_newton.device_code.templates import is_device_template, is_struct
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.runtime import engine, facts

PACKAGE = "tendon_newton"


class Linker:
    """Collects what the modules of a program need, each once, behind all that it calls.

    Device code stays Warp's or becomes plain Python. Some numbers of the law, by name, may be
    others in this program.
    """

    def __init__(
        self, law: ModelLaw, *, device: bool, numbers: Mapping[str, float] | None = None
    ) -> None:
        self._law, self._device, self._numbers = law, device, numbers or {}
        self._names: dict[Any, str] = {}
        self._parts: list[str] = []
        self._imports: set[str] = set()

    def program(
        self, docstring: str, known: Mapping[str, Any], modules: Sequence[ModuleType], *, last: str
    ) -> str:
        """Return the text of a program that knows some facts, its folder and its memory's size.

        The law is written in what the first of the modules defines; `last` is what the program does
        when it is run.
        """
        own = {module.__name__: "" for module in (facts, *modules)}
        own[engine.__name__] = "import mujoco"
        folder = Text("Path(__file__).resolve().parent")
        known = {"FOLDER": folder, "MEMORY_SIZE": self._law.memory_size, **known}
        base, *bodies = [self._body(module, own) for module in modules]
        return "\n".join(
            [
                f'"""{docstring}"""\n',
                *([] if self._device else ["from __future__ import annotations\n"]),
                *sorted(self._imports),
                "\n# ---- the model's numbers\n",
                *(f"{name} = {literal(value)}" for name, value in known.items()),
                base,
                "\n# ---- the law of the model's servo, as it stands in the package\n\n",
                "\n\n\n".join(self._parts),
                *bodies,
                f'\nif __name__ == "__main__":\n    {last}\n',
            ]
        )

    def carry(self, name: str, value: Any) -> str:
        """Carry a function, struct or number, and return the name that it has in the text."""
        if isinstance(value, Constant):
            value = self._law.constants[value]
        if isinstance(value, int | float):
            number = literal(self._numbers.get(name, value))
            return self._once(name, (name, number), lambda _: f"{name} = {number}")
        if is_struct(value):
            return self._once(name, value, self._struct_text)
        if self._law.holds_effects(value):
            return self._once(name, value, self._stage_text)
        if callable(value) and (is_device_template(value) or value in self._law.functions):
            return self._once(name, self._law.functions.get(value, value), self._function_text)
        return name

    def _once(self, name: str, value: Any, text: Callable[[Any], str]) -> str:
        """Carry something the first time that it is asked for."""
        key = getattr(value, "__code__", value)  # a class makes a function anew for each look
        if key not in self._names:
            assert name not in self._names.values(), f"two things are called {name}"
            self._names[key] = name
            self._parts.append(text(value))
        return self._names[key]

    def _body(self, module: ModuleType, own: Mapping[str, str]) -> str:
        """Return what follows a module's imports, once all that they bring is carried."""
        text = inspect.getsource(module)
        tree = ast.parse(text)
        imports = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        for node in imports:
            source = str(getattr(node, "module", node.names[0].name))
            if source.split(".")[0] != PACKAGE and source != "__future__":
                self._imports.add(ast.unparse(node))
            elif source in own:
                self._imports |= {own[source]} - {""}
            elif source != "__future__":
                for alias in node.names:
                    self.carry(alias.name, vars(module)[alias.name])
        first = max((node.end_lineno or 0 for node in imports), default=0)
        body = "\n".join(text.splitlines()[first:]).strip()
        summary = (ast.get_docstring(tree) or "").split("\n", 1)[0].rstrip(".")
        return f"\n\n# ---- {summary}\n\n\n{body}\n"

    def _function_text(self, function: Callable[..., Any]) -> str:
        """Return a device function as text, once all that it calls and reads is carried."""
        definition: Any = copy.deepcopy(syntax_of(function).body[0])
        definition.name = self._names[function.__code__]
        definition = self._folded(definition, function.__globals__)
        for node in ast.walk(definition):
            if isinstance(node, ast.Name) and node.id in function.__globals__:
                node.id = self.carry(node.id, function.__globals__[node.id])
        kernel = "tid" in function.__code__.co_names
        return self._decorated(definition, "kernel" if kernel else "func")

    def _stage_text(self, slot: Callable[..., Any]) -> str:
        """Return the function of a slot for effects."""
        definition = ast.parse(self._law.text(slot, self.carry)).body[0]
        return self._decorated(self._folded(definition, slot.__globals__), "func")

    def _struct_text(self, declared: type) -> str:
        """Return a struct's declaration.

        Fields that few kernels have are left out, and so are the marks of sleeping effects: a
        program has those of its model alone.
        """
        fields = inspect.get_annotations(declared)
        own = {n: k for n, k in fields.items() if not k.startswith(("Annotated", "Flags"))}
        scope = vars(inspect.getmodule(declared))
        for kind in own.values():
            self.carry(kind, scope.get(kind))
        if self._device:
            rows = [f"    {name}: {kind}" for name, kind in own.items()]
            return "\n".join(["@wp.struct", f"class {declared.__name__}:", *rows])
        usual = {"Jet": "Jet()", "int": "0"}
        rows = [f"    {name} = {usual.get(kind, '0.0')}" for name, kind in own.items()]
        return "\n".join([f"class {declared.__name__}(Struct):", *rows])

    def _folded(self, definition: ast.stmt, scope: Mapping[str, Any]) -> Any:
        known = {
            name: self._law.constants.get(value, value)
            for name, value in scope.items()
            if isinstance(value, Constant | int | float)
        }
        shared = {"memory", *structs_of(definition, dict(scope), is_struct)}
        folded = Folded(known).visit(definition)
        return folded if self._device else PlainPython(shared).visit(folded)

    def _decorated(self, definition: Any, kind: str) -> str:
        definition.decorator_list = (
            [ast.parse(f"wp.{kind}", mode="eval").body] if self._device else []
        )
        return ast.unparse(ast.fix_missing_locations(definition))


class Folded(ast.NodeTransformer):
    """Puts in what Warp would know when it compiles."""

    def __init__(self, known: Mapping[str, Any]) -> None:
        self._known = known

    def visit_If(self, node: ast.If) -> Any:
        """Keep the branch that is taken."""
        if not is_call(node.test, "static"):
            return self.generic_visit(node)
        taken = node.body if self._value(node.test) else node.orelse
        return [self.visit(statement) for statement in taken]

    def visit_Call(self, node: ast.Call) -> Any:
        """Put in a number."""
        if is_call(node, "static"):
            return ast.Constant(self._value(node))
        return self.generic_visit(node)

    def _value(self, call: Any) -> Any:
        return eval(ast.unparse(call.args[0]), dict(self._known))


class PlainPython(ast.NodeTransformer):
    """Makes plain Python of device code.

    Structs and vectors, which Warp copies where they get another name, are `shared`.
    """

    def __init__(self, shared: set[str]) -> None:
        self._shared = shared

    def visit_Assign(self, node: ast.Assign) -> Any:
        """Copy what Warp would copy."""
        if isinstance(node.value, ast.Name) and node.value.id in self._shared:
            own = ast.Attribute(value=node.value, attr="copy", ctx=ast.Load())
            node.value = ast.Call(func=own, args=[], keywords=[])
            return node
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> Any:
        """Leave numbers as they are, and make a tuple of an effect's values."""
        self.generic_visit(node)
        if is_call(node, "real"):
            return node.args[0]
        if is_call(node, "Values"):
            return ast.Tuple(elts=node.args, ctx=ast.Load())
        return node


def is_call(node: ast.AST, name: str) -> bool:
    """Tell whether a node calls a function of some name."""
    if not isinstance(node, ast.Call):
        return False
    return name in (getattr(node.func, "id", None), getattr(node.func, "attr", None))


def literal(value: Any) -> str:
    """Return a value as Python text: rows one a line, infinity by its name."""
    if isinstance(value, float) and math.isinf(value):
        return "math.inf" if value > 0.0 else "-math.inf"
    if isinstance(value, tuple):
        return "(" + "".join(f"{literal(v)}, " for v in value) + ")"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + "".join(f"    {literal(row)},\n" for row in value) + "]"
    if isinstance(value, list):
        return "[" + ", ".join(literal(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k!r}: {literal(v)}" for k, v in value.items()) + "}"
    return value if isinstance(value, Text) else repr(value)


class Text(str):
    """A fact that is Python text already."""

    __slots__ = ()
