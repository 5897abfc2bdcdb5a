"""Where rigs come from: sub-folders of a folder, or a generator called with one seed after another.

A source is small and is sent to the worker, which loads the logs itself. A worker on another machine must see the same
folder under the same path, or be able to import the generator.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Protocol

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import CONFIGURATION_NAME, CONTRACT, read_configuration, read_data_set
from heli_identifier.workbench.campaign.key import files_digest, source_digest
from heli_identifier.workbench.campaign.rig import Rig

TRAINING, HELD_OUT = "train*.csv", "held*.csv"
"""Names of the logs in a rig's folder."""


class Source(Protocol):
    """One rig before its logs are loaded."""

    @property
    def rig(self) -> str:
        """Name of the rig, unique in the campaign."""

    def content(self) -> str:
        """Return the digest of the rig's logs, or of what makes them."""

    def load(self) -> Rig:
        """Return the rig with its logs."""


@dataclass(frozen=True)
class FolderRig:
    """A rig whose logs lie in a folder.

    Attributes
    ----------
    rig : str
    folder : str
    configuration : str
        Path of the rig's heli.toml, which describes its logs; empty if they follow the contract.
    """

    rig: str
    folder: str
    configuration: str = ""

    def content(self) -> str:
        """Return the digest of the bytes of its files."""
        configuration = [Path(self.configuration)] if self.configuration else []
        return files_digest([*self._logs(TRAINING), *self._logs(HELD_OUT), *configuration])

    def load(self) -> Rig:
        """Read its logs.

        Raises
        ------
        LogError, ConfigurationError
            A log or the configuration cannot be read; see their readers.
        """
        configuration = read_configuration(self.configuration) if self.configuration else None
        format = configuration.format if configuration else CONTRACT
        training, held_out = read_data_set(self._logs(TRAINING), self._logs(HELD_OUT), format)
        return Rig(training, held_out, configuration=configuration)

    def _logs(self, pattern: str) -> list[Path]:
        return sorted(Path(self.folder).glob(pattern))


@dataclass(frozen=True)
class GeneratedRig:
    """A rig that a function makes.

    Attributes
    ----------
    rig : str
    generator : str
        "module:function"; the function returns a :class:`Rig`.
    arguments : tuple
        Arguments of the function, for instance one seed.
    ingredients : tuple of str
        Further modules and packages on whose source the logs depend.
    """

    rig: str
    generator: str
    arguments: tuple[str | int | float, ...]
    ingredients: tuple[str, ...] = ()

    def content(self) -> str:
        """Return the digest of the generator's source and arguments, so that a finished rig is skipped unmade."""
        return f"{self.generator} {self.arguments!r} {_generator_digest(self.generator, self.ingredients)}"

    def load(self) -> Rig:
        """Make its logs.

        Raises
        ------
        ConfigurationError
            The generator cannot be found or does not return a :class:`Rig`.
        """
        rig = named_function(self.generator)(*self.arguments)
        if not isinstance(rig, Rig):
            raise ConfigurationError(
                f"{self.generator} returned a {type(rig).__name__}, a heli_identifier.workbench.campaign.Rig is needed."
            )
        return rig


def folder_rigs(folder: str | PathLike[str], configuration: str | PathLike[str] | None = None) -> list[FolderRig]:
    """Return every sub-folder that holds train*.csv and held*.csv, in the order of their names.

    Parameters
    ----------
    folder : path
    configuration : path, optional
        Configuration of the rigs that have no heli.toml beside their logs.

    Raises
    ------
    ConfigurationError
        The folder or such a sub-folder is missing, or a sub-folder holds only one kind of log.
    """
    root = Path(os.path.realpath(folder))
    if not root.is_dir():
        raise ConfigurationError(f"{folder} is no folder; name one with a sub-folder for each rig.")
    rigs = []
    for path in sorted(child for child in root.iterdir() if child.is_dir()):
        found = [next(path.glob(pattern), None) for pattern in (TRAINING, HELD_OUT)]
        if all(found):
            rigs.append(FolderRig(path.name, str(path), _configuration(path, configuration)))
        elif any(found):
            missing = HELD_OUT if found[0] else TRAINING
            raise ConfigurationError(f"{path} holds no {missing}; a rig's folder needs {TRAINING} and {HELD_OUT}.")
    if not rigs:
        raise ConfigurationError(f"no sub-folder of {folder} holds {TRAINING} and {HELD_OUT}; each rig needs one.")
    return rigs


def _configuration(folder: Path, shared: str | PathLike[str] | None) -> str:
    """Return the path of a rig's own configuration, else of the shared one, else an empty text."""
    own = folder / CONFIGURATION_NAME
    if os.path.lexists(own):
        return str(own)
    return os.path.realpath(shared) if shared else ""


def generated_rigs(generator: str, count: int, first_seed: int = 0) -> list[GeneratedRig]:
    """Return ``count`` rigs that ``generator`` makes from the seeds ``first_seed``, ``first_seed`` + 1, ...

    Parameters
    ----------
    generator : str
        "module:function"; the function takes one whole number and returns a :class:`Rig`.
    count : int
        At least 1.
    first_seed : int

    Raises
    ------
    ConfigurationError
        There is no such function, or ``count`` is less than 1.
    """
    if count < 1:
        raise ConfigurationError(f"rigs = {count} must be at least 1.")
    named_function(generator)
    return [GeneratedRig(f"seed {seed}", generator, (seed,)) for seed in range(first_seed, first_seed + count)]


def named_function(name: str) -> Callable:
    """Import a function by "module:function".

    Raises
    ------
    ConfigurationError
        The form is wrong, or the module or the function does not exist or cannot be imported.
    """
    module, separator, function = name.partition(":")
    if not (module and separator and function):
        raise ConfigurationError(f"{name!r} must read module:function, for instance my_rigs:make.")
    try:
        found = getattr(import_module(module), function, None)
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"{name}: module {error.name} cannot be found; run from the folder that holds it, or put that folder on "
            "PYTHONPATH."
        ) from error
    except (Exception, SystemExit) as error:  # whatever the user's own file does
        raise ConfigurationError(
            f"{name}: module {module} cannot be imported: {type(error).__name__}: {error}; mend it."
        ) from error
    if not callable(found):
        raise ConfigurationError(f"{name}: module {module} has no function {function}.")
    return found


@cache
def _generator_digest(generator: str, ingredients: tuple[str, ...]) -> str:
    return source_digest((generator.partition(":")[0], *ingredients))
