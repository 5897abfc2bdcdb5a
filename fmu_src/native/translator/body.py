"""One function in translation: its lines, its variables, conversions of its values, its loops and its lists.

Every assignment makes a new variable in C. A variable that both branches set, or that a loop sets again, becomes one
variable to which both assign.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any, NoReturn

from ...errors import Untranslatable
from . import types as c
from .values import Expr, Run, known_items, literal, type_of, unwrap


class Body:
    """One function in translation; ``program``, a Translation, translates the functions that it calls."""

    def __init__(
        self, program: Any, name: str, function: FunctionType, parameters: dict[str, c.CType], returns: c.CType | None
    ) -> None:
        self.program, self.name, self.function = program, name, function
        self.parameters, self.result = parameters, returns or c.UNKNOWN
        self.changed_lists: set[str] = set()  # variables of which an element is changed, or to which one is appended
        self.needs_space = self.is_external = False
        self.lines: list[str] = []
        self.depth, self.count = 1, 0
        self.env: dict[str, Any] = {}  # values of the variables
        self.ended = False  # whether a return has ended the block

    # Lines

    def emit(self, line: str) -> None:
        """Add a line to the current block."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def collect_aside(self, lines: list[str], deeper: int = 1) -> Iterator[None]:
        """Collect lines in a list of their own."""
        outer, self.lines = self.lines, lines
        self.depth += deeper
        yield
        self.depth -= deeper
        self.lines = outer

    @contextmanager
    def open_block(self, head: str) -> Iterator[None]:
        """Add a block in braces."""
        self.emit(f"{head} {{")
        with self.collect_aside(self.lines):
            yield
        self.emit("}")

    def refuse(self, node: ast.AST | None, reason: str) -> NoReturn:
        """Refuse a form of Python."""
        code = self.function.__code__
        line = code.co_firstlineno - 1 + getattr(node, "lineno", 1)
        raise Untranslatable(f"{'/'.join(Path(code.co_filename).parts[-3:])}, line {line}: {reason}")

    # Variables of C

    def fresh_name(self, name: str = "t") -> str:
        """Return a new name."""
        self.count += 1
        return f"{name.lstrip('_') or 't'}_{self.count}"

    def declare(self, kind: c.CType, name: str = "t", text: str = "") -> Expr:
        """Declare a variable, with a value or without."""
        self.program.define_type(kind)
        variable = Expr(self, kind, self.fresh_name(name))
        self.emit(f"{f'{kind.name} '.replace('* ', '*')}{variable.code}{f' = {text}' if text else ''};")
        return variable

    def split_value(self, value: Expr) -> Any:
        """Return a tuple of known length as a tuple of its elements."""
        if not isinstance(value.type, c.Row):
            return value
        return tuple(self.split_value(Expr(self, kind, value.path(f"x{i}"))) for i, kind in enumerate(value.type.items))

    def name_value(self, value: Any, name: str = "t") -> Any:
        """Return ``value`` in a form that can be used several times: a variable if it is more than a name."""
        if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
            return type(value)(self.name_value(item, name) for item in value)
        if not isinstance(value, Expr) or value.is_simple:
            return value
        return self.declare(value.type, name, value.bare)

    def store(self, name: str, value: Any) -> None:
        """Set a variable; a list that the function changes is copied to a new variable."""
        if name in self.changed_lists:
            kind = type_of(value)
            value = self.declare(kind, name, self.as_type(value, kind).bare)
        self.env[name] = self.name_value(value, name)

    def set_item(self, items: Any, index: Any, value: Any) -> None:
        """Set an element of a list."""
        self.emit(f"{items.path('at')}[{self.index_text(items, index)}] = {self.as_type(value, items.type.item).bare};")

    def new_list(self, kind: c.CType, room: str) -> Expr:
        """Declare an empty list with room for this number of elements."""
        self.needs_space = True
        return self.declare(kind, text=f"new_{kind.name}(space, {room})")

    def append_item(self, items: Any, value: Any) -> None:
        """Append a value to a list."""
        self.needs_space = True
        self.emit(f"push_{items.type.name}(space, &{items.code}, {self.as_type(value, items.type.item).bare});")

    # Conversions

    def as_type(self, value: Any, target: c.CType) -> Expr:
        """Return ``value`` as an expression of type ``target``, or raise NoType."""
        have = type_of(value)
        if isinstance(value, Expr) and (have == target or target == c.UNKNOWN):
            return value
        self.program.define_type(target)
        if isinstance(target, c.Maybe):
            inner = "0" if have == c.NOTHING else f"true, {self.as_type(value, target.item).bare}"
            return Expr(self, target, f"({target.name}){{{inner}}}")
        if isinstance(have, c.Maybe):
            return self.as_type(unwrap(value), target)
        if have in (c.BOOL, c.INT, c.FLOAT, c.TEXT) and not isinstance(value, Expr) and have in (target, c.BOOL, c.INT):
            text = literal(float(value) if target == c.FLOAT else value)
            return Expr(self, target, text, text.startswith("-"))
        if target in (c.INT, c.FLOAT) and have in (c.BOOL, c.INT):
            return Expr(self, target, value.as_float or f"({target.name}){value.code}", bool(value.as_float))
        items = known_items(value)
        if items is not None and isinstance(target, c.Row) and len(items) == len(target.items):
            inner = ", ".join(self.as_type(item, kind).bare for item, kind in zip(items, target.items, strict=True))
            return Expr(self, target, f"({target.name}){{{inner}}}")
        if isinstance(target, c.Listing) and (items == [] or have == c.Listing(c.UNKNOWN)):
            return Expr(self, target, f"({target.name}){{0}}")
        if isinstance(target, c.Listing) and isinstance(have, c.Listing | c.Row):
            copy = self.new_list(target, str(len(items or ())))
            self.for_each(value, lambda item: self.append_item(copy, item))
            return copy
        if items is not None and have == target and isinstance(target, c.Struct):
            return self.make_struct(target.kind, *items)
        raise c.NoType(f"{have.name} is given where {target.name} is needed")

    def unpack(self, value: Any, count: int) -> tuple[Any, ...]:
        """Return ``count`` elements of a tuple or list."""
        items = known_items(value)
        if items is None and isinstance(type_of(value), c.Listing):
            items = [self.get_item(value, i) for i in range(count)]
        if items is None or len(items) != count:
            raise c.NoType(f"{type_of(value).name} does not fit {count} variables")
        return tuple(items)

    # Loops

    def repeat(self, head: str, assigned: Collection[str], translate_body: Callable[[], None]) -> None:
        """Add a loop whose body ``translate_body`` adds; it assigns to variables, of which some exist before it."""
        first = {name: self.env[name] for name in sorted(self.env.keys() & set(assigned))}
        first = {name: self.as_type(value, type_of(value)) for name, value in first.items()}
        carried = {name: self.declare(value.type, name, value.bare) for name, value in first.items()}
        outer = {**self.env, **{name: self.split_value(variable) for name, variable in carried.items()}}
        self.env = dict(outer)
        carried_names, next_values = {variable.code for variable in carried.values()}, {}
        with self.open_block(head):
            translate_body()
            for name, variable in carried.items():
                value = self.as_type(self.env[name], variable.type)
                if carried_names & set(re.findall(r"\w+", value.code)):
                    value = self.declare(variable.type, name, value.bare)
                next_values[variable.code] = value.bare
            for code, text in next_values.items():
                self.emit(f"{code} = {text};")
        self.env, self.ended = outer, False

    def for_each(self, over: Any, visit: Callable[[Any], None], assigned: Collection[str] = ()) -> None:
        """Call ``visit`` with every element: one by one if all of them are known, else once inside a loop in C."""
        items = known_items(over)
        if items is not None:
            for item in items:
                visit(item)
            return
        run, k = self.loop_range(over), self.fresh_name("k")
        count = self.name_value(Expr(self, c.INT, run.count)).code
        self.repeat(f"for (int64_t {k} = 0; {k} < {count}; {k}++)", assigned, lambda: visit(run.at(k)))

    # Tuples and lists

    def loop_range(self, over: Any) -> Run:
        """Return what a loop in C runs over."""
        if isinstance(over, Run):
            return over
        sequence = self.name_value(unwrap(over))
        return Run(sequence.path("count"), lambda k: self.get_item(sequence, Expr(self, c.INT, k)))

    def collect(self, fill: Callable[[Callable[[Any], None]], None], room: str = "0") -> Any:
        """Return the values that ``fill`` adds: a tuple, or a list if it adds them inside a loop in C."""
        values: list[Any] = []
        lines: list[str] = []
        outer = deepest = self.depth

        def add(value: Any) -> None:
            nonlocal deepest
            deepest = max(deepest, self.depth)
            values.append(value)

        with self.collect_aside(lines, 0):
            fill(add)
        if deepest == outer:
            self.lines += lines
            return tuple(values)
        items = self.new_list(type_of(values), room)
        fill(lambda value: self.append_item(items, value))
        return items

    def make_display(self, *parts: tuple[bool, Any]) -> Any:
        """Return ``(a, *b)``; its length is known unless one of its starred parts is a list."""
        values = [(is_starred, self.name_value(value) if is_starred else value) for is_starred, value in parts]
        rooms = [self.loop_range(value).count for starred, value in values if starred and known_items(value) is None]

        def fill(add: Callable[[Any], None]) -> None:
            for is_starred, value in values:
                self.for_each(value, add) if is_starred else add(value)

        return self.collect(fill, f"{rooms[0]} + {len(parts) - 1}" if rooms else "0")

    def get_item(self, value: Any, index: Any) -> Any:
        """Return ``value[index]``; a slice of a list is a new list."""
        value = unwrap(value)
        bounds = (index.start, index.stop, index.step) if isinstance(index, slice) else (index,)
        items = known_items(value)
        if items is not None and not any(isinstance(bound, Expr) for bound in bounds):
            return tuple(items[index]) if isinstance(index, slice) else items[index]
        if items is not None:
            value = self.as_type(tuple(items), type_of(items))
        value = self.name_value(value)
        places = [self.index_text(value, bound) for bound in bounds]
        if not isinstance(index, slice):
            return self.split_value(Expr(self, value.type.item, f"{value.path('at')}[{places[0]}]"))
        self.needs_space = True
        first, beyond, step = places[0] or "0", places[1] or value.path("count"), places[2] or "1"
        return Expr(self, value.type, f"part_of_{value.type.name}(space, {value.code}, {first}, {beyond}, {step})")

    def index_text(self, value: Expr, index: Any) -> str:
        """Return an index in C; a negative one counts from the end."""
        if isinstance(index, int) and index < 0:
            return f"{value.path('count')} - {-index}"
        return "" if index is None else self.as_type(index, c.INT).bare

    # Functions and classes of the project

    def make_struct(self, kind: type, *values: Any, **fields: Any) -> Expr:
        """Make a struct: ``PlantState(...)``."""
        bound = inspect.signature(kind).bind(*values, **fields)
        bound.apply_defaults()
        types = c.fields(kind)
        inner = [f".{name} = {self.as_type(bound.arguments[name], of_field).bare}" for name, of_field in types.items()]
        struct = self.declare(c.Struct(kind), kind.__name__.lower(), f"{{{', '.join(inner)}}}")
        if hasattr(kind, "__post_init__"):  # its own checks
            self.program.call(self, kind.__post_init__, struct)
        return struct

    def replace_fields(self, old: Any, **new: Any) -> Expr:
        """Return ``old._replace(...)``: a copy of a struct with other values in some fields."""
        return self.make_struct(old.type.kind, **{name: getattr(old, name) for name in c.fields(old.type.kind)} | new)
