// The replay: time, controls, and what they move.

const byId = (id) => document.getElementById(id);
const SPEEDS = [["auto", "slow at the contact"], [1, "1×"], [0.5, "1/2×"], [0.1, "1/10×"],
                [0.02, "1/50×"]];
const RANGES = [["all", "whole time"], [2, "2 s"], [0.2, "0.2 s"]]; // of the plots [s]
const ROOM_FOR_LABEL = 8; // share of the track that an event's label needs on its left [%]
const SLOWEST_FRAME = 0.1; // a longer time between two frames counts as this [s]

const ARRAYS = { float32: Float32Array, uint32: Uint32Array };

/** Puts arrays of 32-bit numbers in the place of their texts in base64, everywhere in `node`. */
function decode(node) {
  if (node === null || typeof node !== "object") return node;
  const kind = Object.keys(ARRAYS).find((name) => typeof node[name] === "string");
  if (kind) {
    const bytes = Uint8Array.from(atob(node[kind]), (letter) => letter.charCodeAt(0));
    return new ARRAYS[kind](bytes.buffer);
  }
  for (const key of Object.keys(node)) node[key] = decode(node[key]);
  return node;
}

class Replay {
  constructor(data, meshes) {
    this.data = data;
    this.stamps = data.stamps;
    data.end = this.stamps[this.stamps.length - 1];
    this.now = 0;
    this.playing = false;
    this.view = new View(data, meshes, byId("view"), () => {
      byId("view").classList.add("empty");
      byId("view").textContent = "This browser does not draw WebGL: the plots, the times and the "
        + "pictures below work without it.";
    });
    this.plots = data.plots.map((plot) =>
      new Plot(plot, data, byId("plots"), (time) => this.seek(time)));
    this.makeControls();
    this.view.look(data.views[0]);
    new ResizeObserver(() => this.resize()).observe(byId("replay"));
    this.resize();
    this.seek(data.begin);
  }

  makeControls() {
    for (const [id, options] of [["speed", SPEEDS], ["range", RANGES]]) {
      for (const [value, text] of options) byId(id).append(new Option(text, value));
    }
    if (!this.data.slow.length) byId("speed").value = 1;
    this.data.views.forEach((view, k) => byId("camera").append(new Option(view.name, k)));
    Object.assign(byId("time"), { min: 0, max: this.data.end });
    byId("play").onclick = () => this.play(!this.playing);
    byId("time").oninput = (event) => this.seek(Number(event.target.value));
    byId("range").onchange = () => this.set(this.now);
    byId("camera").onchange = (event) => this.view.look(this.data.views[event.target.value]);
    document.addEventListener("keydown", (event) => this.key(event));
    const part = (name, from, to, className, left = false) => {
      const button = document.createElement("button");
      Object.assign(button, { textContent: name, title: name, className, type: "button" });
      const share = (time) => 100 * time / this.data.end;
      button.style.left = `${share(from)}%`;
      if (to > from) button.style.width = `${share(to - from)}%`;
      else if (left && share(from) > ROOM_FOR_LABEL) button.classList.add("left");
      button.onclick = () => this.seek(from);
      return button;
    };
    for (const phase of this.data.phases) {
      byId("phases").append(part(phase.name, phase.start, phase.end, "phase"));
    }
    this.data.events.forEach((event, k) => { // every other label stands on the left of its line
      byId("events").append(part(event.name, event.time, event.time, "event", k % 2 === 0));
    });
    byId("phases").hidden = !this.data.phases.length;
    byId("events").hidden = !this.data.events.length;
    this.view.marks.forEach((mark) => {
      const label = document.createElement("label");
      const box = Object.assign(document.createElement("input"), { type: "checkbox" });
      box.checked = true;
      box.onchange = () => {
        mark.shown = box.checked;
        this.set(this.now);
      };
      const dot = document.createElement("i");
      dot.style.background = mark.mark.color;
      label.append(box, dot, mark.mark.name);
      byId("marks").append(label);
    });
  }

