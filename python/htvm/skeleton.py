"""The skeleton that a capture was tracked with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Skeleton:
    """The joints and bones of a capture, constant over its sequence."""

    joint_names: Sequence[str]
    bones: Sequence[Tuple[int, int]]  # of each the joint that it turns about, and the other one
    radii: Optional[Sequence[float]] = None  # millimetres, of the bones; None: calibrated on the first frame


@dataclass
class Pose:
    """The skeleton in one frame."""

    joints: ArrayLike  # (j, 3), millimetres
    orientations: Optional[ArrayLike] = None  # (b, 3, 3), rotations of the bones; None: derived from the joints
    tracked: Optional[ArrayLike] = None  # (j,), False: the position is a guess; None: all are tracked
