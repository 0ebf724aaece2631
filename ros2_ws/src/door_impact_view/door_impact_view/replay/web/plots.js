// The plots: their time axis shows the replay's time, and a click in a plot sets it.

const PLOT_HEIGHT = 98; // fixed, because a height that follows the page's would grow for ever

// uPlot draws on a canvas, which the page's style sheet does not reach.
const INK = matchMedia("(prefers-color-scheme: dark)").matches
  ? { text: "#c9cdd3", grid: "#ffffff1c", phase: "#565b63", event: "#e0c060", now: "#ffffff" }
  : { text: "#000000", grid: "#00000012", phase: "#c4c8ce", event: "#7a5c00", now: "#111111" };

const SAME_TIME = 1e-3; // a sample that is this near counts, also at the edge of a gap [s]

/** The value of a curve at a time, between two samples; null in a gap and outside. */
function valueAt(t, values, time) {
  if (!t.length || time < t[0] || time > t[t.length - 1]) return null;
  const i = indexAt(t, time);
  const j = Math.min(i + 1, t.length - 1);
  const w = t[j] > t[i] ? (time - t[i]) / (t[j] - t[i]) : 0;
  const value = w === 0 ? values[i] : (1 - w) * values[i] + w * values[j];
  if (!Number.isNaN(value)) return value;
  const near = [j, i].find((k) => !Number.isNaN(values[k]) && Math.abs(t[k] - time) < SAME_TIME);
  return near === undefined ? null : values[near];
}

/** The index of the last time that is not after `time`, or 0. */
function indexAt(t, time) {
  let low = 0;
  let high = t.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= time) low = middle;
    else high = middle;
  }
  return low;
}

/** A number with as many digits as a reader needs: three, and no exponent. */
function shortNumber(value) {
  if (value === null) return "–";
  const digits = Math.min(3, Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value) || 1))));
  return value.toFixed(digits).replace("-", "−");
}

class Plot {
  constructor(plot, data, place, seek) {
    this.plot = plot;
    this.now = 0;
    const head = document.createElement("div");
    head.className = "plot-head";
    head.append(Object.assign(document.createElement("b"), {
      textContent: `${plot.title} [${plot.unit}]`,
    }));
    this.shown = plot.curves.map((curve) => {
      const label = document.createElement("span");
      const swatch = document.createElement("i");
      swatch.style.borderTop = `3px ${curve.dashed ? "dashed" : "solid"} ${curve.color}`;
      const value = document.createElement("output");
      label.append(swatch, curve.label + " ", value);
      head.append(label);
      return value;
    });
    const body = document.createElement("div");
    place.append(head, body);
    const tables = plot.curves.map(({ t, values }) =>
      [Array.from(t), Array.from(values, (v) => (Number.isNaN(v) ? null : v))]);
    for (const limit of plot.limits) tables.push([[0, data.end], [limit.value, limit.value]]);
    const limits = plot.limits.map((limit) =>
      ({ label: limit.label, stroke: limit.color, width: 1.5, dash: [2, 4] }));
    const curves = plot.curves.map((curve) => ({
      label: curve.label, stroke: curve.color, width: 1.6, points: { show: false },
      ...(curve.dashed ? { dash: [7, 4] } : {}),
    }));
    this.u = new REPLAY.uPlot({
      width: 400, height: PLOT_HEIGHT, legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, range: () => this.range } },
      axes: [{ size: 26, values: (_, ticks) => ticks.map((tick) => +tick.toFixed(4)) },
             { size: 52, space: 16 }].map((axis) =>
        ({ ...axis, stroke: INK.text, grid: { stroke: INK.grid }, ticks: { stroke: INK.grid } })),
      padding: [8, 10, 0, 0],
      series: [{}, ...curves, ...limits.map((limit) => ({ ...limit, points: { show: false } }))],
      hooks: { draw: [(u) => this.lines(u, data)] },
    }, REPLAY.uPlot.join(tables), body);
    this.u.over.addEventListener("click", (event) => seek(this.u.posToVal(event.offsetX, "x")));
    plot.limits.forEach((limit) => {
      const label = document.createElement("span");
      const swatch = document.createElement("i");
      swatch.style.borderTop = `3px dotted ${limit.color}`;
      label.append(swatch, `${limit.label} ${shortNumber(limit.value)}`);
      head.append(label);
    });
  }

  /** Draws the starts of the phases, the events and the present time. */
  lines(u, data) {
    const line = (time, color, dash, width) => {
      const x = Math.round(u.valToPos(time, "x", true));
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
      u.ctx.beginPath();
      u.ctx.strokeStyle = color;
      u.ctx.lineWidth = width * devicePixelRatio;
      u.ctx.setLineDash(dash);
      u.ctx.moveTo(x, u.bbox.top);
      u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
      u.ctx.stroke();
    };
    u.ctx.save();
    for (const phase of data.phases) line(phase.start, INK.phase, [], 1);
    for (const event of data.events) line(event.time, INK.event, [4, 3], 1);
    line(this.now, INK.now, [], 1.5);
    u.ctx.restore();
  }

  /** Shows the time `now`, and of the time axis the part `range`. */
  set(now, range) {
    this.now = now;
    this.range = range;
    this.plot.curves.forEach(({ t, values }, k) => {
      this.shown[k].textContent = shortNumber(valueAt(t, values, now));
    });
    this.u.setScale("x", { min: range[0], max: range[1] });
  }

  resize(width) {
    this.u.setSize({ width, height: PLOT_HEIGHT });
  }
}
