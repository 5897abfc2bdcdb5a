"""A program: every function that its entries need, made for the types of its arguments as a template is."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from types import FunctionType
from typing import Any, get_type_hints

from heli_plant.syntax import definition_of

from . import assignments, displays, operators, statements, subscripts
from .body import Body, Handler, c_name
from .calls import call, parameter_types
from .conversions import as_type
from .expression import Expr
from .homes import homes
from .refusal import Untranslatable
from .types import (
    DUAL,
    FLOAT,
    NOTHING,
    UNKNOWN,
    CType,
    Function,
    Listing,
    Maybe,
    NoType,
    Row,
    Struct,
    annotated,
    fields,
)

HANDLERS: dict[type, Handler] = {
    ast.Constant: operators.constant,
    ast.Name: operators.name,
    ast.BinOp: operators.binary,
    ast.UnaryOp: operators.unary,
    ast.Compare: operators.compare,
    ast.BoolOp: operators.either,
    ast.IfExp: operators.conditional,
    ast.Attribute: subscripts.attribute,
    ast.Subscript: subscripts.subscript,
    ast.JoinedStr: operators.text,
    ast.Tuple: displays.tuple_display,
    ast.List: displays.list_display,
    ast.ListComp: displays.comprehension,
    ast.GeneratorExp: displays.comprehension,
    ast.Call: call,
    ast.Assign: assignments.assignment,
    ast.AnnAssign: assignments.annotated_assignment,
    ast.AugAssign: assignments.changed_in_place,
    ast.If: statements.branch,
    ast.While: statements.repeat_while,
    ast.For: statements.repeat_for,
    ast.Return: statements.give_back,
    ast.Expr: statements.lone_expression,
    ast.Raise: statements.refusal,
    ast.Break: statements.leave_loop,
    ast.Continue: statements.next_turn,
    ast.Pass: statements.nothing,
}
"""What translates each kind of syntax node."""

_MOST_PASSES = 20


@dataclass
class Unit:
    """One translated function."""

    name: str
    function: FunctionType
    parameters: list[tuple[str, CType]]
    result: CType = NOTHING
    lines: list[str] = field(default_factory=list)
    callees: list[Unit] = field(default_factory=list)
    needs_space: bool = False
    changed: set[str] = field(default_factory=set)
    """Parameters of which the function changes elements."""

    @property
    def head(self) -> str:
        """The function's declaration."""
        parts = ["Space *space"] if self.needs_space else []
        for name, kind in self.parameters:
            if isinstance(kind, Struct):
                parts.append(f"const {kind.name} *{c_name(name)}")
            elif not isinstance(kind, Function):
                parts.append(f"{kind.name} {c_name(name)}".replace("* ", "*"))
        return f"{self.result.name} {self.name}({', '.join(parts) or 'void'})"


