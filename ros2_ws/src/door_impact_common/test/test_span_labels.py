"""Names of spans never overlap, however short the spans are."""

import numpy as np
import pytest
from door_impact_common.span_labels import label_spans
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("matplotlib")
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


@given(missing=st.lists(st.tuples(st.integers(0, 4), st.sampled_from(
    [(np.nan, 1.0), (0.0, np.nan), (np.nan, np.nan), (-np.inf, 1.0), (0.0, np.inf),
     (-np.inf, np.inf)])), min_size=1, max_size=4))
@settings(max_examples=10, deadline=None)
def test_spans_whose_times_are_unknown_change_nothing(missing):
    """A phase that never came has no time: the others are named as without it, wherever it is."""
    known = [("cam", 0.0, 0.4), ("post", 0.4, 0.45), ("hold", 0.45, 0.5), ("retreat", 0.5, 2.0)]
    spans = list(known)
    for place, (start, end) in missing:
        spans.insert(place, ("never", start, end))
    drawn = []
    for each in (known, spans):
        figure = Figure(figsize=(4.0, 3.0))
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        axes.set_xlim(0.0, 2.0)
        height = label_spans(axes, each)
        figure.draw_without_rendering()
        drawn.append((height, [(text.get_text(), text.xy, text.xyann) for text in axes.texts]))
    assert drawn[0] == drawn[1]
