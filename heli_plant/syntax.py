"""Functions of the plant as syntax trees: taken apart, changed, and made functions again.

:mod:`heli_plant.laws` puts the catalogue's laws together with this, :mod:`heli_plant.specialised` leaves out what a
parameter set does not use. A function that was made so keeps its ``definition``, since no file holds it.
"""

import ast
import inspect
from collections.abc import Mapping
from functools import cache
from textwrap import dedent
from threading import RLock
from types import FunctionType
from typing import Any

_LOCK = RLock()
"""Python 3.11 loses count of its recursion where two threads convert syntax trees at once (CPython issue 106905)."""


@cache
def text_of(function: FunctionType) -> str:
    """Return the source of a function, also of one that was made here."""
    definition = getattr(function, "definition", None)
    return ast.unparse(definition) if definition is not None else dedent(inspect.getsource(function))


def definition_of(function: FunctionType) -> ast.FunctionDef:
    """Return a definition of a function to work on, without docstring, annotations and decorators."""
    with _LOCK:
        tree = ast.parse(text_of(function)).body[0]
    assert isinstance(tree, ast.FunctionDef)
    tree.decorator_list, tree.returns = [], None
    for argument in (*tree.args.posonlyargs, *tree.args.args):
        argument.annotation = None
    if isinstance(tree.body[0], ast.Expr) and isinstance(tree.body[0].value, ast.Constant):
        del tree.body[0]
    return tree


def made(definition: ast.FunctionDef, namespace: Mapping[str, Any], like: FunctionType | None = None) -> FunctionType:
    """Return the function of a definition that finds its names in ``namespace``.

    A function made ``like`` another, of whose definition it is a version, keeps its name, place and documentation.
    """
    scope = dict(namespace)
    module = ast.fix_missing_locations(ast.Module([definition], []))
    file = f"<{definition.name} of {scope['__name__']}>"
    if like is not None:
        file = like.__code__.co_filename
        ast.increment_lineno(module, like.__code__.co_firstlineno - definition.lineno)
    with _LOCK:
        code = compile(module, file, "exec")
    exec(code, scope)
    function = scope[definition.name]
    function.definition = definition
    if like is not None:
        function.__qualname__, function.__doc__ = like.__qualname__, like.__doc__
    return function
