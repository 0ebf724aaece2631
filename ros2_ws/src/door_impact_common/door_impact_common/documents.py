"""Documents that users write, such as YAML files: described and checked by pydantic.

A document is a class below `Part`, or a pydantic dataclass with the configuration `STRICT`.
Default, range and meaning of a field are then in one place, and `checked` refuses the rest.
"""

from __future__ import annotations

import difflib
import math
import reprlib
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
)

from door_impact_common.errors import SettingError

T = TypeVar("T")
STRICT = ConfigDict(extra="forbid")  # a key that nobody reads is a typing error
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)]
Share = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=1.0)]
Count = Annotated[int, Field(strict=True, ge=1)]
Name = Annotated[str, Field(min_length=1)]
Vector = tuple[Number, Number, Number]


class Part(BaseModel):
    """A mapping in a document; keys that it does not describe are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _ascending(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise ValueError("two numbers, the lower one first")
    return pair


Range = Annotated[tuple[Number, Number], AfterValidator(_ascending)]


def number(default: float | None, low: float, high: float, text: str) -> Any:
    """Return a field of a pydantic dataclass: a number from `low` to `high`, and its meaning."""
    return Field(default, strict=True, allow_inf_nan=False, ge=low, le=high, description=text)


def descriptions(kind: Any) -> dict[str, tuple[Any, str]]:
    """Return default and meaning of each field with a description, by name.

    A node declares them as parameters (`door_impact_common.parameters.Parameters`); they have NaN
    for the default None, because a parameter of ROS 2 has one type.
    """
    return {
        name: (math.nan if field.default is None else field.default, field.description)
        for name, field in kind.__pydantic_fields__.items() if field.description}


# Words for what a value must be, by pydantic's types of errors; braces are filled from the error.
_WORDS = {
    "missing": "given",
    "invalid_key": "a text as key (a decimal number has a point, not a comma)",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "a text",
    "string_too_short": "a text that is not empty",
    "greater_than": "above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than_equal": "{le:g} or less",
    "literal_error": "{expected}",
    "tuple_type": "a list",
    "too_short": "a list of {min_length} values",
    "too_long": "a list of {max_length} values",
    "dict_type": "a mapping of keys",
    "model_type": "a mapping of keys",
    "dataclass_type": "a mapping of keys",
    "value_error": "{error}",
}


def checked(kind: type[T], document: Any) -> T:
    """Return a document as an instance of the class that describes it.

    Args:
        kind: The class.
        document: Mappings, lists and scalars, as a YAML file has them.

    Raises:
        SettingError: A key is missing or unknown, or a value is of a wrong type or out of range.
            `setting` is its place, such as "leaf.width".
    """
    try:
        return TypeAdapter(kind).validate_python(document)
    except ValidationError as caught:
        error = caught.errors(include_url=False)[0]
    place = ".".join(map(str, error["loc"])) or "the document"
    if error["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        raise SettingError(place, "unknown", _known(kind, error["loc"]))
    words = _WORDS.get(error["type"], error["msg"])
    value = error["input"]
    if error["type"] == "missing":
        value = "missing"
    elif not isinstance(value, int | float | None):
        value = reprlib.repr(value)
    raise SettingError(place, value, words.format(**error.get("ctx", {})))


def _known(kind: Any, loc: tuple[int | str, ...]) -> str:
    """Return the known keys beside an unknown one, the most similar one first."""
    for part in loc[:-1]:
        kind = _fields(kind).get(str(part), kind)
    names = [*_fields(kind)]
    near = difflib.get_close_matches(str(loc[-1]), names, 1)
    return f"a known key, such as {near[0]}" if near else f"one of {', '.join(names)}"


def _fields(kind: Any) -> Mapping[str, Any]:
    """Return the annotations of a description's fields by name, with None left out of unions."""
    for each in (kind, *getattr(kind, "__args__", ())):
        found = getattr(each, "__pydantic_fields__", None)
        if found:
            return {name: field.annotation for name, field in found.items()}
    return {}
