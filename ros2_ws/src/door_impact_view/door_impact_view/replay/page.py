"""Make the page of a replay: one HTML text that needs no network, no server and no other file."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.files import read_file

from door_impact_view.replay.recording import Curve, Mark, Plot, Replay, Tree, cameras_around
from door_impact_view.scene.colors import css
from door_impact_view.scene.urdf import SLIDING, TURNING, Shape

_SCRIPTS = ("scene.js", "plots.js", "replay.js")
_STYLES = ("uPlot.min.css", "style.css")
_POINT_SIZE = 0.018  # radius of a mark [m]
_KINDS = {".gif": "image/gif", ".png": "image/png"}


def page(title: str, *replays: Replay, before: str = "", after: str = "") -> str:
    """Make the page of a recording.

    The meshes of robot and door are part of it.

    Args:
        title: Title of the page, any text.
        replays: What it shows, one or several, of which the reader chooses one. At first it shows
            the last one with a contact, or the last one.
        before: HTML above the replay.
        after: HTML below it.
    """
    meshes: dict[bytes, dict[str, Any]] = {}
    runs = [_data(replay, meshes) for replay in replays]
    first = max(range(len(replays)), key=lambda k: (bool(replays[k].slow), k))
    data = json.dumps({"first": first, "meshes": list(meshes.values()), "runs": runs},
                      allow_nan=False, separators=(",", ":"))
    section = _filled("replay.html", {
        "LIBRARY": _text("replay_lib.min.js"),
        "DATA": data.replace("<", "\\u003c"),  # no text of the recording can end the element
        "SCRIPT": "\n".join(_text(name) for name in _SCRIPTS),
    })
    return _filled("template.html", {
        "TITLE": html.escape(title),
        "STYLE": "\n".join(_text(name) for name in _STYLES),
        "BEFORE": before,
        "REPLAY": section,
        "AFTER": after,
    })


def picture(path: Path, caption: str) -> str:
    """Return a picture, a GIF or a PNG, as HTML that contains the picture itself.

    Args:
        path: The picture.
        caption: Text below it.

    Raises:
        InputError: The file cannot be read.
    """
    content = base64.b64encode(read_file(path)).decode()
    text = html.escape(caption)
    return (f'<figure><img src="data:{_KINDS[path.suffix]};base64,{content}" alt="{text}">'
            f"<figcaption>{text}</figcaption></figure>")


def _text(name: str) -> str:
    return (files(__package__) / "web" / name).read_text(encoding="utf-8")


def _filled(name: str, parts: Mapping[str, str]) -> str:
    """Return a template with texts in the places of their names; the texts may contain names."""
    return re.sub("@@([A-Z]+)@@", lambda found: parts[found[1]], _text(name))


def _packed(kind: str, values: Any) -> dict[str, str]:
    data = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<")).tobytes()
    return {kind: base64.b64encode(data).decode()}


def _floats(values: Any) -> dict[str, str]:
    return _packed("float32", values)


def _data(replay: Replay, meshes: dict[bytes, dict[str, Any]]) -> dict[str, Any]:
    """Return what the scripts read; times count from the first stamp. Adds its meshes."""
    zero = float(replay.stamps[0])
    return {
        "name": replay.name,
        "notes": [*replay.notes, *(tree.scene.note for tree in replay.trees if tree.scene.note)],
        "begin": replay.begin - zero,
        "stamps": _floats(replay.stamps - zero),
        "trees": [_tree(tree, meshes) for tree in replay.trees],
        "marks": [_mark(mark) for mark in replay.marks],
        "phases": [{"name": phase.name, "start": phase.start - zero, "end": phase.end - zero}
                   for phase in replay.phases],
        "slow": [{"start": start - zero, "end": end - zero, "speed": speed}
                 for start, end, speed in replay.slow],
        "events": [{"name": event.name, "time": event.time - zero} for event in replay.events],
        "plots": [_plot(plot, zero) for plot in replay.plots],
        "views": [asdict(camera) for camera in replay.cameras or cameras_around(replay)],
    }


def _tree(tree: Tree, meshes: dict[bytes, dict[str, Any]]) -> dict[str, Any]:
    column = {name: index for index, name in enumerate(tree.joints)}
    return {
        "root": tree.scene.root,
        "links": tree.scene.links,
        "columns": len(tree.joints),
        "positions": _floats(tree.positions),
        "base": _floats(tree.base),
        "joints": [{
            "parent": joint.parent, "child": joint.child,
            "origin": joint.origin.T.ravel().round(9).tolist(),  # by columns, as three.js has it
            "axis": joint.axis.round(9).tolist(), "slides": joint.kind in SLIDING,
            "column": column.get(joint.name, -1) if joint.kind in TURNING + SLIDING else -1,
        } for joint in tree.scene.joints],
        "shapes": [_shape(shape, meshes) for shape in tree.scene.shapes],
    }


def _shape(shape: Shape, meshes: dict[bytes, dict[str, Any]]) -> dict[str, Any]:
    """Return a shape; its mesh is added to the others, unless it is among them."""
    vertices = np.asarray(shape.mesh.vertices, dtype=np.float32)
    faces = np.asarray(shape.mesh.faces, dtype=np.uint32)
    key = vertices.tobytes() + faces.tobytes()
    meshes.setdefault(key, {"vertices": _floats(vertices), "faces": _packed("uint32", faces)})
    return {"link": shape.link, "mesh": list(meshes).index(key), "color": shape.color}


def _mark(mark: Mark) -> dict[str, Any]:
    return {"name": mark.name, "color": css(mark.color), "size": _POINT_SIZE,
            "corners": 1 if mark.places.ndim == 2 else mark.places.shape[1],
            "places": _floats(mark.places)}


def _plot(plot: Plot, zero: float) -> dict[str, Any]:
    return {
        "title": plot.title, "unit": plot.unit,
        "curves": [_curve(curve, zero) for curve in plot.curves],
        "limits": [{"label": limit.label, "value": limit.value, "color": css(limit.color)}
                   for limit in plot.limits],
    }


def _curve(curve: Curve, zero: float) -> dict[str, Any]:
    return {"label": curve.label, "color": css(curve.color), "dashed": curve.dashed,
            "t": _floats(curve.t - zero), "values": _floats(curve.values)}
