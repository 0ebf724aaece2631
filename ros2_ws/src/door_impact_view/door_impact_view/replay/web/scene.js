// The scene: trees of links that the joints' angles move (forward kinematics), and marks.

/** The geometry of a mesh, of which several shapes may share one. */
function meshGeometry({ vertices, faces }) {
  const geometry = new REPLAY.BufferGeometry();
  geometry.setAttribute("position", new REPLAY.BufferAttribute(vertices, 3));
  geometry.setIndex(new REPLAY.BufferAttribute(faces, 1));
  return geometry;
}

/** A shape of a link, in the link's frame. */
function makeShape({ mesh, color }, geometries) {
  const [red, green, blue, opacity] = color.map((value) => value / 255);
  const material = new REPLAY.MeshLambertMaterial({
    transparent: opacity < 1, opacity, flatShading: true, // the meshes have no normals
    side: REPLAY.DoubleSide, // a negative scale turns a mesh inside out
  });
  material.color.setRGB(red, green, blue, "srgb");
  return new REPLAY.Mesh(geometries[mesh], material);
}

/** A tree of links: nested groups, so that three.js itself does the forward kinematics. */
class Tree {
  constructor(tree, geometries) {
    this.tree = tree;
    this.links = Object.fromEntries(tree.links.map((link) => [link, new REPLAY.Group()]));
    this.root = this.links[tree.root];
    for (const joint of tree.joints) {
      const fixed = new REPLAY.Group(); // the joint's origin in the parent link
      fixed.matrix.fromArray(joint.origin).decompose(fixed.position, fixed.quaternion, fixed.scale);
      fixed.add(this.links[joint.child]); // what the joint moves
      this.links[joint.parent].add(fixed);
      joint.vector = new REPLAY.Vector3(...joint.axis);
    }
    for (const shape of tree.shapes) this.links[shape.link].add(makeShape(shape, geometries));
    this.first = new REPLAY.Quaternion();
    this.second = new REPLAY.Quaternion();
  }

  /** Moves the tree to the share `w` between the samples `i` and `j`. */
  set(i, j, w) {
    const { base, positions, joints, columns } = this.tree;
    const rows = base.length / 7;
    const a = 7 * Math.min(i, rows - 1);
    const b = 7 * Math.min(j, rows - 1);
    this.root.position.set(...[0, 1, 2].map((k) => (1 - w) * base[a + k] + w * base[b + k]));
    this.first.set(base[a + 4], base[a + 5], base[a + 6], base[a + 3]);
    this.second.set(base[b + 4], base[b + 5], base[b + 6], base[b + 3]);
    this.root.quaternion.copy(this.first).slerp(this.second, w);
    for (const joint of joints) {
      if (joint.column < 0) continue; // fixed, or not recorded
      const value = (1 - w) * positions[i * columns + joint.column]
        + w * positions[j * columns + joint.column];
      const child = this.links[joint.child];
      if (joint.slides) child.position.copy(joint.vector).multiplyScalar(value);
      else child.quaternion.setFromAxisAngle(joint.vector, value);
    }
  }
}

/** A point or a polygon that is drawn over everything else. */
class Mark {
  constructor(mark) {
    this.mark = mark;
    this.object = new REPLAY.Group();
    this.shown = true;
    const over = { color: mark.color, depthTest: false, transparent: true };
    if (mark.corners === 1) {
      this.object.add(new REPLAY.Mesh(
        new REPLAY.SphereGeometry(mark.size, 20, 14), new REPLAY.MeshBasicMaterial(over)));
    } else {
      this.geometry = new REPLAY.BufferGeometry();
      this.corners = new Float32Array(3 * mark.corners);
      this.geometry.setAttribute("position", new REPLAY.BufferAttribute(this.corners, 3));
      const fan = [];
      for (let k = 1; k + 1 < mark.corners; k++) fan.push(0, k, k + 1);
      const area = this.geometry.clone(); // shares the corners; a convex polygon is a fan
      area.setAttribute("position", this.geometry.getAttribute("position"));
      area.setIndex(fan);
      this.object.add(
        new REPLAY.Mesh(area, new REPLAY.MeshBasicMaterial(
          { ...over, opacity: 0.3, side: REPLAY.DoubleSide })),
        new REPLAY.LineLoop(this.geometry, new REPLAY.LineBasicMaterial(over)));
    }
    // Polygons under points.
    this.object.children.forEach((child) => {
      child.renderOrder = mark.corners === 1 ? 2 : 1;
      child.frustumCulled = false; // the corners move, and three.js keeps the first bounds
    });
  }

  set(i, j, w) {
    const { places, corners } = this.mark;
    const size = 3 * corners;
    const place = (k) => {
      const from = places[i * size + k];
      const to = places[j * size + k];
      // The corners of two polygons do not correspond: a polygon is that of the sample before.
      return corners > 1 || w === 0 ? from : w === 1 ? to : (1 - w) * from + w * to;
    };
    const there = !Number.isNaN(place(0)); // NaN: unknown at this time
    this.object.visible = this.shown && there;
    if (!there) return;
    if (corners === 1) {
      this.object.position.set(place(0), place(1), place(2));
      return;
    }
    for (let k = 0; k < size; k++) this.corners[k] = place(k);
    this.geometry.getAttribute("position").needsUpdate = true;
  }
}

/** Everything that is drawn in three dimensions. Without WebGL nothing is drawn. */
class View {
  constructor(data, meshes, place, failed) {
    this.place = place;
    this.scene = new REPLAY.Scene();
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.scene.background = new REPLAY.Color(dark ? "#4a4f57" : "#f4f5f7");
    this.camera = new REPLAY.PerspectiveCamera(40, 1, 0.05, 100);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new REPLAY.HemisphereLight("#ffffff", "#8f8f8f", 2.2));
    const sun = new REPLAY.DirectionalLight("#ffffff", 1.6);
    sun.position.set(3, 2, 5);
    this.scene.add(sun);
    const grid = new REPLAY.GridHelper(6, 24, ...(
      dark ? ["#7d838c", "#5f656e"] : ["#a8adb5", "#d3d6db"]));
    grid.rotation.x = Math.PI / 2;
    this.scene.add(grid);
    const geometries = meshes.map(meshGeometry);
    this.trees = data.trees.map((tree) => new Tree(tree, geometries));
    this.marks = data.marks.map((mark) => new Mark(mark));
    for (const { root } of this.trees) this.scene.add(root);
    for (const { object } of this.marks) this.scene.add(object);
    try {
      this.renderer = new REPLAY.WebGLRenderer({ antialias: true });
    } catch (error) {
      failed();
      return;
    }
    place.append(this.renderer.domElement);
    this.controls = new REPLAY.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
  }

  set(i, j, w) {
    for (const moving of [...this.trees, ...this.marks]) moving.set(i, j, w);
    this.draw();
  }

  look({ position, target }) {
    this.camera.position.set(...position);
    this.camera.lookAt(...target);
    if (!this.controls) return;
    this.controls.target.set(...target);
    this.controls.update();
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!this.renderer || !width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.renderer) this.renderer.render(this.scene, this.camera);
  }
}
