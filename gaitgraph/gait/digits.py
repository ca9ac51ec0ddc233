"""The digits that the numbers of a column were printed with, told from the numbers themselves.

A number that is a decimal of few digits was printed with them, whichever format it comes from: a column that says 0.393
and 0.41 has three decimals. Numbers of full precision have 15 digits or more.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.records import Record

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray

_FULL = 15  # significant digits from which on a number has the precision of a float
_WHOLE = 2.0**53  # from here on floats have no decimals
_MOST_DECIMALS = 99
_ENOUGH = 3  # different numbers with fewer decimals than others, which tell that significant digits were counted
_READ = 100  # numbers that are read as decimals at once


@dataclass(frozen=True, slots=True)
class Digits(Record):
    """The most decimals and significant digits of a column's numbers, as printed in a `unit` [the column's unit].

    `steps` is whether these are steps of a servo, which has nothing between them.
    """

    decimals: int = 99
    figures: int = 17
    unit: float = 1.0
    steps: bool = False

    def half_units(self, values: FloatArray) -> FloatArray:
        """Return half a unit of the last digit of each value, shape as the values.

        >>> Digits(decimals=3, figures=4).half_units(np.array([0.393, -1.2])).tolist()
        [0.0005, 0.0005]
        >>> Digits(figures=3, unit=0.01).half_units(np.array([0.393])).tolist()
        [0.0005]
        """
        size = np.maximum(np.abs(values) / self.unit, 1e-300)
        whole = np.floor(np.log10(size) + 1e-12)
        of_figures = np.maximum(self.figures - 1 - whole, 0)  # 50 may have two figures
        places = np.minimum(self.decimals, of_figures)
        return np.asarray(0.5 * self.unit * 10.0**-places)


FLOAT_32 = Digits(figures=7)
"""The digits of numbers in single precision."""


def digits_of(values: FloatArray, unit: float = 1.0) -> Digits:
    """Return the digits of a column's finite numbers; `unit` is that of the numbers in the unit of the column.

    >>> digits_of(np.array([0.393, 0.41, -1.2]))
    Digits(decimals=3, figures=17, unit=1.0, steps=False)
    >>> digits_of(np.array([1 / 3, 0.5])) == Digits()
    True
    """
    decimals = figures = 0
    left = values
    while len(left):
        for value in left[:: max(len(left) // _READ, 1)].tolist():
            _, digits, exponent = Decimal(repr(value)).normalize().as_tuple()
            figures = max(figures, len(digits))
            decimals = max(decimals, -int(exponent))
            if figures >= _FULL or decimals > _MOST_DECIMALS:
                return Digits(unit=unit)
        left = left[np.abs(left) < _WHOLE]
        scaled = left * 10.0**decimals
        left = left[np.abs(scaled - np.rint(scaled)) > 1e-9 + 1e-15 * np.abs(scaled)]
    # Of two decimals 0.06 and 0.1 were printed, not of one figure: a few numbers may end in zeros.
    large = values[np.abs(values) >= 10.0 ** (figures - decimals)]
    if len(np.unique(large)) < _ENOUGH:
        return Digits(decimals, unit=unit)
    return Digits(decimals, figures, unit)