  key(event) {
    if (event.target.tagName === "SELECT" || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === " " && event.target.tagName === "BUTTON") return; // it is pressed itself
    const step = event.shiftKey ? 0.001 : 0.1; // [s]
    const contact = this.data.events.find((found) => found.name === "contact");
    const actions = {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => this.seek(this.now - step),
      ArrowRight: () => this.seek(this.now + step),
      Home: () => this.seek(0),
      End: () => this.seek(this.data.end),
      c: () => contact && this.seek(contact.time),
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }

  /** Stops playing and shows a time [s]. */
  seek(time) {
    this.play(false);
    this.set(time);
  }

  /** Shows a time [s]. */
  set(time) {
    const { stamps, data } = this;
    this.now = Math.min(data.end, Math.max(0, time));
    const i = indexAt(stamps, this.now);
    const j = Math.min(i + 1, stamps.length - 1);
    const w = j > i ? (this.now - stamps[i]) / (stamps[j] - stamps[i]) : 0;
    this.view.set(i, j, w);
    byId("time").value = this.now;
    byId("clock").textContent = `${this.now.toFixed(3)} s`;
    byId("phase").textContent = this.place();
    const range = this.range();
    for (const plot of this.plots) plot.set(this.now, range);
  }

  /** The phase, and the time from the last event or to the next one within a second. */
  place() {
    const { phases, events } = this.data;
    const phase = phases.find(({ start, end }) => start <= this.now && this.now < end);
    const near = events.filter(({ time }) => Math.abs(time - this.now) < 1)
      .sort((a, b) => Math.abs(a.time - this.now) - Math.abs(b.time - this.now))[0];
    const since = near ? this.now - near.time : 0;
    const sign = since < 0 ? "−" : "+";
    return [phase ? phase.name : "",
            near ? `${near.name} ${sign} ${Math.abs(since).toFixed(3)} s` : ""]
      .filter(Boolean).join(", ");
  }

  /** The part of the time axis that the plots show. */
  range() {
    const chosen = byId("range").value;
    if (chosen === "all") return [0, this.data.end];
    const half = Number(chosen) / 2;
    return [this.now - half, this.now + half];
  }

  /** Recorded time over real time at the present time. */
  speed() {
    const chosen = byId("speed").value;
    if (chosen !== "auto") return Number(chosen);
    const slow = this.data.slow.filter(({ start, end }) => start <= this.now && this.now < end);
    return Math.min(1, ...slow.map(({ speed }) => speed));
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    byId("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (this.now >= this.data.end) this.set(0);
    let last = performance.now();
    const tick = (time) => {
      if (!this.playing) return;
      const elapsed = Math.min(SLOWEST_FRAME, Math.max(0, (time - last) / 1000));
      last = time;
      this.set(this.now + this.speed() * elapsed);
      if (this.now >= this.data.end) this.play(false);
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  resize() {
    this.view.resize();
    for (const plot of this.plots) plot.resize(byId("plots").clientWidth);
    for (const { classList, scrollWidth, clientWidth } of byId("phases").children) {
      classList.toggle("narrow", scrollWidth > clientWidth); // no part of a name is shown
    }
  }

  /** The place and orientation (w, x, y, z) of a tree's link in the world, for tests. */
  linkPose(tree, link) {
    const group = this.view.trees[tree].links[link];
    group.updateWorldMatrix(true, false);
    const place = new REPLAY.Vector3();
    const turn = new REPLAY.Quaternion();
    group.matrixWorld.decompose(place, turn, new REPLAY.Vector3());
    return { place: place.toArray(), orientation: [turn.w, turn.x, turn.y, turn.z] };
  }
}

/** The number of the run to show: that of an address that ends with, for example, #run=1. */
function chosenRun({ runs, first }) {
  const named = Number((/^#run=(\d+)$/.exec(location.hash) ?? [])[1]) - 1;
  return named in runs ? named : first;
}

const recorded = JSON.parse(byId("replay-data").textContent);
const shownRun = chosenRun(recorded);
recorded.runs.forEach(({ name }, k) =>
  byId("run").append(new Option(name, k, false, k === shownRun)));
byId("runs").hidden = recorded.runs.length < 2;
byId("run").onchange = (event) => {
  location.hash = `run=${Number(event.target.value) + 1}`;
};
addEventListener("hashchange", () => location.reload()); // another run is shown from anew
for (const note of recorded.runs[shownRun].notes) {
  byId("notes").append(Object.assign(document.createElement("li"), { textContent: note }));
}
window.replay = new Replay(decode(recorded.runs[shownRun]), decode(recorded.meshes));
