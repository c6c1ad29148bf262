"""The compiled part of the package; `palpus` shows its names."""

import os
from typing import Any, ClassVar, Literal, Protocol, TypedDict, final

import numpy as np
import numpy.typing as npt

__version__: str

CONTACT: np.dtype[np.void]
DISTANCE: np.dtype[np.void]
DEPTH: np.dtype[np.void]

type _Floats = npt.NDArray[np.float64]
type _Rows = npt.NDArray[np.void]
