"""One function while it is translated: its lines, its variables, conversions of its values, and its branches and loops.

Every assignment makes a variable of its own in C. Where two branches meet, or a loop begins again, a variable that they
have both set becomes one variable that both assign to. What the types of results and of growing lists are is found by
translating the function again until none widens any more.
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

from heli_plant.dual import Dual

from ...errors import Untranslatable
from . import types as c
from .values import Expr, Run, known_items, literal, type_of, unwrap


class Body:
    """One function in translation; ``program``, a Translation, translates those that it calls and defines the types."""

    def __init__(
        self, program: Any, name: str, function: FunctionType, parameters: dict[str, c.CType], returns: c.CType | None
    ) -> None:
        self.program, self.name, self.function = program, name, function
        self.parameters, self.hinted = parameters, returns
        self.result: c.CType = returns or c.UNKNOWN  # type of the result, as far as it is known
        self.stored: set[str] = set()  # variables of which an element is changed, or to which one is appended: lists
        self.needs_space = self.is_external = False

    def begin(self) -> None:
        """Begin a pass."""
        self.lines: list[str] = []
        self.depth, self.count = 1, 0
        self.env: dict[str, Any] = {}  # values of the variables
        self.ended = False  # whether this is behind a return
        for name, kind in self.parameters.items():
            self.store(name, self.split_value(Expr(self, kind, f"(*{name})" if isinstance(kind, c.Struct) else name)))

    # Lines

    def emit(self, line: str) -> None:
        """Add a line to the current block."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def collect_aside(self, apart: list[str], deeper: int = 1) -> Iterator[None]:
        """Collect lines apart from the current block."""
        outer, self.lines = self.lines, apart
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
        """Return a name that is not taken."""
        self.count += 1
        return f"{name.lstrip('_') or 't'}_{self.count}"

    def declare(self, kind: c.CType, name: str = "t", text: str = "") -> Expr:
        """Declare a variable, with a value or without."""
        self.program.define_type(kind)
        made = Expr(self, kind, self.fresh_name(name))
        self.emit(f"{f'{kind.name} '.replace('* ', '*')}{made.code}{f' = {text}' if text else ''};")
        return made

    def split_value(self, value: Expr) -> Any:
        """Return a tuple of known length as a tuple of its elements, a dual number as one of its parts."""
        if value.type == c.DUAL:
            return Dual(Expr(self, c.FLOAT, value.path("value")), Expr(self, c.FLOAT, value.path("slope")))
        if not isinstance(value.type, c.Row):
            return value
        return tuple(self.split_value(Expr(self, kind, value.path(f"x{i}"))) for i, kind in enumerate(value.type.items))

    def name_value(self, value: Any, name: str = "t") -> Any:
        """Return ``value`` so that it may be used repeatedly: in a variable if it is more than a name."""
        if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
            return type(value)(self.name_value(one, name) for one in value)
        if isinstance(value, Dual):
            return Dual(self.name_value(value.value, name), self.name_value(value.slope, name))
        if not isinstance(value, Expr) or value.is_simple:
            return value
        return self.declare(value.type, name, value.bare)

    def store(self, name: str, value: Any) -> None:
        """Set a variable; one of which an element is changed, or to which one is appended, gets a list of its own."""
        if name in self.stored:
            kind = type_of(value)
            value = self.declare(kind, name, self.as_type(value, kind).bare)
        self.env[name] = self.name_value(value, name)

    def set_item(self, made: Any, index: Any, value: Any) -> None:
        """Set an element of a list."""
        if not isinstance(type_of(made), c.Listing):
            raise c.NoType(f"a value is put into {type_of(made).name}, which is no list")
        self.emit(f"{made.path('at')}[{self.index_text(made, index)}] = {self.as_type(value, made.type.item).bare};")

    def new_list(self, kind: c.CType, room: str) -> Expr:
        """Declare an empty list with room for some elements."""
        self.needs_space = True
        return self.declare(kind, text=f"new_{kind.name}(space, {room})")

    def append_item(self, made: Expr, value: Any) -> None:
        """Append a value to a list."""
        self.needs_space = True
        if not isinstance(made.type, c.Listing):
            raise c.NoType("append needs a list that is a variable of the same function")
        item = self.as_type(value, made.type.item)
        self.emit(f"push_{made.type.name}(space, &{made.code}, {item.bare});")

    # Conversions

    def as_type(self, value: Any, wanted: c.CType) -> Expr:
        """Return ``value`` as an expression of type ``wanted``, or raise NoType."""
        have = type_of(value)
        if isinstance(value, Expr) and (have == wanted or wanted == c.UNKNOWN):
            return value
        self.program.define_type(wanted)
        if isinstance(wanted, c.Maybe):
            inner = "0" if have == c.NOTHING else f"true, {self.as_type(value, wanted.item).bare}"
            return Expr(self, wanted, f"({wanted.name}){{{inner}}}")
        if isinstance(have, c.Maybe):
            return self.as_type(unwrap(value), wanted)
        if wanted == c.DUAL:
            parts = (value.value, value.slope) if isinstance(value, Dual) else (value, 0.0)
            return Expr(self, c.DUAL, f"(Dual){{{', '.join(self.as_type(part, c.FLOAT).bare for part in parts)}}}")
        if have in (c.BOOL, c.INT, c.FLOAT, c.TEXT) and not isinstance(value, Expr) and have in (wanted, c.BOOL, c.INT):
            return Expr(self, wanted, literal(float(value) if wanted == c.FLOAT else value))
        if wanted in (c.INT, c.FLOAT) and have in (c.BOOL, c.INT):
            return Expr(self, wanted, value.as_float or f"({wanted.name}){value.code}")
        items = known_items(value)
        if items is not None and isinstance(wanted, c.Row) and len(items) == len(wanted.items):
            inner = ", ".join(self.as_type(one, kind).bare for one, kind in zip(items, wanted.items, strict=True))
            return Expr(self, wanted, f"({wanted.name}){{{inner}}}")
        if isinstance(wanted, c.Listing) and (items == [] or have == c.Listing(c.UNKNOWN)):
            return Expr(self, wanted, f"({wanted.name}){{0}}")
        if isinstance(wanted, c.Listing) and isinstance(have, c.Listing | c.Row):
            made = self.new_list(wanted, str(len(items or ())))
            self.for_each(value, lambda one: self.append_item(made, one))
            return made
        if items is not None and have == wanted and isinstance(wanted, c.Struct):
            return self.make_struct(wanted.kind, *items)
        raise c.NoType(f"{have.name} is given where {wanted.name} is needed")

    def unpack(self, value: Any, count: int) -> tuple[Any, ...]:
        """Return ``count`` elements of a tuple or list."""
        items = known_items(value)
        if items is None and isinstance(type_of(value), c.Listing):
            items = [self.get_item(value, i) for i in range(count)]
        if items is None or len(items) != count:
            raise c.NoType(f"{type_of(value).name} does not fit {count} variables")
        return tuple(items)

    # Loops

    def repeat(self, head: str, assigned: Collection[str], turn: Callable[[], None]) -> None:
        """Add a loop whose body ``turn`` translates; it assigns to variables, some of which live before it."""
        first = {name: self.env[name] for name in sorted(self.env.keys() & set(assigned))}
        texts = {name: self.as_type(value, type_of(value)) for name, value in first.items()}
        carried = {name: self.declare(text.type, name, text.bare) for name, text in texts.items()}
        around = {**self.env, **{name: self.split_value(made) for name, made in carried.items()}}
        self.env = dict(around)
        own, after = {made.code for made in carried.values()}, {}
        with self.open_block(head):
            turn()
            for name, made in carried.items():
                new = self.as_type(self.env[name], made.type)
                if own & set(re.findall(r"\w+", new.code)):
                    new = self.declare(made.type, name, new.bare)
                after[made.code] = new.bare
            for code, value in after.items():
                self.emit(f"{code} = {value};")
        self.env, self.ended = around, False

    def for_each(self, over: Any, take: Callable[[Any], None], assigned: Collection[str] = ()) -> None:
        """Let ``take`` see every element: unrolled where they are known one by one, else in a loop."""
        items = known_items(over)
        if items is not None:
            for item in items:
                take(item)
            return
        run, k = self.loop_range(over), self.fresh_name("k")
        count = self.name_value(Expr(self, c.INT, run.count)).code
        self.repeat(f"for (int64_t {k} = 0; {k} < {count}; {k}++)", assigned, lambda: take(run.at(k)))

    # Tuples and lists

    def loop_range(self, over: Any) -> Run:
        """Return what a loop in C runs over."""
        if isinstance(over, Run):
            return over
        sequence = self.name_value(unwrap(over))
        if not isinstance(type_of(sequence), c.Listing):
            raise c.NoType(f"a loop in C cannot run over {type_of(sequence).name}")
        return Run(sequence.path("count"), lambda k: self.get_item(sequence, Expr(self, c.INT, k)))

    def collect(self, fill: Callable[[Callable[[Any], None]], None], room: str = "0") -> Any:
        """Return what ``fill`` puts: a tuple where no loop in C is in between, else a list."""
        values: list[Any] = []
        lines: list[str] = []
        outer = deepest = self.depth

        def see(value: Any) -> None:
            nonlocal deepest
            deepest = max(deepest, self.depth)
            values.append(value)

        with self.collect_aside(lines, 0):
            fill(see)
        if deepest == outer:
            self.lines += lines
            return tuple(values)
        made = self.new_list(c.Listing(c.element_type(c.Row(tuple(map(type_of, values))))), room)
        fill(lambda value: self.append_item(made, value))
        return made

    def make_display(self, *parts: tuple[bool, Any]) -> Any:
        """Return ``(a, *b)``: of known length unless a list is among its parts."""
        kept = [(is_starred, self.name_value(one) if is_starred else one) for is_starred, one in parts]
        rooms = [self.loop_range(one).count for is_starred, one in kept if is_starred and known_items(one) is None]

        def fill(put: Callable[[Any], None]) -> None:
            for is_starred, one in kept:
                self.for_each(one, put) if is_starred else put(one)

        return self.collect(fill, rooms[0] if rooms else "0")

    def get_item(self, value: Any, index: Any) -> Any:
        """``value[index]``; a part of a list is a list of its own."""
        value = unwrap(value)
        bounds = (index.start, index.stop, index.step) if isinstance(index, slice) else (index,)
        items = known_items(value)
        if items is not None and not any(isinstance(bound, Expr) for bound in bounds):
            return tuple(items[index]) if isinstance(index, slice) else items[index]
        if items is not None:
            value = self.as_type(tuple(items), c.Listing(c.element_type(c.Row(tuple(map(type_of, items))))))
        value = self.name_value(value)
        if not isinstance(value.type, c.Listing):
            raise c.NoType(f"{value.type.name} has no elements")
        places = [self.index_text(value, bound) for bound in bounds]
        if not isinstance(index, slice):
            return self.split_value(Expr(self, value.type.item, f"{value.path('at')}[{places[0]}]"))
        self.needs_space = True
        first, beyond, step = places[0] or "0", places[1] or value.path("count"), places[2] or "1"
        return Expr(self, value.type, f"part_of_{value.type.name}(space, {value.code}, {first}, {beyond}, {step})")

    def index_text(self, value: Expr, index: Any) -> str:
        """Return an index as C counts it: a negative one counts from the end."""
        if index is None:
            return ""
        if isinstance(index, int) and index < 0:
            return f"{value.path('count')} - {-index}"
        return self.as_type(index, c.INT).bare

    # Functions and classes of the project

    def make_struct(self, kind: type, *given: Any, **named: Any) -> Expr:
        """Make a struct: ``PlantState(...)``."""
        bound = inspect.signature(kind).bind(*given, **named)
        bound.apply_defaults()
        inner = [f".{name} = {self.as_type(bound.arguments[name], own).bare}" for name, own in c.fields(kind).items()]
        made = self.declare(c.Struct(kind), kind.__name__.lower(), f"{{{', '.join(inner)}}}")
        if hasattr(kind, "__post_init__"):  # it checks itself
            self.program.call(self, kind.__post_init__, made)
        return made

    def replace_fields(self, old: Expr, **new: Any) -> Expr:
        """``old._replace(...)``: a copy of a struct with other values in some fields."""
        assert isinstance(old.type, c.Struct)
        return self.make_struct(old.type.kind, **{name: getattr(old, name) for name in c.fields(old.type.kind)} | new)
