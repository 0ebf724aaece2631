"""Names of spans that never came."""

import numpy as np
import pytest
from door_impact_common.span_labels import label_spans

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure


@pytest.mark.parametrize("missing", [(np.nan, 1.0), (0.0, np.nan), (-np.inf, 1.0), (0.0, np.inf)])
@pytest.mark.parametrize("place", [0, 2, 4])
def test_a_span_whose_times_are_unknown_changes_no_other(place, missing):
    """A phase that never came has no time: the others are named as without it, wherever it is."""
    known = [("cam", 0.0, 0.4), ("post", 0.4, 0.45), ("hold", 0.45, 0.5), ("retreat", 0.5, 2.0)]
    drawn = []
    for spans in (known, [*known[:place], ("never", *missing), *known[place:]]):
        axes = Figure(figsize=(4.0, 3.0)).subplots()
        axes.set_xlim(0.0, 2.0)
        height = label_spans(axes, spans)
        drawn.append((height, [(text.get_text(), text.xy, text.xyann) for text in axes.texts]))
    assert drawn[0] == drawn[1]