class Translation:
    """Functions and types that a program needs.

    Parameters
    ----------
    externals : mapping, optional
        Functions that are written in C: the name there.
    """

    def __init__(self, externals: dict[Callable[..., Any], str] | None = None) -> None:
        self.externals = externals or {}
        self.units: dict[tuple[Any, ...], Unit] = {}
        self.types: list[CType] = []
        self.names: dict[str, Any] = {}
        self.needs_duals = False

    def entry(self, function: Callable[..., Any], *bound: Callable[..., Any]) -> Unit:
        """Translate a function; ``bound`` are functions, or types, for those parameters that have no annotation.

        Raises
        ------
        Untranslatable
            It, or a function that it calls, uses a form that has no translation.
        """
        function, waiting = inspect.unwrap(function), list(bound)
        kinds: list[CType] = []
        for name, kind in parameter_types(function).items():  # type: ignore[arg-type]
            if kind is None and not waiting:
                raise Untranslatable(
                    inspect.getsourcefile(function) or "?",
                    function.__code__.co_firstlineno,
                    f"the parameter {name} of {function.__name__} needs an annotation",
                )
            if kind is None:
                given = waiting.pop(0)
                kind = _bound(given)
            kinds.append(kind)
        return self.function(function, tuple(kinds))

    def differentiated(self, function: Callable[..., Any], by: Collection[str]) -> Unit:
        """Translate a function whose parameters ``by`` are dual numbers; the others have annotations."""
        function = inspect.unwrap(function)
        kinds = parameter_types(function)  # type: ignore[arg-type]
        return self.function(function, tuple(DUAL if name in by else kind for name, kind in kinds.items()))

    def function(self, function: Any, arguments: tuple[CType, ...]) -> Unit:
        """Return the translation of ``function`` for these argument types."""
        function = inspect.unwrap(function)
        key = (function, arguments)
        if key not in self.units:
            self.units[key] = self._translated(function, arguments)
        return self.units[key]

    def _translated(self, function: FunctionType, arguments: tuple[CType, ...]) -> Unit:
        names = list(inspect.signature(function).parameters)
        unit = Unit(self._name(function, DUAL in arguments), function, list(zip(names, arguments, strict=True)))
        for _, kind in unit.parameters:
            self.use(kind)
        hinted = None if DUAL in arguments else _result(function)
        if function in self.externals:
            unit.name, unit.needs_space, unit.result = self.externals[function], True, hinted or NOTHING
            self.use(unit.result)
            return unit
        file = function.__code__.co_filename
        origin = ("/".join(Path(file).parts[-3:]), function.__code__.co_firstlineno - 1)
        definition = definition_of(function)
        places = homes(definition)
        body = Body(self, HANDLERS, function.__globals__, origin, places, assignments.declare)
        body.returns = hinted
        assigned = {n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        for _ in range(_MOST_PASSES):
            before = dict(body.types), body.returned, set(body.grown), set(body.changed)
            body.begin()
            if hinted is None and before[1] != UNKNOWN:
                body.returns = before[1]
            _parameters(body, unit, assigned)
            body.statements(definition.body)
            if (body.types, body.returned, body.grown, body.changed) == before:
                break
        else:
            raise Untranslatable(origin[0], origin[1] + 1, f"the types of {function.__name__} do not settle")
        unit.result = body.returns or (NOTHING if body.returned == UNKNOWN else body.returned)
        unit.changed = body.changed & set(names)
        unit.lines, unit.callees, unit.needs_space = body.lines, body.callees, body.needs_space
        return unit

    def _name(self, function: Any, differentiated: bool) -> str:
        """Return a name in C: the module's and the function's."""
        module = function.__module__.rpartition(".")[2]
        own = re.sub(r"\W+|__+", "_", function.__qualname__).strip("_")
        base = name = f"{module}_{own}{'_dual' if differentiated else ''}"
        number = 1
        while name in self.names:
            number += 1
            name = f"{base}_{number}"
        self.names[name] = function
        return name

    def use(self, kind: CType) -> None:
        """Define a type and those that it is made of."""
        self.needs_duals = self.needs_duals or kind == DUAL
        if kind in self.types or kind == UNKNOWN or (isinstance(kind, Listing) and kind.item == UNKNOWN):
            return
        if isinstance(kind, Struct):
            for inner in fields(kind.kind).values():
                self.use(inner)
        elif isinstance(kind, Row):
            for inner in kind.items:
                self.use(inner)
        elif isinstance(kind, Listing | Maybe):
            self.use(kind.item)
        if isinstance(kind, Struct | Row | Listing | Maybe):
            self.types.append(kind)


def _bound(given: Any) -> CType:
    """Return the type of a parameter for which a type or a function is given."""
    if given is float:
        return FLOAT
    return Struct(given) if isinstance(given, type) else Function(given)


def _result(function: FunctionType) -> CType | None:
    """Return the type of the result as its annotation says it."""
    try:
        hint = get_type_hints(function).get("return", UNKNOWN)
        return None if hint is UNKNOWN else annotated(hint)
    except (NameError, NoType, TypeError):
        return None


def _parameters(body: Body, unit: Unit, assigned: set[str]) -> None:
    """Let the parameters' names stand for what C passes; one that is assigned to becomes a variable."""
    for name, kind in unit.parameters:
        if isinstance(kind, Function):
            body.bind(name, Expr(kind, constant=kind.function))
        elif name in assigned and (isinstance(kind, Struct) or body.types.get(name, kind) != kind):
            wanted = body.widen(name, kind)
            given = Expr(kind, c_name(name), pointer=isinstance(kind, Struct))
            body.emit(f"{wanted.name} {name}_now = {as_type(body, given, wanted).text};")
            body.bind(name, Expr(wanted, f"{name}_now"))
            body.renamed[name] = f"{name}_now"
        elif name in assigned:
            body.widen(name, kind)
        else:
            body.bind(name, Expr(kind, c_name(name), pointer=isinstance(kind, Struct)))
