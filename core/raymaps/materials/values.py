# SPDX-License-Identifier: LGPL-2.1-or-later
"""The plain values that a scene is made of: records, names, numbers, and values by band."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, Strict, ValidationInfo

from raymaps.errors import FormatError

__all__ = [
    "Angle",
    "Integer",
    "Name",
    "NonNegative",
    "Number",
    "Positive",
    "Record",
    "Rgb",
    "RgbNonNegative",
    "RgbShare",
    "Share",
    "Vector",
    "file_content",
    "nonzero",
]


class Record(BaseModel):
    """Base of all parts of a scene: frozen, finite numbers only, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


def _checked_name(name: str) -> str:
    if not name.strip() or any(ord(c) < 32 or ord(c) == 127 for c in name):
        raise ValueError("a name must be visible text without control characters")
    return name


def _as_three(value: Any) -> Any:
    """Let one number stand for three equal bands."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value, value)
    return value


Name = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_checked_name)]

#: A finite number: neither text that looks like one, nor true or false.
Number = Annotated[float, Strict()]
Integer = Annotated[int, Strict()]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Share = Annotated[Number, Field(ge=0, le=1)]
Angle = Annotated[Number, Field(ge=0, le=180)]
Vector = tuple[Number, Number, Number]

#: A value for each of the bands red, green, blue; a single number stands for all three.
Rgb = Annotated[
    tuple[Number, Number, Number],
    BeforeValidator(_as_three, json_schema_input_type=Number | tuple[Number, Number, Number]),
]
RgbShare = Annotated[
    tuple[Share, Share, Share],
    BeforeValidator(_as_three, json_schema_input_type=Share | tuple[Share, Share, Share]),
]
RgbNonNegative = Annotated[
    tuple[NonNegative, NonNegative, NonNegative],
    BeforeValidator(_as_three, json_schema_input_type=NonNegative | tuple[NonNegative, NonNegative, NonNegative]),
]


def nonzero(vector: Vector) -> Vector:
    """Refuse a direction without a length."""
    if not 1e-150 < math.hypot(*vector) < 1e150:
        raise ValueError("a direction must have a length above zero")
    return vector


Content = TypeVar("Content")


def file_content(file: str, info: ValidationInfo, read: Callable[[Path], Content]) -> Content:
    """What a file that a scene speaks of holds; a relative path counts from the folder of the scene.

    Raises
    ------
    ValueError
        With the sentence of the reader, if the file can't be read.
    """
    try:
        return read((info.context or {}).get("folder", Path()) / file)
    except FormatError as error:
        raise ValueError(str(error)) from error
