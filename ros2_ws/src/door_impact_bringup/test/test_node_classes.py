"""No node hides or touches what belongs to rclpy's Node."""

import ast
import re
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node

SOURCES = Path(__file__).parents[2]
BASES = {"Node", "GuardedNode"}
ABSOLUTE = re.compile(r"/[a-z]\w*(/\w+)*")


def node_modules():
    """Modules of all packages that import rclpy, by their paths."""
    for path in sorted(SOURCES.glob("*/*/**/*.py")):
        text = path.read_text("utf-8")
        if "rclpy" in text and "test" not in path.relative_to(SOURCES).parts:
            yield path, ast.parse(text)


CLASSES = [pytest.param(each, id=each.name)
           for _, module in node_modules() for each in ast.walk(module)
           if isinstance(each, ast.ClassDef) and {ast.unparse(base) for base in each.bases} & BASES]


def is_self(node):
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


@pytest.fixture(scope="module")
def taken():
    """Names of a plain Node's attributes and methods."""
    rclpy.init(args=[])
    node = Node("plain")
    yield {*vars(node), *dir(Node)}
    node.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize("node_class", CLASSES)
def test_a_node_hides_nothing_of_rclpy(node_class, taken):
    """The planner's `_parameters` once replaced rclpy's, and the node ended at its start.

    Public methods may be overridden if they call those of rclpy.
    """
    assert taken.isdisjoint(
        each.attr for each in ast.walk(node_class)
        if isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store)
        and is_self(each.value))

    for method in node_class.body:
        if isinstance(method, ast.FunctionDef | ast.AsyncFunctionDef) and method.name in taken:
            assert method.name == "__init__" or not method.name.startswith("_")
            assert f"super().{method.name}(" in ast.unparse(method)


def test_nothing_touches_private_names_of_rclpy():
    """Neither modules nor attributes: another version need not have them."""
    for path, module in node_modules():
        for each in ast.walk(module):
            if isinstance(each, ast.Import | ast.ImportFrom):
                names = [getattr(each, "module", None) or "", *(name.name for name in each.names)]
                assert not any(".impl" in name or "._" in name for name in names), path
            elif isinstance(each, ast.Attribute) and not is_self(each.value):
                assert not each.attr.startswith("_") or each.attr.startswith("__"), (
                    path, each.lineno)


def texts(module):
    """Texts of a module; of a formatted one its beginning, with a letter for what comes next."""
    parts = set()
    for each in ast.walk(module):
        if isinstance(each, ast.JoinedStr):
            parts.update(map(id, each.values))
            if isinstance(each.values[0], ast.Constant):
                yield f"{each.values[0].value}x"
        elif isinstance(getattr(each, "value", None), str) and id(each) not in parts:
            yield each.value


@pytest.mark.parametrize("package", sorted({path.parent.name for path in SOURCES.glob("*/*.xml")}))
def test_names_can_be_moved(package):
    """Namespaces and remappings move every topic, service and action but those of all robots."""
    for path in SOURCES.glob(f"{package}/{package}/**/*.py"):
        text = path.read_text("utf-8")
        if "rclpy" in text or "ros" in path.parts or package == "robot_driver":
            absolute = set(filter(ABSOLUTE.fullmatch, texts(ast.parse(text))))
            assert absolute <= {"/tf", "/tf_static", "/clock", "/diagnostics"}, path
