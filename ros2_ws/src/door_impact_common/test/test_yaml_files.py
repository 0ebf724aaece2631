"""YAML files are read by the core schema of YAML 1.2; what could mean two things is refused."""

import math

import pytest
from door_impact_common.errors import InputError
from door_impact_common.yaml_files import read_yaml, yaml_text
from hypothesis import example, given
from hypothesis import strategies as st


@pytest.fixture
def read(tmp_path):
    """Writes a file and reads it."""

    def write_and_read(content):
        file = tmp_path / "file.yaml"
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        return read_yaml(file)

    return write_and_read


SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
DOCUMENTS = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
    st.text(), inner, max_size=3), max_leaves=20)


@given(document=DOCUMENTS)
@example(document=["1e3", "047", "12:30", "no", "1_000", "~", "", "<<", 1e300, -math.inf])
def test_documents_are_read_as_they_were_written(tmp_path_factory, document):
    """A text that looks like a number comes back as a text."""
    file = tmp_path_factory.mktemp("yaml") / "file.yaml"
    file.write_text(yaml_text(document), encoding="utf-8")
    assert read_yaml(file) == document


@pytest.mark.parametrize(("text", "value"), [
    ("6e-2", 0.06), (".5", 0.5), ("1.", 1.0), ("+3", 3), ("-0.0", 0.0), ("no", "no"),
    ("True", True), ("2026-11-26", "2026-11-26"), ("-.inf", -math.inf), ("~", None),
    ("1.2.3", "1.2.3")])
def test_scalars_are_those_of_yaml_1_2(read, text, value):
    """YAML 1.1 would make a text of 6e-2, false of no, and a date of 2026-11-26."""
    found = read(f"key: {text}")["key"]
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("text", ["047", "-007.5", "1_000", "12:30", "0x1F", "0b11", "0o17"])
def test_numbers_that_yaml_1_1_reads_otherwise_are_refused(read, text):
    """47 or 39? The message has the spelling and the line."""
    with pytest.raises(InputError, match=rf"file\.yaml: line 2.*{text}"):
        read(f"other: 1\nkey: {text}")


def test_anchors_aliases_and_merges_are_read(read):
    """Doors of a series may share their closer; a merged key may be given anew."""
    found = read("base: &b {k: 1, c: &c [2]}\nmore: {<<: *b, k: 3}\nlast: *c\n")
    assert found == {"base": {"k": 1, "c": [2]}, "more": {"k": 3, "c": [2]}, "last": [2]}


@pytest.mark.parametrize("content", [
    "root:x: [secret", b"\xffsecret", "!!python/object/apply:os.system [secret]", "[" * 5000,
    "leaf: {mass: 20, width: 0.9, mass: 30}"])
def test_what_is_no_yaml_or_has_a_key_twice_is_refused(read, content):
    """Nothing else is raised, and nothing is executed."""
    with pytest.raises(InputError, match=r"file\.yaml: "):
        read(content)
