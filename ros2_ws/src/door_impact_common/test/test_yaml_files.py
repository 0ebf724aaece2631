"""Which YAML files are read, and that no content of a refused one is in the message."""

import pytest
import yaml
from door_impact_common.errors import InputError
from door_impact_common.yaml_files import DEEPEST, MOST_NODES, read_yaml
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


@pytest.mark.parametrize("depth", [DEEPEST + 1, 5000])
@pytest.mark.parametrize("form", ["[]", "{a: }", "- "])
def test_deep_nesting_is_refused(read, depth, form):
    """Some hundred lists inside each other would exceed Python's recursion limit."""
    text = "- " * depth + "1"
    if form != "- ":
        text = form[:-1] * depth + form[-1] * depth
    with pytest.raises(InputError, match=r"file.yaml: is nested more than 50 times"):
        read(text)


def test_nesting_by_aliases_is_refused(read):
    """Each line is 20 deep, and contains the one before."""
    lines = [f"a{n}: &a{n} {'[' * 20}{f'*a{n - 1}' if n else 1}{']' * 20}\n" for n in range(4)]
    read("".join(lines[:2]))
    with pytest.raises(InputError, match="is nested more than 50 times"):
        read("".join(lines))


@pytest.mark.parametrize("merge", [False, True])
def test_an_alias_bomb_is_refused(read, merge):
    """Ten lines that stand for 10^10 nodes, in lists or in merged mappings."""
    lines = ["a0: &a0 {x: 1}\n"]
    for n in range(1, 11):
        parts = ", ".join(10 * [f"*a{n - 1}"])
        lines.append(f"a{n}: &a{n} {f'{{<<: [{parts}]}}' if merge else f'[{parts}]'}\n")
    read("".join(lines[:4]))
    with pytest.raises(InputError, match=f"has more than {MOST_NODES} entries"):
        read("".join(lines))


def test_many_nodes_are_refused(read):
    """A list of as many numbers as are allowed is still read."""
    assert len(read("[" + "1," * (MOST_NODES - 1) + "]")) == MOST_NODES - 1
    with pytest.raises(InputError, match="entries"):
        read("[" + "1," * MOST_NODES + "]")


def test_a_node_that_contains_itself_is_refused(read):
    """Whatever walks through it would never end."""
    with pytest.raises(InputError, match="contains itself"):
        read("a: &a [*a]")


@pytest.mark.parametrize("content", [
    "root:x: [secret", "secret: *secret", "!secret {}", "secret: %secret", "? [secret]\n: 1",
    "secret: 2001-99-99", "secret: " + "9" * 5000, b"\xffsecret", "secret\0", "- secret\nsecret: 1",
    "!!python/object/apply:os.system [secret]", "<<: secret", "!!binary 'secret!'",
    "---\nsecret: 1\n---\nsecret: 2"])
def test_what_is_no_yaml_is_refused_without_its_content(read, content):
    """The message has the file and where possible the line."""
    with pytest.raises(InputError, match=r"file\.yaml: ") as caught:
        read(content)
    assert "secret" not in str(caught.value)


def test_a_file_of_a_megabyte_is_refused(read):
    """PyYAML needs seconds for a megabyte."""
    with pytest.raises(InputError, match="is larger than 1 MB"):
        read("#" * 1_000_001)
