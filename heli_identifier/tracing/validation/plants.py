"""The plants before and after, fitted by what they are compared by: multi-step prediction errors.

The search detects effects by the likelihood of one-step innovations, which weighs what lies above the filter frequency.
A plant is judged by how well it predicts a second ahead. Both plants are therefore fitted once more to the training
logs by their errors .5, 1 and 2 s ahead (:mod:`heli_identifier.tracing.multistep`). Shapes of effects, the
horizontal offset and the tables of unknown curves keep the values that the likelihood gave.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from heli_identifier.online import Estimate
from heli_identifier.tracing.multistep.fit import MultistepFit, fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.fit import BASE, Fit
from heli_identifier.tracing.prediction.problem import reduce_log
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.validation.disagreement import Disagreement, disagree, spanning
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

RATE = 25.0
"""Rate [Hz] of the records that multi-step errors are computed on: the fastest motion that counts a second ahead."""


@dataclass(frozen=True, eq=False)
class FittedPlant:
    """A plant with the uncertainty of its parameters.

    Attributes
    ----------
    parameters : PlantParameters
    estimates : mapping of str to Estimate
        By field: parameters of the simplified model (one that was given has no standard error), coefficients and shapes
        of effects, tables of unknown curves.
    undetermined : tuple of str
        Parameters of the simplified model that the logs do not determine.
    disputed : tuple of Disagreement
        Fields whose estimates by errors and by likelihood differ by more than chance; their intervals span both.
    converged : bool
    expected : tuple of str
        Coefficients of effects that the model before has.
    fit : MultistepFit or None
        None where predictions diverge wherever a fit begins: the plant is then the likeliest one.
    """

    parameters: PlantParameters
    estimates: Mapping[str, Estimate]
    undetermined: tuple[str, ...] = ()
    disputed: tuple[Disagreement, ...] = ()
    converged: bool = True
    expected: tuple[str, ...] = ()
    fit: MultistepFit | None = None

    @property
    def base(self) -> dict[str, Estimate]:
        """Parameters of the model before: those of the simplified one by the paper's symbols, expected effects."""
        return {field: self.estimates[field] for field in (*BASE, *self.expected, "T_m")}

    @property
    def of_effects(self) -> dict[str, Estimate]:
        """Coefficients and shapes of effects and tables of unknown curves, by the plant's fields."""
        return {field: value for field, value in self.estimates.items() if field not in self.base}

    @property
    def tables(self) -> dict[str, Estimate]:
        """Tables of unknown curves, by the plant's fields."""
        return {field: value for field, value in self.estimates.items() if field.startswith("table_")}


@dataclass(frozen=True, eq=False)
class Plants:
    """Plants of models that were found in the same training records.

    Attributes
    ----------
    null : Fit
        Fit of the null model by likelihood.
    """

    null: Fit

    @cached_property
    def starts(self) -> tuple[Starts, ...]:
        """Training records with the starts of their predictions."""
        return tuple(Starts(reduce_log(record, RATE)) for record in self.null.problem.records)

    @cached_property
    def before(self) -> FittedPlant:
        """Plant of the null model."""
        return self._fitted(self.null, self._base)

    def of(self, model: Model, tables: Mapping[str, Estimate] = MappingProxyType({})) -> FittedPlant:
        """Plant of a model and of the ``tables`` of its unknown curves, by field; another unknown torque is no part.

        With nothing found it is the plant before.
        """
        if not model.effects and not model.unknowns:
            return self.before
        return self._fitted(model.fit, (*self._base, *(effect.field for effect in model.effects)), tables)

    def beyond(self, fit: MultistepFit, model: Model, tables: Mapping[str, Estimate]) -> FittedPlant:
        """Plant of a fit that has predictive effects beside those of ``model`` and the same ``tables``."""
        return self._plant(fit, model.fit, fit.names, tables)

    @property
    def _base(self) -> tuple[str, ...]:
        return (*(field for field in BASE if field in self.null.free), *self._expected)

    @property
    def _expected(self) -> tuple[str, ...]:
        return tuple(self.null.problem.expected)

    def _fitted(
        self, by_likelihood: Fit, fields: tuple[str, ...], tables: Mapping[str, Estimate] = MappingProxyType({})
    ) -> FittedPlant:
        """Fit by multi-step errors; by likelihood where predictions diverge wherever the fit begins."""
        base = by_likelihood.parameters._replace(**{field: table.value for field, table in tables.items()})
        try:
            found: MultistepFit | Fit = fit_multistep(Multistep(self.starts, base, self.null.problem.expected), fields)
        except ValueError:
            found = by_likelihood
        return self._plant(found, by_likelihood, fields, tables)

    def _plant(
        self,
        found: MultistepFit | Fit,
        by_likelihood: Fit,
        fields: tuple[str, ...],
        tables: Mapping[str, Estimate],
    ) -> FittedPlant:
        likeliest = by_likelihood.parameters
        model = (*BASE, *self._expected, "T_m")
        given = {field: Estimate(getattr(likeliest, field), None, BY_FIELD[field].unit) for field in model}
        shapes = {field: by_likelihood.estimate(field) for field in by_likelihood.free if field not in BASE}
        estimates = given | shapes | dict(tables)
        if not isinstance(found, MultistepFit):
            estimates |= {field: found.estimate(field) for field in fields if field in found.free}
            return FittedPlant(found.parameters, estimates, converged=found.converged, expected=self._expected)
        estimates |= {field: found.estimate(field) for field in fields}
        undetermined = tuple(field for field in found.undetermined if field in BASE)
        pairs = [(f, estimates[f], by_likelihood.estimate(f)) for f in fields if f in by_likelihood.free]
        disputed = tuple(Disagreement(*pair) for pair in pairs if disagree(*pair[1:]))
        estimates |= {d.field: spanning(d.by_errors, d.by_likelihood) for d in disputed}
        return FittedPlant(found.parameters, estimates, undetermined, disputed, found.converged, self._expected, found)
