import os
from types import TracebackType
from typing import ClassVar, Literal, Protocol, TypeAlias, TypedDict, final, type_check_only

import numpy as np
import numpy.typing as npt

__all__ = [
    "Body",
    "depth",
    "contact_tolerance",
    "contacts",
    "distance",
    "Loop",
    "main",
    "query",
    "Error",
    "Settings",
    "World",
    "__version__",
    "CONTACT",
    "DISTANCE",
    "DEPTH",
]

__version__: str

CONTACT: np.dtype[np.void]
DISTANCE: np.dtype[np.void]
DEPTH: np.dtype[np.void]

_Floats: TypeAlias = npt.NDArray[np.float64]
_Indices: TypeAlias = npt.NDArray[np.uint32]
_Rows: TypeAlias = npt.NDArray[np.void]

@type_check_only
class _Mesh(Protocol):
    @property
    def vertices(self) -> npt.ArrayLike: ...
    @property
    def faces(self) -> npt.ArrayLike: ...

@type_check_only
class _Health(TypedDict):
    closed: bool
    manifold: bool
    genus: int | None
    components: int
    boundary_edges: int
    non_manifold_edges: int
    self_intersecting_triangles: int
    notices: list[str]

@type_check_only
class _Status(TypedDict):
    tick: int
    time: float
    tool: _Floats
    grip: _Floats
    wrench: _Floats
    contacts: int
    phase: Literal["idle", "waiting", "ramping", "engaged", "faulted", "stopped", "latched"]
    running: bool

@type_check_only
class _Summary(TypedDict):
    ticks: int
    duration: float
    rate: float
    late: int
    skipped: int
    step_us: tuple[float, float, float, float]
    force_max: float
    torque_max: float
    faults: int
    allocations: int
    end: str

class Error(ValueError): ...

@final
class Body:
    EXACT: ClassVar[float]
    HAPTIC: ClassVar[float]
    @staticmethod
    def load(
        path: str | os.PathLike[str],
        *,
        scale: float | None = None,
        unit: str | None = None,
        flatness: float | None = None,
        cache: bool = True,
        workers: int | None = None,
    ) -> Body: ...
    @staticmethod
    def from_arrays(
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        scale: float | None = None,
        unit: str | None = None,
        flatness: float | None = None,
        cache: bool = False,
        workers: int | None = None,
    ) -> Body: ...
    @staticmethod
    def from_mesh(
        mesh: _Mesh,
        *,
        scale: float | None = None,
        unit: str | None = None,
        flatness: float | None = None,
        cache: bool = False,
        workers: int | None = None,
    ) -> Body: ...
    @property
    def vertices(self) -> _Floats: ...
    @property
    def triangles(self) -> _Indices: ...
    @property
    def piece_count(self) -> int: ...
    def piece(self, number: int) -> tuple[_Floats, _Indices]: ...
    @property
    def volume(self) -> float: ...
    @property
    def center_of_mass(self) -> _Floats: ...
    @property
    def inertia(self) -> _Floats: ...
    @property
    def mass_source(self) -> Literal["mesh", "hull", "sheet"]: ...
    @property
    def size(self) -> float: ...
    def health(self) -> _Health: ...

def query(
    a: Body,
    b: Body,
    poses: npt.ArrayLike,
    tolerance: float | None = None,
    *,
    prove: bool = True,
    workers: int | None = None,
) -> tuple[_Rows, _Rows]: ...
def contacts(
    a: Body,
    b: Body,
    poses: npt.ArrayLike,
    tolerance: float | None = None,
    *,
    prove: bool = True,
    workers: int | None = None,
) -> _Rows: ...
def distance(
    a: Body,
    b: Body,
    poses: npt.ArrayLike,
    tolerance: float | None = None,
    *,
    prove: bool = True,
    workers: int | None = None,
) -> _Rows: ...
def depth(
    a: Body,
    b: Body,
    poses: npt.ArrayLike,
    *,
    gap: float | None = None,
    budget: int | None = None,
    outside: bool = False,
    workers: int | None = None,
) -> _Rows: ...
def main(argv: list[str]) -> int: ...
def contact_tolerance(a: Body, b: Body, pose: npt.ArrayLike) -> float: ...
@final
class Settings:
    @staticmethod
    def coupled(
        *,
        force: float,
        torque: float,
        tolerance: float,
        period: float = 1e-3,
        friction: tuple[float, float] | None = None,
        grip: npt.ArrayLike | None = None,
    ) -> Settings: ...
    @staticmethod
    def direct(
        *,
        tolerance: float = 1e-3,
        stiffness: float = 800.0,
        damping: float = 0.0,
        force: float = ...,
        torque: float = ...,
        friction: tuple[float, float] | None = None,
        grip: npt.ArrayLike | None = None,
    ) -> Settings: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def stiffness(self) -> float: ...
    @property
    def damping(self) -> float: ...
    @property
    def limits(self) -> tuple[float, float]: ...
    @property
    def friction(self) -> tuple[float, float] | None: ...
    @property
    def grip(self) -> tuple[float, float, float]: ...
    @property
    def is_coupled(self) -> bool: ...

@final
class World:
    def __new__(cls, settings: Settings, *, gravity: npt.ArrayLike | None = None) -> World: ...
    def add_fixed(self, body: Body, pose: npt.ArrayLike) -> int: ...
    def add_driven(self, body: Body, pose: npt.ArrayLike) -> int: ...
    def add_free(
        self, body: Body, pose: npt.ArrayLike, *, density: float | None = None, mass: float | None = None
    ) -> int: ...
    def add_tool(self, body: Body, settings: Settings) -> int: ...
    def step(self, poses: npt.ArrayLike, dt: float = 1e-3, *, twists: npt.ArrayLike | None = None) -> _Floats: ...
    def wrench(self, tool: int) -> _Floats: ...
    def contacts(self, of: int, other: int) -> _Rows: ...
    def drive(self, body: int, pose: npt.ArrayLike, twist: npt.ArrayLike | None = None) -> None: ...
    def put(self, body: int, pose: npt.ArrayLike) -> None: ...
    def throw(self, body: int, twist: npt.ArrayLike) -> None: ...
    def pose(self, body: int) -> _Floats: ...
    def twist(self, body: int) -> _Floats: ...
    def clear(self) -> None: ...

@final
class Loop:
    def __new__(
        cls,
        world: World,
        start: npt.ArrayLike,
        *,
        device: str = "simulated",
        hand: str = "normal",
        rate: float = 1000.0,
        duration: float | None = None,
        real_time: bool = True,
        priority: bool = False,
    ) -> Loop: ...
    def start(self) -> None: ...
    def stop(self) -> _Summary: ...
    def wait(self) -> _Summary: ...
    @property
    def is_running(self) -> bool: ...
    def status(self) -> _Status: ...
    @property
    def wrench(self) -> _Floats: ...
    def lead(self, pose: npt.ArrayLike) -> None: ...
    def drive(self, body: int, pose: npt.ArrayLike, twist: npt.ArrayLike | None = None) -> None: ...
    def set_settings(self, settings: Settings) -> None: ...
    def __enter__(self) -> Loop: ...
    def __exit__(
        self,
        *_raised: type[BaseException] | BaseException | TracebackType | None,
    ) -> None: ...
    def summary(self) -> _Summary: ...
