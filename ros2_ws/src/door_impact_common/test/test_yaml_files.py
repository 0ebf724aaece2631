"""Which YAML files are read, and that no content of a refused one is in the message."""

import pytest
import yaml
from door_impact_common.errors import InputError
from door_impact_common.yaml_files import read_yaml
from hypothesis import given
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
def test_documents_are_read_as_they_were_written(tmp_path_factory, document):
    """The limits change nothing of usual content."""
    file = tmp_path_factory.mktemp("yaml") / "file.yaml"
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    assert read_yaml(file) == document


def test_anchors_aliases_and_merges_are_read(read):
    """Doors of a series may share their closer."""
    found = read("base: &b {k: 1, c: &c [2]}\nmore: {<<: *b, k: 3}\nlast: *c\n")
    assert found == {"base": {"k": 1, "c": [2]}, "more": {"k": 3, "c": [2]}, "last": [2]}


def test_deep_nesting_is_refused(read):
    """Some hundred lists inside each other would exceed Python's recursion limit."""
    with pytest.raises(InputError, match="nested"):
        read("[" * 5000 + "]" * 5000)


@pytest.mark.parametrize("content", [
    "root:x: [secret", b"\xffsecret", "!!python/object/apply:os.system [secret]"])
def test_what_is_no_yaml_is_refused_without_its_content(read, content):
    """The message has the file and where possible the line."""
    with pytest.raises(InputError, match=r"file\.yaml: ") as caught:
        read(content)
    assert "secret" not in str(caught.value)
